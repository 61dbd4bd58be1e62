"""What the 3-D view of report.html is given: geometry and light in one deflated block, and the numbers beside it."""

import itertools
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.asset.report_mesh import PageMesh, octahedral, steps
from stages.core.albedo import MIN_COSINE, diffuse_table, open_albedo
from stages.core.tiles import repeats

TABLE = (33, 64)
"""Roughness steps and cosine steps of the table of white albedos; viewer.js knows them too."""


@dataclass(frozen=True)
class PageLight:
    """The light of the view, z up.

    levels: radiance at each roughness, (H / 2^k, 2 H / 2^k, 3). harmonics: (9, 3). towards, power, spread: its lamp's, as in
    `stages.light.prefilter`. exposure: factor on radiance.
    """

    levels: list[NDArray[np.float32]]
    harmonics: NDArray[np.float64]
    towards: NDArray[np.float64]
    power: NDArray[np.float64]
    spread: float
    exposure: float


def groups(mesh: PageMesh, set_of_look: list[int]) -> list[dict[str, int]]:
    """Runs of triangles that share a set of maps: first index, indices, set."""
    sets = np.array(set_of_look)[mesh.look]
    borders = [0, *(np.flatnonzero(np.diff(sets)) + 1).tolist(), len(sets)]
    return [{"start": 3 * a, "count": 3 * (b - a), "set": int(sets[a])} for a, b in itertools.pairwise(borders)]


def box(mesh: PageMesh) -> dict[str, Any]:
    """The boxes that 16-bit positions and UVs lie in, whether textures repeat, and the radius of the sphere that holds all."""
    used = mesh.positions[np.unique(mesh.triangles)]
    low, extent = used.min(0), float(np.ptp(used, axis=0).max()) or 1.0
    radius = float(np.linalg.norm(used, axis=1).max())
    least, wide, beyond = [0.0, 0.0], 1.0, repeats(mesh.uv[mesh.triangles])
    if beyond:
        least, wide = mesh.uv.min(0).astype(float).tolist(), float(np.ptp(mesh.uv, axis=0).max())
    return {
        "origin": low.astype(float).tolist(), "extent": extent, "radius": radius, "uv_box": [*least, wide], "repeats": beyond,
    }  # fmt: skip


def light_data(light: PageLight) -> dict[str, Any]:
    """Numbers of the light for the viewer."""
    return {
        "height": len(light.levels[0]), "levels": len(light.levels), "harmonics": light.harmonics.reshape(-1).tolist(),
        "towards": light.towards.tolist(), "power": light.power.tolist(), "spread": light.spread,
        "exposure": light.exposure, "least_cosine": MIN_COSINE,
    }  # fmt: skip


def packed(mesh: PageMesh, light: PageLight) -> tuple[list[dict[str, Any]], bytes]:
    """Geometry and light as one deflated block, and the table of what is in it."""
    frame = box(mesh)
    arrays: dict[str, NDArray] = {
        "position": steps((mesh.positions - np.array(frame["origin"])) / frame["extent"]),
        "normal": octahedral(mesh.normals).view(np.uint16),
        "uv": steps((mesh.uv - np.array(frame["uv_box"][:2], np.float32)) / np.float32(frame["uv_box"][2])),
        "triangles": mesh.triangles.reshape(-1, 1).astype(np.uint32),
        "environment": np.concatenate([shared_exponent(level).reshape(-1, 1) for level in light.levels]),
        "albedos": white_albedos().view(np.uint16).reshape(-1, 4),
    }
    table, pieces = [], []
    for name, values in arrays.items():
        delta = name in ("position", "normal", "uv", "triangles")
        shape = {"columns": values.shape[1], "count": len(values)}
        table.append({"name": name, "size": values.dtype.itemsize, **shape, "delta": delta})
        pieces += [shuffled(column, delta) for column in values.T]
    return table, zlib.compress(b"".join(pieces), 9)


def shuffled(column: NDArray, delta: bool) -> bytes:
    """Numbers (N,) as the low bytes of all, then the next; of their differences if so. Deflate finds more in it."""
    first = np.zeros(1, column.dtype)
    values = np.diff(column, prepend=first) if delta else column  # unsigned: wraps, and wraps back when summed
    little = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    return np.ascontiguousarray(little.view(np.uint8).reshape(len(column), -1).T).tobytes()


def shared_exponent(radiance: NDArray[np.float32]) -> NDArray[np.uint32]:
    """Radiance (..., 3) as OpenGL's RGB9_E5. Source: EXT_texture_shared_exponent."""
    bits, bias = 9, 15
    values = np.clip(radiance.astype(np.float64), 0, 65408)
    largest = np.maximum(values.max(-1), 2.0 ** (-bias - 1))
    exponent = np.floor(np.log2(largest)).astype(np.int64) + 1 + bias
    exponent += np.floor(largest / 2.0 ** (exponent - bias - bits) + 0.5).astype(np.int64) == 1 << bits
    whole = np.floor(values / (2.0 ** (exponent - bias - bits))[..., None] + 0.5).astype(np.uint32)
    return whole[..., 0] | whole[..., 1] << 9 | whole[..., 2] << 18 | exponent.astype(np.uint32) << 27


def white_albedos() -> NDArray[np.float16]:
    """What a white point reflects of an even light: A, B and E over roughness and the root of N·V, (33 * 64, 4)."""
    rows, columns = TABLE
    cosine = np.maximum((np.arange(columns) / (columns - 1)) ** 2, MIN_COSINE)
    roughness = np.repeat(np.arange(rows) / (rows - 1), columns)
    specular = open_albedo(roughness, np.tile(cosine, rows))
    table = diffuse_table()
    diffuse = np.interp(np.sqrt(cosine), np.arange(len(table)) / (len(table) - 1), table)
    return np.column_stack([specular, np.tile(diffuse, rows), np.ones(rows * columns)]).astype(np.float16)
