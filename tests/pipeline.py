"""The four stages at a small setting, through the command line: what tests of whole runs, kills and damages share."""

import hashlib
from pathlib import Path

import numpy as np

CLOCKED = (".run.json", "run.json", ".curve.csv")
"""Names whose content tells how long something took."""


def cube_sphere(path: Path, count: int = 6) -> None:
    """A rounded box of quads, as an OBJ without UVs."""
    t = np.linspace(-1, 1, count + 1)
    lines, faces, base = [], [], 1
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = np.meshgrid(t, t, indexing="ij")
            points = np.stack(np.broadcast_arrays(u, v, side), -1).reshape(-1, 3)
            points = np.roll(points, axis, 1)
            points = points * (0.5 + 0.5 / np.linalg.norm(points, axis=1, keepdims=True))
            lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
            for i in range(count):
                for j in range(count):
                    square = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
                    corners = [base + a * (count + 1) + b for a, b in square]
                    faces.append("f " + " ".join(map(str, corners if side > 0 else corners[::-1])))
            base += (count + 1) ** 2
    path.write_text("\n".join(lines + faces) + "\n")


def stages(folder: Path, steps: int = 60) -> dict[str, list[str]]:
    """The command of each stage, all paths within a folder. Args: steps: of distillation."""
    prep, conditions, material = folder / "prep.npz", folder / "conditions", folder / "material.npz"
    few = ["--views", "5", "--size", "48", "--env", "overcast", "--env", "studio", "--quality", "draft"]
    return {
        "prep": ["prep", str(folder / "mesh.obj"), "-o", str(prep), "--texture-size", "512", "--padding", "4"],
        "conditions": ["conditions", str(prep), "-o", str(conditions), *few],
        "distill": ["distill", str(conditions), "--prompt", "red plastic", "-o", str(material), "--steps", str(steps)],
        "bake": ["bake", str(prep), str(material), "-o", str(folder / "asset"), "--size", "512", "--preview-size", "48"],
    }


def fingerprint(folder: Path) -> dict[str, str]:
    """SHA-256 of every file that holds no clock."""
    files = [p for p in sorted(folder.rglob("*")) if p.is_file() and not p.name.endswith(CLOCKED)]
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}
