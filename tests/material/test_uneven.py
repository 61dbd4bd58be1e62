"""Borders are found, and no more texels than pay."""

import numpy as np

from stages.material.uneven import MOST, uneven


def maps(albedo: np.ndarray) -> np.ndarray:
    """(H, W) grey albedo as a material."""
    return np.stack([*[albedo] * 3, np.full_like(albedo, 0.5), np.zeros_like(albedo)], -1).astype("f4")


def test_the_texels_on_both_sides_of_a_border_are_uneven() -> None:
    albedo = np.full((32, 40), 0.2)
    albedo[:, 20:] = 0.6
    known = np.ones(albedo.shape, bool)
    found = uneven(maps(albedo), known)
    assert (np.flatnonzero(found.any(0)) == [19, 20]).all() and found[:, 19:21].all()
    assert (np.flatnonzero(uneven(maps(albedo), known, wrap=True).any(0)) == [0, 19, 20, 39]).all()


def test_what_lies_off_the_charts_is_no_neighbour() -> None:
    albedo = np.full((32, 40), 0.5)
    known = np.ones(albedo.shape, bool)
    albedo[10:20, 10:20], known[10:20, 10:20] = 0, False
    assert not uneven(maps(albedo), known).any()
    assert not uneven(maps(albedo), np.zeros_like(known)).any()


def test_metal_and_roughness_have_borders_too() -> None:
    known = np.ones((32, 64), bool)
    for column in (3, 4):
        made = maps(np.full(known.shape, 0.5))
        made[8:, :, column] = 1
        assert (np.flatnonzero(uneven(made, known).any(1)) == [7, 8]).all()


def test_of_grain_that_differs_everywhere_the_strongest_is_taken() -> None:
    rng = np.random.default_rng(0)
    made, known = maps(rng.random((128, 128)) ** 2), np.ones((128, 128), bool)
    assert 0.9 * MOST < uneven(made, known).mean() <= MOST
    assert not uneven(maps(0.5 + 0.01 * rng.random((128, 128))), known).any()
