"""Light of a known material: what the transport gives at its roughness, from a third of the rays and sums."""

import numpy as np
import pytest
import torch

from stages.core.shading import Material, shade
from stages.light.known import reflected
from stages.light.transport import Quality, light_transport
from tests.light import scenes

MANY = Quality(480, 240, extra=False, smooth=False)


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_it_is_what_the_transport_gives(metallic: float) -> None:
    """At knots of roughness, on a box in a corner under a sun: without bias, and each pixel within the noise of both."""
    scene, light = scenes.box_in_corner(), scenes.sunny_light(300.0)
    points = scenes.view_of(scene, 24)
    values = np.full((len(points.n), 5), 0.6, np.float32)
    values[:, 3] = np.array([0.0, 0.08, 0.25, 0.5, 1.0])[np.arange(len(values)) % 5]
    values[:, 4] = metallic
    found = reflected(scene, points, [light], values, MANY, 1)[0]
    wanted = shade(light_transport(scene, points, [light], MANY, 2)[0], Material.of(torch.from_numpy(values))).numpy()
    difference = found / (1 + found) - wanted / (1 + wanted)
    assert abs(difference.mean()) < 1e-3
    assert np.sqrt((difference**2).mean()) < 0.012


def test_an_even_light_comes_out_exact() -> None:
    """In the open, with a handful of rays: roughness is each point's own, between knots and under the least of them."""
    points = scenes.open_point(0.6, 4)
    values = np.full((4, 5), 1.0, np.float32)
    values[:, 3] = (0.03, 0.2, 0.43, 0.9)
    quality = Quality(8, 4, extra=False, smooth=False)
    found = reflected(scenes.sphere(1), points, [scenes.even_light()], values, quality, 0)[0]
    wanted = shade(
        light_transport(scenes.sphere(1), points, [scenes.even_light()], quality, 0)[0], Material.of(torch.from_numpy(values))
    )
    assert found == pytest.approx(wanted.numpy(), abs=3e-3)
