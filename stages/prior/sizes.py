"""Words of size: "a 30 cm vase", "12 feet tall", "a giant teapot"."""

import re

UNITS = {
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 1e-3),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 1e-2),
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("km", "kilometre", "kilometres", "kilometer", "kilometers"), 1e3),
    **dict.fromkeys(("inch", "inches", "in"), 0.0254), **dict.fromkeys(("ft", "foot", "feet"), 0.3048),
}  # fmt: skip
"""Unit → metres."""

_UNIT = "|".join(sorted(UNITS, key=len, reverse=True))
MEASURE = re.compile(rf"(\d+(?:\.\d+)?)[ -]?({_UNIT})\b(?:[ -](?:tall|high|wide|long|large|big|across))?")

TIMES = {
    "tiny": 0.2, "miniature": 0.1, "mini": 0.3, "little": 0.6, "small": 0.6, "large": 1.6, "big": 1.6, "huge": 4.0,
    "giant": 8.0,
    "enormous": 8.0, "gigantic": 10.0, "colossal": 10.0, "oversized": 2.0, "life-size": 1.0, "life size": 1.0,
}  # fmt: skip
"""Word → factor of a thing's usual size."""

LEAST, MOST = 1e-3, 1e4
"""Metres that an object may have."""


def measured(prompt: str) -> tuple[str, float | None]:
    """A prompt without its first measure, and that in metres, if it has one."""
    found = MEASURE.search(prompt)
    if not found:
        return prompt, None
    metres = float(found[1]) * UNITS[found[2]]
    return MEASURE.sub(" ", prompt, 1), min(max(metres, LEAST), MOST)
