"""Options of `dreammat train`."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class TrainPriorOptions:
    """What the embedded prior is trained with."""

    steps: int = 9000  # optimiser steps, the reader's first ones included
    text_steps: int = 3000  # first steps, that train the reader alone, on captions and the materials they call for
    batch: int = 32  # pictures a step
    learning_rate: float = 6e-4  # of Adam, after warming up
    shards: int = 40  # files of light transport
    tiles: int = 40  # pictures in each shard
    start: Path | None = None  # weights to begin with, as far as they fit; None: random ones
    seed: int = 0
    device: str = "cpu"  # a torch device
    workers: int = 0  # processes that make batches; 0: the training process itself
    checkpoint_every: int = 60  # steps
    sample_every: int = 600  # steps between sample sheets


@dataclass(frozen=True)
class PicturesOptions:
    """What pictures a ControlNet is trained on. Paper: 16 views, each in one of six environments."""

    captions: Path | None = None  # JSON: file name -> caption, or {"caption": ..., "tags": [...]}
    captioner: Path | None = None  # folder of a BLIP model, for files without a caption
    env: tuple[str, ...] = ()  # as for `conditions`, to draw from; empty: random ones, others for each object
    lights: int = 2  # environments of an object
    views: int = 16  # of an object, each in all of its environments
    size: int = 512  # pixels along each side of a view
    quality: str = "draft"  # rays a point: draft, standard, high; pictures have 8 bits
    seed: int = 0
    shard: tuple[int, int] = (1, 1)  # (i, n): the i-th of n parts of the work


@dataclass(frozen=True)
class TrainControlnetOptions:
    """How a ControlNet is trained. Paper: batch 256, 3 epochs of 1,242,880 pictures, learning rate 1e-5, nothing dropped."""

    sd_model: str = ""  # the base: a folder in the layout of diffusers, or an id of the hub
    steps: int = 15_000  # optimiser steps
    batch: int = 256  # pictures a step
    at_once: int = 4  # of them on a device at a time; gradients of the rest are accumulated
    learning_rate: float = 1e-5  # of AdamW
    no_prompt: float = 0.1  # share of pictures learnt without their caption
    no_geometry: float = 0.05  # ... without depth and normals
    no_light: float = 0.05  # ... without light maps
    precision: str | None = None  # "no", "fp16" or "bf16"; None: bf16 on a GPU, else no
    seed: int = 0
    workers: int = 0  # processes that read pictures; 0: the training process itself
    checkpoint_every: int = 500  # steps
    sample_every: int = 1000  # steps between sample sheets
