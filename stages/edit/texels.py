"""Which texels of a texture belong to parts of the mesh."""

import numpy as np
from numpy.typing import NDArray

from stages.asset.parts import find, named_parts
from stages.bake.fill import pad
from stages.bake.raster import Layout, covered_samples, touched_texels
from stages.bake.stage import Subject
from stages.core.artifact import Artifact

Chosen = NDArray[np.bool_] | None
"""Triangles (F,) of some parts; None: of the whole mesh."""


def chosen_triangles(mesh: Artifact, called: tuple[str, ...]) -> Chosen:
    """The triangles of some parts. Args: called: names, patterns or numbers, none for all. Raises: InputError."""
    if not called:
        return None
    mine, parts = np.zeros(len(mesh["triangles"]), bool), named_parts(mesh)
    for call in called:
        for part in find(parts, call):
            mine[part.triangles] = True
    return mine


def texels_of(subject: Subject, chosen: Chosen) -> tuple[NDArray[np.bool_], int]:
    """The texels of a set that some triangles show, and those off the charts that are filled from them.

    A texel whose centre they cover is theirs, also where others share it (mirrored and stacked islands); at the rim of a
    chart, where nothing covers the centre, it is theirs if they touch it.

    Returns:
        (size, size); how many of the texels show other triangles too.
    """
    size, here = subject.layout.size, subject.triangles
    if chosen is None:
        return np.ones((size, size), bool), 0
    if not (chosen & here).any():
        return np.zeros((size, size), bool), 0
    own, others = (_covered(subject, triangles & here) for triangles in (chosen, ~chosen))
    touched = touched_texels(_layout(subject, chosen & here)).triangle >= 0
    filled = (own | (touched & ~others)).astype(np.float32)
    pad(subject.touched.triangle >= 0, filled)
    return filled > 0, int((own & others).sum())


def _layout(subject: Subject, triangles: NDArray[np.bool_]) -> Layout:
    return Layout.of(subject.mesh["uv"], subject.layout.size, subject.mesh["charts"], triangles)


def _covered(subject: Subject, triangles: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Texels whose centres some triangles cover, (size, size)."""
    size = subject.layout.size
    if not triangles.any():
        return np.zeros((size, size), bool)
    return covered_samples(_layout(subject, triangles), 1, range(size)).triangle >= 0
