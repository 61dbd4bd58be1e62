"""What phrases say without saying it: tyres are rubber, knobs are on the front, skin is all over."""

from dataclasses import replace
from itertools import pairwise

from stages.prior.colors import CHANGES
from stages.prior.lexicon import Join, singulars
from stages.prior.objects import OBJECTS
from stages.prior.phrases import Phrase, family, is_hue
from stages.prior.places import GATHERS, HEADED, OWN, PARTS, SHAPES, Region, gathering
from stages.prior.stuffs import KNOWN, ROOFS


def implied(phrases: list[Phrase]) -> None:
    """Say it, in place. Args: phrases: one or more."""
    for step in STEPS:
        step(phrases)


def _barks(phrases: list[Phrase]) -> None:
    """Bark is that of the tree that is named: "a birch log, bark peeling off"."""
    trees = [p.substance.split(" ")[0] for p in phrases if p.substance and family(p.substance) == "wood"]
    trees += [p.thing.split(" ")[0] for p in phrases if p.thing]
    for phrase in phrases:
        if phrase.substance == "bark" and not phrase.colors:
            phrase.substance = next((f"{tree} bark" for tree in trees if f"{tree} bark" in KNOWN), "bark")


def _alone(phrases: list[Phrase]) -> None:
    """A part that is all that is named is the thing: "a tire"."""
    first, last = phrases[0], phrases[-1]
    listed = all(p.join.kind == "and" and not p.thing for p in phrases[1:]) and all(p.color_only for p in phrases[:-1])
    if len(phrases) > 1 and listed and last.where in OBJECTS and last.where in PARTS:
        last.thing, last.region, last.where = last.where, None, ""  # "a blue and yellow tartan cushion"
    names = (first.where, first.where.split(" ")[-1])  # "a hawaiian shirt"
    thing = next((one for name in names for one in (name, *singulars(name)) if one in OBJECTS), "")
    if not first.says_what and thing and len(phrases) == 1:
        phrases[0] = replace(first, thing=thing, region=None, where="")


def _patterned(phrases: list[Phrase]) -> None:
    """A pattern of which no colour is said is darker than what it lies on: "a striped pullover"."""
    first, *rest = phrases
    plain = bool(first.thing) and not (first.animal or first.within or first.palette) and first.where in PLAIN_PATTERNS
    alone = not any(p.where in SHAPES or p.color_only for p in rest)
    if plain and first.region and alone:
        phrases.insert(1, Phrase(Join("with"), colors=["dark"], region=first.region, where=first.where))
        first.region, first.where = None, ""
    for phrase, after in zip(rest, [*rest[1:], Phrase()], strict=False):
        told = after.color_only and after.join.kind == "comma"  # "with a striped sail, red and white"
        bare = not told and phrase.join.kind in ("with", "comma") and not (phrase.says_what or phrase.weather or phrase.finish)
        if bare and not phrase.colors and phrase.where in (*PLAIN_PATTERNS, *CHECKS):
            phrase.colors = ["black" if phrase.where in CHECKS else "dark"]  # "with checkers on the side"


PLAIN_PATTERNS = ("speckled", "flecked", "mottled", "dappled", "striped", "stripes", "spotted", "spots", "dotted",
                  "polka dot", "polka dots")
CHECKS = ("checks", "chequers", "checkers", "checker", "checkerboard", "chequerboard", "checkered", "chequered")
"""Patterns that are darker than what they lie on, or black on it."""


def _flecked(phrases: list[Phrase]) -> None:
    """A stuff of one colour that is speckled has specks that are darker: "a mug with a speckled cream glaze"."""
    for number, phrase in reversed(list(enumerate(phrases))):
        stuff = phrase.substance and any(map(is_hue, phrase.colors)) and not phrase.palette
        if stuff and phrase.where in FLECKED and phrase.join.kind not in ("spots", "and") and not phrase.animal:
            marks = Phrase(Join("with"), colors=[*phrase.colors, "dark"], region=phrase.region, where=phrase.where)
            if phrase.within:
                phrase.region, phrase.where, marks.within = phrase.within.region, phrase.within.where, phrase.within
                phrase.within = None
            else:
                phrase.region, phrase.where = None, ""
            beneath = number + 1 < len(phrases) and phrases[number + 1].join.beneath
            phrases.insert(number + 1 + beneath, marks)


FLECKED = ("speckled", "flecked", "mottled", "dappled")
"""Patterns that a stuff has of itself."""


def _listed(phrases: list[Phrase]) -> None:
    """What joins the first of a list joins the others: "crusted with salt and green corrosion"."""
    for one, other in pairwise(phrases):
        listed = other.join.kind == "and" and one.join.kind in LISTED and one.substance and other.substance
        if listed and not (one.region or other.region):
            other.join = one.join
            one.much, other.much = 0.6 * one.much, 0.6 * other.much


def _bodies(phrases: list[Phrase]) -> None:
    """A beast's skin is all that one sees of it: "an orc with green skin"."""
    first, *rest = phrases
    for number, skin in enumerate(rest if first.thing and not first.says_stuff else []):
        if skin.join.kind == "and" and phrases[number].color_only and not (skin.region or phrases[number].region):
            continue  # "an owl, brown and white feathers"
        if skin.where == "coat" and OBJECTS[first.thing].made.split(" with ")[0].endswith("fur"):
            skin.region, skin.where = PARTS["body"], "body"  # "a husky with a grey coat"
        told = bool(skin.colors) or not number
        joined = skin.join.kind in ("with", "and", "comma") and not skin.region
        if told and joined and skin.substance.split(" ")[-1] in SKINS:
            skin.region, skin.where = PARTS["body"], "body"


def _fronts(phrases: list[Phrase]) -> None:
    """Knobs and buttons are on the front."""
    for phrase in phrases:
        if phrase.where in ("knobs", "buttons") and not phrase.within:
            phrase.within = Phrase(region=Region("badge", 1.4), where="front")


def _heads(phrases: list[Phrase]) -> None:
    """A beard, a visor or eyes are in front of the head, and shoulder pads beside it, of who has one."""
    if phrases[0].thing not in HEADED:
        return
    for phrase in phrases[1:]:
        part = phrase.where.split(" ")[-1]
        if part in FACIAL and not phrase.within:
            phrase.region = Region("front", FACIAL[part])
            phrase.within = Phrase(region=Region("above", 0.28), where="head")
        elif part in NECKS and not phrase.within:
            phrase.region = Region("below", 0.74)
            phrase.within = Phrase(region=Region("above", 0.4), where="neck")
        elif part in SHOULDERED and not phrase.within:
            phrase.within = Phrase(region=Region("above", 0.4), where="shoulders")


FACIAL = {"beard": 0.45, "moustache": 0.3, "visor": 0.45, "mask": 0.45, "eyes": 0.25, "goggles": 0.35, "faceplate": 0.45}
"""Parts in front of a head, and how far back they reach."""

NECKS = ("scarf", "necklace", "neckerchief", "bandana", "collar")
SHOULDERED = ("pads", "pad", "pauldrons", "pauldron", "guards", "plates", "epaulettes")


def _stones(phrases: list[Phrase]) -> None:
    """The stone of a jewel is a gem: "a gold bracelet with a teal stone"."""
    first, *rest = phrases
    for phrase in rest:
        if phrase.join.kind in ("inlay", "stud") and phrase.color_only:  # "inlaid with turquoise"
            named = (name for word in phrase.colors for name in (f"{word} stone", word) if name in KNOWN)
            phrase.substance = next((name for name in named if family(name) in ("gem", "stone")), "")
            phrase.colors = [] if phrase.substance else phrase.colors
    named = (name for word in first.colors for name in (f"{word} stone", word) if name in KNOWN)
    gem = next((name for name in named if family(name) == "gem"), "")
    thing = first.thing or (rest[0].thing if rest else "")
    if thing in JEWELS and gem and first.metal:
        first.colors = []  # "an emerald ring in yellow gold"
        phrases.insert(1, Phrase(Join("stud"), gem))
    elif thing in JEWELS and gem and rest and rest[0].metal and rest[0].join.kind == "and":
        first.thing, first.substance, first.colors = thing, rest[0].substance, []  # "a turquoise and silver bracelet"
        rest[0].substance, rest[0].thing, rest[0].join = gem, "", Join("stud")
    for phrase in rest if first.thing in JEWELS else []:
        if phrase.substance in ("stone", "stones") and phrase.join.kind in ("with", "and", "comma") and not phrase.region:
            phrase.substance = "gem"


JEWELS = ("ring", "bracelet", "pendant", "necklace", "brooch", "earring", "earrings", "tiara", "crown", "amulet", "locket",
          "cufflinks", "bangle", "choker", "engagement ring", "signet ring", "talisman", "circlet", "diadem")  # fmt: skip
"""Things that are set with stones."""


def _sprinkles(phrases: list[Phrase]) -> None:
    """Sprinkles lie on the icing."""
    for before, phrase in pairwise(phrases):
        icing = gathering(before.substance) in ("icing", "frosting", "whipped cream")
        if icing and "sprinkles" in phrase.where and not phrase.within:
            phrase.within = Phrase(region=before.region or GATHERS[gathering(before.substance)], where=before.where or "icing")


def _stuffs(phrases: list[Phrase]) -> None:
    """Parts that are of the same stuff on all things; of what roofs are laid."""
    for phrase in phrases:
        part = phrase.where.split(" ")[-1]
        if part in OWN and not phrase.says_what:
            phrase.substance, phrase.colors = OWN[part][0], list(OWN[part][1])
        if phrase.where.endswith("roof"):
            phrase.substance = ROOFS.get(phrase.substance, phrase.substance)


SKINS = frozenset(["skin", "hide", "scales", "feathers", "fur"])
"""What is all that one sees of a beast that has it."""


def _shade(phrases: list[Phrase]) -> None:
    """A pattern that is only darker or lighter is so than what it lies on: "a grey cat with darker stripes"."""
    for number, phrase in enumerate(phrases[1:], 1):
        changed = not phrase.says_what and any(word in CHANGES for word in phrase.colors)
        own = bool(phrase.where) and phrase.region is not None and phrase.where not in SHAPES
        part = (phrase.where in PARTS or own) and not phrase.within and phrase.region != PARTS["body"]
        if changed and (part or phrase.where in SHAPES.keys() - WEARS.keys()):
            whole = [p for p in phrases[:number] if not p.region or p.region.kind == "all"]
            first = next((p for p in reversed(whole) if any(map(is_hue, p.colors))), phrases[0])
            usual = [word for word in OBJECTS[first.thing].made.split(" ") if is_hue(word)] if first.thing else []
            ground = [word for word in first.colors if is_hue(word)] or [w for w in [first.substance] if w] or usual[:1]
            phrase.colors[:0] = ground


BURNT = frozenset(["charred", "burnt", "burned"])
"""Words that say of wood that it is charcoal."""


def _scorch(phrases: list[Phrase]) -> None:
    """Burnt wood that is charred at one place is brown elsewhere: "a burnt wooden crate, charred at the corners"."""
    first, *rest = phrases
    if BURNT & set(first.weather) and any(p.region and BURNT & set(p.weather) for p in rest):
        first.weather = [word for word in first.weather if word not in BURNT]
        first.colors = first.colors or ["dark"]


LISTED = ("cover", "partly", "spots", "inlay", "stud", "streak", "edge")
"""Joins that hold for all that "and" goes on with."""

WEARS = {
    **{name: "scratched" for name, region in SHAPES.items() if region.kind == "scratches"},
    **{name: "streaky" for name, region in SHAPES.items() if region.kind == "streaks" and not name.startswith("dripping")},
    **dict.fromkeys(("stains", "stained", "water stains", "water rings", "ring marks", "coffee rings", "cup rings"), "stained"),
    **dict.fromkeys(("cracks", "fissures"), "cracked"),
    **dict.fromkeys(("smudges", "smears"), "dirty"),
}  # fmt: skip
"""Patterns that are wear where no stuff is named for them."""

STEPS = (_alone, _patterned, _flecked, _listed, _bodies, _fronts, _heads, _stones, _sprinkles, _shade, _scorch, _barks, _stuffs)
"""What is implied, one after the other."""
