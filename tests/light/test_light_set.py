"""The octahedral square, the split of lights into residual and excess, and what samples them."""

import numpy as np
import pytest

from stages.core.color import luminance
from stages.light import light_set as module
from stages.light.environment import Environment, directions_of_texels, lookup
from stages.light.light_set import CELLS, CUT, FINE, LARGEST_CELL, LightSet, Texels, light_set, split
from stages.light.octahedral import direction_to_square, octahedral, square_to_direction, texel_directions
from stages.light.transport import share_out
from stages.light.transport_kernels import _in_cell, on_square


def gradient(height: int) -> np.ndarray:
    """Brighter to the right and to the top, tinted."""
    row, column = np.mgrid[:height, : 2 * height] / height
    return np.stack([1 + column, 1 + row, 2 - row], -1).astype(np.float32)


def with_lamps() -> Environment:
    pixels = gradient(64)
    pixels[20, 30] = 5000.0
    pixels[40:44, 90:100] = 80.0
    return Environment("lamps", pixels)


def texels_of(lights: LightSet, values: np.ndarray) -> np.ndarray:
    """Values kept in blocks, (4 N, C), back on the square: (FINE, FINE, C)."""
    square = np.zeros((FINE // 2, FINE // 2, 4, values.shape[-1]))
    square[lights.block >= 0] = values.reshape(-1, 4, values.shape[-1])
    return square.reshape(FINE // 2, FINE // 2, 2, 2, -1).swapaxes(1, 2).reshape(FINE, FINE, -1)


def test_octahedral_map_is_inverted_and_keeps_area() -> None:
    generator = np.random.default_rng(2)
    for direction in generator.normal(size=(300, 3)):
        direction = direction / np.linalg.norm(direction)
        u, v = direction_to_square(*direction)
        assert 0 <= u <= 1
        assert 0 <= v <= 1
        assert square_to_direction(u, v) == pytest.approx(tuple(direction), abs=1e-9)
    z = np.array([square_to_direction(u, v)[2] for u, v in generator.random((20_000, 2))])
    assert np.mean(z > 0.5) == pytest.approx(0.25, abs=0.01)  # a cap of height 0.5 is a quarter of the sphere


def test_the_square_holds_the_mean_of_what_look_ups_along_its_directions_find() -> None:
    pixels = np.random.default_rng(5).random((24, 48, 3)).astype(np.float32)
    found = octahedral(pixels, 16, 3)
    fine = [[square_to_direction((x + 0.5) / 48, (y + 0.5) / 48) for x in range(48)] for y in range(48)]
    expected = lookup(pixels, np.array(fine).reshape(-1, 3)).reshape(16, 3, 16, 3, 3).mean((1, 3))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize("row, column", [(0, 5), (3, 0), (31, 63), (16, 32), (15, 31), (20, 63)])
def test_nothing_of_a_single_texel_is_passed_over(row: int, column: int) -> None:
    pixels = np.zeros((32, 64, 3), np.float32)
    pixels[row, column] = 1.0
    _, angle = directions_of_texels(32, 64)
    square = octahedral(pixels, 256, 3)
    reached = octahedral(pixels + 1e-6, 256, 3) > 1e-5  # every texel is looked up where no part is black
    assert ((square > 0) == reached).all()
    assert square.mean() * 4 * np.pi == pytest.approx(angle[row], rel=0.35)  # bilinear at a pole is no box


def test_split_adds_up_and_bounds_the_residual() -> None:
    pixels = gradient(32)
    pixels[4, 9] = 60000.0
    residual, excess = split(pixels)
    assert residual + excess == pytest.approx(pixels, rel=1e-6)
    assert (excess >= 0).all()
    assert luminance(residual).max() < 6 * luminance(residual).mean()
    assert split(np.ones((8, 16, 3), np.float32))[1].max() == 0


def test_keeps_the_energy() -> None:
    light = with_lamps()
    lights = light_set([light])
    _, angle = directions_of_texels(64, 128)
    whole = (light.radiance.astype(np.float64) * angle[:, None, None]).sum((0, 1))
    excess = texels_of(lights, lights.fine[:, :3]).sum((0, 1)) * 4 * np.pi / FINE**2
    residual = lights.pyramid[-1, :3].astype(np.float64) * 4 * np.pi  # the coarsest level is the mean
    assert residual + excess == pytest.approx(whole, rel=2e-3)


def test_densities_and_cells_cover_the_excess() -> None:
    dark = Environment("even", np.ones((8, 16, 3), np.float32))
    lights = light_set([dark, with_lamps()])
    density = texels_of(lights, lights.density) * 4 * np.pi / FINE**2
    assert density.sum((0, 1))[:2] == pytest.approx([0, 1], abs=1e-5)
    cells = lights.cells
    assert cells.first.tolist()[:2] == [0, 0]
    assert cells.energy.sum() == pytest.approx(1, abs=1e-5)
    assert lights.texels.lot[:, 1].sum() == pytest.approx(len(cells.begin), rel=1e-4)
    side = FINE // CELLS
    x, y, z = texel_directions(FINE)
    for k, (start, end) in enumerate(cells.begin):
        column, row = lights.texels.lot[start:end, 2:].T.astype(int)
        assert (cells.number[1, row // side, column // side] == k).all()
        assert cells.energy[k] == pytest.approx(density[row, column, 1].sum(), rel=1e-4)
        assert len(row) <= np.pi * cells.radius[k] ** 2 / (4 * np.pi / FINE**2) * 1.001  # no more than its area holds
        away = np.arccos((np.stack([x, y, z], -1)[row, column] @ cells.direction[:, k]).clip(-1, 1))
        assert away.max() < 3 * cells.radius[k]
    assert sorted(set(cells.number[cells.number >= 0])) == list(range(len(cells.begin)))
    shown = texels_of(lights, lights.fine[:, 3:6])
    column, row = lights.texels.lot[:, 2:].T.astype(int)
    assert lights.texels.radiance == pytest.approx(shown[row, column])
    assert module.MAX_LIGHTS * 3 < module.CHANNELS  # the last one is that of the weights


def test_cells_are_cut_where_it_is_bright() -> None:
    """Against the rule applied square by square, on areas of all brightnesses."""
    generator = np.random.default_rng(3)
    energy = generator.random((FINE, FINE)) * np.exp(3 * generator.normal(size=(32, 32))).repeat(16, 0).repeat(16, 1)
    energy[:64, :64] *= 1e-6
    energy /= energy.sum()
    row, column = np.mgrid[:FINE, :FINE].reshape(2, -1)
    code = module._morton(row, column)
    order = np.argsort(code)
    corner, across = module._cut(code[order], energy.ravel()[order])
    square = np.empty((FINE, FINE), np.int64)
    square[row[order], column[order]] = across

    def check(y: int, x: int, size: int) -> None:
        """A square of FINE / size texels is cut if it is bright, and not otherwise."""
        width = FINE // size
        inside = square[y : y + width, x : x + width]
        if size < CELLS and energy[y : y + width, x : x + width].sum() > CUT * (size / 16) ** 2:
            assert (inside > size).all()
            for j in (0, width // 2):
                for i in (0, width // 2):
                    check(y + j, x + i, 2 * size)
        else:
            assert (inside == size).all()

    for y in range(0, FINE, FINE // LARGEST_CELL):
        for x in range(0, FINE, FINE // LARGEST_CELL):
            check(y, x, LARGEST_CELL)
    assert set(across) == {8, 16, 32, 64}
    assert len(np.unique(corner)) == round(float(((square / FINE) ** 2).sum()))


def test_light_rays_go_where_they_are_needed() -> None:
    sun = gradient(64)
    sun[20, 30] = 50_000.0
    windows = gradient(64)
    windows[20:30, 10:20] = windows[20:30, 60:70] = windows[40:44, 90:110] = 60.0
    even = np.ones((8, 16, 3), np.float32)
    rays = share_out(16, light_set([Environment(n, p) for n, p in (("sun", sun), ("windows", windows), ("even", even))]))
    assert rays[2] == 0  # there is no excess to aim at
    assert 2 <= rays[0] < rays[1]
    assert (rays % 2 == 0).all()


def test_a_lamp_of_one_texel_is_hit_in_every_environment() -> None:
    """Texels of all environments lie one after the other; the second one's only texel has a width of its own."""
    energy = np.zeros((FINE, FINE, 2))
    places = [(100, 40), (300, 411)]
    for e, (row, column) in enumerate(places):
        energy[row, column, e] = 1.0
    texels, cells = module._cells(energy, [np.ones((FINE, FINE, 3))] * 2)
    for k, (row, column) in enumerate(places):
        for u in (0.0, 0.4, 1.0):
            u_found, v_found, texel, share = _in_cell(k, u, 0.5, (texels, cells.begin, cells.first))
            assert (int(v_found * FINE), int(u_found * FINE)) == (row, column)
            assert (texel, share) == (k, 1)


def test_texels_are_drawn_by_their_energy() -> None:
    """The guided search finds what the obvious one does."""
    energy = np.zeros((FINE, FINE, 1))
    energy[128:136, 64:72, 0] = np.random.default_rng(5).random((8, 8)) ** 8  # one cell
    energy /= energy.sum()
    texels, cells = module._cells(energy, [np.ones((FINE, FINE, 3))])
    for k, (start, end) in enumerate(cells.begin):
        column, row = texels.lot[start:end, 2:].T.astype(int)
        share = energy[row, column, 0] / energy[row, column, 0].sum()
        for u in np.random.default_rng(6).random(500).astype(np.float32):
            _, _, texel, found = _in_cell(k, u, np.float32(0.5), (texels, cells.begin, cells.first))
            before = share[: texel - start].sum()
            assert before - 1e-6 <= u <= before + share[texel - start] + 1e-6
            assert found == pytest.approx(share[texel - start], rel=1e-4)


def test_a_cell_of_no_width_gives_a_direction() -> None:
    """Energy that is lost in the rounding of the sum must not make a ray that is not a number."""
    index = np.array([0, 1], np.int32)
    lot = np.array([[0, 1, 7, 0], [0, 0, 9, 0]], np.float32)
    texels = Texels(lot, index, np.ones((2, 3), np.float32))
    assert np.isfinite(_in_cell(1, 0.3, 0.5, (texels, np.array([[0, 1], [1, 2]]), np.array([0, 2])))).all()


def test_directions_in_float32() -> None:
    places = np.random.default_rng(7).random((3000, 2)).astype(np.float32)
    places[:5] = [[0.5, 0.5], [0, 0], [1, 1], [0, 1], [0.5, 0]]
    for u, v in places:
        assert on_square(u, v) == pytest.approx(square_to_direction(float(u), float(v)), abs=1e-6)
