"""Models in the ways in which artists lay out UVs, from prep to the picture, beside Blender: `make uvs`.

Each keeps its UVs bit for bit in model.glb, or it is said why not; with a Python that has bpy, Cycles shows of model.glb, and
of model.obj with texture sets, what preview.png shows. That stacked islands are as crisp as unstacked ones:
`tests/test_shared_texels.py`.
"""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.asset.read_glb import read_model
from stages.bake.options import BakeOptions
from stages.bake.stage import bake
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions
from stages.core.artifact import load_npz, read_json
from stages.core.images import read_image, write_png
from stages.core.schemas import PREP
from stages.distill.options import DistillOptions
from stages.distill.stage import distill
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from stages.report.preview import VIEWS, compared, in_blender

Soup = tuple[NDArray, NDArray]
"""Quads: corners (Q, 4, 3) and UVs (Q, 4, 2)."""

FIELD = 0.05, 0.45
"""Where a lone island lies, along u and v."""


def ball(rows: int = 12, columns: int = 24, middle: tuple[float, float, float] = (0, 0, 0), radius: float = 1.0) -> Soup:
    """A sphere without its caps, unrolled over the unit square."""
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    theta, phi = np.pi * (0.92 - 0.84 * v), 2 * np.pi * u
    point = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1) * radius + middle
    return quads(point), quads(np.stack([u, v], -1))


def quads(grid: NDArray) -> NDArray:
    """(Q, 4, D) of an (M, N, D) grid."""
    return np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], 2).reshape(-1, 4, grid.shape[-1])


def at(soup: Soup, low: tuple[float, float], size: tuple[float, float]) -> Soup:
    """The same with its UVs in a field of the plane."""
    return soup[0], np.array(low) + soup[1] * np.array(size)


def together(*soups: Soup) -> Soup:
    return np.concatenate([s[0] for s in soups]), np.concatenate([s[1] for s in soups])


def balls(count: int) -> list[Soup]:
    """Balls in a row, each with the whole square."""
    return [ball(middle=(2.2 * k, 0.3 * k, 0)) for k in range(count)]


def one_tile_up() -> Soup:
    return at(ball(), (0.05, 1.05), (0.9, 0.9))


def across_the_border() -> Soup:
    return at(ball(), (-0.4, 0.3), (0.9, 0.9))


def a_few_outside() -> Soup:
    points, uv = at(ball(), (0.02, 0.0), (0.9, 0.9))
    uv = uv.copy()
    uv[:2] -= (0, 0.05)
    return points, uv


def without_area(share: int = 60) -> Soup:
    points, uv = at(ball(40, 80), (0.05, 0.05), (0.9, 0.9))
    uv = uv.copy()
    uv[:: len(uv) // share] = uv[:: len(uv) // share, :1]
    return points, uv


def slivers() -> Soup:
    points, uv = at(ball(40, 80), (0.05, 0.05), (0.9, 0.9))
    thin = points[:20] + (0, 1e-4, 0) * np.array([[0], [0], [1], [1]])
    thin[:, 2:] = thin[:, [1, 0]] + (0, 1e-4, 0)
    return together((points, uv), (thin, np.repeat(uv[:20, :1], 4, 1) + np.array([(0, 0), (1e-3, 0), (1e-3, 1e-7), (0, 1e-7)])))


def mirrored() -> Soup:
    left, right = balls(2)
    return together(at(left, (0.05, 0.05), (0.9, 0.9)), at(right, (0.95, 0.05), (-0.9, 0.9)))


def mirrored_at_the_seam() -> Soup:
    points, uv = ball()
    return at((points, np.stack([np.minimum(uv[..., 0], 1 - uv[..., 0]) * 2, uv[..., 1]], -1)), (0.05, 0.05), (0.9, 0.9))


def stacked() -> Soup:
    return together(*(at(one, (0.05, 0.05), (0.9, 0.9)) for one in balls(5)))


def stacked_a_tile_away() -> Soup:
    return together(*(at(one, (0.05 + k, 0.05 - k), (0.9, 0.9)) for k, one in enumerate(balls(3))))


def panels() -> Soup:
    """A ball of eight slices that all show one strip."""
    points, uv = ball(12, 32)
    slice_ = np.minimum(np.floor(uv.mean(1)[:, 0] * 8), 7)
    return points, (uv - np.stack([slice_, 0 * slice_], -1)[:, None] / 8) * (7.2, 0.9) + 0.05


def stacked_at_scales() -> Soup:
    one, two = balls(2)
    return together(at(one, (0.05, 0.05), (0.9, 0.9)), at(two, (0.3, 0.3), (0.4, 0.4)))


def twice_around() -> Soup:
    return at(ball(), (0.0, 0.05), (2.0, 0.9))


def far_away() -> Soup:
    return at(ball(), (100.05, -99.95), (0.9, 0.9))


def some_missing() -> Soup:
    points, uv = at(ball(40, 80), (0.05, 0.05), (0.9, 0.9))
    uv = uv.copy()
    uv[100:130] = np.nan
    return points, uv


def on_the_edges() -> Soup:
    return ball()


def of_slots(count: int = 6) -> Soup:
    """A helmet: parts of several materials, each with the whole square for itself."""
    soups = [at(half, (0.03, 0.03), (0.94, 0.94)) for half in balls(count)]
    return together(*soups)


def of_tiles(count: int = 4) -> Soup:
    """UDIM: parts that fill tile after tile, no two alike; 1001, 1002, 1011, 1012."""
    soups = [ball(8 + 2 * k, 16 + 4 * k, (2.2 * k, 0.3 * k, 0)) for k in range(count)]
    return together(*(at(soup, (k % 2 + 0.04, k // 2 + 0.05), (0.9 - 0.06 * k, 0.9 - 0.1 * k)) for k, soup in enumerate(soups)))


SLOTS = {"of_slots": 6}
"""Ways whose quads are of so many material slots, one after the other."""

SETS = ("of_slots", "of_tiles")
"""Ways that have several texture sets, of which an OBJ is looked at too."""

LEAST = 32.0
"""PSNR, dB, that a picture must have."""

WAYS: dict[str, Callable[[], Soup]] = {
    way.__name__: way
    for way in (
        one_tile_up, across_the_border, a_few_outside, without_area, slivers, mirrored, mirrored_at_the_seam, stacked,
        stacked_a_tile_away, panels, stacked_at_scales, twice_around, far_away, some_missing, on_the_edges,
        of_slots, of_tiles,
    )
}  # fmt: skip


def write_obj(path: Path, soup: Soup, slots: int = 1) -> Path:
    """Quads as an OBJ; those without UVs (NaN) have none. Args: slots: materials, each of as many quads."""
    points, vertex = np.unique(np.round(soup[0].reshape(-1, 3), 9), axis=0, return_inverse=True)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in np.nan_to_num(soup[1]).reshape(-1, 2).astype(np.float32).astype(float).tolist()]
    corners, bare = vertex.reshape(-1, 4) + 1, np.isnan(soup[1]).any((1, 2))
    for k, quad in enumerate(corners.tolist()):
        if slots > 1 and k % (len(corners) // slots) == 0:
            lines.append(f"usemtl part {slots * k // len(corners)}")
        lines.append("f " + " ".join(f"{v}" if bare[k] else f"{v}/{4 * k + c + 1}" for c, v in enumerate(quad)))
    path.write_text("\n".join(lines) + "\n")
    return path


def made(mesh: Path, folder: Path, prompt: str, size: int, preview: int) -> Path:
    """All four stages at a small setting. Returns: the asset."""
    folder.mkdir(parents=True, exist_ok=True)
    prepared, seen, material, asset = (folder / name for name in ("prep.npz", "conditions", "material.npz", "asset"))
    prep(mesh, prepared, PrepOptions(texture_size=size))
    conditions(prepared, seen, ConditionsOptions(views=8, size=96, env=("studio",), quality="draft"))
    distill(seen, material, DistillOptions(prompt=prompt, steps=40))
    bake(prepared, material, asset, BakeOptions(size=size, preview_size=preview, occlusion_rays=4))
    return asset


def uv_bits_kept(prepared: Path, asset: Path) -> bool:
    """Whether model.glb holds the very UVs, v turned over where the file's points up."""
    mesh = load_npz(prepared, PREP)
    if not mesh.provenance.extra["uv_kept"]:
        return False
    down = mesh.provenance.extra["source_format"] == "glb"
    there = mesh["source_uv"][mesh["loop_source_uv"][mesh["loop_source_uv"] >= 0]].astype(np.float32)
    expected = there if down else np.stack([there[:, 0], 1 - there[:, 1]], 1).astype(np.float32)
    parts = [part for node in read_model(asset / "model.glb").nodes for part in node.primitives]
    found = {row.tobytes() for part in parts for row in part.uv}
    return {row.tobytes() for row in np.ascontiguousarray(expected)} <= found


def beside(asset: Path, python: str, model: str) -> list[float]:
    """PSNR in dB of what Cycles shows of a model beside preview.png, view by view; a picture of both lies beside the asset."""
    studio, ours = read_json(asset / "preview.json"), read_image(asset / "preview.png")[..., :3]
    theirs = in_blender(python, asset, [studio["views"][view] for view in VIEWS], studio, model)
    found, picture = compared(ours, theirs, studio)
    write_png(asset.with_name(f"beside_{model}.png"), picture)
    return found


def main() -> None:
    """Run it; exits with 1 where fewer than nine in ten keep their UVs, or where a picture differs by more than LEAST."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", type=Path, default=Path("uvs"))
    parser.add_argument("--cycles", default="")
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--preview", type=int, default=160)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("meshes", nargs="*", type=Path, help="further models")
    chosen = parser.parse_args()
    chosen.o.mkdir(parents=True, exist_ok=True)
    meshes = [write_obj(chosen.o / f"{name}.obj", way(), SLOTS.get(name, 1)) for name, way in WAYS.items()] + chosen.meshes
    kept, rows, least = 0, 0, np.inf
    for mesh in meshes:
        if chosen.only and mesh.stem not in chosen.only:
            continue
        asset = made(mesh, chosen.o / mesh.stem, "rusty iron with moss in the crevices", chosen.size, chosen.preview)
        said = json.loads((asset / "bake.json").read_text())["extra"]["findings"]["uv"]
        row = {"model": mesh.stem, "kept": uv_bits_kept(chosen.o / mesh.stem / "prep.npz", asset), "said": said}
        for model in ("model.glb", "model.obj") if mesh.stem in SETS else ("model.glb",):
            if chosen.cycles:
                row[model] = [round(psnr, 1) for psnr in beside(asset, chosen.cycles, model)]
                least = min(least, *row[model])
        kept, rows = kept + row["kept"], rows + 1
        print(json.dumps(row), flush=True)
    print(f"{kept} of {rows} keep their UVs; pictures are alike to {least:.1f} dB at the least")
    sys.exit(kept < 0.9 * rows or least < LEAST)


if __name__ == "__main__":
    main()
