"""The paper's Table 2: how well assets show their prompts (CLIP score), and how like Stable Diffusion's pictures (FID).

    out/<asset>_<hash>/renders.npz   the asset from random views, Filmic on white, in each of the environments in turn
    out/<asset>_<hash>/samples.npz   what Stable Diffusion alone draws for its prompt
    out/assets.csv                   CLIP score of each asset
    out/eval.json                    both measures over all assets

Source: Zhang et al. 2024, "DreamMat", Section 4.3: 10 meshes, 5 prompts each, 120 views. The paper's CLIP score is of the size
that Hessel's scale gives (2.5 times the cosine), which `clip_score_2.5` has; it does not say which CLIP.
"""

import csv
import dataclasses
import importlib.util
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.random import default_rng
from numpy.typing import NDArray

from stages.conditions.cameras import place_cameras
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import read_lights
from stages.core.artifact import (
    Field,
    Provenance,
    Schema,
    load_npz,
    peek,
    read_manifest,
    save_npz,
    sha256_file,
    write_json,
    write_text,
)
from stages.core.errors import InputError
from stages.core.progress import Progress, silent
from stages.core.schemas import ASSET
from stages.prep.read_gltf import read_gltf
from stages.report.metrics import HESSEL, clip_score, frechet_distance
from stages.report.options import EvalOptions
from stages.sd.files import find_base
from stages.sd.models import load_network
from stages.train.objects import place
from stages.train.options import PicturesOptions
from stages.train.pictures import render_view, whole

PICTURES = Schema("dreammat.pictures", 1, {"pictures": Field("u1", ("N", "S", "S", 3))})

STEPS, SCALE = 50, 7.5
"""Of DDIM and of classifier-free guidance: diffusers' defaults."""

AT_ONCE = 4
"""Pictures drawn or measured at a time."""


@dataclass(frozen=True)
class Score:
    """CLIP score of one asset: 100 times the mean cosine between its views and its prompt."""

    asset: str
    prompt: str
    clip_score: float


@dataclass(frozen=True)
class EvalResult:
    """Scores of the assets, and `summary`: what eval.json says."""

    scores: list[Score]
    summary: dict[str, float]


def evaluate(
    assets: tuple[Path, ...], out: Path, options: EvalOptions, force: bool = False, progress: Progress = silent
) -> EvalResult:
    """Measure the folders that `bake` made; pictures that are there from an earlier run are kept.

    Raises: InputError, ArtifactError, OutputError.
    """
    if importlib.util.find_spec("torchmetrics") is None:
        raise InputError('dreammat eval: needs torchmetrics, not installed here; pip install ".[sd]"')
    if len(names := {asset.resolve() for asset in assets}) < len(assets):
        raise InputError(f"{len(assets)} assets, but {len(names)} different ones; give each once")
    device = torch.device(options.device)
    clip, distance = clip_score(Path(options.clip), device), frechet_distance(Path(options.inception), device)
    base, networks = find_base(options.sd_model)
    hashes = {network.folder.name: sha256_file(network.weights) for network in networks}
    drawing = None
    scores = []
    for i, asset in enumerate(assets):
        progress("assets", i, len(assets))
        prompt = read_manifest(asset, ASSET)[0].extra["prompt"]
        folder = out / f"{asset.resolve().parent.name}_{sha256_file(asset / ASSET.manifest)[:8]}"
        shown = {"views": options.views, "size": options.size, "env": list(options.env)}
        drawn = {"samples": options.samples, "size": options.size, "prompt": prompt, "steps": STEPS, "scale": SCALE}
        model = asset / "model.glb"
        asked = Provenance(shown, options.seed, {"model": sha256_file(model)})
        if (renders := found(folder / "renders.npz", asked, force)) is None:
            renders = keep(folder / "renders.npz", asked, render(model, options))
        asked = Provenance(drawn, options.seed, hashes)
        if (samples := found(folder / "samples.npz", asked, force)) is None:
            drawing = drawing or load_pipeline(base, networks, device)
            samples = keep(folder / "samples.npz", asked, draw(drawing, prompt, options))
        scores.append(Score(str(asset), prompt, measure(clip, distance, renders, samples, prompt)))
    mean = float(np.mean([score.clip_score for score in scores]))
    summary = {"clip_score": mean, "clip_score_2.5": HESSEL * mean, "fid": float(distance.compute()), "assets": len(assets)}
    write_text(out / "assets.csv", table(scores))
    write_json(out / "eval.json", summary)
    return EvalResult(scores, summary)


def table(scores: list[Score]) -> str:
    """CSV, a line for each asset."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([("asset", "prompt", "clip_score"), *map(dataclasses.astuple, scores)])
    return text.getvalue()


def found(path: Path, asked: Provenance, force: bool) -> NDArray[np.uint8] | None:
    """The pictures (N, S, S, 3) of an earlier run that asked for the same."""
    made = None if force else peek(path, PICTURES)
    return load_npz(path, PICTURES)["pictures"] if made is not None and made.same_request(asked) else None


def keep(path: Path, asked: Provenance, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Write pictures and hand them on."""
    save_npz(path, PICTURES, {"pictures": pictures}, asked)
    return pictures


def render(model: Path, options: EvalOptions) -> NDArray[np.uint8]:
    """A textured model from random views, (N, S, S, 3), Filmic on white."""
    thing, rng = place(model, read_gltf(model)), default_rng(options.seed)
    lights, _, _ = read_lights(options.env)
    cameras = place_cameras(
        thing.scene.vertices.astype(np.float64), ConditionsOptions(views=options.views, seed=options.seed)
    )
    shown = PicturesOptions(size=options.size, quality="standard")
    pictures = []
    for k, (c2w, fov_y) in enumerate(zip(cameras.c2w, cameras.fov_y, strict=True)):
        light = lights[k % len(lights)]
        pictures.append(whole(render_view(thing, (c2w, float(fov_y)), [light], shown, int(rng.integers(2**31)))))
    return np.stack(pictures)


def load_pipeline(base: Path, networks: tuple, device: torch.device) -> Any:
    """Stable Diffusion as diffusers runs it, in half precision on a GPU."""
    from diffusers import AutoencoderKL, DDIMScheduler, StableDiffusionPipeline, UNet2DConditionModel
    from transformers import CLIPTextModel, CLIPTokenizer

    kinds = (UNet2DConditionModel, AutoencoderKL, CLIPTextModel)
    unet, vae, text = (load_network(kind, network) for kind, network in zip(kinds, networks, strict=True))
    tokenizer = CLIPTokenizer.from_pretrained(base / "tokenizer", local_files_only=True)
    as_released = {"clip_sample": False, "steps_offset": 1}  # what early configs leave out, and the pipeline asks for
    scheduler = DDIMScheduler.from_pretrained(base / "scheduler", local_files_only=True, **as_released)
    parts = (vae, text, tokenizer, unet, scheduler, None, None)
    pipeline: Any = StableDiffusionPipeline(*parts, requires_safety_checker=False)
    pipeline.set_progress_bar_config(disable=True)
    return pipeline.to(device, torch.float16 if device.type == "cuda" else torch.float32)


def draw(pipeline: Any, prompt: str, options: EvalOptions) -> NDArray[np.uint8]:
    """What Stable Diffusion draws for a prompt, (N, S, S, 3)."""
    size = {"height": options.size, "width": options.size, "num_inference_steps": STEPS, "guidance_scale": SCALE}
    parts = []
    for start in range(0, options.samples, AT_ONCE):
        seeds = range(start, min(start + AT_ONCE, options.samples))
        generators = [torch.Generator().manual_seed(options.seed * 1_000_003 + seed) for seed in seeds]
        drawn = pipeline([prompt] * len(seeds), generator=generators, output_type="np", **size).images
        parts.append((drawn * 255 + 0.5).astype(np.uint8))
    return np.concatenate(parts)


def measure(clip: Any, distance: Any, renders: NDArray, samples: NDArray, prompt: str) -> float:
    """Add an asset's pictures to the FID. Returns: its CLIP score."""
    clip.reset()
    with torch.no_grad():
        for pictures, real in ((renders, False), (samples, True)):
            for part in torch.from_numpy(pictures).movedim(-1, 1).split(AT_ONCE):
                part = part.to(clip.device)
                distance.update(part, real=real)
                if not real:
                    clip.update(part, [prompt] * len(part))
    return float(clip.compute())
