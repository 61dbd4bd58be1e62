"""Write the demo's mesh: a turned urn with two handles on a square plinth, as an untextured OBJ.

python examples/urn.py OUT.obj
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Part = tuple[NDArray, NDArray]
"""Vertices (V, 3), y up, and quads (Q, 4)."""

PROFILE = np.array(  # radius, height
    [
        (0.001, 0.10), (0.30, 0.10), (0.31, 0.13), (0.24, 0.16), (0.11, 0.22), (0.10, 0.27), (0.15, 0.30), (0.16, 0.33),
        (0.28, 0.42), (0.38, 0.56), (0.42, 0.72), (0.40, 0.86), (0.30, 0.98), (0.20, 1.05), (0.18, 1.10), (0.19, 1.14),
        (0.29, 1.20), (0.31, 1.22), (0.29, 1.24), (0.24, 1.22), (0.15, 1.13), (0.14, 1.06), (0.22, 0.98), (0.30, 0.86),
        (0.001, 0.60),
    ]
)  # fmt: skip


def grid(points: NDArray, closed: bool) -> Part:
    """Quads over a (rows, columns, 3) grid of points whose columns wrap around, and whose rows do if `closed`."""
    rows, columns, _ = points.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    below = np.roll(index, -1, 0)
    corners = [index, np.roll(index, -1, 1), np.roll(below, -1, 1), below]
    quads = np.stack([c if closed else c[:-1] for c in corners], -1).reshape(-1, 4)
    return points.reshape(-1, 3), quads


def smooth(profile: NDArray, count: int) -> NDArray:
    """A Catmull-Rom curve through the profile, `count` points a segment."""
    padded = np.vstack([profile[:1], profile, profile[-1:]])
    t = np.arange(count)[:, None] / count
    curve = []
    for a, b, c, d in zip(padded[:-3], padded[1:-2], padded[2:-1], padded[3:], strict=True):
        curve.append(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3))
    return np.vstack([*curve, profile[-1:]])


def body() -> Part:
    """The turned vessel, inside and outside, with shallow flutes around the belly."""
    curve = smooth(PROFILE, 4)
    angle = np.arange(96) / 96 * 2 * np.pi
    belly = np.exp(-(((curve[:, 1] - 0.68) / 0.16) ** 2)) * (np.arange(len(curve)) < 0.6 * len(curve))
    radius = np.maximum(curve[:, :1], 1e-3) * (1 - 0.035 * belly[:, None] * (0.5 + 0.5 * np.cos(16 * angle)))
    height = np.broadcast_to(curve[:, 1:], radius.shape)
    return grid(np.stack([radius * np.sin(angle), height, radius * np.cos(angle)], -1), closed=False)


def handle(side: float) -> Part:
    """A tube that swings from the shoulder to the neck."""
    t = np.linspace(0, 1, 28)
    path = np.stack([side * (0.20 + 0.36 * np.sin(np.pi * t) ** 0.8 + 0.16 * (1 - t)), 0.82 + 0.34 * t, 0 * t], -1)
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    across = np.cross(tangent, [0.0, 0.0, 1.0])
    angle = np.arange(16) / 16 * 2 * np.pi * side
    ring = across[:, None] * np.cos(angle)[:, None] + np.array([0.0, 0.0, 1.0]) * np.sin(angle)[:, None]
    return grid(path[:, None] + 0.035 * ring, closed=False)


def plinth() -> Part:
    """A square slab with a bevelled upper edge."""
    rings = [(1e-3, 0.0), (0.36, 0.0), (0.36, 0.08), (0.335, 0.105), (1e-3, 0.105)]
    angle = (np.arange(4) + 0.5) / 4 * 2 * np.pi
    around = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1) * np.sqrt(2)
    return grid(np.stack([r * around + [0, y, 0] for r, y in rings]), closed=False)


def write_obj(path: Path, parts: list[Part]) -> None:
    """Write parts as groups of quads."""
    lines, base = [], 1
    for i, (vertices, quads) in enumerate(parts):
        lines.append(f"g part_{i}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
        lines += ["f " + " ".join(map(str, quad + base)) for quad in quads]
        base += len(vertices)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python examples/urn.py OUT.obj")
    write_obj(Path(sys.argv[1]), [body(), handle(1.0), handle(-1.0), plinth()])
