"""The stuff, colour and finish that words give what they name, and what wear makes of it."""

from dataclasses import replace
from functools import cache

import numpy as np

from stages.core.color import srgb_decode, srgb_encode
from stages.material.look import from_oklab, to_oklab
from stages.material.recipe import Coat
from stages.prior.colors import CHANGES, COLORS, LEANINGS, changed, rgb
from stages.prior.implied import BURNT
from stages.prior.names import FINISHES, FINISHES_METAL
from stages.prior.phrases import LIVING, Phrase, is_hue
from stages.prior.places import CORRODES, FADED, MADE, WEATHER
from stages.prior.stuffs import BOARDS, FINISH_LOOKS, GENERIC, KNOWN, PAINTABLE, Stuff

RGB = tuple[float, float, float]

SIMILAR = 0.2
"""Distance in OKLab within which a named colour describes a stuff's own."""


def stuff_of_part(phrase: Phrase, beneath: Coat | None) -> str:
    """What a part is made of of which words name the colour alone, or "". Args: beneath: what it is on, None for a whole."""
    said = phrase.where or phrase.part or (phrase.thing if beneath is not None else "")
    straw = beneath is not None and beneath.look in ("straw", "wicker", "bristles")
    soft = straw or (beneath is not None and family_of_look(beneath.look) in ("organic", "fabric", "leather", "metal", "ice"))
    hard = beneath is not None and family_of_look(beneath.look) in ("metal", "wood", "stone", "ceramic", "paint", "gem")
    cloth = beneath is not None and family_of_look(beneath.look) in ("fabric", "leather")
    beast = beneath is not None and beneath.look in PELTS
    sorts = ["", *(name for name, is_it in zip(SORTS, (straw, beast, soft, hard, cloth), strict=True) if is_it)]
    found = (MADE.get((name, sort), "") for name in (said, said.split(" ")[-1]) for sort in sorts)
    return next(filter(None, found), "") if phrase.colors else ""


SORTS = ("straw", "beast", "soft", "hard", "cloth")
"""What parts are on that are of other stuffs there, as parts_made.tsv has it."""


def kin(phrase: Phrase, usual: Phrase) -> bool:
    """Whether a thing of the stuff of a phrase has the colour that it usually has."""
    if not usual.substance or usual.substance == phrase.substance:
        return bool(usual.substance)
    pelt = KNOWN[usual.substance][0].look == KNOWN[phrase.substance][0].look in PELTS
    if phrase.substance == "plush" and KNOWN[usual.substance][0].look in PELTS:
        return True  # "a red panda plush"
    return family_of(usual) == family_of(phrase) != "stone" and (pelt or phrase.substance in GENERIC)


def drawn_on(made: Phrase, beneath: Coat) -> bool:
    """Whether what is named on a thing, with its colour, is not of its own stuff there: the keys of a toy, cranes on silk."""
    kind = KNOWN[made.substance][0].family if made.substance else ""
    alive = bool(made.substance) and KNOWN[made.substance][0].look in LIVING
    cloth = kind == "paint" and family_of_look(beneath.look) == "fabric"
    return cloth or kind in ("metal", "stone", "gem") or (alive and family_of_look(beneath.look) != "organic")


def painted(made: Phrase) -> str:
    """What a thing is made of where words name its colour: wood and iron are painted, but for those of their own colour."""
    own = KNOWN[made.substance][0] if made.substance else None
    if not own or own.paintable or own.family not in ("wood", "metal"):
        return made.substance
    hues = [word for word in made.colors if word in COLORS or word.startswith("#")]
    named, usual = (to_oklab(srgb_decode(np.array(c))[:, None])[:, 0] for c in (color_of(made), own.color))
    if not hues or (made.substance in DYED_METALS and named[0] < WHITE):
        return made.substance  # no white is anodised
    grey = own.family == "metal" and bool(np.hypot(*named[1:]) < GREYISH) and named[0] < WHITE
    tinted = own.family == "wood" or float(np.hypot(*usual[1:])) > GREYISH
    tinted &= bool(np.hypot(*named[1:]) < VIVID * np.hypot(*usual[1:]))
    same = tinted and float(np.linalg.norm(named - usual)) < SIMILAR and named[1] > -GREYISH / 2  # nor green
    return made.substance if grey or same else "painted wood" if own.family == "wood" else "painted metal"


WOODEN = ("wood", "wooden", "timber")
"""Wood of any kind, which is painted where words give it a colour that no wood has."""

PLAIN_METALS = ("metal", "steel", "iron", "tin", "sheet metal")
"""Metals that are painted where words give them a colour that no metal has: "a red metal toolbox"."""

GAUDY = {**dict.fromkeys(WOODEN, "painted wood"), **dict.fromkeys(PLAIN_METALS, "painted metal")}
"""What they are then."""


def gaudy(phrase: Phrase) -> bool:
    """Whether a phrase's colour is one that neither wood nor iron has of itself: green, blue, red."""
    if not any(word in COLORS or word.startswith("#") for word in phrase.colors):
        return False
    _, *chroma = to_oklab(srgb_decode(np.array(color_of(phrase)))[:, None])[:, 0]
    return bool(np.hypot(*chroma) > GREYISH and (chroma[1] < 0.6 * np.hypot(*chroma)))


def greenish(phrase: Phrase) -> bool:
    """Whether a phrase's colour is green or turquoise."""
    if not any(map(is_hue, phrase.colors)):
        return False
    red, green, blue = color_of(phrase)
    return green > 1.15 * red and green > 0.85 * blue


PELTS = ("fur", "feathers")
"""Looks whose colour is that of the beast: a bear of faux fur is as brown as one of fur."""

DYED_METALS = frozenset(["aluminium", "aluminum", "brushed aluminium", "chrome"])
"""Metals that take colour as metals."""

VIVID = 1.7
"""How many times the chroma of a stuff a colour may have that it has of itself."""

GREYISH, WHITE = 0.04, 0.9
"""Chroma and lightness in OKLab below which a colour may be that of a bare metal."""


def corroded(name: str, phrase: Phrase) -> str:
    """What weather leaves on a phrase's stuff: rust on iron, verdigris on copper."""
    if name == "rust" and phrase.substance and KNOWN[phrase.substance][0].look == "verdigris":
        return "verdigris"
    if name not in ("rust", "verdigris") or not phrase.substance or not KNOWN[phrase.substance][0].metallic:
        return name
    return CORRODES.get(KNOWN[phrase.substance][0].look.split(" ")[-1], name)


def weathers_of(phrase: Phrase) -> list[str]:
    """The words of weather of a phrase from below, one for each thing that weather does."""
    told: dict[tuple[str, str], str] = {}
    charred = bool(phrase.substance) and family_of(phrase) == "wood" and not phrase.amount_of(BURNT)
    for word, weather in WEATHER.items():
        if word in phrase.weather and not (charred and word in BURNT):
            told.setdefault((weather.stuff, weather.region.kind), word)
    if sum(place == "crevices" for _, place in told) > 1:
        told.pop(("grime", "crevices"), None)  # what else lies in crevices hides it
    return list(told.values())


def color_of(phrase: Phrase, own: RGB | None = None) -> RGB:
    """sRGB of a phrase's colour words: those that name colours mixed, or the stuff's own, changed by those that change one."""
    base = [
        rgb(COLORS.get(w, w)) if w in COLORS or w.startswith("#") else np.array(KNOWN[w][0].color)
        for w in phrase.colors if is_hue(w)
    ]  # fmt: skip
    color = np.mean(base, 0) if base else np.array((0.5, 0.5, 0.5) if own is None else own)
    for word in (*LEANINGS, *CHANGES):
        if word in phrase.colors:
            color = changed(color, word)
    return triple(color)


def described(wanted: Stuff, named: RGB) -> RGB:
    """A named colour as this stuff has it: "green moss" is moss."""
    if wanted.paintable or wanted.metallic or wanted.look in PAINTABLE or wanted.family in ("fabric", "leather"):
        return named
    own, other = (to_oklab(srgb_decode(np.array(c))[:, None])[:, 0] for c in (wanted.color, named))
    one, two = np.hypot(*own[1:]), np.hypot(*other[1:])
    plain = two < GREYISH / 2 < one or one < GREYISH < two - 2 * GREYISH  # grey moss, and yellow porcelain
    if float(np.linalg.norm(own - other)) > SIMILAR or plain:
        return named
    return triple(np.array(wanted.color) + 0.3 * (np.array(named) - np.array(wanted.color)))


def roughness_of(phrase: Phrase, metal: bool) -> float | None:
    """What words of finish say, if any does."""
    table = {**FINISHES, **FINISHES_METAL} if metal else {**FINISHES_METAL, **FINISHES}
    found = [sum(table[word]) / 2 for word in phrase.finish if word in table]
    return float(np.mean(found)) if found else None


@cache
def family_of_look(look: str) -> str:
    """The family of the stuffs that have a look, or one of its finishes."""
    found = (s.family for stuffs in KNOWN.values() for s in stuffs if look in (s.look, s.look.split(" ")[-1]))
    return next(found, "metal" if look.split(" ")[0] in FINISH_LOOKS else "")


def family_of(phrase: Phrase) -> str:
    return KNOWN[phrase.substance][0].family


def worn(coat: Coat) -> Coat:
    """A coat where it is worn: metal is polished, all else is lighter and rougher."""
    rough = coat.roughness or 0.5
    if (coat.metallic or 0.0) > 0.5:
        return replace(coat, roughness=max(0.12, 0.55 * rough), said=f"bare {coat.said}")
    color = None if coat.color is None else triple(np.array(coat.color) + 0.2 * (1 - np.array(coat.color)))
    return replace(coat, color=color, roughness=min(1.0, rough + 0.15), said=f"worn {coat.said}")


def faded(color: np.ndarray, phrase: Phrase) -> RGB:
    keep = float(np.prod([FADED.get(word, 1.0) for word in phrase.weather]))
    pale = np.mean(color) + keep * (np.asarray(color) - np.mean(color))
    return triple(pale + 0.5 * (1 - keep) * (1 - pale))


def encoded(lab: np.ndarray) -> RGB:
    """sRGB of OKLab."""
    return triple(srgb_encode(from_oklab(lab[:, None])[:, 0]))


def triple(color: np.ndarray) -> RGB:
    red, green, blue = np.clip(color, 0, 1).tolist()
    return red, green, blue


def said_of(phrase: Phrase) -> str:
    """A phrase in few words."""
    boards = ["boards"] if phrase.boards and phrase.substance not in BOARDS else []
    name = phrase.substance or phrase.animal or phrase.thing
    finish = [word for word in phrase.finish if word not in name.split(" ")]
    return " ".join([*finish, *phrase.colors, *phrase.unknown, name, *boards]).strip()
