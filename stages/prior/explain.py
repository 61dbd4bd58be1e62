"""A recipe in words, for people: what was understood, and where it lies."""

from stages.material.parts import SHAPED
from stages.material.recipe import Coat, Mask, Recipe

HEADINGS = ("what", "where", "look", "colour", "roughness", "metal")

PLACES = {
    "all": "everywhere", "below": "lowest {}", "above": "highest {}", "front": "foremost {}", "back": "rearmost {}",
    "middle": "middle {}", "sides": "outermost {} on either side", "badge": "middle of the front, {} wide", "left": "left {}",
    "right": "right {}", "fade": "fading in over the upper {}", "up": "{} facing up", "down": "{} facing down",
    "edges": "{} on edges", "details": "small pieces of their own, or {} on edges",
    "crevices": "{} in crevices", "hidden": "innermost {}", "spots": "spots, {}", "stripes": "stripes, {}",
    "bands": "bands, {}",
    "dots": "dots, {}", "flowers": "flowers, {}", "zigzag": "zigzag, {}", "gingham": "gingham, {}",
    "checks": "checks, {}", "veins": "veins, {}", "patches": "patches, {}", "streaks": "streaks, {}",
    "scratches": "scratches, {}",
    "chips": "chips, {}", "pieces": "pieces of their own", "along": "by its shape",
    "level": "level, by its shape",
}  # fmt: skip
"""Kind of a mask → where it is, with its share."""

Row = tuple[str, str, str, str, str, str]


def explained(recipe: Recipe) -> list[Row]:
    """A recipe as rows under `HEADINGS`, the base first, then likewise its parts."""
    rows = [_row(recipe.base, "everywhere" if not recipe.parts else "all that is no part")]
    rows += [_row(layer.coat, " and ".join(map(place, layer.masks))) for layer in recipe.layers]
    for part in recipe.parts:
        base, *layers = explained(part.recipe)
        rows.append((base[0], f"part {part.name}", *base[2:]))
        rows += [(row[0], f"part {part.name}, {row[1]}", *row[2:]) for row in layers]
    return rows


def parts(recipe: Recipe) -> list[str]:
    """A line for each coat: "black rubber: lowest 8 % (sole)"."""
    return [f"{what}: {where}" for what, where, *_ in explained(recipe)]


def table(recipe: Recipe) -> list[str]:
    """`explained` as lines with aligned columns."""
    rows = [HEADINGS, *explained(recipe)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(HEADINGS))]
    return ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def place(mask: Mask) -> str:
    """Where a mask lies: "lowest 8 % (sole)"."""
    share = f"{1 - mask.share if mask.invert else mask.share:.0%}".replace("%", " %")
    where = PLACES[mask.kind].format(share)
    if mask.kind == "badge" and mask.share > 1:
        where = "all of the front"
    if mask.invert:
        where = f"what is left of it, {share}"
    if mask.level is None and mask.said.split(" ")[-1] in SHAPED:
        return f"{mask.said}, found by its shape, or {where}"
    return f"{where} ({mask.said})" if mask.said and mask.said not in where else where


def _row(coat: Coat, where: str) -> Row:
    color = "its own" if coat.color is None else "#" + "".join(f"{round(255 * c):02x}" for c in coat.color)
    rough = "its own" if coat.roughness is None else f"{coat.roughness:.2f}"
    return coat.said or coat.look, where, coat.look, color, rough, "yes" if (coat.metallic or 0) > 0.5 else "no"
