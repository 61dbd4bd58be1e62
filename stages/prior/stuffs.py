"""What a name of a substance means: its look, its mean colour and roughness, whether it is metal; and words that change a look.

`names.py` has the names that training teaches; looks.tsv gives these their looks, and stuffs.tsv adds names that only the
reading of prompts knows. A look that is not there is replaced by one of its family. """

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from stages.material.substances import LOOKS
from stages.prior.colors import rgb
from stages.prior.names import SUBSTANCES, Substance
from stages.prior.objects import rows, words


class Stuff(NamedTuple):
    """color: (3,) sRGB mean. paintable: a colour that words name may replace its own."""

    name: str
    family: str
    look: str
    color: tuple[float, float, float]
    roughness: float
    metallic: float
    paintable: bool = True


LOOK_OF = {name: look for look, names in rows("looks.tsv") for name in words(names)}
"""A substance's name → the look it should have; also of names whose means the reader knows alone."""

FAMILY_LOOKS = {
    "metal": ("steel",), "rust": ("rust",), "wood": ("oak",), "stone": ("rock", "granite"),
    "ceramic": ("porcelain", "glossy plastic"),
    "plastic": ("plastic",), "paint": ("paint",), "fabric": ("fabric", "linen"), "leather": ("leather", "rubber"),
    "organic": ("skin", "wax"), "paper": ("paper", "foam"), "gem": ("glass",), "ice": ("snow", "foam"),
}  # fmt: skip
"""Family → looks that stand in for one that is missing, the best first."""

GENERIC = frozenset(words(
    "wood, wooden, timber, fabric, cloth, textile, metal, metallic, stone, rock, ceramic, pottery, plastic, paint, painted, "
    "flashing, leather, paper, veneer, wood veneer"
))  # fmt: skip
"""Names of whole families: another name before one of them says which ("teak wood")."""

BOARDS = frozenset(words(
    "boards, planks, floorboards, wooden boards, wooden planks, wood planks, wood boards, decking, planking, parquet, "
    "wooden floor, wood floor"
))  # fmt: skip
"""Words for sawn boards, which any wood may lie in."""

PATTERNED = frozenset(words(
    "brick, bricks, tile, tiles, roof tiles, shingles, setts, paving, mosaic, stone blocks, stone bricks, concrete blocks"
))  # fmt: skip
"""Names of what is laid of pieces: a name before one of them is what the pieces are made of."""

ROOFS = {
    **dict.fromkeys(("terracotta", "clay", "tile", "tiles", "tiled", "earthenware"), "roof tiles"), "tin": "galvanized steel",
}  # fmt: skip
"""What a roof is laid of, where words name its stuff."""

COATINGS = frozenset(words("plaster, stucco, enamel, gold leaf, gold foil, varnish, glaze, lacquer, black lacquer, gilding, "
"gilded, gilt"))
"""Thin coats that are no paint."""

FINISH_LOOKS = {
    "beaten": "hammered", "forged": "hammered", "dented": "hammered", "burnished": "polished", "mirror": "polished",
    "mirror-like": "polished", "mirror polished": "polished", "gleaming": "polished", "milled": "machined",
    "turned": "machined",
    "cast": "cast", "hammered": "hammered", "brushed": "brushed", "polished": "polished", "machined": "machined",
}  # fmt: skip
"""Words of finish → the finish whose look of a metal they call for."""


PAINTABLE = frozenset(words("ceramic, plastic, paint, fabric, leather, paper, tomato skin, wax, skin, fur, feathers, scales"))
"""Families and looks that take any colour. Of others a colour that is like their own only describes them: "green moss"."""


def _stuff(name: str, s: Substance) -> Stuff:
    anchors = [rgb(text) for text in s.colors]
    plainest = min(anchors, key=lambda color: float(np.ptp(color)))
    red, green, blue = (plainest if s.paintable else np.mean(anchors, 0)).tolist()  # of any colour: none that stands out
    look = LOOK_OF.get(name, name)
    return Stuff(name, s.family, look, (red, green, blue), sum(s.roughness) / 2, s.metallic, s.paintable)


def _extra() -> dict[str, list[Stuff]]:
    table: dict[str, list[Stuff]] = {}
    for family, look, color, roughness, names in rows("stuffs.tsv"):
        red, green, blue = rgb(color).tolist()
        for name in words(names):
            paintable = family in PAINTABLE or look in PAINTABLE
            table[name] = [Stuff(name, family, look, (red, green, blue), float(roughness), float(family == "metal"), paintable)]
    return table


def _taught() -> dict[str, list[Stuff]]:
    table: dict[str, list[Stuff]] = {}
    for substance in SUBSTANCES:
        for name in substance.names:
            table.setdefault(name, []).append(_stuff(name, substance))
    return table


KNOWN = _taught() | _extra()
"""Each name with what it may mean: of two, one takes colours and one has its own."""


def stuff(name: str, colored: bool) -> Stuff:
    """What a name means. Args: colored: a colour is named with it."""
    found = KNOWN[name]
    return next((s for s in found if s.paintable == colored), found[0])


def look_of(wanted: Stuff, finish: Collection[str] = (), available: Collection[str] | None = None) -> str:
    """The look of a stuff under words of finish, where there is one for it; that of its family where its own is missing."""
    there = LOOKS if available is None else available
    metal = wanted.look.split(" ")[-1]
    for word in finish:
        if wanted.metallic and f"{FINISH_LOOKS.get(word, word)} {metal}" in there:
            return f"{FINISH_LOOKS.get(word, word)} {metal}"
    return next((look for look in (wanted.look, metal, *FAMILY_LOOKS[wanted.family]) if look in there), next(iter(there)))


def boards_of(wanted: Stuff) -> Stuff:
    """A wood, sawn into boards."""
    return wanted._replace(look=f"{wanted.look.removesuffix(' boards')} boards")
