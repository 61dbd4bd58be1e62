"""Which phrase of a prompt is the base, and what lies over it."""

from dataclasses import replace
from itertools import pairwise

from stages.prior.colors import COLORS
from stages.prior.grammar import split
from stages.prior.lexicon import Join
from stages.prior.objects import OBJECTS
from stages.prior.phrases import Phrase, family
from stages.prior.places import CLOTHES, DETAILS, JOINED, PARTS, PEELS, PERSONS, SHAPES, Region, gathering, parts_of
from stages.prior.stuffs import GENERIC, KNOWN, PATTERNED

Order = tuple[Phrase, list[Phrase]]
"""The base, and what lies over it, from below."""


def ordered(phrases: list[Phrase]) -> Order:
    """The base, and what lies over it from below: "spots on tan", "paint peeling off wood" name the upper one first."""
    for after in phrases[1:]:
        if after.join.kind == "below" and (after.coats or gathering(after.substance)):
            after.join = Join("over")  # "iron under peeling paint"
    beneath = next((k for k, p in enumerate(phrases) if k and p.join.beneath and p.join.kind == "cover"), 0)
    if beneath > 1 and all(p.join.kind == "and" for p in phrases[1:beneath]):
        for phrase in phrases[1:beneath]:
            phrase.join = phrases[beneath].join  # "a moss and fern covered log"
    base = 0
    while base + 1 < len(phrases) and phrases[base + 1].join.beneath and not _stands(phrases[base], phrases[base + 1]):
        base += 1
    upper = [replace(phrase, join=Join(after.join.kind)) for phrase, after in pairwise(phrases[: base + 1])]
    first, over = phrases[base], [*reversed(upper), *_between(phrases[base + 1 :])]
    if upper and upper[0].thing and not (first.thing or first.part) and upper[0].says_stuff:
        first, over[base - 1] = replace(first, thing=upper[0].thing), replace(upper[0], thing="")  # "a vase, glaze over clay"
    for step in STEPS:
        first, over = step(first, over)
    return first, over


def _between(phrases: list[Phrase]) -> list[Phrase]:
    """What is left where pieces are only named to say that something lies between them: "moss between the stones"."""
    kept: list[Phrase] = []
    for phrase in phrases:
        if phrase.join == Join("crevices", True) and kept:
            kept[-1] = replace(kept[-1], region=kept[-1].region or PARTS["crevices"])
        else:
            kept.append(phrase)
    return kept


def _stands(first: Phrase, second: Phrase) -> bool:
    """Whether a thing stands on its own part, "a dragon on a wooden base", rather than a stuff on what is beneath."""
    if second.join.kind in ("peel", "through"):
        return False  # "paint peeling off a door"
    part = second.where in PARTS and bool(second.region) and second.region != PARTS["walls"]
    solid = bool(second.thing) and _family_made(second) in ("wood", "metal", "stone") and bool(_family_made(first))
    laid = second.boards or second.substance in PATTERNED  # "a bell on an oak board"
    rests = (bool(first.substance) and not second.thing) or solid or bool(second.part) or laid
    thing = bool(first.thing) and second.join.kind == "on" and rests
    return (part or thing) and not first.region and not gathering(first.substance)


def _family_made(phrase: Phrase) -> str:
    """The family of a thing's stuff, as it is said or usual."""
    stuff = phrase.substance or (split(OBJECTS[phrase.thing].made)[0].substance if phrase.thing else "")
    return family(stuff) if stuff else ""


LARGE = 0.5
"""Share of a part that may be the base of what else is named."""


def _largest(first: Phrase, over: list[Phrase]) -> Order:
    """Where each phrase is a part, the largest is the base: "gold rim, white porcelain body"."""
    if first.where in PARTS and over and all(p.where in PARTS and p.says_what for p in over):
        parts = [first, *over]
        largest = max(parts, key=lambda p: p.region.share if p.region else 0.0)
        if (first.where, largest.where) == ("base", "top"):
            return first, over  # "oak base and gold top"
        if largest is not first and first.region and first.region.share < LARGE:
            return largest, [p for p in parts if p is not largest]
    return first, over


FRAMES, SEATS = ("frame", "framework"), ("seat", "cushion", "cushions", "upholstery", "backrest")
"""Parts of furniture: what the rest of it is made like, and what lies on that."""


def _framed(first: Phrase, over: list[Phrase]) -> Order:
    """A frame is the base of what sits in it: "a chair: oak frame, velvet seat". Where there is none, a seat or table top is
    that of its legs, and of what is all upholstered; legs are that of a chair."""
    if first.thing and not (first.substance or first.region) and all(p.where in PARTS and p.says_what for p in over):
        frame = next((p for p in over if p.where in FRAMES), None)
        if frame and any(p.where in SEATS for p in over):
            whole = replace(frame, thing=first.thing, region=None, where="", join=first.join)
            return whole, [p for p in over if p is not frame]
        seat, legs = (next((p for p in over if p.where in places), None) for places in (("seat", "top"), ("legs",)))
        upper = _upholstered(first) or not first.thing.endswith("chair")
        if seat and not first.colors and (_upholstered(first) or legs):
            main = seat if upper or not legs else legs  # the seat is all of a stool that its legs are not
            whole = replace(main, thing=first.thing, region=None, where="", join=first.join)
            return whole, [p for p in over if p is not main]
    return first, over


def _clothed(first: Phrase, over: list[Phrase]) -> Order:
    """Skin shows of a person beside clothes: "a pirate with a red coat"."""
    if first.thing in PERSONS and not first.says_stuff and any(p.where in CLOTHES for p in over):
        return replace(first, substance="skin"), over
    return first, over


def _panelled(first: Phrase, over: list[Phrase]) -> Order:
    """Panels are all of a thing of which nothing else is said: "a crate with white painted panels"."""
    bare = bool(first.thing) and not (first.substance or first.colors or first.unknown or first.animal)
    panels = next((p for p in over if p.where in ("panel", "panels", "plates", "plating") and p.says_what), None)
    if not (bare and panels):
        return first, over
    weather = [*first.weather, *panels.weather]
    whole = replace(panels, thing=first.thing, region=None, where="", join=first.join, weather=weather)
    return whole, [p for p in over if p is not panels]


ROOFING = frozenset(["thatch", "thatched", "roof tiles", "shingles", "slate tiles", "roof slates"])
"""What lies on roofs when nobody says where."""


def _is_gem(phrase: Phrase) -> bool:
    return bool(phrase.substance) and family(phrase.substance) == "gem"


def _is_all(phrase: Phrase) -> bool:
    return phrase.region is not None and phrase.region.kind == "all"


def _flanked(first: Phrase, over: list[Phrase]) -> Order:
    """Sides are those of what else is said what it is of: "a toaster, mint enamel, chrome sides"."""
    if first.says_stuff and not first.region:
        sides = ("sides", "on the sides")
        over = [replace(p, region=Region("sides", 0.3)) if p.where in sides else p for p in over]
    return first, over


def _of_body(first: Phrase, over: list[Phrase]) -> Order:
    """The body, where one is spoken of, is the base, and what was named first lies on top of it."""
    whole = [_is_all(p) and p.says_what and not (gathering(p.substance) or p.thing or p.part or _is_gem(p)) for p in over]
    at = whole.index(True) if True in whole else None
    if at is None:
        return first, over
    body, others = over[at], [*over[:at], *over[at + 1 :]]
    if body.color_only and set(body.weather) & PEELS:
        body = replace(body, substance="paint")  # "an iron bench with peeling turquoise slats"
    if body.coats and first.substance and not (first.region or first.coats or first.substance in ROOFING):
        return replace(body, thing=first.thing, shows=replace(first), weather=[*first.weather, *body.weather]), others
    if body.color_only and (first.substance or first.unknown) and not (first.colors or first.region):
        return replace(first, colors=body.colors), others  # "a lacquer bowl, red inside, black outside"
    alone = bool(first.thing) and not (first.substance or first.colors or first.unknown)
    if alone or (first.substance in GENERIC and body.substance and family(first.substance) == family(body.substance)):
        return replace(body, thing=body.thing or first.thing, weather=[*first.weather, *body.weather]), others
    if not (first.region or gathering(first.substance) or first.substance in ROOFING):
        first = replace(first, region=Region("badge", 0.5) if first.thing else Region("above", 0.4))
    return body, [first, *others]


def _told_after(first: Phrase, over: list[Phrase]) -> Order:
    """A thing whose stuff is said after it, if at all."""
    told = any(word in KNOWN or word in COLORS for word in first.thing.split())  # "bronze statue"
    if not first.thing or told or first.substance or first.unknown or first.animal:
        return first, over
    worn = next((p for p in over if p.animal and not (p.colors or p.region or p.substance)), None)
    if worn:  # "an egg with a leopard print"
        return replace(first, animal=worn.animal), [p for p in over if p is not worn]
    return _on_ground(first, over) or _of_what(first, over)


def _on_ground(thing: Phrase, over: list[Phrase]) -> Order | None:
    """The stuff on which all that was named before lies, if any does: "a mailbox, icicles and frost on blue paint"."""
    laid_on = ("on", "over", "cover", "partly")  # "a chest, barnacle-crusted oak"
    beneath = [p.join.kind in laid_on and p.join.beneath and bool(p.substance or p.unknown) for p in over]
    at = beneath.index(True) if any(beneath) else 0
    laid = all(gathering(p.substance) or p.coats or p.part or p.where in SHAPES for p in over[:at])
    if not at or over[at].region or not laid:
        return None
    said = replace(over[at], thing=thing.thing, join=Join(""), weather=[*thing.weather, *over[at].weather])
    paints = [replace(p, join=Join("over")) for p in over[:at] if p.coats]
    return said, [*paints, *[p for p in over[:at] if not p.coats], *over[at + 1 :]]


def _of_what(thing: Phrase, over: list[Phrase]) -> Order:
    """A thing with the stuff that is said after it: "armchair upholstered in velvet", "a gnome in the snow, terracotta"."""
    for k, phrase in enumerate(over):
        named = phrase.join.kind == "comma" and bool(phrase.substance) and not phrase.part
        if k and not (gathering(over[k - 1].substance) or over[k - 1].weather):
            break
        painted = not (k or thing.weather or RUSTY & set(thing.thing.split(" "))) and _paints(phrase)
        bound = phrase.join.kind == "band" and bool(phrase.substance) and family(phrase.substance) in ("leather", "fabric")
        painted |= bound and _upholstered(thing)  # "a book bound in leather"
        whole = (_covers(phrase) or painted or _of_usual(phrase, thing)) if named or not k else False
        part = phrase.part and (k or not phrase.substance or phrase.join.kind == "comma")
        elsewhere = phrase.region or part or not phrase.says_what
        if elsewhere or not (whole or (not k and _upholsters(phrase, thing))) or (thing.colors and not named):
            continue
        dyed = phrase.colors or phrase.coats or any(word in COLORS for word in phrase.substance.split())
        colors = phrase.colors if dyed else thing.colors  # "a red jar, porcelain"
        weather = [*thing.weather, *phrase.weather]
        said = replace(phrase, thing=thing.thing, join=Join(""), colors=colors, weather=weather)
        return said, [*over[:k], *over[k + 1 :]]
    return thing, over


def _covers(phrase: Phrase) -> bool:
    """Whether what covers a thing is all that one sees of it: leather does, moss does not."""
    gathers = bool(gathering(phrase.substance))
    return phrase.join.kind in ("all", "cover", "comma") and not (gathers or set(phrase.weather) & PEELS)


def _flaked(first: Phrase, over: list[Phrase]) -> Order:
    """A thing whose paint peels is what paint is on: "a car door with peeling turquoise paint"."""
    usual = split(OBJECTS[first.thing].made)[0] if first.thing and not first.says_stuff else Phrase()
    peels = any(p.coats and set(p.weather) & PEELS and not p.region and p.join.kind == "with" and not p.shows for p in over)
    if peels and usual.substance and family(usual.substance) == "paint":
        return replace(first, substance="wood" if "wood" in usual.substance else "steel"), over
    return first, over


RUSTY = {"rusty", "rusted"}


def _paints(phrase: Phrase) -> bool:
    """Whether a thing is painted all over: "a dresser with white paint"."""
    paint = phrase.coats and family(phrase.substance) == "paint" and bool(phrase.colors)
    return paint and phrase.join.kind == "with" and not (phrase.weather or phrase.region)


SKINS = ("fabric", "leather", "stone", "ceramic", "plastic")
"""Families of stuffs that are all of a thing if they are any of it: "a stroller with charcoal fabric"."""


def _of_usual(phrase: Phrase, thing: Phrase) -> bool:
    """Whether what a thing is said to have is what it is all made of: "a ship with dark oak planks"."""
    usual = split(OBJECTS[thing.thing].made)[0]
    if phrase.join.kind == "with" and phrase.substance in GENERIC and phrase.weather and not (phrase.thing or phrase.part):
        return family(phrase.substance) in ("wood", "stone", "metal")  # "a house with rotten wood"
    if phrase.join.kind != "with" or not (usual.substance and phrase.substance) or gathering(phrase.substance):
        return False
    kin = "wood" in (usual.substance, usual.substance.split(" ")[-1]) and phrase.boards  # "a barn with red boards"
    kin |= family(phrase.substance) == family(usual.substance)
    same = phrase.boards or KNOWN[phrase.substance][0].look == KNOWN[usual.substance][0].look
    whole = kin and (same or family(usual.substance) in SKINS)
    return whole and not (set(phrase.weather) & PEELS or phrase.thing or phrase.part)


def _upholsters(phrase: Phrase, thing: Phrase) -> bool:
    """Whether what a thing is upholstered in is all that one sees of it: of an armchair, not of a chair."""
    return phrase.join.kind == "seat" and _upholstered(thing)


def _upholstered(thing: Phrase) -> bool:
    """Whether cloth or leather is all that one sees of a thing."""
    usual = split(OBJECTS[thing.thing].made)[0]
    return bool(usual.substance) and family(usual.substance) in ("fabric", "leather")


def _either_side(first: Phrase, over: list[Phrase]) -> Order:
    """Two that lie above and below each other share the whole: "gold above, oak below"."""
    if over and over[0].join.kind in ("above", "below") and first.region and not over[0].region:
        over[0] = replace(over[0], region=Region("below" if first.region.kind == "above" else "above", 0.5))
    pair = over[:2] if len(over) > 1 and first.thing and not first.says_stuff else []
    if [p.where for p in pair] == ["above", "below"] and gathering(pair[1].substance) and pair[0].says_stuff:
        weather = [*first.weather, *pair[0].weather]
        whole = replace(pair[0], thing=first.thing, region=None, where="", join=first.join, weather=weather)
        return whole, over[1:]  # "a jeep, white paint above, mud below"
    beside = first
    for number, phrase in enumerate(over):
        if beside.join.kind == "dip" and not beside.region and region_of(phrase) in ("above", "below"):
            beside = replace(beside, region=Region("below" if region_of(phrase) == "above" else "above", 0.5))
            over[number - 1] = beside  # "dipped in white, terracotta below"
        region, other = phrase.region, beside.region
        if region and other and phrase.where in ("above", "below") and {region.kind, other.kind} == {"above", "below"}:
            over[number] = replace(phrase, region=region._replace(share=1 - other.share))
        beside = phrase
    return first, over


SEATED = ("chair", "stool", "bench", "throne", "pew", "armchair")
"""Things of which cloth and leather are where one sits."""


def _is_cloth(phrase: Phrase) -> bool:
    """Whether it is cloth or leather that lies beside other parts."""
    cloth = bool(phrase.substance) and family(phrase.substance) in ("fabric", "leather")
    return cloth and phrase.join.kind in ("with", "and", "comma") and not (phrase.thing or phrase.part or phrase.within)


def region_of(phrase: Phrase) -> str:
    """The kind of place where a phrase lies, if that is said."""
    return phrase.region.kind if phrase.region else ""


def _fading(first: Phrase, over: list[Phrase]) -> Order:
    """What a thing is at one end is what it is, where it fades into something else: "blue at the bottom fading to white"."""
    ends = len(over) > 1 and over[1].join.kind == "fade" and region_of(over[0]) in ("below", "above")
    if first.thing and not first.says_stuff and ends and over[0].says_stuff and not over[0].thing:
        return replace(over[0], thing=first.thing, region=None, where="", join=first.join), over[1:]
    return first, over


def _bared(first: Phrase, over: list[Phrase]) -> Order:
    """What a coat lets see where it peels is the base: "a wooden door, peeling paint showing grey oak"."""
    for phrase in over:
        shown = phrase.shows
        if not (shown and shown.substance and set(phrase.weather) & PEELS) or phrase.region:
            continue
        usual = split(OBJECTS[first.thing].made)[0] if first.thing else Phrase()
        own = first.substance or usual.substance
        metal = bool(own) and family(own) in ("metal", "paint")
        solid = family(shown.substance) in ("metal", "wood", "stone", "plastic", *(["rust"] if metal else []))
        unsaid = not first.substance and solid and bool(first.thing)  # "a crate, white paint chipped to aluminium"
        if own and not first.colors and (unsaid or family(shown.substance) == family(own)):
            first = replace(first, substance=shown.substance, colors=shown.colors)
    return first, over


def in_its_places(first: Phrase, over: list[Phrase], thing: str = "") -> Order:
    """Parts of a thing that has them elsewhere than others. Args: thing: where the first does not name it."""
    name = thing or first.thing or first.substance
    places = parts_of(name)
    for phrase in over:
        for part in (phrase, phrase.within):
            if part and (part.where or part.part or not part.region) and part.join.kind != "inlay":
                names = [part.where or part.part] if part.where or part.part else [part.thing, part.substance]
                names += [part.join.kind] if part.join.kind not in ("cover", "top", "stripe") else []
                found = (places.get(word) for name in names if name for word in (name, name.split(" ")[-1]))
                part.region = next(filter(None, found), part.region)
            kind = part.join.kind if part else ""
            if part and not part.region and kind in PARTS and JOINED.get(kind) == PARTS[kind]:
                part.region, part.where = PARTS[kind], kind  # "an ivory handled dagger"
        pair = phrase is over[0] and phrase.join.kind == "and"  # "in black and red leather"
        if not (phrase.region or pair) and name.split(" ")[-1] in SEATED and _is_cloth(phrase):
            phrase.region, phrase.where = PARTS["upholstery"], "upholstery"  # "a chair with gold legs and pink velvet"
    for one, other in pairwise(over):
        again = one.region == other.region is not None and one.substance == other.substance and one.where == other.where
        if again and other.join.kind == "and" and one.colors and other.colors and not other.within:
            other.within = Phrase(one.join, region=one.region, where=one.where)  # "red and blue glass" in one window
            other.region, other.where = SHAPES["patches"], ""
    return first, over


def _of_thing(phrase: Phrase) -> bool:
    """Whether it is a part of the thing that it lies on."""
    return any(phrase.where.endswith(f" {name}") or phrase.where == name for name in PARTS) and not phrase.within


def _smaller_last(first: Phrase, over: list[Phrase]) -> Order:
    """Of parts on the same side the smaller lies on the larger, whichever is named first: a pommel on its grip."""
    for kind in ("below", "above", "front", "back", "up"):
        at = [k for k, p in enumerate(over) if p.region and p.region.kind == kind and _of_thing(p)]
        by_size = sorted((over[k] for k in at), key=lambda p: -p.region.share if p.region else 0.0)
        for k, phrase in zip(at, by_size, strict=True):
            over[k] = phrase
    return first, over


def _dirt_last(first: Phrase, over: list[Phrase]) -> Order:
    """What gathers lies on paint, whichever is named first: "mud on the hull and chipped paint"."""
    paints = [p for p in over if p.coats and not (p.region or gathering(p.substance))]
    dirt = [p for p in over if gathering(p.substance)]
    if not (paints and dirt) or over.index(paints[-1]) < over.index(dirt[0]):
        return first, over
    return first, [p for p in over if p not in dirt] + dirt


def _is_detail(phrase: Phrase) -> bool:
    """Whether it is a part that no table knows."""
    beside = phrase.join.kind in ("with", "and", "comma") and bool(phrase.part or phrase.thing)
    return beside and not (gathering(phrase.substance) or (phrase.substance and family(phrase.substance) == "gem"))


ON_EDGES = ("edges", "details")

NARROWER = 0.4
"""Share of the edges of which one says something that the next gets."""


def _edges_apart(first: Phrase, over: list[Phrase]) -> Order:
    """Of two that lie on edges the second has the sharpest ones only: "orange corners and worn metal edges"; small pieces
    are the first's."""
    at = [k for k, p in enumerate(over) if p.says_what and (p.region.kind in ON_EDGES if p.region else _is_detail(p))]
    for number, k in enumerate(at[1:], 1):
        region = over[k].region or DETAILS
        over[k] = replace(over[k], region=region._replace(kind="edges", share=region.share * NARROWER**number))
    return first, over


STEPS = (
    in_its_places, _largest, _framed, _panelled, _clothed, _flaked, _flanked, _of_body, _told_after, _fading, _either_side,
    _bared, _smaller_last, _dirt_last, _edges_apart,
)  # fmt: skip
"""What orders phrases, one after the other."""
