"""The octahedral square, the split of lights into residual and excess, and what samples them."""

import numpy as np
import pytest

from stages.core.color import luminance
from stages.light import light_set as module
from stages.light.environment import Environment, directions_of_texels
from stages.light.light_set import CELLS, FINE, LightSet, light_set, split
from stages.light.octahedral import direction_to_square, octahedral, square_to_direction
from stages.light.transport import share_out
from stages.light.transport_kernels import _in_cell


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
    assert lights.cumulative[-1] == pytest.approx(1)
    side = FINE // CELLS
    for k, (start, end) in enumerate(cells.begin):
        texels = lights.texels[start:end]
        assert (cells.number[1, texels // FINE // side, texels % FINE // side] == k).all()
        share = density[texels // FINE, texels % FINE, 1].sum()
        assert cells.energy[k] == pytest.approx(share, rel=1e-4)
    assert (cells.number >= 0).sum() == len(cells.begin)
    assert module.MAX_LIGHTS * 3 <= module.CHANNELS


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
    """Cumulative energies run on over environments, so that the second one's only texel has a width of its own."""
    energy = np.zeros((FINE, FINE, 2))
    places = [(100, 40), (300, 411)]
    for e, (row, column) in enumerate(places):
        energy[row, column, e] = 1.0
    texels, cumulative, cells = module._cells(energy)
    for k, (row, column) in enumerate(places):
        for u in (0.0, 0.4, 1.0):
            found = _in_cell(k, u, 0.5, (texels, cumulative, cells.begin, cells.first))
            u_found, v_found = direction_to_square(*found)
            assert (int(v_found * FINE), int(u_found * FINE)) == (row, column)


def test_a_cell_of_no_width_gives_a_direction() -> None:
    """Energy that is lost in the rounding of the sum must not make a ray that is not a number."""
    excess = (np.array([7, 9], np.int32), np.array([1.0, 1.0]), np.array([[0, 1], [1, 2]]), np.array([0, 2]))
    assert np.isfinite(_in_cell(1, 0.3, 0.5, excess)).all()
