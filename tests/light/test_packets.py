"""Rays asked of Embree many at once are blocked where they are when asked one by one."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from stages.light import packets
from stages.light.scene import Scene
from tests.light import scenes


@pytest.fixture
def missing(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """As where the functions of a library are not found through one that is linked to it."""
    monkeypatch.setitem(packets._FUNCTIONS, "rtcOccluded32", (None,))
    packets.embree.cache_clear()
    yield
    packets.embree.cache_clear()


def rays(count: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    random = np.random.default_rng(4)
    return random.uniform(-1, 1, (count, 3)).astype(np.float32), random.normal(size=(count, 3)).astype(np.float32)


def one_by_one(scene: Scene, origins: NDArray, directions: NDArray) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = scene._any.run(origins, directions, query="OCCLUDED") >= 0
    return found


@pytest.mark.parametrize("count", [0, 1, 16, 19, 100_000])
def test_they_are_blocked_as_when_asked_one_by_one(count: int) -> None:
    scene = scenes.box_in_corner()
    origins, directions = rays(count)
    assert (scene.occluded(origins, directions) == one_by_one(scene, origins, directions)).all()


def test_only_those_are_asked_that_are_named() -> None:
    scene = scenes.sphere(4)
    origins, directions = rays(10_000)
    asked = np.random.default_rng(1).permutation(10_000)[:5_003]
    found, every = scene.occluded(origins, directions, asked), one_by_one(scene, origins, directions)
    assert (found[asked] == every[asked]).all() and every[asked].any()
    assert not np.delete(found, asked).any() and np.delete(every, asked).any()


def test_what_stands_around_is_in_the_way_and_alone_nothing_is() -> None:
    ball, origins, directions = scenes.sphere(3), *rays(10_000)
    scene = Scene(ball.vertices, ball.triangles, ball.normals, casters=(ball.vertices + 1, ball.triangles))
    among = scene.occluded(origins, directions)
    assert (among == one_by_one(scene, origins, directions)).all()
    assert (scene.hidden(origins, directions) == ball.occluded(origins, directions)).all()
    assert among.sum() > scene.hidden(origins, directions).sum()


def test_nothing_is_in_the_way_of_nothing() -> None:
    ball, origins, directions = scenes.sphere(1), *rays(40)
    assert not Scene(ball.vertices, ball.triangles[:0], ball.normals[:0]).occluded(origins, directions).any()


@pytest.mark.usefixtures("missing")
def test_without_packets_rays_are_asked_one_by_one() -> None:
    scene, origins, directions = scenes.sphere(4), *rays(1_000)
    with pytest.raises(OSError, match="rtcOccluded32"):
        packets.Packets(scene.vertices, scene.triangles)
    every = one_by_one(scene, origins, directions)
    assert (scene.occluded(origins, directions) == every).all() and every.any()
    assert (scene.occluded(origins, directions, np.arange(500)) == every & (np.arange(1_000) < 500)).all()
