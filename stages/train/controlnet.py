"""Trains the light- and geometry-aware ControlNet on rendered pictures, resumable at any moment.

    out/controlnet/         what `distill --controlnet` takes, in the layout of diffusers: the averaged weights
    out/checkpoint.npz      all that a resumed run needs
    out/curve.csv           step, loss, seconds
    out/samples_NNNNNN.png  what the model draws under conditions of the training set

Only the ControlNet learns: to predict the noise in a picture's latents from conditions and caption. It runs on the GPU if there
is one, else on the CPU; `accelerate launch -m dreammat_cli train controlnet ...` divides each batch over several GPUs.

Source: Zhang et al. 2024, "DreamMat", Section 4.1; Zhang et al. 2023, "Adding Conditional Control to Text-to-Image Diffusion
Models", Section 3.3.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from stages.core import diffusion
from stages.core.artifact import MANIFEST, Provenance, peek, plain_options, sha256_file
from stages.core.errors import InputError, NumericalError, one_line
from stages.core.progress import Progress, silent
from stages.sd.files import ModelFiles, find_base, find_models
from stages.sd.models import (
    Denoiser,
    StableDiffusion,
    TextEncoder,
    load_for_training,
    load_text_encoder,
    write_untrained_controlnet,
)
from stages.sd.options import SdOptions
from stages.train.controlnet_samples import write_samples
from stages.train.controlnet_state import TRAINED, State, load_checkpoint, save
from stages.train.options import TrainControlnetOptions
from stages.train.picture_batches import Batch, Draws, Pictures, batch_of

FREE = ("sd_model", "steps", "at_once", "precision", "workers", "checkpoint_every", "sample_every")
"""Options that a resumed run may change; the base itself is known by its hashes."""

LARGEST_GRADIENT = 1.0
"""Norm to which the gradient is clipped."""

DTYPES = {"no": torch.float32, "fp16": torch.float16, "bf16": torch.bfloat16}
"""What the frozen networks are kept in, by precision."""


@dataclass(frozen=True)
class TrainControlnetResult:
    """controlnet: the folder. step: how far training is. up_to_date: nothing was left to do."""

    controlnet: Path
    step: int
    up_to_date: bool


def train_controlnet(
    pictures: Path, out: Path, options: TrainControlnetOptions, force: bool = False, progress: Progress = silent
) -> TrainControlnetResult:
    """Train on the folder that `render_pictures` made until `options.steps`; continues where it was stopped.

    Args:
        force: begin again.
    Raises: InputError, ArtifactError, OutputError; NumericalError when a loss is not finite.
    """
    data, folder = Pictures(pictures), out / "controlnet"
    _, (unet, vae, text_encoder) = find_base(options.sd_model)
    weights = {"unet": unet.weights, "vae": vae.weights, "text_encoder": text_encoder.weights}
    hashes = {name: sha256_file(path) for name, path in weights.items()}
    request = Provenance(learnt_from(options), options.seed, {"pictures": data.digest, **hashes})
    done = None if force else peek(folder, TRAINED)
    if done is not None and done.same_request(request) and done.extra["step"] >= options.steps:
        return TrainControlnetResult(folder, done.extra["step"], up_to_date=True)

    accelerator = accelerator_of(options)
    stored = None if force else load_checkpoint(out / "checkpoint.npz", request)
    if stored is None and accelerator.is_main_process:
        for name in ("checkpoint.npz", f"controlnet/{MANIFEST}"):
            (out / name).unlink(missing_ok=True)
        write_untrained_controlnet(folder, unet, vae, options.seed)
    accelerator.wait_for_everyone()
    files = find_models(SdOptions(options.sd_model, str(folder)))
    check_size(pictures, data.size, files)
    model = load_for_training(files, accelerator.device, DTYPES[accelerator.mixed_precision])
    state = State(model.denoiser.controlnet, options.learning_rate)
    if stored is not None:
        state.restore(stored)
    for loss in optimise(accelerator, model, state, data, options):
        if accelerator.is_main_process:
            last = state.step == options.steps
            progress(f"training the ControlNet (loss {loss:.4f})", state.step, options.steps)
            if last or state.step % options.checkpoint_every == 0:
                save(state, out, request)
            if last or state.step % options.sample_every == 0:
                state.exchange()
                with accelerator.autocast():
                    write_samples(out / f"samples_{state.step:06d}.png", model, data, options.seed)
                state.exchange()
    accelerator.end_training()
    return TrainControlnetResult(folder, state.step, up_to_date=False)


def learnt_from(options: TrainControlnetOptions) -> dict[str, Any]:
    """The options that shape the result."""
    return {name: value for name, value in plain_options(options).items() if name not in FREE}


def accelerator_of(options: TrainControlnetOptions) -> Any:
    """Accelerate's view of the devices that are there.

    Raises: InputError when they do not know the precision, or the batch cannot be divided over them.
    """
    from accelerate import Accelerator

    precision = options.precision or ("bf16" if torch.cuda.is_available() else "no")
    try:
        accelerator = Accelerator(mixed_precision=precision)
    except ValueError as error:
        raise InputError(f"--precision {precision}: not on this machine ({one_line(error)}); choose another") from error
    together = options.at_once * accelerator.num_processes
    if options.batch % together:
        raise InputError(
            f"--batch {options.batch}: not a multiple of {together}, the pictures at once ({options.at_once}) on "
            f"{accelerator.num_processes} devices; choose another --batch or --at-once"
        )
    accelerator.gradient_accumulation_steps = options.batch // together
    return accelerator


def check_size(folder: Path, size: int, files: ModelFiles) -> None:
    """Raises: InputError when pictures have an edge that the model cannot take."""
    if size % files.multiple:
        expected = f"expected a multiple of {files.multiple}; make them with --size 512"
        raise InputError(f"{folder}: pictures of {size} pixels, {expected}")


def optimise(
    accelerator: Any, model: StableDiffusion, state: State, data: Pictures, options: TrainControlnetOptions
) -> Iterator[float]:
    """Yield the loss of each step up to the last, after the step is done."""
    controlnet, optimizer = accelerator.prepare(state.controlnet, state.optimizer)
    learning = replace(model, denoiser=Denoiser(model.denoiser.unet, controlnet))
    text = load_text_encoder(model.files)
    text.encoder.to(model.device)
    batches = loader(accelerator, Draws(data, latent_shape(data, model.files), options), state.step)
    before = state.curve[-1][-1] if state.curve else 0.0
    start = time.perf_counter()
    while state.step < options.steps:
        losses = []
        for _ in range(accelerator.gradient_accumulation_steps):
            with accelerator.accumulate(controlnet):
                with accelerator.autocast():
                    loss = noise_loss(learning, text, next(batches))
                accelerator.backward(loss)
                if accelerator.sync_gradients:
                    accelerator.clip_grad_norm_(state.parameters, LARGEST_GRADIENT)
                optimizer.step()
                optimizer.zero_grad()
            losses.append(loss.detach())
        mean = float(accelerator.reduce(torch.stack(losses).mean(), "mean"))
        if not math.isfinite(mean):
            raise NumericalError(f"step {state.step}: the loss is not finite, seed {options.seed}; lower --learning-rate")
        state.curve.append((state.step, mean, before + time.perf_counter() - start))
        state.follow()
        yield mean


def loader(accelerator: Any, draws: Draws, step: int) -> Iterator[Batch]:
    """This process's share of the batches of each step from `step` on."""
    options, devices, rank = draws.options, accelerator.num_processes, accelerator.process_index
    count = options.at_once
    first, last = (s * options.batch // count for s in (step, options.steps))
    numbers = (list(range(i * count, (i + 1) * count)) for i in range(first + rank, last, devices))
    batches = torch.utils.data.DataLoader(
        draws, batch_sampler=numbers, num_workers=options.workers, collate_fn=batch_of, pin_memory=torch.cuda.is_available()
    )
    return iter(batches)


def latent_shape(data: Pictures, files: ModelFiles) -> tuple[int, int, int]:
    """Channels, height and width of a picture's latents."""
    return files.vae["latent_channels"], data.size // files.vae.factor, data.size // files.vae.factor


def noise_loss(model: StableDiffusion, text: TextEncoder, batch: Batch) -> Tensor:
    """Mean squared error of what the model predicts: the noise, or v. Differentiable in: the ControlNet's parameters."""
    device, dtype, alpha_bar = model.device, model.denoiser.unet.dtype, model.alpha_bar
    picture, conditions, t, noise = (
        x.to(device, non_blocking=True) for x in (batch.picture, batch.conditions, batch.t, batch.noise)
    )
    with torch.no_grad():
        latents, words = model.encode(picture), text.embed(batch.captions)
    x_t = diffusion.add_noise(alpha_bar, latents, noise, t)
    given = (x_t.to(dtype), t, words.to(dtype), conditions.to(dtype), torch.ones((), device=device, dtype=dtype))
    velocity = model.files.prediction == "v_prediction"
    target = diffusion.velocity(alpha_bar, latents, noise, t) if velocity else noise
    return (model.denoiser(*given).float() - target).square().mean()
