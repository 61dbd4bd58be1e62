"""What a step of distillation with Stable Diffusion costs, part by part: counted, measured, and against the machine's peak.

Speed does not depend on the weights' values. Without `--sd-model` the networks have the size of Stable Diffusion 2.1 base and
its 22-channel ControlNet, and random weights. Counts are made on the meta device; times are those of real steps on a
conditions folder, with the device waited for at the end of every part, and of whole steps without waiting.
"""

import contextlib
import csv
import dataclasses
import io
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from stages.core.artifact import Provenance, write_text
from stages.core.errors import InputError
from stages.core.progress import Progress, silent
from stages.core.shading import KNOTS, Material, Transport, shade_reference
from stages.distill.base import Base
from stages.distill.guidance.sd import BUDGET, StableDiffusionGuidance, view_size
from stages.distill.options import DistillOptions
from stages.distill.regions import Regions
from stages.distill.sampling import CropSampler
from stages.distill.stage import Clock, Run, chosen_device, draw, new_state, optimisation_step
from stages.distill.views import Views
from stages.material.residual import Residual
from stages.report.counters import Cost, Stopwatch, count, peak_bandwidth, peak_flops
from stages.report.options import DistillReportOptions
from stages.sd import files, memory, models
from stages.sd.options import SdOptions
from stages.sd.profile import CHANNELS

PROMPT = "weathered bronze"
"""It does not matter which."""

TOKENS, TEXT_WIDTH = 77, 1024

CONTROLNET = {"cross_attention_dim": TEXT_WIDTH, "attention_head_dim": [5, 10, 20, 20], "use_linear_projection": True}
UNET = CONTROLNET | {"sample_size": 64}
"""Stable Diffusion 2.1's; what is not named is diffusers' default, which is Stable Diffusion's."""

VAE = {
    "block_out_channels": [128, 256, 512, 512],
    "down_block_types": ["DownEncoderBlock2D"] * 4,
    "up_block_types": ["UpDecoderBlock2D"] * 4,
    "layers_per_block": 2,
}

BRANCHES = 3

MATRIX = {"cuda": 8192, "cpu": 2048}
COPY = {"cuda": 1 << 32, "cpu": 1 << 28}
"""Sides and bytes of what the peaks are measured with."""


@dataclass(frozen=True)
class Part:
    """One part of a step. gflop, gbyte: counted, 0 where not. milliseconds: median of the steps. of_peak: percent of what the
    machine could do at its peak for as many FLOPs or bytes, whichever takes longer."""

    part: str
    gflop: float
    gbyte: float
    milliseconds: float
    share_percent: float
    of_peak_percent: float


@dataclass(frozen=True)
class DistillReport:
    """parts: of a step. step_milliseconds: of a whole one, not waited for in between. peaks: TFLOP/s and GB/s."""

    parts: list[Part]
    step_milliseconds: float
    peak_tflops: float
    peak_gbytes: float
    device: str


def report_distill(conditions: Path, out: Path, options: DistillReportOptions, progress: Progress = silent) -> DistillReport:
    """Count and measure; writes distill.csv into the folder `out`. Raises: InputError, ArtifactError, OutputError."""
    asked = DistillOptions(prompt=PROMPT, guidance="sd", batch=options.batch, device=options.device)
    device, views = chosen_device(asked), Views(conditions)
    if device.type not in MATRIX:
        raise InputError(f"--device {options.device}: cannot be measured; expected cpu or cuda")
    plan = memory.plan(options.vram, device)
    progress("building the networks", 0, 1)
    model, size = _model(options, views, device, plan)
    sampler = CropSampler(views, size, options.batch, device)
    timed = Timed(model, device)
    run = _run(views, StableDiffusionGuidance(timed, sampler, asked, Regions()), asked, device)  # type: ignore[arg-type]
    steps: list[dict[str, float]] = []
    for i in range(options.warm_up + options.steps):
        progress("measured steps", i, options.warm_up + 2 * options.steps)
        run.clock, timed.seconds = Waiting(device), {}
        run.state.loss.append(optimisation_step(run, draw(run, run.state.step)))
        steps.append(run.clock.per_step(1) | {name: 1000 * s for name, s in timed.seconds.items()})
    run.clock, whole = Clock(), Stopwatch(device)
    for i in range(options.steps):
        progress("whole steps", options.warm_up + options.steps + i, options.warm_up + 2 * options.steps)
        run.state.loss.append(optimisation_step(run, draw(run, run.state.step)))
    step = 1000 * whole.seconds() / options.steps
    middle = {name: float(np.median([s[name] for s in steps[options.warm_up :]])) for name in steps[0]}
    pixels = sum(len(views.pixels(view)) for view in views.seen) // len(views.seen) * options.batch
    costs = counted(run.state.residual, model, pixels, options.batch, size)
    dtype = next(model.denoiser.parameters()).dtype
    peaks = peak_flops(device, dtype, MATRIX[device.type]), peak_bandwidth(device, COPY[device.type])
    name = torch.cuda.get_device_name(device) if device.type == "cuda" else f"cpu, {torch.get_num_threads()} threads"
    report = DistillReport(_parts(middle, costs, *peaks), step, peaks[0] / 1e12, peaks[1] / 1e9, name)
    write_text(out / "distill.csv", _csv(report))
    return report


class Waiting(Clock):
    """A clock that waits for the device at the end of every part."""

    def __init__(self, device: torch.device) -> None:
        super().__init__()
        self._device = device

    @contextlib.contextmanager
    def __call__(self, part: str) -> Iterator[None]:
        watch = Stopwatch(self._device)
        yield
        self._parts[part] += watch.seconds()


class Timed:
    """A `StableDiffusion` that times its own parts. seconds: by part."""

    def __init__(self, model: models.StableDiffusion, device: torch.device) -> None:
        self._model, self._device = model, device
        self.seconds: dict[str, float] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def encode(self, picture: Tensor) -> Tensor:
        """See `StableDiffusion.encode`."""
        watch = Stopwatch(self._device)
        latents = self._model.encode(picture)
        self.seconds["encode"] = watch.seconds()
        return latents

    def predict_noise(self, *arguments: Any) -> Tensor:
        """See `StableDiffusion.predict_noise`."""
        watch = Stopwatch(self._device)
        noise = self._model.predict_noise(*arguments)
        self.seconds["denoise"] = watch.seconds()
        return noise


@dataclass(frozen=True)
class Untrained(models.StableDiffusion):
    """Networks of full size with random weights, which no file holds."""

    @property
    def identity(self) -> dict[str, Any]:
        """There is none."""
        return {}

    def embed(self, prompts: list[str]) -> Tensor:
        """As wide as the real ones."""
        return torch.randn(len(prompts), TOKENS, TEXT_WIDTH).to(self.device, self.denoiser.unet.dtype)


def _model(
    options: DistillReportOptions, views: Views, device: torch.device, plan: memory.Plan
) -> tuple[models.StableDiffusion, int]:
    """The networks, and the edge of the pictures that they are shown."""
    if options.sd_model:
        found = files.find_models(SdOptions(sd_model=options.sd_model, controlnet=options.controlnet, vram=options.vram))
        return models.load_models(found, device, plan), view_size(views, found)
    files.need_packages()
    stand_in: Any = SimpleNamespace(prediction="epsilon", multiple=64, base="")
    size = view_size(views, stand_in)
    parts = models.place(*networks(device if not plan.offload else torch.device("cpu")), device, plan)
    alpha_bar = models.diffusion.cosine_schedule().to(device)
    return Untrained(stand_in, *parts, alpha_bar, {}, device, plan), size


def _networks_of(model: models.StableDiffusion) -> tuple[Any, Any, Any]:
    return model.denoiser.unet, model.denoiser.controlnet, model.vae


def networks(device: torch.device) -> tuple[Any, Any, Any]:
    """UNet, ControlNet and VAE as large as Stable Diffusion 2.1's, on a device (also the meta device), not trained."""
    from diffusers import AutoencoderKL, ControlNetModel, UNet2DConditionModel

    models.be_quiet()
    with device:
        made: list[Any] = [
            UNet2DConditionModel(**UNET),
            ControlNetModel(conditioning_channels=CHANNELS, **CONTROLNET),
            AutoencoderKL(**VAE),
        ]
    unet, controlnet, vae = (network.eval().requires_grad_(False) for network in made)
    return unet, controlnet, vae


def _run(views: Views, guidance: StableDiffusionGuidance, options: DistillOptions, device: torch.device) -> Run:
    base = Base(guidance.recipe, views)
    state = new_state(options, views, device, base.recipe)
    return Run(Path(), views, guidance, base, options, BUDGET, Provenance({}, 0, {}), state, Clock())


def counted(residual: Residual, model: models.StableDiffusion, points: int, batch: int, size: int) -> dict[str, Cost]:
    """What the parts of a step cost, on the meta device. Args: points: object pixels of the batch."""
    meta = torch.device("meta")
    with meta:
        where, E = torch.empty(2 * points, 3), torch.empty(points, 3)
        specular, cosine = torch.empty(points, len(KNOTS), 3), torch.empty(points)
        transport = Transport(E, specular, specular.clone(), cosine)
        picture = torch.empty(batch, 3, size, size)
    copy = deepcopy(residual).to(meta)
    material = Material.of(torch.empty(points, 5, device=meta, requires_grad=True))
    costs = {"residual": count(lambda: copy(where)), "shading": count(lambda: shade_reference(transport, material))}
    both = {
        "residual": count(lambda: copy(where).sum().backward()),
        "shading": count(lambda: shade_reference(transport, material).sum().backward()),
    }
    costs["backward"] = both["residual"] + both["shading"] - costs["residual"] - costs["shading"]
    with meta:
        unet, controlnet, vae = (type(network).from_config(network.config) for network in _networks_of(model))
    for network, placed in zip((unet, controlnet, vae), _networks_of(model), strict=True):
        network.to(placed.dtype).requires_grad_(False)

    def encode(leaf: Tensor) -> Tensor:
        return vae.encode(leaf.to(vae.dtype)).latent_dist.mode()

    costs["encode"] = count(lambda: encode(picture.requires_grad_()))
    costs["encode, backward"] = count(lambda: encode(picture.requires_grad_()).sum().backward()) - costs["encode"]
    images, edge, dtype = BRANCHES * batch, size >> (len(vae.config.block_out_channels) - 1), unet.dtype
    latents = torch.empty(images, unet.config.in_channels, edge, edge, device=meta, dtype=dtype)
    t = torch.empty(images, device=meta, dtype=torch.long)
    text = torch.empty(images, TOKENS, unet.config.cross_attention_dim, device=meta, dtype=dtype)
    given = torch.empty(images, CHANNELS, size, size, device=meta, dtype=dtype)
    denoiser, scale = models.Denoiser(unet, controlnet), torch.empty((), device=meta, dtype=dtype)
    with torch.no_grad():
        costs["denoise"] = count(lambda: denoiser(latents, t, text, given, scale))
    return costs


NAMES = {
    "data": "light of a view, to the device",
    "recipe": "recipe",
    "residual": "residual",
    "shading": "shading",
    "encode": "VAE encoder",
    "denoise": "ControlNet and UNet, 3 branches",
    "encode, backward": "VAE encoder, backward; score, conditions",
    "backward": "shading and field, backward",
    "optimiser": "optimiser",
}


MODEL = [NAMES[key] for key in ("encode", "denoise", "encode, backward")]


def _parts(milliseconds: dict[str, float], costs: dict[str, Cost], flops: float, bandwidth: float) -> list[Part]:
    """In the order of a step."""
    times = dict(milliseconds)
    times["encode, backward"] = times.pop("guidance") - times["encode"] - times["denoise"]
    whole, parts = sum(times[key] for key in NAMES), []
    for key, name in NAMES.items():
        cost = costs.get(key, Cost(0.0, 0.0))
        least = max(cost.flops / flops, cost.bytes / bandwidth)
        numbers = (cost.flops / 1e9, cost.bytes / 1e9, times[key], 100 * times[key] / whole, 1e5 * least / times[key])
        parts.append(Part(name, *numbers))
    return parts


def summary(report: DistillReport) -> list[str]:
    """The table for a terminal."""
    lines = [f"{'part':42} {'GFLOP':>9} {'GB':>8} {'ms':>10} {'share':>7} {'of peak':>8}"]
    for p in report.parts:
        counts = f"{p.gflop:9.1f} {p.gbyte:8.2f} {p.milliseconds:10.1f}"
        lines.append(f"{p.part:42} {counts} {p.share_percent:6.1f}% {p.of_peak_percent:7.1f}%")
    other = sum(p.share_percent for p in report.parts if p.part not in MODEL)
    minutes = report.step_milliseconds / 6e4 * BUDGET.steps
    return [
        *lines,
        f"whole step {report.step_milliseconds:.1f} ms, {BUDGET.steps} steps {minutes:.1f} min; "
        f"all but the model {other:.1f} %",
        f"{report.device}: {report.peak_tflops:.2f} TFLOP/s, {report.peak_gbytes:.0f} GB/s",
    ]


def _csv(report: DistillReport) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in dataclasses.fields(Part)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(dataclasses.asdict(part) for part in report.parts)
    return text.getvalue()
