"""Patterns of several colours and coats of animals: which colour is the ground, and which the marks."""

from dataclasses import replace
from itertools import pairwise

from stages.prior.colors import COLORS
from stages.prior.lexicon import Join
from stages.prior.objects import OBJECTS
from stages.prior.phrases import FIRST, Phrase, family, is_hue, lives
from stages.prior.places import ANIMALS, MADE, PARTS, PRINTED, SHAPES, SHELLED, Region
from stages.prior.stuffs import KNOWN


def grounded(phrases: list[Phrase]) -> list[Phrase]:
    """The phrases, each pattern after its ground."""
    return _grounded(_marked(_checked(_painted(_on_color(_told_later(phrases))))))


def _on_color(phrases: list[Phrase]) -> list[Phrase]:
    """A colour on which a pattern lies is that of the thing: "an easter egg with pink zigzags on mint green"."""
    if len(phrases) < 3:
        return phrases
    first, marks, ground, *rest = phrases
    bare = bool(first.thing or first.substance) and not (any(map(is_hue, first.colors)) or first.animal or first.region)
    hue = ground.join.kind == "on" and ground.color_only and not ground.region
    badge = marks.region is not None and marks.region.kind == "badge"
    drawn = bool(marks.thing and marks.colors) and not marks.region  # "a vase, blue dragons on white"
    if bare and hue and (marks.where in SHAPES or badge or drawn) and marks.says_what:
        return [replace(first, colors=[*ground.colors, *first.colors]), marks, *rest]
    return phrases


def _painted(phrases: list[Phrase]) -> list[Phrase]:
    """Phrases, with the paints of each pattern of several; "graffiti on a train" names them before what they are on."""
    if len(phrases) > 1 and phrases[0].where in PAINTS and phrases[1].join.kind == "on":
        first, ground, *rest = phrases
        phrases = [replace(ground, join=FIRST), replace(first, join=Join("with")), *rest]
    return [each for phrase in phrases for each in _paintings(phrase, phrases)]


PAINTS = {
    "kintsugi": ("gold", [""]), "graffiti": ("spray paint", ["blue", "red", "yellow"]),
    "flames": ("paint", ["orange"]), "daisies": ("paint", ["white"]), "sunflowers": ("paint", ["yellow"]),
    "poppies": ("paint", ["red"]), "hearts": ("paint", ["red"]), "puddles": ("water", [""]), "puddle": ("water", [""]),
    "sprinkles": ("glossy plastic", ["red", "yellow", "blue"]),
}
"""Patterns that say of what they are, and of which colours where nobody says."""


def _paintings(phrase: Phrase, beside: list[Phrase]) -> list[Phrase]:
    """A phrase; one that is a pattern of stuffs that everybody knows, as these, unless they are named beside it."""
    stuff, colors = PAINTS.get(phrase.where.split(" ")[0], ("", [""]))
    if phrase.substance or not stuff or not phrase.region:
        return [phrase]
    if any(p.substance == stuff and p.join.kind == "inlay" for p in beside):
        return []  # "repaired with gold (kintsugi)"
    if any(map(is_hue, phrase.colors)):
        return [phrase if stuff == "paint" else replace(phrase, substance=stuff)]
    sizes = [1 + 0.4 * k for k in range(len(colors))]
    regions = [phrase.region._replace(share=phrase.region.share / n, size=phrase.region.size * n) for n in sizes]
    joins = [phrase.join, *([Join("with")] * (len(colors) - 1))]
    return [
        replace(phrase, join=join, substance=stuff, colors=[c for c in [color] if c], region=region)
        for join, color, region in zip(joins, colors, regions, strict=True)
    ]  # fmt: skip


PARTICIPLES = ("striped", "banded", "checked", "chequered", "checkered", "quartered", "spotted", "dotted", "patched")
"""Patterns of which two colours may be told, the first of which is the ground."""

CLOTHS = {"gingham": "red", "houndstooth": "black", "argyle": "green", "tattersall": "brown", "buffalo check": "red"}
"""Checks that are of cloth, and of which colour where nobody says."""


def _told_later(phrases: list[Phrase]) -> list[Phrase]:
    """Two colours of a pattern on a part may be told after it: "with a striped sail, red and white"."""
    for number, (marks, one, other) in enumerate(zip(phrases, phrases[1:], phrases[2:], strict=False)):
        pair = _hue_alone(one) and one.join.kind == "comma" and _hue_alone(other) and other.join.kind == "and"
        if pair and marks.within and marks.where in SHAPES and not any(map(is_hue, marks.colors)):
            ground = Phrase(marks.join, colors=one.colors, region=marks.within.region, where=marks.within.where)
            told = replace(marks, join=Join("with"), colors=other.colors, within=ground)
            return [*phrases[:number], ground, told, *phrases[number + 3 :]]
    return phrases


def _checked(phrases: list[Phrase]) -> list[Phrase]:
    """Checks of cloth are of two colours, named before or after them, white being the other: "gingham, blue and white"."""
    first, *rest = phrases
    told = len(rest) > 1 and first.thing and rest[0].where in PARTICIPLES and rest[0].color_only
    pair = told and rest[0].join.kind == "comma" and _hue_alone(rest[1]) and rest[1].join.kind == "and"
    if pair and not (first.where or first.palette):
        marks = replace(rest[1], join=Join("with"), region=rest[0].region, where=rest[0].where)
        return [replace(first, colors=rest[0].colors), marks, *rest[2:]]  # "a beanie, striped grey and orange"
    if rest and first.thing and not (first.substance or first.where) and rest[0].where in CLOTHS and rest[0].join.kind != "and":
        if rest[0].within:
            return phrases  # "a jar with a red gingham lid"
        return [first, *_checked(rest)]  # "an armchair in houndstooth wool, black on ivory"
    if _plaid(first) and not first.region:
        first = replace(first, region=SHAPES["checks"], where="checks")
    for before, phrase in pairwise(phrases):
        if before.color_only and phrase.join.kind == "and" and _plaid(phrase) and not phrase.region:
            phrase.region, phrase.where = SHAPES["checks"], "checks"  # "red and black plaid"
        elif phrase.where == "lines" and _plaid(before):
            phrase.region, phrase.where = SHAPES["stripes"]._replace(share=0.15), "stripes"
            crossing = replace(phrase, join=Join("with"), region=SHAPES["bands"]._replace(share=0.15), where="bands")
            return [*phrases, crossing]  # "green tartan, red lines"
    for phrase in phrases:
        if phrase.where in CLOTHS and not (phrase.substance or phrase.thing):
            phrase.substance = "fabric"
    if first.where not in SHAPES or first.region is None or not (first.thing or first.substance) or first.animal:
        return phrases
    if first.palette:
        return phrases
    pair = len(rest) > 1 and all(_hue_alone(p) for p in rest[:2]) and rest[1].join.kind in ("and", "on")
    if pair and rest[1].join.kind == "on":
        rest[0], rest[1] = rest[1], replace(rest[0], join=Join("and"))  # "houndstooth, black on ivory"
        rest[0] = replace(rest[0], join=Join("comma"), colors=rest[0].colors or [rest[0].substance], substance="")
    if pair and not first.colors and rest[0].join.kind in ("comma", "in"):
        one, other, rest = rest[0].colors, rest[1].colors, rest[2:]
    elif first.where in ("chequered", "checkered") and not (rest or first.colors or first.metal):
        one, other = ["black"], ["white"]
    elif first.where in CLOTHS and not (rest and rest[0].color_only):
        one, other = first.colors or [CLOTHS[first.where]], ["white"]
    elif first.colors and rest and rest[0].color_only and rest[0].join.kind == "and" and not rest[0].region:
        one, other, rest = first.colors, rest[0].colors, rest[1:]  # "chevron rug, mustard and grey"
    else:
        return phrases
    marks = Phrase(Join("with"), first.substance, first.boards, other, region=first.region, where=first.where)
    return [replace(first, colors=one, region=None, where="", placed=False), marks, *rest]


def _grounded(phrases: list[Phrase]) -> list[Phrase]:
    """Checks of cloth on a part are on white: "a jar with a red gingham lid"."""
    result: list[Phrase] = []
    for phrase in phrases:
        part = phrase.within
        if part and part.region and phrase.where in CLOTHS and phrase.join.kind != "and":
            ground = Phrase(phrase.join, phrase.substance, colors=["white"], region=part.region, where=part.where)
            result.append(ground)
            phrase = replace(phrase, join=Join("with"), within=ground, colors=phrase.colors or [CLOTHS[phrase.where]])
        result.append(phrase)
    return result


def _hue_or_metal(phrase: Phrase) -> bool:
    """Whether a phrase is a colour and nothing else, or a metal: "in black and gold"."""
    return _hue_alone(phrase) or (phrase.metal and not (phrase.colors or phrase.region or phrase.thing))


def _hue_alone(phrase: Phrase) -> bool:
    """Whether a phrase is a colour and nothing else: "ivory" is one, too."""
    named = phrase.substance in COLORS and not (phrase.colors or phrase.unknown or phrase.thing)
    return (phrase.color_only or named) and not phrase.region


def _plaid(phrase: Phrase) -> bool:
    return bool(phrase.substance) and KNOWN[phrase.substance][0].look == "tartan"


def coat_of(animal: str, thing: str = "") -> str:
    """The stuff that shows an animal's marks, or camouflage. Args: thing: what has them."""
    if animal in SHELLED:
        return "fur" if thing and lives(thing) else "glossy plastic"
    made = OBJECTS[thing].made.split(" ")[-1] if thing else ""
    hard = made in KNOWN and family(made) in ("metal", "plastic", "paint")
    return "fur" if animal not in PRINTED else "paint" if hard else "cotton"


def _marked(phrases: list[Phrase]) -> list[Phrase]:
    """An animal's marks in colours that words name, on a ground of its own stuff: "zebra stripes, pink and purple"."""
    first, *rest = phrases
    after = rest[0] if rest else Phrase()
    bare = after.join.kind == "on" and after.substance and not (after.colors or after.region)
    if first.animal and not first.substance and bare:
        return [replace(first, substance=after.substance, region=None, where=""), *rest[1:]]  # "zebra striped, in cowhide"
    if first.color_only and after.animal and after.join.kind == "and":
        if after.where in OBJECTS and not after.thing:
            after.thing, after.region, after.where = after.where, None, ""  # "a green and brown camo helmet"
        first.thing, after.thing = first.thing or after.thing, ""
        first.substance = coat_of(after.animal, first.thing)  # "pink and purple leopard print"
    elif first.animal and any(map(is_hue, first.colors)) and after.join.kind == "and" and _hue_or_metal(after):
        coat = first.substance or coat_of(first.animal, first.thing)
        ground = replace(first, animal="", substance=coat, region=None, where="")
        marks = replace(first, join=Join("with"), colors=after.colors or [after.substance])
        return [ground, marks, *rest[1:]]  # "zebra print in pink and black"
    elif first.animal and after.color_only and after.join.kind == "with" and after.where in MARKS:
        colors = first.colors or [ANIMALS[first.animal][0]]  # "a brown cow with white patches"
        ground = replace(first, animal="", substance=first.substance or coat_of(first.animal, first.thing), colors=colors)
        return [ground, replace(after, animal=first.animal, region=None, where=""), *rest[1:]]
    if not first.animal or first.colors or first.substance or not rest or rest[0].region:
        return phrases
    coat = coat_of(first.animal)
    pair = len(rest) > 1 and _hue_or_metal(rest[1]) and rest[1].join.kind == "and" and not rest[1].region
    if rest[0].join.kind == "on" and rest[0].color_only and not pair:
        rest[0].substance = coat  # "leopard spots on tan"
    elif len(rest) > 1 and rest[0].color_only and rest[0].join.kind in ("comma", "on", "with") and not rest[1].region:
        one, other = rest[:2]
        if other.join.kind not in ("and", "on") or not (_hue_or_metal(other) or other.join.kind == "on"):
            return phrases
        ground, marks = (one, other) if other.join.kind == "and" else (other, one)
        ground = replace(ground, join=FIRST, substance=ground.substance or coat)
        return [ground, replace(first, join=Join("with"), colors=marks.colors or [marks.substance]), *rest[2:]]
    return phrases


def _on_ground(phrases: list[Phrase]) -> list[Phrase]:
    """Two colours of a pattern on a stuff are that stuff: "yellow and black stripes on painted metal"."""
    if len(phrases) < 3:
        return phrases
    one, other, ground, *rest = phrases
    both = one.color_only and not one.region and (other.color_only or other.metal) and other.where in SHAPES
    if not both or other.join.kind != "and" or ground.join.kind != "on" or not ground.substance or ground.region:
        return phrases
    if any(map(is_hue, ground.colors)) and other.region:  # "on white wood"
        one = replace(one, join=Join("with"), region=other.region._replace(share=min(0.8, 1.3 * other.region.share)))
        other = replace(other, region=other.region._replace(share=0.6 * other.region.share))
        return [replace(ground, join=FIRST), replace(one, where=other.where), other, *rest]
    name = "paint" if ground.metal else ground.substance
    laid = [replace(p, substance=p.substance or name, boards=ground.boards, thing=ground.thing) for p in (one, other)]
    return [*laid, *rest]


MARKS = frozenset(SHAPES) - {part for part, _ in MADE}
"""Shapes that are marks and nothing else: straps are bands, too, but of leather."""

TWO_TONE = ("stripes", "bands", "checks", "zigzag", "gingham")
"""Kinds of patterns that two colours share between them."""


def _shared_between(whole: Phrase, marks: Phrase) -> bool:
    """Whether two colours of a pattern are all that one sees of a thing of which no colour is said."""
    two_tone = marks.region is not None and marks.region.kind in TWO_TONE
    return two_tone and not (whole.colors or whole.region or whole.animal)


def _both_of(first: Phrase, second: Phrase) -> bool:
    """Whether a thing of two colours is of the stuff that is named after the second: "a chair in black and red leather"."""
    dyed = first.thing and not (first.substance or first.region or first.animal) and any(map(is_hue, first.colors))
    hue, _, stuff = second.substance.partition(" ")  # "white marble"
    hued = any(map(is_hue, second.colors)) or (hue in COLORS and stuff in KNOWN)
    other = second.substance and hued and not (second.region or second.thing or second.part)
    return bool(dyed and other) and second.join.kind == "and" and family(second.substance) in SHARING


SHARING = ("leather", "fabric", "plastic", "stone", "ceramic")
"""Families of stuffs of which a thing of two colours is, where they are named with the second only."""



def in_pairs(phrases: list[Phrase]) -> list[Phrase]:
    """Colours side by side share what follows: "red and white striped canvas", "white with red and blue stripes"."""
    phrases = _on_ground(phrases)
    for number in range(len(phrases) - 2, -1, -1):
        first, second = phrases[number], phrases[number + 1]
        placed = first.where in PARTS and first.coats and any(map(is_hue, first.colors))
        if number and placed and second.join.kind == "and" and second.color_only and not (second.region or second.part):
            part = Phrase(first.join, region=first.region, where=first.where)
            second.join, second.within, second.region = Join("with"), part, SHAPES["patches"]  # "painted yellow and black"
        if first.join.kind == second.join.kind == "half":
            first.region, first.where = Region("left", 0.5), "half"
        if number == 0 and _both_of(first, second):
            *_, last = second.substance.split(" ")
            first.substance = second.substance if second.colors else last
        if not first.color_only or first.region or first.part or second.join.kind not in ("and", "comma", "fade", "half"):
            continue
        second.finish = second.finish or list(first.finish)
        first.thing = first.thing or ("" if second.where in PARTS else second.thing)
        same = second.join.kind == "and" and family(second.substance or "stone") not in ("metal", "gem")
        said = second.substance and (second.colors or same)
        if said and second.where not in PARTS:
            first.substance, first.boards = second.substance, second.boards
        if number == 0 and second.join.kind == "and" and second.thing and not (second.region or second.animal):
            second.region = SHAPES["patches"]  # "a blue and white enamel mug"
        ground = second.within
        if ground and ground.region and second.join.kind == "and":  # "with a red and white striped awning"
            first.region, first.where, second.join = ground.region, ground.where, Join("with")
            ground.substance = first.substance
        elif number == 1 and second.join.kind == "and" and _shared_between(phrases[0], second):
            first.region, first.where = Region("all", 1.0), ""  # "a tent with red and white stripes"
        elif number and second.where in PARTS and second.join.kind == "and" and second.region and not second.within:
            first.region, first.where = second.region, second.where  # "with a green and gold tail"
            part = Phrase(second.join, region=second.region, where=second.where)
            second.join, second.within, second.region, second.where = Join("with"), part, SHAPES["patches"], ""
        elif number and second.region and second.where in SHAPES:
            share = second.region.share
            first.region, first.where = second.region._replace(share=min(0.8, 1.3 * share)), second.where
            second.region = second.region._replace(share=0.6 * share)  # the second lies within the first
    return phrases
