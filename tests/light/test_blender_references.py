"""Depth, normals and the light of each closure against Blender's Cycles, through Filmic; the bounds of eight bits.

`tests/light/blender/references.py` made the references. The maps' closures are the profile's, but for the diffuse lobe,
which is Lambert's there: that is Burley's without its departure, `BLENDER` with a weight of 0. Quality is `high`, since
pictures this small have too few alike neighbours for the smoothing of `standard`.
"""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from stages.core.shading import LIGHT_MAPS
from stages.light.bounce import blender_light_maps
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.lights import BUILTIN
from stages.light.scene import Scene
from stages.light.terms import BLENDER
from stages.light.transport import QUALITY
from stages.sd.filmic import filmic
from tests.light.blender.references import ENVIRONMENTS, GOLDEN, SHAPES, SIZE, job

LAMBERT = dataclasses.replace(BLENDER, principled=(True, 0.0, 0.0))
MAPS = {"diffuse": (0, 1.0), "glossy_0": (1, 0.0), "glossy_0.5": (1, 0.5), "glossy_1": (1, 1.0)}


@pytest.fixture(scope="module", params=SHAPES)
def seen(request: pytest.FixtureRequest) -> tuple[dict[str, NDArray], GBuffer, Scene, NDArray]:
    """The references, our view, its scene, and which of our points Blender saw, too."""
    with np.load(Path(GOLDEN) / f"blender_{request.param}.npz", allow_pickle=False) as file:
        golden = {name: file[name] for name in file.files}
    given = job(request.param)
    flat = np.zeros((len(given["triangles"]), 3, 3))
    scene = Scene(given["vertices"], given["triangles"], flat).shaded_smooth()
    points = trace_view(scene, given["c2w"], float(given["fov_y"]), SIZE, SIZE)
    both = points.mask & golden["mask"]
    assert (points.mask ^ golden["mask"]).sum() <= 0.005 * points.mask.sum(), "silhouettes"
    golden |= {name: values[both[golden["mask"]]] for name, values in golden.items() if name != "mask"}
    return golden, points, scene, both[points.mask]


def test_depth_and_normals(seen: tuple[dict[str, NDArray], GBuffer, Scene, NDArray]) -> None:
    golden, points, _, both = seen
    depth = points.depth[points.mask][both]
    assert np.abs(depth - golden["depth"]).mean() < 1 / 255 * np.ptp(depth)
    assert np.abs(points.n[both] - golden["normal"]).mean() / 2 < 1 / 255  # stored from -1 ... 1 in 0 ... 1


def test_every_light_term_within_two_steps_of_eight_bits(
    seen: tuple[dict[str, NDArray], GBuffer, Scene, NDArray],
) -> None:
    golden, points, scene, both = seen
    lights = [BUILTIN[name]() for name in ENVIRONMENTS]
    maps = blender_light_maps(scene, points, lights, QUALITY["high"], 0, LAMBERT)
    error = {}
    for environment, found in zip(ENVIRONMENTS, maps, strict=True):
        for term, map_ in MAPS.items():
            ours = filmic(found[torch.from_numpy(both), LIGHT_MAPS.index(map_)]).clamp(max=1)
            blender = golden[f"{environment}_{term}"].astype(np.float32) / 65535
            error[environment, term] = float(np.abs(ours.numpy() - blender).mean() * 255)
    assert max(error.values()) < 2, error
