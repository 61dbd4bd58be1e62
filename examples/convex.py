"""Write two convex meshes, on which nothing casts a shadow: an egg, all smooth, and a drum with two sharp edges.

python examples/convex.py FOLDER
"""

import sys
from pathlib import Path

import numpy as np
from urn import Part, grid, write_obj

AROUND, ROWS = 96, 48


def turned(radius: list[float], height: list[float]) -> Part:
    """A profile from the bottom up, turned around the y axis."""
    angle = np.arange(AROUND) / AROUND * 2 * np.pi
    around = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1)
    return grid(np.stack([r * around + [0, y, 0] for r, y in zip(radius, height, strict=True)]), closed=False)


def egg() -> Part:
    """Blunt below, pointed above; 1.4 times as high as wide."""
    t = np.linspace(0, np.pi, ROWS + 1)
    return turned(list(np.maximum(np.sin(t), 1e-4) * (1 + 0.12 * np.cos(t))), list(-1.4 * np.cos(t)))


def drum() -> Part:
    """A cylinder as high as wide."""
    side = np.linspace(-1, 1, 9)
    return turned([1e-4, *np.ones(len(side)), 1e-4], [-1, *side, 1])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python examples/convex.py FOLDER")
    for name, part in (("egg", egg()), ("drum", drum())):
        write_obj(Path(sys.argv[1]) / f"{name}.obj", [part])
