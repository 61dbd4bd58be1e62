"""The normal map of a height map, decoded as a client does, beside the analytic normals of the same bumps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from stages.asset.maps import Maps
from stages.asset.traced import baked_bumps, world_frames
from stages.bake.relief import _lean, jacobians, lean_reference, own_gradient
from stages.bake.stage import Subject, with_normals
from stages.core.artifact import Artifact, load_npz
from stages.core.schemas import PREP
from stages.light.normal_maps import NormalMap, NormalMaps
from stages.material.relief import STEEPEST
from tests.bake.examples import Example, grid, one_part, save_prep

SIZE = 512
WAVE, HEIGHT = 0.15, 0.004
"""Wavelength and height of the bumps; slopes reach 0.17."""


def bumps(p: NDArray) -> tuple[NDArray, NDArray]:
    """Height (N,) and gradient (N, 3) of waves in space, at world points (N, 3)."""
    k = 2 * np.pi / WAVE
    x, y, z = np.moveaxis(k * p + [0, 1, 2], -1, 0)
    gradient = np.stack([np.cos(x) * np.sin(y) * np.sin(z), np.sin(x) * np.cos(y) * np.sin(z),
                         np.sin(x) * np.sin(y) * np.cos(z)], -1)  # fmt: skip
    return HEIGHT * np.sin(x) * np.sin(y) * np.sin(z), HEIGHT * k * gradient


def ball() -> tuple[Example, NDArray]:
    """A unit sphere in six charts, of which two are mirrored and one turned, and its vertices' normals."""
    n, faces, points, uv, chart = 16, [], [], [], []
    s = np.linspace(-1, 1, n + 1)
    u, v = np.meshgrid(s, s, indexing="ij")
    for k in range(6):
        side = np.roll(np.stack([np.tan(np.pi / 4 * u), np.tan(np.pi / 4 * v), np.ones_like(u)], -1), k % 3, -1)
        side = side * [1, 1, 1] if k < 3 else side * [-1, -1, -1]
        first = len(points) * (n + 1) ** 2
        points.append(side.reshape(-1, 3) / np.linalg.norm(side.reshape(-1, 3), axis=1, keepdims=True) / 2)
        index = first + np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
        quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1).reshape(-1, 4)
        quads = quads if k < 3 else quads[:, ::-1]
        layout = np.stack([u, v], -1) * {1: [1, 1], 4: [1, -1]}.get(k, [1, 1]) / 2 + 0.5
        layout = layout[..., ::-1] if k == 2 else layout
        place = (np.array([k % 3, k // 3]) + 0.03 + 0.94 * layout) / 3
        faces += quads.tolist()
        uv.append(place.reshape(-1, 2)[quads.reshape(-1) - first])
        chart += [k] * len(quads)
    vertices = np.concatenate(points)
    example = Example(vertices, faces, np.concatenate(uv).astype("f4"), chart, [0] * len(faces), one_part())
    return example.with_(to_world=np.eye(4)), 2 * vertices


def smooth(prep: Artifact, normals: NDArray) -> Artifact:
    """The same with a normal for each vertex."""
    return Artifact({**prep.arrays, "normals": normals[prep["triangles"]].astype("f4")}, prep.provenance)


def subject_of(folder: Path, name: str) -> Subject:
    example, normals = ball() if name == "ball" else (grid(6), None)
    if name == "mirrored":  # its charts are two halves, one of which is laid out the other way round
        right = example.loop_uv.reshape(-1, 4, 2)[..., 0].mean(1) > 0.5
        uv = example.loop_uv.copy()
        uv[:, 0] = np.where(np.repeat(right, 4), 1.45 - uv[:, 0], uv[:, 0])
        example = example.with_(loop_uv=uv, chart=right.astype(int).tolist())
    path = save_prep(folder / "prep.npz", example)
    prep = load_npz(path, PREP)
    return Subject.of(path, prep if normals is None else smooth(prep, normals), SIZE)


def decoded(subject: Subject, maps: Maps) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """On charts: points, smooth normals, normals as a client sees them; (S, S) which texels these are."""
    on = subject.touched.triangle >= 0
    surface = subject.touched.where(on)
    points, n = subject.points(surface)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    assert maps.normal is not None
    weights = np.c_[surface.barycentric, 1 - surface.barycentric.sum(1)]
    return points, n, baked_bumps(subject.mesh, [maps.normal]).leaning(n, surface.triangle, weights), on


def baked(subject: Subject) -> Maps:
    """The maps of the waves."""
    on = subject.touched.triangle >= 0
    height = np.zeros((SIZE, SIZE), "f4")
    height[on] = bumps(subject.points(subject.touched.where(on))[0].astype(float))[0]
    return with_normals(subject, Maps(np.zeros((SIZE, SIZE, 5), "f4"), height=height))


def degrees(a: NDArray, b: NDArray) -> NDArray:
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=1) / 2, 0, 1)))


@pytest.mark.parametrize("name", ["sheet", "mirrored", "ball"])
def test_relief_is_the_analytic_one_up_to_the_rims_of_charts(tmp_path: Path, name: str) -> None:
    """Waves of 25 texels and more: a texel's difference is then good to 1 % of the slope, one-sided on rims to 13 %."""
    subject = subject_of(tmp_path, name)
    points, n, seen, on = decoded(subject, baked(subject))
    gradient = bumps(points.astype(float))[1]
    wanted = n - gradient + (gradient * n).sum(1, keepdims=True) * n
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    error, lean = degrees(seen, wanted), degrees(n, wanted)
    inner = binary_erosion(on, iterations=1)[on]
    assert lean.mean() > 2.5
    assert np.quantile(error[inner], 0.999) < 0.6
    assert error[~inner].mean() < 0.6 and np.quantile(error[~inner], 0.99) < 2.5


def test_no_seam_where_two_charts_meet(tmp_path: Path) -> None:
    """Rim texels of different charts at one place in space lean alike, to within what one texel's difference costs."""
    from scipy.spatial import cKDTree

    subject = subject_of(tmp_path, "ball")
    points, _, seen, on = decoded(subject, baked(subject))
    chart = subject.mesh["charts"][subject.touched.triangle[on]]
    pairs = cKDTree(points).query_pairs(0.002, output_type="ndarray")
    across = pairs[chart[pairs[:, 0]] != chart[pairs[:, 1]]]
    assert len(across) > 200
    assert degrees(seen[across[:, 0]], seen[across[:, 1]]).mean() < 1.0


def test_a_step_of_height_leans_no_more_than_the_steepest_slope(tmp_path: Path) -> None:
    """A ledge as high as ten texels are wide, which ends from one texel to the next."""
    subject = subject_of(tmp_path, "sheet")
    height = np.zeros((SIZE, SIZE), "f4")
    height[:, SIZE // 2 :] = 10 / SIZE
    normal = with_normals(subject, Maps(np.zeros((SIZE, SIZE, 5), "f4"), height=height)).normal
    assert normal is not None
    steep = np.linalg.norm(normal[..., :2], axis=-1) / normal[..., 2]
    assert steep.max() == pytest.approx(STEEPEST, rel=1e-4)


def test_flat_stays_flat_and_padding_is_filled(tmp_path: Path) -> None:
    subject = subject_of(tmp_path, "sheet")
    material = np.zeros((SIZE, SIZE, 5), "f4")
    maps = with_normals(subject, Maps(material, height=np.full((SIZE, SIZE), 0.1, "f4")))
    np.testing.assert_array_equal(maps.normal, np.broadcast_to([0, 0, 1], (SIZE, SIZE, 3)))
    assert with_normals(subject, Maps(material)).normal is None
    assert (np.abs(np.linalg.norm(baked(subject).normal, axis=-1) - 1) < 1e-5).all()


@pytest.mark.parametrize("with_own", [False, True])
def test_texels_lean_as_the_reference_says(tmp_path: Path, with_own: bool) -> None:
    subject, rng = subject_of(tmp_path, "ball"), np.random.default_rng(0)
    points, normals = subject.touched.where(subject.touched.triangle >= 0), subject.mesh["normals"]
    carry, slope = rng.normal(size=(len(normals), 3, 2)), rng.normal(size=(len(points.triangle), 2)).astype("f4")
    frames = world_frames(subject.mesh, {0})
    own = replace(frames, maps=[NormalMap(np.array([[[-0.6, 0, 0.8]]], "f4"))]) if with_own else None
    wanted = lean_reference(points, slope, carry, normals, frames, own)
    added = own_gradient(points, normals, own) if own else np.zeros((0, 3))
    found = np.empty_like(wanted)
    _lean(points.triangle, points.barycentric, slope, carry, normals, frames.tangents, added, found)
    assert (found[:, 2] < 0.9).mean() > 0.3
    np.testing.assert_allclose(found, wanted, atol=2e-6)


def test_relief_adds_to_the_normal_map_that_is_there(tmp_path: Path) -> None:
    """A sheet whose own map leans by a slope of 0.75 along u, and a height that rises by 0.5 along v: the sum of both."""
    plain = subject_of(tmp_path, "sheet")
    own = NormalMap(np.array([[[-0.6, 0, 0.8]]], "f4"))
    count = len(plain.mesh["triangles"])
    tangents = np.broadcast_to(np.array([1, 0, 0, 1], "f4"), (count, 3, 4))
    scene = plain.scene.bumped(NormalMaps([own], np.zeros(count, "i4"), np.zeros((count, 3, 2), "f4"), tangents))
    subject = replace(plain, scene=scene)
    on = subject.touched.triangle >= 0
    height = np.zeros((SIZE, SIZE), "f4")
    height[on] = 0.5 * subject.points(subject.touched.where(on))[0][:, 1]
    normal = with_normals(subject, Maps(np.zeros((SIZE, SIZE, 5), "f4"), height=height)).normal
    wanted = np.array([-0.75, -0.5, 1]) / np.linalg.norm([-0.75, -0.5, 1])
    np.testing.assert_allclose(normal[on], np.broadcast_to(wanted, (on.sum(), 3)), atol=2e-3)


def test_what_normals_differ_by_within_a_texel_is_in_its_roughness(tmp_path: Path) -> None:
    """A band of fine waves along u on a plate: rougher there by their curvature, seams included; elsewhere nothing changes."""
    subject = subject_of(tmp_path, "grid")
    on = subject.touched.triangle >= 0
    points = subject.points(subject.touched.where(on))[0]
    wave, high, waves = 0.03, 4e-3, points[:, 1] > 0.1
    height = np.zeros(on.shape, np.float32)
    height[on] = np.where(waves, high * np.sin(2 * np.pi / wave * points[:, 0]), 0)
    material = np.full((SIZE, SIZE, 5), 0.25, np.float32)
    found = with_normals(subject, Maps(material, height=height)).roughness[on]
    texel = float(np.median(np.linalg.norm(jacobians(subject.layout, subject.corners), axis=1)))
    k = 2 * np.pi / wave
    curvature = high * k**2 * np.sin(k * points[:, 0]) * np.sinc(texel / wave) ** 2  # of a sine by differences
    expected = (0.25**4 + curvature**2 * texel**2 / 12) ** 0.25
    inside = waves & (points[:, 1] > 0.13) & (np.abs(points).max(1) < 0.45)
    np.testing.assert_allclose(found[inside], expected[inside], atol=3e-3)
    assert expected[inside].max() > 0.3
    np.testing.assert_allclose(found[points[:, 1] < 0.07], 0.25, atol=1e-6)
