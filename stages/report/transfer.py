"""How exactly a texture transfer (`distill --guidance reference`) brought a model's material over to baked textures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.artifact import load_npz
from stages.core.color import srgb_encode
from stages.core.errors import InputError
from stages.core.schemas import PREP
from stages.light.textured_model import TexturedModel
from stages.report.baked import read_baked

REACH = 1e-4
"""The model's surface must lie this near to a texel's centre, object sizes: another part may be a little above it."""


@dataclass(frozen=True)
class Transfer:
    """Errors over the texels whose centre a view saw. PSNR of the albedo in dB, linear and sRGB; RMSE of the others."""

    texels: int
    albedo_linear_db: float
    albedo_srgb_db: float
    roughness_rmse: float
    metallic_rmse: float


def report_transfer(prep: Path, material: Path, asset: Path, reference: Path) -> Transfer:
    """Compare a baked asset with the textured model that it was to look like.

    Raises: ArtifactError; InputError when the model is unreadable or of another shape.
    """
    baked = read_baked(prep, material, asset)
    model = TexturedModel(reference, load_npz(prep, PREP)["to_world"])
    n = baked.scene.geometric_normal(baked.triangle)
    truth, found = model.material_at(baked.point, baked.point + n, REACH)
    if not found.any():
        raise InputError(f"{reference}: its surface is nowhere near that of {prep}; expected the model of the transfer")
    maps, truth = baked.maps[found], truth[found]
    rough, metal = (rms(maps[:, k] - truth[:, k]) for k in (3, 4))
    colors = maps[:, :3] - truth[:, :3], srgb_encode(maps[:, :3]) - srgb_encode(truth[:, :3])
    linear, srgb = (float(-20 * np.log10(max(rms(error), 1e-6))) for error in colors)
    return Transfer(len(maps), linear, srgb, rough, metal)


def rms(x: NDArray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.square(x, dtype=np.float64).mean()))
