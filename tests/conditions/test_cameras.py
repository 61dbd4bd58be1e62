"""Cameras: framing, stratification, determinism."""

import numpy as np
import pytest

from stages.conditions.cameras import framing_distance, place_cameras, stratified
from stages.conditions.options import ConditionsOptions
from stages.core.frames import camera_rays, project

BOX = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.3, 0.3) for z in (-0.2, 0.2)])


def test_object_reaches_the_asked_share_of_the_frame() -> None:
    options = ConditionsOptions(views=64, size=100)
    cameras = place_cameras(BOX, options)
    reach = []
    for c2w, fov_y in zip(cameras.c2w, cameras.fov_y, strict=True):
        xy, depth = project(BOX, c2w, fov_y, 100, 100)
        assert (depth > 0).all()
        reach.append(np.abs(xy / 50 - 1).max())
    low, high = options.frame
    assert low - 1e-6 <= min(reach) < low + 0.02
    assert high - 0.02 < max(reach) <= high + 1e-6


def test_every_variable_is_stratified_in_its_range() -> None:
    options = ConditionsOptions(views=32)
    cameras = place_cameras(BOX, options)
    fov = np.sort(np.degrees(cameras.fov_y))
    edges = np.linspace(*options.fov, 33)
    assert ((fov >= edges[:-1]) & (fov <= edges[1:])).all()
    azimuth = np.sort(np.arctan2(cameras.c2w[:, 1, 3], cameras.c2w[:, 0, 3]) % (2 * np.pi))
    assert np.diff(azimuth).max() < 2 * 2 * np.pi / 32
    elevation = np.degrees(np.arcsin(cameras.c2w[:, 2, 3] / np.linalg.norm(cameras.c2w[:, :3, 3], axis=-1)))
    assert elevation.min() >= options.elevation[0] - 1e-9
    assert elevation.max() <= options.elevation[1] + 1e-9


def test_seed_decides() -> None:
    a, b, c = (place_cameras(BOX, ConditionsOptions(views=8, seed=s)).c2w for s in (3, 3, 4))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


def test_matrices_are_rigid_and_look_at_the_object() -> None:
    cameras = place_cameras(BOX, ConditionsOptions(views=16))
    R = cameras.c2w[:, :3, :3]
    assert R @ R.transpose(0, 2, 1) == pytest.approx(np.broadcast_to(np.eye(3), R.shape), abs=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    for c2w, fov_y in zip(cameras.c2w, cameras.fov_y, strict=True):
        assert project(np.zeros(3), c2w, fov_y, 64, 64)[0] == pytest.approx([32, 32])


def test_rays_and_projection_are_inverse() -> None:
    cameras = place_cameras(BOX, ConditionsOptions(views=1))
    origins, directions = camera_rays(cameras.c2w[0], cameras.fov_y[0], 12, 8)
    xy, depth = project(origins + 2.5 * directions, cameras.c2w[0], cameras.fov_y[0], 12, 8)
    columns, rows = np.meshgrid(np.arange(12) + 0.5, np.arange(8) + 0.5)
    assert xy == pytest.approx(np.stack([columns.ravel(), rows.ravel()], -1))
    assert depth == pytest.approx(2.5)


def test_stratified_covers_every_part_once() -> None:
    u = np.sort(stratified(10, np.random.default_rng(0)))
    assert (np.floor(u * 10) == np.arange(10)).all()


def test_a_flat_object_is_never_behind_the_camera() -> None:
    plane = BOX * [1, 1, 0]
    towards = np.array([[0.0, 0.0, 1.0 - 1e-9]])
    towards[0, 0] = np.sqrt(1 - towards[0, 2] ** 2)
    assert framing_distance(plane, towards, np.array([0.3]))[0] >= 0.1
