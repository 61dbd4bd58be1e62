"""Where a phrase lies: where words say, where it gathers of itself, or as what joins it tells."""

from stages.prior.order import ROOFING
from stages.prior.phrases import Phrase, lives
from stages.prior.places import DETAILS, GATHERS, GROWN, JOINED, PARTS, SHAPES, Region, gathering
from stages.prior.shades import family_of
from stages.prior.stuffs import PATTERNED

BESIDE = ("with", "over", "and", "comma", "on")
"""Joins that leave open where a phrase lies."""

STRIPS = ("below", "above", "front", "back", "left", "right", "middle")
"""Places that are as high or wide as their word says, however much lies there: "lots of rust near the bottom"."""


def strands(phrase: Phrase) -> bool:
    """Whether a phrase is of something long and thin, which lies around a thing."""
    return phrase.substance.split(" ")[-1] in STRANDS


STRANDS = ("ribbon", "ribbons", "cord", "cords", "rope", "ropes", "string", "twine", "strips")


def scaled(region: Region, much: float) -> Region:
    """A region that covers less or more than usual."""
    return region if much == 1 else region._replace(share=min(0.9, region.share * much))


def place_of(phrase: Phrase) -> Region:
    """Where a phrase lies."""
    region = whole_place_of(phrase)
    return region if phrase.region and region.kind in STRIPS else scaled(region, phrase.much)


def whole_place_of(phrase: Phrase) -> Region:
    """Where it lies, however much of it there is."""
    gathers = GATHERS.get(gathering(phrase.substance))
    if gathers and phrase.where in ("on top", "on the top", "on top of it"):
        return Region("up", min(0.45, gathers.share) if gathers.kind == "up" else 0.45, gathers.size, gathers.wear)
    cut = bool(phrase.substance) and family_of(phrase) in ("organic", "wood")
    if phrase.where in ("on top", "on the top") and cut and not gathers:
        return Region("up", 0.4)  # "a cake with strawberries on top"
    if gathers and phrase.region and phrase.region.kind == "all":
        return gathers  # "ivy climbing the walls"
    if phrase.region and phrase.region.kind == "all" and phrase.part:
        return DETAILS  # "with a red letter on each side"
    if phrase.region and phrase.region.kind == "all" and phrase.substance and family_of(phrase) == "gem":
        return PARTS["central gem"]  # "a book with a gem on the cover"
    if phrase.region:
        return phrase.region._replace(wear=max(phrase.region.wear, 0.7 * gathers.wear)) if gathers else phrase.region
    if gathers and phrase.join.kind in ("with", "on", "cover", "over", "and", "comma", "cap", "top"):
        covers = phrase.join.kind in ("cover", "over")
        return gathers._replace(share=max(gathers.share, 0.65)) if covers and gathers.kind != "up" else gathers
    grown = GROWN.get(phrase.substance.split(" ")[-1])
    if grown and phrase.join.kind in BESIDE and not phrase.part:
        return grown
    if strands(phrase) and phrase.join.kind in ("cover", *BESIDE):
        return SHAPES["bands"]._replace(share=0.5, size=0.06) if phrase.within else SHAPES["bands"]._replace(share=0.15)
    if phrase.substance and family_of(phrase) == "gem" and phrase.join.kind in BESIDE and not phrase.part:
        return SHAPES["studs"]
    if phrase.substance in ROOFING and phrase.join.kind in ("", *BESIDE):
        return PARTS["roof"]
    stand = phrase.thing or phrase.boards or phrase.substance in PATTERNED
    if (phrase.part or (stand and phrase.join.beneath)) and phrase.join.kind == "on":
        return PARTS["stand"]  # "a cannon on a wooden carriage"
    drawn = bool(phrase.thing) and (lives(phrase.thing) or phrase.thing == "crane")
    if drawn and (phrase.colors or phrase.metal) and phrase.join.kind in BESIDE:
        return SHAPES["motifs"]  # "a kimono with gold cranes"
    if (phrase.part or phrase.thing) and phrase.join.kind in BESIDE:
        return DETAILS
    return JOINED.get(phrase.join.kind, JOINED["with"])
