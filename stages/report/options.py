"""What `dreammat report` can be told."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ReportOptions:
    """Options of the conditions report."""

    size: int = 512
    """pixels along each side of the view that is measured"""
    env: tuple[str, ...] = ()
    """as for `conditions`; empty for the five built-in environments"""
    seed: int = 0
    """of the camera and of the measured rays; the converged result uses others"""
    bounces: int = 2
    """of light between the object's surfaces, which is measured too; 0 for direct light alone"""
    mitsuba: str = ""
    """a Python interpreter that has the package mitsuba; empty for no side-by-side"""
    cycles: str = ""
    """a Python interpreter that has the package bpy (Blender); empty for no side-by-side"""


@dataclass(frozen=True)
class PriorReportOptions:
    """Options of the prior report."""

    mesh: tuple[str, ...] = ()
    """mesh files to work on; empty for the report's own six shapes"""
    seeds: int = 2
    """runs of every prompt"""
    prompts: int = 0
    """about this many prompts, spread over the list; 0 for all"""
    steps: int | None = None
    """of every distillation; None for the default"""
    views: int = 48
    """cameras of every mesh"""
    bounces: int = 0
    """of light between surfaces, in the pictures by which the material is found"""
    ladder: bool = True
    """also take conditions away, as the paper's ablation does: 120 more runs"""


@dataclass(frozen=True)
class OcclusionReportOptions:
    """Options of the occlusion report."""

    size: int = 2048
    """of the texture, texels along each edge"""
    texels: int = 1000
    """that are compared with float64"""
    rays: tuple[int, ...] = (16, 128, 1280)
    """of each point, one measurement for each"""
    seed: int = 0
    """of the choice of texels"""


@dataclass(frozen=True)
class UnwrapReportOptions:
    """Options of the report on a texture layout."""

    gutter: int = 8
    """least texels between xatlas's charts, where the mesh's UVs were its own"""
    seconds: float = 600.0
    """that xatlas may take"""


@dataclass(frozen=True)
class TransferReportOptions:
    """Options of the report on a texture transfer."""

    reference: Path | None = None
    """the textured model that the transfer was told to follow"""


@dataclass(frozen=True)
class TransfersReportOptions:
    """Options of the report on transfers of a folder of models."""

    views: int = 40
    """cameras of each model"""
    size: int = 256
    """pixels along each side of a view"""
    steps: int | None = None
    """of each distillation; None for the default"""
    texture: int = 1024
    """texels along each edge"""


@dataclass(frozen=True)
class PreviewReportOptions:
    """Options of the report on an asset's preview."""

    cycles: str = ""
    """a Python interpreter that has the package bpy (Blender); empty for no side-by-side"""
    three: str = ""
    """a folder of node modules that has three, for a side-by-side in Chromium; empty for none"""


@dataclass(frozen=True)
class DistillReportOptions:
    """Options of the report on a step with Stable Diffusion."""

    sd_model: str = ""
    """as for `distill`; empty for networks of full size with random weights"""
    controlnet: str = ""
    """as for `distill`"""
    vram: int | None = None
    """as for `distill`"""
    batch: int = 1
    """views a step"""
    warm_up: int = 2
    """steps before those that are measured"""
    steps: int = 5
    """that are measured part by part, and as many again as a whole"""
    device: str = "cpu"
    """a torch device"""


@dataclass(frozen=True)
class EvalOptions:
    """Options of `dreammat eval`. Models are local; the paper's Table 2 has 50 assets, 120 views and samples of each."""

    sd_model: str = ""
    """the base that draws the pictures to compare with: a folder in the layout of diffusers, or an id of the hub"""
    clip: str = ""
    """folder of a CLIP model as transformers writes it"""
    inception: str = ""
    """TorchScript file of the Inception network: uint8 pictures (N, 3, H, W), return_features=True -> (N, D)"""
    views: int = 120
    """random views of an asset"""
    samples: int = 120
    """pictures that the base draws for an asset's prompt"""
    size: int = 512
    """pixels along each side of a picture"""
    env: tuple[str, ...] = ()
    """as for `conditions`, taken in turn; empty for the five built-in environments"""
    seed: int = 0
    """of views, rays and samples"""
    device: str = "cpu"
    """a torch device"""
