"""Options of the swatch stage; imports nothing heavy, so that the command line can show its help at once."""

from dataclasses import dataclass
from pathlib import Path

from stages.core.errors import InputError

SIZES = (256, 512, 1024, 2048, 4096, 8192)
"""Texture sizes that can be made, texels along each edge."""


@dataclass(frozen=True)
class SwatchOptions:
    """How a material is shown without a mesh."""

    prompt: str = ""  # what it is made of
    size: int = 2048  # texels along each edge, one of SIZES
    metres: float | None = None  # edge of the square; None: what shows the structure of its substance best
    seed: int = 0  # of its patterns
    library: Path | None = None  # folder of scanned materials, which are preferred
    preview_size: int = 384  # pixels along each edge of one picture of preview.png

    def __post_init__(self) -> None:
        """Raises: InputError that names the option, what was found and what is expected."""
        if not self.prompt.strip():
            raise InputError('the prompt is empty; say what the material is, such as "rusty iron"')
        if self.size not in SIZES:
            raise InputError(f"size: {self.size} texels; expected one of {', '.join(map(str, SIZES))}")
        if self.metres is not None and not 1e-3 <= self.metres <= 1e3:
            raise InputError(f"metres: {self.metres:g}; expected the edge of a square of 0.001 to 1000 m")
        if not 32 <= self.preview_size <= 2048:
            raise InputError(f"preview size: {self.preview_size} pixels; expected 32 to 2048")
