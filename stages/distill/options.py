"""What distillation can be asked for. Symbols are those of the paper (Zhang et al. 2024, DreamMat)."""

from dataclasses import dataclass, field
from pathlib import Path

from stages.sd.options import SdOptions

GIVEN = ("none", "geometry", "light", "full")
LOSSES = ("csd", "sds")

QUALITY = {"draft": 0.25, "standard": 1.0, "high": 4.0}
"""Steps, as a multiple of what the guidance calls for."""

NEGATIVE_PROMPT = "blurry, low quality, noisy, shadows, highlights, baked lighting"


@dataclass(frozen=True)
class ScoreOptions:
    """How a diffusion model's predictions become a gradient."""

    negative_prompt: str = NEGATIVE_PROMPT  # what the picture should not look like
    loss: str = "csd"  # one of LOSSES: classifier score distillation, or the classic one; sets the next three
    eta1: float | None = None  # weight of the positive prediction, Eq. 7; None: what loss and guidance call for
    eta2: tuple[float, float] | None = None  # of the negative one, at the start and from two thirds on; None: likewise
    posterior: float | None = None  # share of (eps_pos - noise) added to the classifier score; None: likewise
    given: str = "full"  # conditions the model gets: one of GIVEN; the paper's ablations
    lights: str = "all"  # environments that steps are lit by: "all", or "one", the first; likewise


@dataclass(frozen=True)
class HoldOptions:
    """What holds the material itself."""

    anchor: float = 0.5  # weight of the squared distance from what the words alone call for
    bimodal: float = 0.02  # weight of m (1 - m), which sends metallic to 0 or 1 towards the end
    smoothness: float = 0.0  # weight of ‖Γ(p) - Γ(p + ε)‖², for every guidance


@dataclass(frozen=True)
class DistillOptions:
    """Options of `stages.distill.stage.distill`; `--guidance reference` uses those marked * and nothing below them."""

    guidance: str = "prior"  # * "prior": the embedded diffusion model; "sd": Stable Diffusion; "reference": a known material
    reference: Path | None = None  # * glTF binary or other textured scene, for the reference guidance
    quality: str = "standard"  # * one of QUALITY
    steps: int | None = None  # * optimiser steps; None: what guidance and quality call for
    batch: int = 1  # * images a step, or that many times PIXELS for the reference
    learning_rate: float | None = None  # * of Adam, at the start; None: what the guidance calls for
    seed: int = 0  # *
    device: str = "cpu"  # * a torch device
    prompt: str = ""  # what the object is made of
    parts: tuple[tuple[str, str], ...] = ()  # name, pattern or number of parts, and what each is made of in its place
    like: Path | None = None  # material.npz whose prompt, recipe and draw are taken over, at the same physical scale
    object_size: float | None = None  # metres, longest edge; None: what the prompt's words say
    library: Path | None = None  # folder of scanned materials, which are preferred
    score: ScoreOptions = field(default_factory=ScoreOptions)
    hold: HoldOptions = field(default_factory=HoldOptions)
    sd: SdOptions = field(default_factory=SdOptions)  # models and memory of Stable Diffusion
