"""Texture transfer of every model of a folder, from its file to baked textures, and how exact each is.

Written: transfer.csv, a line for each model; transfer.png, a picture of each, the truth above what was found: lit, its albedo,
roughness and metallic. What is made of each model is kept: the same call continues where it was stopped.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.bake.options import BakeOptions
from stages.bake.stage import bake
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import conditions
from stages.core.errors import InputError
from stages.core.images import write_png
from stages.core.progress import Progress, silent
from stages.core.shading import Material
from stages.distill.options import DistillOptions
from stages.distill.preview import pictures
from stages.distill.stage import distill
from stages.distill.views import Surface, Views
from stages.light.textured_model import TexturedModel
from stages.prep.options import PrepOptions
from stages.prep.stage import prep
from stages.report.options import TransfersReportOptions
from stages.report.rows import write_csv
from stages.report.transfer import report_transfer

ENDINGS = (".glb", ".gltf")

RUN_LOGS = ("prep.npz.run.json", "conditions/run.json", "material.npz.run.json", "asset/run.json")

DECIBELS, ROUGHNESS, METALLIC = 30.0, 0.05, 0.08
"""A transfer is called exact from this PSNR of the linear albedo, up to these RMSE."""


@dataclass(frozen=True)
class Row:
    """Errors as of `transfer.Transfer`, and what all four stages took: seconds, of all cores together cpu_seconds."""

    model: str
    exact: bool
    albedo_linear_db: float
    albedo_srgb_db: float
    roughness_rmse: float
    metallic_rmse: float
    texels: int
    seconds: float
    cpu_seconds: float


def report_transfers(
    models: Path, out: Path, options: TransfersReportOptions, progress: Progress = silent
) -> list[Row]:
    """Run what is missing, measure, and write the report's files into a folder.

    Raises: InputError, ArtifactError, OutputError, NumericalError.
    """
    found = sorted(path for path in models.glob("*") if path.suffix.lower() in ENDINGS) if models.is_dir() else []
    if not found:
        raise InputError(f"{models}: holds no textured model; expected a folder of .glb or .gltf files")
    rows, sheet = list[Row](), list[NDArray[np.float32]]()
    for model in found:
        folder = out / model.stem
        transfer(model, folder, options, progress)
        rows.append(measured(model, folder))
        sheet.append(beside(model, folder))
        write_csv(out / "transfer.csv", rows)
    write_png(out / "transfer.png", np.concatenate(sheet))
    return rows


def transfer(model: Path, folder: Path, options: TransfersReportOptions, progress: Progress) -> None:
    """All four stages, as far as they are not done: prep.npz, conditions, material.npz and asset in a folder."""
    ready, lit, made = folder / "prep.npz", folder / "conditions", folder / "material.npz"
    prep(model, ready, PrepOptions(texture_size=options.texture), progress=progress)
    conditions(ready, lit, ConditionsOptions(views=options.views, size=options.size), progress=progress)
    distill(lit, made, DistillOptions(guidance="reference", reference=model, steps=options.steps), progress=progress)
    bake(ready, made, folder / "asset", BakeOptions(options.texture), progress=progress)


def measured(model: Path, folder: Path) -> Row:
    """Errors of a transfer that is done, and what it took."""
    errors = asdict(report_transfer(folder / "prep.npz", folder / "material.npz", folder / "asset", model))
    logs = [json.loads((folder / name).read_text()) for name in RUN_LOGS]
    took = {name: round(sum(log[name] for log in logs), 1) for name in ("seconds", "cpu_seconds")}
    exact = (
        errors["albedo_linear_db"] >= DECIBELS
        and errors["roughness_rmse"] <= ROUGHNESS
        and errors["metallic_rmse"] <= METALLIC
    )
    return Row(model.stem, exact, **errors, **took)


def beside(model: Path, folder: Path) -> NDArray[np.float32]:
    """The view that shows most, by the model above and by the baked asset below: (2 S, 4 S, 3), encoded for display."""
    views = Views(folder / "conditions")
    view = max(views.seen, key=lambda number: len(views.pixels(number)))
    eye = views.c2w[view, :3, 3].astype(np.float32)

    def shown(path: Path) -> NDArray[np.float32]:
        known = TexturedModel(path, views.to_world)

        def material(surface: Surface, width: Tensor) -> Material:
            points = surface.points.numpy()
            return Material.of(torch.from_numpy(known.material_at(points, np.broadcast_to(eye, points.shape))[0]))

        return pictures(views, view, 0, material)

    return np.concatenate([shown(model), shown(folder / "asset" / "model.glb")])


def summary(rows: list[Row]) -> list[str]:
    """The table for people."""
    head = f"{'model':24} {'albedo dB':>9} {'roughness':>9} {'metallic':>8} {'seconds':>7} {'CPU s':>6}  exact"
    return [head] + [
        f"{row.model:24} {row.albedo_linear_db:9.1f} {row.roughness_rmse:9.3f} {row.metallic_rmse:8.3f} {row.seconds:7.0f} "
        f"{row.cpu_seconds:6.0f}  {'yes' if row.exact else 'no'}"
        for row in rows
    ]
