"""Options of `export`; imports nothing heavy, so that the command line can show its help at once."""

from dataclasses import dataclass

from stages.core.errors import InputError

TARGETS = ("blender", "three", "godot", "web", "unreal", "unity-hdrp", "unity-urp", "usd", "materialx")
"""What an asset can be written for."""


@dataclass(frozen=True)
class ExportOptions:
    """What an asset is written for."""

    target: str  # one of TARGETS

    def __post_init__(self) -> None:
        """Raises: InputError that names the option, what was found and what is expected."""
        if self.target not in TARGETS:
            raise InputError(f"target: {self.target}; expected one of {', '.join(TARGETS)}")


@dataclass(frozen=True)
class PartsOptions:
    """How the parts of a mesh are drawn."""

    size: int = 640  # pixels along each edge of one picture
