"""Charts joined into larger ones: unions that unroll do so exactly; those that are no disk, or too curved, stay apart."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.prep import merge as merging
from stages.prep.charts import project
from stages.prep.merge import flatten, laid_flat, merge
from stages.prep.overlap import overlapping
from stages.prep.uv import signed_area, stretch, uv_charts
from tests.prep.shapes import cube

SIZE, PADDING = 512, 4


def sheet(around: int, along: int, radius: float, turn: float) -> tuple[NDArray, NDArray, NDArray]:
    """Part of a cylinder of length 1: vertices, triangles, and the strip (from 0) that each is in, around it."""
    angle, height = np.linspace(0, turn, around + 1), np.linspace(0, 1, along + 1)
    a, h = np.meshgrid(angle, height, indexing="ij")
    vertices = np.stack([radius * np.cos(a), radius * np.sin(a), h], -1).reshape(-1, 3)
    index = np.arange((around + 1) * (along + 1)).reshape(around + 1, along + 1)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1)
    triangles = np.stack([quads[..., [0, 1, 2]], quads[..., [0, 2, 3]]], 2)
    strip = np.broadcast_to(np.arange(around)[:, None, None], triangles.shape[:3])
    return vertices, triangles.reshape(-1, 3), strip.reshape(-1)


def test_strips_of_a_bent_sheet_unroll_into_one() -> None:
    vertices, triangles, strip = sheet(24, 4, 0.4, 1.5 * np.pi)
    chart = strip // 4
    flat, joined = merge(vertices, triangles, project(vertices, triangles, chart), chart, SIZE, PADDING)
    assert (joined == 0).all()
    assert stretch(vertices[triangles], flat) == pytest.approx(1, abs=1e-4)
    chord = 2 * 0.4 * np.sin(1.5 * np.pi / 24 / 2)
    assert np.ptp(flat.reshape(-1, 2), axis=0) == pytest.approx([24 * chord, 1], rel=1e-3)
    assert uv_charts(triangles, flat).max() == 0  # corners that meet have the very same place


def test_a_tube_is_no_disk() -> None:
    vertices, triangles, strip = sheet(24, 4, 0.4, 2 * np.pi)
    last = triangles >= 24 * 5
    triangles = np.where(last, triangles - 24 * 5, triangles)  # closed
    second = strip >= 12
    plane = laid_flat(vertices[triangles])
    flat = project(vertices, triangles, second.astype(int))
    assert flatten(plane, triangles, flat[..., 0] + 1j * flat[..., 1], second) is None
    joined = merge(vertices, triangles, project(vertices, triangles, strip // 4), strip // 4, SIZE, PADDING)[1]
    assert joined.max() >= 1


def test_lone_faces_go_back_into_a_chart_with_holes() -> None:
    """Faces that were cut out here and there fill their holes again, though each union still has the other holes."""
    vertices, triangles, strip = sheet(12, 12, 0.4, 1.2 * np.pi)
    face = np.arange(len(triangles)) // 2
    lone = (strip % 4 == 1) & (face % 12 % 4 == 2)
    chart = np.where(lone, face + 1, 0)
    assert len(np.unique(chart)) == 10
    unrolled = merge(vertices, triangles, project(vertices, triangles, strip), strip, SIZE, PADDING)[0]
    flat, joined = merge(vertices, triangles, unrolled, chart, SIZE, PADDING)
    assert (joined == 0).all() and stretch(vertices[triangles], flat) == pytest.approx(1, abs=1e-3)


def test_what_is_too_curved_stays_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two quarters of a ball make half a ball, which cannot be laid flat within 5 % of stretch."""
    n = 12
    a, b = np.meshgrid(np.linspace(-1.4, 1.4, n + 1), np.linspace(-1.2, 1.2, n + 1), indexing="ij")
    vertices = np.stack([np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)], -1).reshape(-1, 3)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    chart = (vertices[triangles].mean(1)[:, 0] > 0).astype(int)
    flat = project(vertices, triangles, chart)
    given = laid_flat(vertices[triangles]), triangles, flat[..., 0] + 1j * flat[..., 1], chart == 1
    assert flatten(*given) is None
    monkeypatch.setattr(merging, "_STRETCH", 2.0)
    monkeypatch.setattr(merging, "SQUASHED", 0.2)
    assert flatten(*given) is not None


def test_a_cube_becomes_fewer_pieces_that_cover_nothing_twice() -> None:
    vertices, triangles = cube()
    normal = np.cross(*(vertices[triangles[:, k]] - vertices[triangles[:, 0]] for k in (1, 2)))
    chart = np.unique(np.round(normal / np.abs(normal).max()), axis=0, return_inverse=True)[1].reshape(-1)
    assert chart.max() == 5
    before = project(vertices, triangles, chart)
    flat, joined = merge(vertices, triangles, before, chart, SIZE, PADDING)
    assert joined.max() < 5
    assert not overlapping(flat, joined).any()
    assert np.abs(signed_area(flat)) == pytest.approx(np.abs(signed_area(before)), rel=1e-6)
    assert stretch(vertices[triangles], flat) == pytest.approx(1, abs=1e-6)


def test_a_mesh_with_too_much_to_try_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, triangles, strip = sheet(24, 4, 0.4, np.pi)
    flat = project(vertices, triangles, strip)
    monkeypatch.setattr(merging, "_EFFORT", merging._OVERHEAD)
    assert merge(vertices, triangles, flat, strip, SIZE, PADDING)[1].max() == 22
