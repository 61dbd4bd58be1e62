"""What `dreammat conditions` can be told."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ConditionsOptions:
    """Options of the conditions stage; ranges are (low, high)."""

    views: int = 128
    """cameras"""
    size: int = 256
    """pixels along each side of a view; 512 for Stable Diffusion"""
    env: tuple[str, ...] = ()
    """names of built-in environments or paths of .hdr and .exr files; empty for the five built-in ones"""
    seed: int = 0
    """of cameras and ray directions"""
    quality: str = "standard"
    """rays a point: draft, standard, high"""
    error: float = 0.0
    """tone-mapped RMSE, percent, to choose the rays by instead of `quality`; 0 for `quality`"""
    fov: tuple[float, float] = (25.0, 45.0)
    """vertical field of view, degrees"""
    elevation: tuple[float, float] = (-20.0, 45.0)
    """camera elevation, degrees"""
    frame: tuple[float, float] = (0.6, 0.85)
    """share of the half-frame that the object's farthest point reaches"""
    profile: str = "gltf"
    """for whom: "gltf" for the embedded prior and for references; "sd" adds what the released ControlNet was trained on"""
    maps: bool = False
    """also write the condition maps of every view as maps_<environment>.exr"""
    bounces: int = 0
    """of light between the object's surfaces; 0 for direct light alone"""
    shard: tuple[int, int] = (1, 1)
    """make the I-th of N parts of the views alone, to be merged"""
    merge: tuple[Path, ...] = ()
    """folders of all N parts, whose views are brought together"""
