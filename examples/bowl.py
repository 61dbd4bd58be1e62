"""Write a deep bowl, which sees much of itself, as an untextured OBJ.

python examples/bowl.py OUT.obj
"""

import sys
from pathlib import Path

import numpy as np


def main(out: Path) -> None:
    """A hemisphere with a wall of its own thickness, turned about y."""
    angle = np.linspace(0, np.pi / 2, 40)
    outside = np.stack([0.5 * np.sin(angle), 0.5 - 0.5 * np.cos(angle)], -1)
    inside = np.stack([0.465 * np.sin(angle), 0.5 - 0.46 * np.cos(angle)], -1)[::-1]
    profile = np.concatenate([outside, inside])
    profile[[0, -1], 0] = 1e-4
    turn = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    radius, height = np.broadcast_arrays(profile[:, :1], np.zeros(96))[0], np.broadcast_to(profile[:, 1:], (80, 96))
    points = np.stack([radius * np.sin(turn), height, radius * np.cos(turn)], -1).reshape(-1, 3)
    row, column = np.mgrid[:79, :96].reshape(2, -1)
    beside = (column + 1) % 96
    corners = (row * 96 + column, row * 96 + beside, (row + 1) * 96 + beside, (row + 1) * 96 + column)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
    lines += [f"f {a} {b} {c} {d}" for a, b, c, d in np.stack(corners, -1) + 1]
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
