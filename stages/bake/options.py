"""Options of the bake stage; imports nothing heavy, so that the command line can show its help at once."""

from dataclasses import dataclass
from pathlib import Path

from stages.core.errors import InputError

SIZES = (512, 1024, 2048, 4096, 8192)
"""Texture sizes that can be baked, texels along each edge."""


@dataclass(frozen=True)
class BakeOptions:
    """How textures are baked."""

    size: int | None = None  # texels along each edge, one of SIZES; None: 2048, of several sets by their share of the surface
    supersample: int = 2  # N samples on a texel's diagonal, averaged; N x N where it differs from its neighbours
    preview_size: int = 320  # pixels along each edge of one view of preview.png
    occlusion_rays: int = 128  # of each point whose ambient occlusion is traced
    relief: float = 1.0  # how strongly what stands out of the surface is shown, as a multiple; 0 none
    library: Path | None = None  # folder of scanned materials, for a material that uses some

    def __post_init__(self) -> None:
        """Raises: InputError that names the option, what was found and what is expected."""
        if self.size is not None and self.size not in SIZES:
            raise InputError(f"size: {self.size} texels; expected one of {', '.join(map(str, SIZES))}")
        if not 1 <= self.supersample <= 8:
            raise InputError(f"supersample: {self.supersample}; expected 1 to 8 samples along each edge of a texel")
        if not 0 <= self.relief <= 2:
            raise InputError(f"relief: {self.relief:g}; expected 0 (none) to 2 (twice as deep as the real thing)")
        if not 1 <= self.occlusion_rays <= 1 << 16:
            raise InputError(f"occlusion rays: {self.occlusion_rays}; expected 1 to {1 << 16} a point")
        if not 32 <= self.preview_size <= 2048:
            raise InputError(f"preview size: {self.preview_size} pixels; expected 32 to 2048")
