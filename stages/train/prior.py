"""Trains the embedded prior from nothing: renders tiles, then learns to denoise them, resumable at any moment.

    out/shards/shard_NNN.npz   light transport to train on
    out/checkpoint.npz         all that a resumed run needs
    out/prior.npz              weights to ship: averaged, half precision
    out/curve.csv              step, losses, seconds
    out/samples_NNNNNN.png     pictures sampled under held-out tiles
"""

import math
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from stages.core import diffusion
from stages.core.artifact import (
    Field,
    Provenance,
    Schema,
    load_npz,
    peek,
    plain_options,
    save_npz,
    sha256_file,
    write_text,
)
from stages.core.errors import NumericalError
from stages.core.progress import Progress, silent
from stages.prior.model import VOCABULARY_FILE, WEIGHTS, PriorNetwork, save_weights
from stages.prior.profile import drop
from stages.prior.vocabulary import Vocabulary
from stages.train.batches import Batch, CaptionBatch, CaptionBatches, PictureBatches, Tiles
from stages.train.options import TrainPriorOptions
from stages.train.render import render_shards
from stages.train.samples import write_samples

CURVE = ("step", "loss_noise", "loss_material", "loss_text", "seconds")

CHECKPOINT = Schema(
    "dreammat.prior_checkpoint",
    1,
    {
        "parameters": Field("f4", ("N",)),
        "average": Field("f4", ("N",)),  # exponential moving average of the parameters
        "moment_1": Field("f4", ("N",)),
        "moment_2": Field("f4", ("N",)),
        "curve": Field("f8", ("S", len(CURVE))),
    },
    extra=("step", "seconds"),
)

MATERIAL_WEIGHT = 0.3
BACKGROUND_WEIGHT = 0.1
NULL_TEXT, NO_GEOMETRY, NO_LIGHT = 0.12, 0.15, 0.15
"""Shares of pictures that are learnt without their text, geometry or light maps."""

WORD_NOISE = 0.06
"""Deviation of the noise on each component of a (unit) word vector, so that neighbours of a word are learnt with it."""

FREE = ("device", "workers", "checkpoint_every", "sample_every", "shards", "steps")
"""Options that a run may be continued with others of; more shards are more to learn from, from then on, and more steps go on
from where it stands, at the rate that a run of so many has there."""

CAPTIONS = 256
WARM_UP = 150
BETAS = (0.9, 0.99)


@dataclass(frozen=True)
class TrainPriorResult:
    """weights: the file to ship. step: how far training is. up_to_date: nothing was left to do."""

    weights: Path
    step: int
    up_to_date: bool


class State:
    """Network, optimiser state and average, each in one row of memory."""

    def __init__(self, network: PriorNetwork, device: torch.device) -> None:
        self.network = network.to(device)
        self.row = torch.cat([p.detach().reshape(-1) for p in network.parameters()])
        self.gradient = torch.zeros_like(self.row)
        start = 0
        for p in network.parameters():
            part = slice(start, start + p.numel())
            p.data, p.grad = self.row[part].view_as(p), self.gradient[part].view_as(p)
            start += p.numel()
        self.average = self.row.clone()
        self.moment_1, self.moment_2 = torch.zeros_like(self.row), torch.zeros_like(self.row)
        self.step, self.seconds = 0, 0.0
        self.curve: list[tuple[float, ...]] = []

    def update(self, learning_rate: float) -> None:
        """One step of Adam with clipped gradient, and of the average."""
        norm = self.gradient.norm()
        if not torch.isfinite(norm):
            raise NumericalError(f"step {self.step}: the gradient is not finite; lower --learning-rate")
        self.gradient.mul_(torch.clamp(1.0 / norm, max=1.0))
        self.moment_1.lerp_(self.gradient, 1 - BETAS[0])
        self.moment_2.lerp_(self.gradient.square(), 1 - BETAS[1])
        count = self.step + 1
        deviation = (self.moment_2 / (1 - BETAS[1] ** count)).sqrt_().clamp_(min=1e-8)
        self.row.addcdiv_(self.moment_1, deviation, value=-learning_rate / (1 - BETAS[0] ** count))
        self.average.lerp_(self.row, 1 - min(0.998, count / (count + 10)))
        self.gradient.zero_()
        self.step = count


def train_prior(
    out: Path, options: TrainPriorOptions, force: bool = False, progress: Progress = silent
) -> TrainPriorResult:
    """Render the training set where it is missing, and train until `options.steps`; continues where it was stopped.

    Args:
        out: folder. force: begin again, with the tiles that are there.
    Raises: NumericalError when a loss is not finite; OutputError.
    """
    weights = out / "prior.npz"
    inputs = {"vocabulary": sha256_file(VOCABULARY_FILE)}
    if options.start is not None:
        inputs["start"] = sha256_file(options.start)
    request = Provenance(learnt_from(options), options.seed, inputs)
    done = None if force else peek(weights, WEIGHTS)
    if done is not None and done.same_request(request) and done.extra["training"]["step"] >= options.steps:
        return TrainPriorResult(weights, done.extra["training"]["step"], up_to_date=True)
    tiles = Tiles(render_shards(out / "shards", options.shards, options.tiles, options.seed, progress))
    vocabulary = Vocabulary.load(VOCABULARY_FILE)
    with torch.random.fork_rng():  # nn.Module initialisation knows only the global generator, which is put back
        torch.default_generator.manual_seed(options.seed)
        network = PriorNetwork(vocabulary.vectors.shape[1])
    if options.start is not None:
        begin_with(network, options.start)
    state = State(network, torch.device(options.device))
    if not force:
        restore(state, out / "checkpoint.npz", request)
    for losses in optimise(state, tiles, vocabulary, options):
        progress(f"training the prior (loss {losses[0]:.4f})", state.step, options.steps)
        if state.step % options.checkpoint_every == 0 or state.step == options.steps:
            save(state, out, request)
        if state.step % options.sample_every == 0 or state.step == options.steps:
            write_samples(out / f"samples_{state.step:06d}.png", weights, tiles, options)
    return TrainPriorResult(weights, state.step, up_to_date=False)


def learnt_from(options: TrainPriorOptions) -> dict[str, Any]:
    """The options that shape the result; a resumed run may change the others."""
    chosen = {name: value for name, value in plain_options(options).items() if name not in FREE}
    return chosen | {"start": options.start.name if options.start else None}


def begin_with(network: PriorNetwork, path: Path) -> None:
    """Take what an earlier training learnt; where a parameter has grown since, the rest is 0. Raises: ArtifactError."""
    stored = load_npz(path, WEIGHTS)
    parameters, start = dict(network.named_parameters()), 0
    for name, shape in stored.provenance.extra["layout"]:
        values = torch.from_numpy(stored["parameters"][start : start + math.prod(shape)].astype(np.float32)).view(shape)
        start += values.numel()
        if name in parameters and _fits(shape, parameters[name].shape):
            parameters[name].data.zero_()[tuple(map(slice, shape))] = values


def _fits(shape: list[int], into: torch.Size) -> bool:
    return len(shape) == len(into) and all(old <= new for old, new in zip(shape, into, strict=True))


def optimise(
    state: State, tiles: Tiles, vocabulary: Vocabulary, options: TrainPriorOptions
) -> Iterator[tuple[float, float, float]]:
    """Yield the losses (noise, material, text) of each step up to the last, after the step is done."""
    alpha_bar, zero = diffusion.cosine_schedule().to(options.device), torch.zeros((), device=options.device)
    pictures = loader(PictureBatches(tiles, options.batch, options.seed), state.step, options.text_steps, options)
    captions = loader(CaptionBatches(CAPTIONS, options.seed), state.step, 0, options)
    while state.step < options.steps:
        start = time.perf_counter()
        generator = torch.Generator().manual_seed(options.seed * 1_000_003 + state.step)
        if state.step < options.text_steps:
            noise, material = zero, zero
            text = reader_loss(state.network, vocabulary, next(captions), generator)
        else:
            noise, material = picture_losses(state.network, vocabulary, next(pictures), alpha_bar, generator)
            text = zero
        (noise + MATERIAL_WEIGHT * material + text).backward()
        state.update(learning_rate(state.step, options))
        values = (float(noise.detach()), float(material.detach()), float(text.detach()))
        state.seconds += time.perf_counter() - start
        state.curve.append((state.step, *values, state.seconds))
        yield values


def loader(dataset: torch.utils.data.Dataset, step: int, first: int, options: TrainPriorOptions) -> Iterator:
    """Batches of the steps from `step` (at least `first`) to the last, in order."""
    steps = range(max(step, first), options.steps)
    workers = options.workers
    batches = torch.utils.data.DataLoader(dataset, batch_size=None, sampler=steps, num_workers=workers, collate_fn=None)
    return iter(batches)


def learning_rate(step: int, options: TrainPriorOptions) -> float:
    """Warms up in both phases, stays, and falls along a cosine over the last two fifths to a twentieth."""
    in_phase = step if step < options.text_steps else step - options.text_steps
    rise = min(1.0, (in_phase + 1) / WARM_UP)
    fall = np.clip((step / options.steps - 0.6) / 0.4, 0, 1)
    return options.learning_rate * rise * (0.05 + 0.95 * float(np.cos(fall * np.pi / 2)) ** 2)


def picture_losses(
    network: PriorNetwork, vocabulary: Vocabulary, batch: Batch, alpha_bar: Tensor, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Errors of v and of the material of each pixel."""
    device, count = alpha_bar.device, len(batch.image)
    t = torch.randint(0, diffusion.STEPS, (count,), generator=generator).to(device)
    noise = torch.randn(batch.image.shape, generator=generator).to(device)
    lost = torch.rand((3, count), generator=generator)
    image, mask, material = (x.to(device) for x in (batch.image, batch.mask, batch.material))
    conditions = drop(batch.conditions.to(device), (lost[1] < NO_GEOMETRY).to(device), (lost[2] < NO_LIGHT).to(device))
    described = (lost[0] >= NULL_TEXT).tolist()
    prompts = [caption if keep else "" for caption, keep in zip(batch.captions, described, strict=True)]
    text = network.text(*noisy_words(vocabulary, prompts, generator, device))
    x_t = diffusion.add_noise(alpha_bar, image, noise, t)
    with torch.autocast(device.type, torch.bfloat16):
        v, surface = network.denoiser(x_t, t, diffusion.per_image(alpha_bar, t), conditions, text)
    weight = mask + BACKGROUND_WEIGHT * (1 - mask)
    error = (v - diffusion.velocity(alpha_bar, image, noise, t)).square().mean(1, keepdim=True)
    material_error = (surface - material).square().mean(1, keepdim=True)
    return (error * weight).sum() / weight.sum(), (material_error * mask).sum() / mask.sum().clamp(min=1)


def reader_loss(
    network: PriorNetwork, vocabulary: Vocabulary, batch: CaptionBatch, generator: torch.Generator
) -> Tensor:
    """Error of the materials that phrases call for."""
    device = next(network.parameters()).device
    read = network.reader.read(*noisy_words(vocabulary, batch.captions, generator, device))
    return (read - batch.coats.to(device)).square().mean()


def noisy_words(
    vocabulary: Vocabulary, prompts: list[str], generator: torch.Generator, device: torch.device
) -> tuple[Tensor, Tensor]:
    """Word vectors of prompts, a little off; as `Vocabulary.encode`."""
    vectors, present = vocabulary.encode(prompts)
    vectors = vectors + WORD_NOISE * torch.randn(vectors.shape, generator=generator) * present[..., None]
    return vectors.to(device), present.to(device)


def save(state: State, out: Path, request: Provenance) -> None:
    """Write checkpoint, weights and curve."""
    rows = {name: getattr(state, name).cpu().numpy() for name in ("average", "moment_1", "moment_2")}
    rows |= {"parameters": state.row.cpu().numpy(), "curve": np.array(state.curve)}
    extra = {"step": state.step, "seconds": round(state.seconds, 1)}
    save_npz(out / "checkpoint.npz", CHECKPOINT, rows, Provenance(request.options, request.seed, request.inputs, extra))
    hours, device = round(state.seconds / 3600, 3), str(state.row.device)
    training = {"step": state.step, "hours": hours, "commit": commit(), "device": device}
    save_weights(out / "prior.npz", state.network, rows["average"], request, training)
    lines = [",".join(CURVE), *(f"{int(s)},{a:.6f},{b:.6f},{c:.6f},{w:.1f}" for s, a, b, c, w in state.curve)]
    write_text(out / "curve.csv", "\n".join(lines) + "\n")


def restore(state: State, path: Path, request: Provenance) -> None:
    """Continue from a checkpoint of the same request, where there is one."""
    found = peek(path, CHECKPOINT)
    if found is None or not found.same_request(request):
        return
    stored = load_npz(path, CHECKPOINT)
    with torch.no_grad():
        state.row.copy_(torch.from_numpy(stored["parameters"]))
        for name in ("average", "moment_1", "moment_2"):
            getattr(state, name).copy_(torch.from_numpy(stored[name]))
    state.step, state.seconds = found.extra["step"], found.extra["seconds"]
    state.curve = [tuple(row) for row in stored["curve"].tolist()]


def commit() -> str:
    """The source's commit, or "unknown" outside a repository."""
    here = Path(__file__).parent
    run = subprocess.run(["git", "rev-parse", "HEAD"], cwd=here, capture_output=True, text=True, check=False)
    return run.stdout.strip() if run.returncode == 0 else "unknown"
