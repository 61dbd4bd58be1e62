"""Rays chosen for an error: fewer for a larger one, and the error is reached."""

import numpy as np
import pytest
import torch

from stages.conditions.predict import TRUTH, choose_quality
from stages.core.color import reinhard
from stages.core.errors import InputError
from stages.core.shading import light_maps
from stages.light.lights import BUILTIN
from stages.light.transport import light_transport
from tests.light import scenes


def test_reaches_what_was_asked_for() -> None:
    scene = scenes.box_in_corner()
    points = scenes.view_of(scene, 96)
    lights = [BUILTIN["studio"](), BUILTIN["clear_sky"]()]
    truth = light_transport(scene, points, lights, TRUTH, seed=6)
    rays = []
    for target in (2.0, 0.5):
        quality, expected = choose_quality(scene, points, lights, target, seed=0)
        assert expected <= target
        rays.append(quality.lobe)
        found = light_transport(scene, points, lights, quality, seed=5)
        for a, b in zip(found, truth, strict=True):
            error = reinhard(light_maps(a)) - reinhard(light_maps(b))
            assert float(torch.sqrt(error.square().mean((0, 2))).max()) * 100 < 1.5 * target
    assert rays[0] < rays[1]


def test_out_of_reach_and_out_of_sight() -> None:
    scene = scenes.sphere(3)
    points = scenes.view_of(scene, 24)
    with pytest.raises(InputError, match="ask for that"):
        choose_quality(scene, points, [BUILTIN["studio"]()], 1e-4, seed=0)
    nothing = points[np.zeros(0, np.int64)]
    assert choose_quality(scene, nothing, [BUILTIN["studio"]()], 1.0, seed=0)[1] == 0
