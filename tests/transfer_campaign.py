"""Texture transfer of six models: `make transfer`. Three are real ones below ASSETS; three are made here, each of one kind that
is hard: fine scratches in metal, chips down to metal with ragged borders, dark metal in dark plastic.
"""

import argparse
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter
from trimesh.visual.material import PBRMaterial

from stages.core.color import srgb_encode
from stages.report.options import TransfersReportOptions
from stages.report.transfers import report_transfers, summary

REAL = ("avocado.glb", "babylon_shaderball.glb", "vintage_fan.glb")

TEXELS = 1024
"""Along the edge of the made models' textures."""

Maps = tuple[NDArray, NDArray, NDArray]
"""Linear albedo (N, N, 3), roughness and metallic (N, N)."""


def mixed(share: NDArray, under: tuple[float, ...], over: tuple[float, ...]) -> Maps:
    """What lies over covers a share (N, N) of each texel. Args: three of albedo, roughness, metallic, of each."""
    values = np.array(under) + share[..., None] * (np.array(over) - np.array(under))
    return values[..., :3], values[..., 3], values[..., 4]


def scratched(rng: np.random.Generator) -> Maps:
    """Bright metal under 6,000 scratches, rougher and paler, two to four texels wide."""
    scratches = np.zeros((TEXELS, TEXELS))
    for _ in range(6000):
        start, turn, length = rng.random(2) * TEXELS, rng.random() * np.pi, rng.uniform(20, 140)
        along = np.arange(0, length, 0.25)[:, None] * (np.cos(turn), np.sin(turn))
        row, column = (start + along).astype(int).T % TEXELS
        scratches[row, column] = 1
    share = np.clip(2.2 * gaussian_filter(scratches, 0.8, mode="wrap"), 0, 1)
    return mixed(share, (0.55, 0.53, 0.50, 0.15, 1.0), (0.70, 0.68, 0.66, 0.50, 1.0))


def chipped(rng: np.random.Generator) -> Maps:
    """Red paint, chipped down to bare steel."""
    octaves = (gaussian_filter(rng.normal(size=(TEXELS, TEXELS)), size, mode="wrap") * size for size in (2, 4, 8, 16, 32, 64))
    chips = sum(octaves)
    return mixed(np.clip((chips - 0.6) / 0.1, 0, 1), (0.45, 0.04, 0.03, 0.35, 0.0), (0.56, 0.55, 0.53, 0.25, 1.0))


def patched(rng: np.random.Generator) -> Maps:
    """Dark metal in dark plastic, in hard-edged squares of 64 texels."""
    squares = np.kron(rng.random((TEXELS // 64, TEXELS // 64)) < 0.5, np.ones((64, 64)))
    return mixed(squares, (0.03, 0.03, 0.035, 0.5, 0.0), (0.12, 0.11, 0.10, 0.3, 1.0))


MADE: dict[str, tuple[str, Callable[[np.random.Generator], Maps]]] = {
    "scratched_metal": ("spot.obj", scratched), "paint_chips": ("bob_uv.obj", chipped), "dark_metal": ("bob_uv.obj", patched),
}  # fmt: skip
"""Name → its mesh and its texture."""


def make(mesh: Path, maps: Maps, model: Path) -> None:
    """Write a mesh, unwrapped where it has no UVs, and its textures as a GLB."""
    thing = trimesh.load(mesh, force="mesh", process=False)
    if getattr(thing.visual, "uv", None) is None:
        thing = thing.unwrap()
    albedo, roughness, metallic = maps
    orm = np.stack([np.ones_like(roughness), roughness, metallic], -1)
    base, other = (Image.fromarray(np.rint(255 * m).astype(np.uint8)) for m in (srgb_encode(albedo.astype(np.float32)), orm))
    material = PBRMaterial(baseColorTexture=base, metallicRoughnessTexture=other, metallicFactor=1.0, roughnessFactor=1.0)
    thing.visual = trimesh.visual.TextureVisuals(thing.visual.uv, material=material)
    thing.export(model)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--assets", type=Path, required=True, help="a folder below which the meshes and models lie")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--views", type=int, default=64)
    parser.add_argument("--size", type=int, default=512, help="pixels along the edge of a view")
    parser.add_argument("--only", nargs="*", help="names of some of the models")
    args = parser.parse_args()
    models = args.output / "models"
    models.mkdir(parents=True, exist_ok=True)
    wanted = set(args.only or [*MADE, *(Path(name).stem for name in REAL)])
    for name in (name for name in REAL if Path(name).stem in wanted):
        shutil.copy(next(args.assets.rglob(name)), models)
    for number, (name, (mesh, texture)) in enumerate(MADE.items()):
        if name in wanted:
            make(next(args.assets.rglob(mesh)), texture(np.random.default_rng(number)), models / f"{name}.glb")
    options = TransfersReportOptions(views=args.views, size=args.size)
    print("\n".join(summary(report_transfers(models, args.output, options))))


if __name__ == "__main__":
    main()
