"""Options of `edit`; imports nothing heavy, so that the command line can show its help at once."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from stages.core.errors import InputError


@dataclass(frozen=True)
class EditOptions:
    """One edit. What stands here from top to bottom is done in this order.

    Hue and saturation are those of OKLCh, the polar form of OKLab; brightness and tint are factors on linear albedo.
    """

    part: tuple[str, ...] = ()  # names, patterns or numbers of parts, see `stages.asset.parts`; none: all of it
    hue: float = 0.0  # degrees that the colour is turned by
    saturation: float = 1.0  # factor on chroma
    brightness: float = 1.0  # factor on albedo
    tint: str = "#ffffff"  # sRGB colour that albedo is multiplied by
    roughness_scale: float = 1.0  # factor on roughness
    roughness_offset: float = 0.0  # added to it
    metallic: float | None = None  # what metallic becomes, 0 … 1
    invert_metallic: bool = False  # 1 - metallic instead

    def __post_init__(self) -> None:
        """Raises: InputError that names the option, what was found and what is expected."""
        for name, low, high in (
            ("hue", -360, 360), ("saturation", 0, 100), ("brightness", 0, 100), ("roughness_scale", 0, 100),
            ("roughness_offset", -1, 1), ("metallic", 0, 1),
        ):  # fmt: skip
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise InputError(f"{name.replace('_', ' ')}: {value:g}; expected {low} to {high}")
        self.tint_srgb()

    def tint_srgb(self) -> tuple[float, float, float]:
        """The tint as sRGB values in [0, 1]. Raises: InputError."""
        digits = self.tint.removeprefix("#")
        if len(digits) == 3:
            digits = "".join(2 * digit for digit in digits)
        if len(digits) != 6 or any(digit not in "0123456789abcdefABCDEF" for digit in digits):
            raise InputError(f"tint: {self.tint!r}; expected a colour as #rgb or #rrggbb, such as '#8a5'")
        red, green, blue = (int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4))
        return red, green, blue

    def changes(self) -> dict[str, Any]:
        """What differs from leaving all as it is, as JSON types. Raises: InputError where nothing does."""
        found = {
            f.name: value
            for f in dataclasses.fields(self)
            if (value := getattr(self, f.name)) != f.default and f.name != "part"
        }
        if not found:
            raise InputError("nothing to change; give --hue, --saturation, --brightness, --tint or one of the others")
        return ({"part": list(self.part)} if self.part else {}) | found

    @staticmethod
    def of(changes: dict[str, Any]) -> "EditOptions":
        """The inverse of `changes`."""
        return EditOptions(**{**changes, "part": tuple(changes.get("part", ()))})

    def told(self) -> str:
        """In words, on one line."""
        shown = {name: f"{value:g}" if isinstance(value, float | int) else value for name, value in self.changes().items()}
        shown |= {"invert_metallic": ""} if self.invert_metallic else {}
        found = [f"{name.replace('_', ' ')} {value}".rstrip() for name, value in shown.items() if name != "part"]
        return ", ".join(found) + (f" on {', '.join(self.part)}" if self.part else "")
