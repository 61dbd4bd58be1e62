"""Occlusion of texels: its error against float64, and that nothing leaks over charts, creases, walls and seams."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.bake.occlusion import both_sides, lookouts_of, occlusion_map
from stages.bake.raster import Layout, Surface, touched_texels
from stages.core.progress import silent
from stages.light.openness import reference_openness
from stages.light.scene import Scene

DEFAULT = 128


class Boxes:
    """Boxes, each face a chart of its own in a square atlas. boxes: (lowest, highest) corners."""

    def __init__(self, size: int, *boxes: tuple[tuple[float, ...], tuple[float, ...]], open_mesh: bool = False) -> None:
        corners, charts, uv = [], [], []
        across = int(np.ceil(np.sqrt(6 * len(boxes))))
        for low, high in boxes:
            for axis in range(3):
                for end in (0, 1):
                    square = np.zeros((4, 3))
                    u, v = [(axis + 1) % 3, (axis + 2) % 3][:: 1 if end else -1]
                    square[:, u], square[:, v] = [0, 1, 1, 0], [0, 0, 1, 1]
                    square[:, axis] = end
                    square = np.array(low) + square * (np.array(high) - low)
                    cell = np.array([len(charts) // 2 % across, len(charts) // 2 // across])
                    place = (cell + 0.02 + 0.96 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])) / across
                    corners += [square[[0, 1, 2]], square[[0, 2, 3]]]
                    uv += [place[[0, 1, 2]], place[[0, 2, 3]]]
                    charts += [len(charts) // 2] * 2
        flat = np.array(corners)
        normal = np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        triangles = np.arange(3 * len(flat)).reshape(-1, 3)
        self.scene = Scene(flat.reshape(-1, 3), triangles, np.repeat(normal[:, None], 3, 1))
        self.uv, self.charts, self.open = np.array(uv, "f4"), np.array(charts, "i4"), open_mesh
        self.touched = touched_texels(Layout.of(self.uv, size))

    def occlusion(self, rays: int = DEFAULT) -> NDArray[np.float32]:
        return occlusion_map(self.scene, self.touched, self.charts, rays, self.open, silent)

    def reference(self, surface: Surface) -> NDArray[np.float64]:
        def measure(rows: NDArray, side: float) -> NDArray:
            return reference_openness(self.scene, lookouts_of(self.scene, surface[rows], side), 300)

        return both_sides(measure, len(surface.triangle), self.open)

    def chart(self, index: int) -> NDArray[np.bool_]:
        """Texels of a chart: 6 * box + 2 * axis + end."""
        return (self.touched.triangle >= 0) & (self.charts[self.touched.triangle] == index)


TABLE = (
    ((-0.5, -0.5, 0.0), (0.5, 0.5, 0.05)),  # a slab, on which stand
    ((-0.3, -0.3, 0.05), (-0.1, -0.1, 0.4)),  # a post that touches it,
    ((0.1, -0.2, 0.02), (0.3, 0.2, 0.3)),  # one that reaches into it,
    ((-0.4, 0.2, 0.07), (0.4, 0.4, 0.09)),  # and, a hair above, a board
)


@pytest.mark.parametrize(("rays", "percent"), [(DEFAULT, 1.5), (10 * DEFAULT, 0.3)])
def test_error_against_float64(rays: int, percent: float) -> None:
    boxes = Boxes(256, *TABLE)
    on_chart = boxes.touched.triangle >= 0
    chosen = np.random.default_rng(0).choice(int(on_chart.sum()), 600, replace=False)
    truth = boxes.reference(boxes.touched.where(on_chart)[chosen])
    error = 100 * (boxes.occlusion(rays)[on_chart][chosen] - truth)
    assert np.sqrt((error**2).mean()) <= percent
    assert np.abs(error).max() <= 12 * percent  # shadows' edges are sharp to the texel
    assert abs(error.mean()) <= 0.1


def test_a_thin_wall_keeps_its_sides_apart() -> None:
    """A wall of a fiftieth of a texel with a lid a hair over one side: dark there, bright on the other, to the last texel."""
    boxes = Boxes(128, ((-0.5, -0.5, 0), (0.5, 0.5, 1e-4)), ((-0.5, -0.5, 4e-4), (0.5, 0.5, 0.05)))
    occlusion = boxes.occlusion()
    assert occlusion[boxes.chart(4)].min() == 1  # below
    assert np.median(occlusion[boxes.chart(5)]) < 0.01  # above, under the lid


def test_means_run_over_seams() -> None:
    """A long board in two pieces that meet: at the seam both charts say the same."""
    wall = ((-0.5, 0.2, -0.2), (0.5, 0.3, 0.2))
    boxes = Boxes(256, ((-0.5, -0.2, -0.05), (0.0, 0.2, 0.0)), ((0.0, -0.2, -0.05), (0.5, 0.2, 0.0)), wall)
    occlusion = boxes.occlusion(32)
    left, right = (np.where(boxes.chart(k), occlusion, np.nan) for k in (5, 11))
    rows = np.flatnonzero(np.isfinite(left).any(1))
    edge = [next(v for v in row[::-1] if np.isfinite(v)) for row in left[rows]]
    start = [next(v for v in row if np.isfinite(v)) for row in right[np.flatnonzero(np.isfinite(right).any(1))]]
    assert np.abs(np.array(edge) - start).max() < 0.03


def test_off_the_charts_it_is_open() -> None:
    boxes = Boxes(128, *TABLE)
    assert (boxes.occlusion(1)[boxes.touched.triangle < 0] == 1).all()


def test_a_sheet_whose_front_is_shut_in_shows_its_back() -> None:
    """A sheet that faces down, a hair over a slab: a closed mesh shows its front, an open one its back."""
    slab, board = ((-0.5, -0.5, -0.1), (0.5, 0.5, 0.0)), ((-0.4, -0.4, 1e-4), (0.4, 0.4, 0.1))
    for open_mesh, expected in ((False, 0.0), (True, 1.0)):
        boxes = Boxes(128, slab, board, open_mesh=open_mesh)
        sheet = np.r_[0:12, 20:22]  # of the board, only what faces down
        boxes.scene = Scene(boxes.scene.vertices, boxes.scene.triangles[sheet], boxes.scene.normals[sheet])
        boxes.charts = boxes.charts[sheet]
        boxes.touched = touched_texels(Layout.of(boxes.uv[sheet], 128))
        assert np.median(boxes.occlusion(16)[boxes.chart(10)]) == pytest.approx(expected, abs=0.01)


def test_every_chart_has_samples_however_small() -> None:
    """A chart of a few texels in a texture of many takes its own value, not its neighbours'."""
    boxes = Boxes(512, ((-0.5, -0.5, 0), (0.5, 0.5, 0.1)), ((0.1, 0.1, 0.1), (0.101, 0.101, 0.101)))
    on_chart = boxes.chart(11)
    truth = boxes.reference(boxes.touched.where(on_chart))
    assert np.abs(boxes.occlusion()[on_chart] - truth).max() < 0.05
