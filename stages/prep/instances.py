"""Instances: parts that are one mesh in several places, equal to the bit in their own frames.

Formats say it in different ways (several nodes with one mesh, EXT_mesh_gpu_instancing, point instancers); readers give each
place a part of its own, so that light is traced in all of them. One of them is given texels, and the others show the same.
"""

import hashlib
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stages.prep.source import Source, rows_of


def with_instances(source: Source) -> Source:
    """The source, each part that repeats an earlier one marked as an instance of the first such."""
    if len(source.parts) < 2:
        return source
    first: dict[bytes, int] = {}
    faces = rows_of(source.face_part, len(source.parts))
    loops = rows_of(source.loop_part(), len(source.parts))
    parts = []
    for number, part in enumerate(source.parts):
        found = first.setdefault(_fingerprint(source, number, faces[number], loops[number]), number)
        parts.append(replace(part, instance_of=found if found != number else -1))
    return replace(source, parts=parts)


def _fingerprint(source: Source, number: int, faces: NDArray[np.int64], loops: NDArray[np.int64]) -> bytes:
    """Of a part's material, faces, vertices, UVs and normals, in its own frame."""
    vertex = source.loop_vertex[loops]
    digest = hashlib.sha256(source.parts[number].material.encode() + np.diff(source.loop_start)[faces].tobytes())
    digest.update((vertex - vertex[:1]).tobytes())
    tables: list[tuple[NDArray, NDArray]] = [(source.vertices, source.loop_vertex), (source.normals, source.loop_normal)]
    for table, row in [*tables, (source.uv, source.loop_uv), *source.more_uv]:
        mine = row[loops]
        digest.update((mine >= 0).tobytes() + table[mine[mine >= 0]].tobytes())
    return digest.digest()


def firsts(source: Source, loops: NDArray) -> NDArray[np.bool_]:
    """Which triangles (F, 3) of loops are of no instance, or of the first one."""
    own = np.array([part.instance_of < 0 for part in source.parts])
    return own[source.loop_part()[loops[:, 0]]]


def like_the_first(source: Source, uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """UVs of all loops (L, 2), those of instances taken from the first one, corner by corner; where it has some."""
    made = uv.copy()
    loops = rows_of(source.loop_part(), len(source.parts))
    for number, part in enumerate(source.parts):
        if part.instance_of >= 0:
            given = uv[loops[part.instance_of]]
            made[loops[number]] = np.where(np.isfinite(given), given, uv[loops[number]])
    return made


def told(source: Source) -> list[str]:
    """What is said of instances, if there are any."""
    count = sum(part.instance_of >= 0 for part in source.parts)
    return [f"{count:,} instances show the texels of the first of their kind"] if count else []


