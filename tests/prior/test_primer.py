"""Paint comes off down to its primer first: around the metal that shows there is a rim of it."""

import numpy as np
import pytest

from stages.material.evaluate import evaluate_coats
from stages.material.masks import settled
from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.surface import Surface
from stages.prior.primer import CHALK, OXIDE, primed

STEEL, OAK, BLUE = Coat("steel", metallic=1.0), Coat("oak"), Coat("paint", (0.1, 0.2, 0.7))


def plate(count: int) -> Surface:
    across = (np.arange(count, dtype=np.float32) + 0.5) / count
    y, z = (a.ravel() for a in np.meshgrid(across, across))
    point = np.stack([0 * y, y, z], 1)
    return Surface.bare(point, np.broadcast_to(np.array([1, 0, 0], np.float32), point.shape), 1 / count)


@pytest.mark.parametrize(
    ("base", "layer"),
    [(STEEL, Layer(BLUE, (Mask("chips", 0.3, 0.2, 0.6, invert=True),))), (BLUE, Layer(STEEL, (Mask("chips", 0.2, 0.2, 0.6),)))],
)
def test_a_rim_of_primer_lies_around_the_metal(base: Coat, layer: Layer) -> None:
    layers = primed(base, [layer])
    assert [found.coat.said for found in layers] == ["primer", layer.coat.said] and layers[0].coat.color == OXIDE
    recipe = settled(Recipe(base, tuple(layers), 4), plate(96))
    shares = evaluate_coats(recipe, plate(192))[1].reshape(192, 192, 3)
    steel, paint = (shares[..., 0], shares[..., 2]) if base is STEEL else (shares[..., 2], shares[..., 0])
    primer = shares[..., 1]
    assert 0.03 < primer.mean() < 0.3 and primer.mean() < steel.mean() < paint.mean()
    metal = steel > 0.9
    beside = np.zeros_like(metal)
    for axis in (0, 1):
        for step in (-1, 1):
            beside |= np.roll(metal, step, axis)
    assert (paint[beside & ~metal] > 0.9).mean() < 0.05  # from metal one comes to primer


def test_wood_has_a_pale_primer_and_what_is_no_paint_has_none() -> None:
    chips = (Mask("chips", 0.3, 0.2, 0.6, invert=True),)
    assert primed(OAK, [Layer(BLUE, chips)])[0].coat.color == CHALK
    for base, layer in ((STEEL, Layer(Coat("rust"), chips)), (STEEL, Layer(BLUE, (Mask("below", 0.5),)))):
        assert primed(base, [layer]) == [layer]
