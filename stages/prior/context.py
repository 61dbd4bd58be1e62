"""What phrases of a prompt lend each other: a part its stuff, a coat what it peels off, a pattern its ground."""

from dataclasses import replace
from itertools import pairwise

from stages.prior.colors import CHANGES, COLORS, LEANINGS
from stages.prior.objects import OBJECTS
from stages.prior.phrases import FIRST, Phrase, family, is_hue
from stages.prior.places import ANIMALS, PARTS, PEELS, PRINTED, SHAPES, SHELLED, SHOWS, Region, gathering
from stages.prior.stuffs import KNOWN, ROOFS
from stages.prior.tokens import FOODS, PAINTED, Join, singulars


def understood(phrases: list[Phrase]) -> list[Phrase]:
    """What phrases lend each other."""
    for number, phrase in enumerate(phrases):
        if phrase.where.endswith("roof"):
            phrase.substance = ROOFS.get(phrase.substance, phrase.substance)
        thing = next((name for name in (phrase.where, *singulars(phrase.where)) if name in OBJECTS), "")
        if not phrase.says_what and thing and len(phrases) == 1:
            phrases[number] = replace(phrase, thing=thing, region=None, where="")  # "a tire"
    if not phrases:
        return []
    for one, other in pairwise(phrases):
        listed = other.join.kind == "and" and one.join.kind in LISTED and one.substance and other.substance
        if listed and not (one.region or other.region):
            other.join = one.join  # "crusted with salt and green corrosion"
            one.much, other.much = 0.6 * one.much, 0.6 * other.much
    if len(phrases) > 1 and phrases[0].thing and not phrases[0].says_stuff and phrases[1].join.kind == "with":
        skin = phrases[1]
        if skin.substance.split(" ")[-1] in SKINS and not skin.region:  # "an orc with green skin"
            skin.region, skin.where = PARTS["body"], "body"
    _shade(phrases)
    _scorch(phrases)
    for phrase in phrases:
        if phrase.where.split(" ")[-1] in USUAL and not phrase.says_what:
            phrase.substance, *phrase.colors = USUAL[phrase.where.split(" ")[-1]]
    phrases = _grounded(_marked(_checked(_peeled(_painted(phrases)))))
    result: list[Phrase] = []
    for number, phrase in enumerate(phrases):
        before = result[-1] if result else None
        after = phrases[number + 1] if number + 1 < len(phrases) else None
        if not before and phrase.where in ALONE and after and after.join.kind == "comma" and after.color_only:
            phrase.region, phrase.where = None, ""  # "quartz countertop, white"
        if phrase.substance in PAINTED and phrase.join.kind == "comma" and not phrase.region:
            phrase.join = Join("paint")
        if after and not before and after.join.kind == "comma" and not (phrase.says_what or phrase.region):
            after.join = phrase.join  # "matte, dark red paint"
            after.finish += phrase.finish
            after.colors[:0] = phrase.colors
            _add(after.weather, phrase.weather)
        elif before and _only_names(phrase, result):
            body = next((p for p in reversed(result) if p.join.beneath), result[0])
            body.thing = body.thing or phrase.thing
            _add(body.weather, phrase.weather)
        elif before and phrase.join.kind == "show":
            _show(result, phrase)
        elif before and phrase.join.kind == "through" and phrase.says_what and (not phrase.region or _there(phrase)):
            if phrase.region:  # "rust showing through white paint at the edges"
                before.region, before.where, phrase.region, phrase.where = phrase.region, phrase.where, None, ""
            result[-1] = _covering(before, phrase)
        elif before and phrase.join.kind == "paint" and not (phrase.says_what or phrase.region):  # "with a satin finish"
            result[0].finish += phrase.finish
            _add(result[0].weather, phrase.weather)
        elif before and phrase.join.kind == "paint" and before.region and _finishes(phrase, result[0]):
            result[0].substance, result[0].colors = phrase.substance or result[0].substance, phrase.colors
            result[0].finish += phrase.finish  # "with ivory grips and a nickel finish"
        elif before and phrase.join.kind == "paint" and not (before.region or phrase.region) and before.says_what:
            phrase.join, phrase.thing = before.join, phrase.thing or before.thing
            _add(phrase.weather, before.weather)
            if before.substance:
                phrase.shows = Phrase(substance=before.substance, boards=before.boards, colors=before.colors)
            result[-1] = phrase
        elif before and _ground_of(phrase, before):
            before.colors += phrase.colors  # "terrazzo, white base"
        elif before and phrase.substance in CLEAR and _glazes(phrase, before):
            before.finish += phrase.finish or ["glossy"]
            before.colors += phrase.colors
            _add(before.weather, phrase.weather)
        elif before and not phrase.says_what and not phrase.region:  # "bronze, polished"
            whole = result[0] if before.region and phrase.join.kind == "comma" else before  # "a boot with a red sole, worn"
            if any(word in SHOWS for word in phrase.weather):
                whole = next((p for p in result if p.coats), whole)  # "green paint over wood, peeling"
            whole.finish += phrase.finish
            whole.colors += [word for word in phrase.colors if word in LEANINGS]
            _add(whole.weather, phrase.weather)
        elif len(result) > 1 and _wears_all(phrase, result):
            for painted in result:
                if painted.coats or painted.color_only:
                    _add(painted.weather, phrase.weather)
        elif before and _wears(before, phrase):
            if phrase.coats and not before.coats:  # "a white fence with flaking paint"
                before.shows = phrase.shows or Phrase(substance=before.substance, thing=before.thing)
                if before.metal:  # "a red metal toolbox, the paint chipped"
                    before.substance = "painted metal"
            worn = result[0] if phrase.join.kind == "comma" and before.region and not phrase.coats else before
            _add(worn.weather, phrase.weather or [WEARS[phrase.where]])  # "..., steel joints, some scratches"
        elif before and phrase.join.kind == "comma" and _describes(before, phrase, after):
            _describe(before, phrase)
        elif len(result) > 1 and _again(result[0], phrase):
            result[0].finish += phrase.finish
            _add(result[0].weather, phrase.weather)
        elif after and _heads(phrase, after):
            after.region, after.where, after.join = phrase.region, phrase.where, Join("with")  # "trim: copper"
        elif before and not phrase.says_what and not (phrase.weather or phrase.finish):
            _lend(before, phrase, after, result)
        else:
            if before and not phrase.within and _within(before, phrase):
                phrase.within = before
            result.append(phrase)
    return _in_pairs(_laid(result))


USUAL = {**dict.fromkeys(("tyres", "tires", "tyre", "tire"), ("rubber", "black")), **dict.fromkeys(("stand", "tripod"),
("black iron",))}
"""Parts that are of the same stuff on all things, where none is said: its name and colours."""

SKINS = frozenset(["skin", "hide", "scales", "feathers", "fur"])
"""What is all that one sees of a beast that has it."""


def _shade(phrases: list[Phrase]) -> None:
    """A pattern that is only darker or lighter is so than what it lies on: "a grey cat with darker stripes"."""
    for phrase in phrases[1:]:
        changed = not phrase.says_what and any(word in CHANGES for word in phrase.colors)
        if changed and phrase.where in SHAPES.keys() - WEARS.keys():
            first = phrases[0]
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


def _finishes(phrase: Phrase, whole: Phrase) -> bool:
    """Whether a finish that is named last is that of a thing of which no stuff is said."""
    return bool(whole.thing) and not (whole.substance or whole.colors or phrase.region) and phrase.says_what


def _again(whole: Phrase, phrase: Phrase) -> bool:
    """Whether a phrase after a comma only says again what the whole is of: "a red fox with a white chest, fluffy fur"."""
    made = _made(whole)
    plain = bool(phrase.substance) and not (phrase.colors or phrase.region or phrase.thing or phrase.part)
    return plain and phrase.join.kind == "comma" and bool(made) and KNOWN[phrase.substance][0].look == KNOWN[made][0].look


def _made(whole: Phrase) -> str:
    """The stuff of a phrase, or what its thing is usually made of; "" where none is known."""
    words = OBJECTS[whole.thing].made.split(" ") if whole.thing else []
    return whole.substance or next((word for word in words if word in KNOWN and word not in COLORS), "")


LISTED = ("cover", "partly", "spots", "inlay", "stud", "streak", "edge")
"""Joins that hold for all that "and" goes on with."""


def _laid(phrases: list[Phrase]) -> list[Phrase]:
    """A stuff on a thing of which nothing else is said is what it is made of: "dragon scales on a kite shield"."""
    if len(phrases) < 2:
        return phrases
    first, on, *rest = phrases
    bare = on.thing and not (on.substance or on.colors or on.unknown or on.animal or on.region)
    gathers = bool(gathering(first.substance))
    whole = first.substance and not (first.thing or first.region or first.animal or gathers or first.coats)
    if not (bare and whole and on.join.kind == "on") or KNOWN[first.substance][0].look in FOODS:
        return phrases
    return [replace(first, thing=on.thing, size=on.size, weather=[*first.weather, *on.weather]), *rest]


def _only_names(phrase: Phrase, before: list[Phrase]) -> bool:
    """Whether a phrase after a comma only says what thing has the stuffs before it: "chrome flaking off brass, a faucet"."""
    alone = phrase.thing and not (phrase.substance or phrase.colors or phrase.unknown or phrase.animal)
    return bool(alone) and phrase.join.kind == "comma" and bool(before[0].substance)


def _painted(phrases: list[Phrase]) -> list[Phrase]:
    """Phrases, with the paints of each pattern of several; "graffiti on a train" names them before what they are on."""
    if len(phrases) > 1 and phrases[0].where in PAINTS and phrases[1].join.kind == "on":
        first, ground, *rest = phrases
        phrases = [replace(ground, join=FIRST), replace(first, join=Join("with")), *rest]
    return [each for phrase in phrases for each in _paintings(phrase, phrases)]


PAINTS = {
    "kintsugi": ("gold", [""]), "graffiti": ("spray paint", ["blue", "red", "yellow"]),
    "sprinkles": ("glossy plastic", ["red", "yellow", "blue"]),
    "rainbow": ("paint", ["red", "orange", "yellow", "green", "blue", "violet"]),
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
        return [replace(phrase, substance=stuff)]
    sizes = [1 + 0.4 * k for k in range(len(colors))]
    regions = [phrase.region._replace(share=phrase.region.share / n, size=phrase.region.size * n) for n in sizes]
    joins = [phrase.join, *([Join("with")] * (len(colors) - 1))]
    return [
        replace(phrase, join=join, substance=stuff, colors=[c for c in [color] if c], region=region)
        for join, color, region in zip(joins, colors, regions, strict=True)
    ]  # fmt: skip


CLOTHS = {"gingham": "red", "houndstooth": "black", "argyle": "green", "tattersall": "brown", "buffalo check": "red"}
"""Checks that are of cloth, and of which colour where nobody says."""


def _checked(phrases: list[Phrase]) -> list[Phrase]:
    """Checks of cloth are of two colours, named before or after them, white being the other: "gingham, blue and white"."""
    first, *rest = phrases
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
            phrase = replace(phrase, join=Join("with"), within=ground)
        result.append(phrase)
    return result


def _hue_alone(phrase: Phrase) -> bool:
    """Whether a phrase is a colour and nothing else: "ivory" is one, too."""
    named = phrase.substance in COLORS and not (phrase.colors or phrase.unknown or phrase.thing)
    return (phrase.color_only or named) and not phrase.region


def _plaid(phrase: Phrase) -> bool:
    return bool(phrase.substance) and KNOWN[phrase.substance][0].look == "tartan"


def _there(phrase: Phrase) -> bool:
    """Whether a phrase ends with where something of it is: "at the edges"."""
    edges = phrase.region is not None and phrase.region.kind == "edges"
    return edges and phrase.where.startswith(("at ", "on ", "along ", "around "))


UNDERNEATH = ("underneath", "beneath", "below", "under")
BROKEN = SHOWS | {"cracked", "cracking"}
"""Words of wear that let see what is underneath a coat."""


def _peeled(phrases: list[Phrase]) -> list[Phrase]:
    """What lies underneath a coat that peels is what it peels off; what gathers on top lies on what is underneath it."""
    for number, phrase in enumerate(phrases[1:], 1):
        if phrase.coats and _there(phrase) and any(word in SHOWS for word in phrase.weather):
            phrase.region, phrase.where = None, ""  # "a safe, green enamel worn away at the corners"
        if phrase.where not in UNDERNEATH or not phrase.says_what:
            continue
        before = phrases[:number]
        off = next((p for p in before if p.join.kind == "peel"), None)
        coat = next((p for p in before if set(p.weather) & (PEELS | BROKEN if p.coats else PEELS)), None)
        if off:  # "bark peeling off a log, pale wood underneath"
            off.substance, off.colors, off.thing = phrase.substance or off.substance, phrase.colors, ""
            return [*before, *phrases[number + 1 :]]
        if coat:  # "peeling paint, grey wood underneath"
            phrase.region, phrase.where, phrase.join = None, "", Join("show")
        elif number == 1 and gathering(phrases[0].substance) and phrases[0].region:  # "snow on top, granite underneath"
            first = replace(phrase, region=None, where="", join=FIRST)
            return [first, replace(phrases[0], join=Join("with")), *phrases[2:]]
    for number, (thing, coat, off) in enumerate(zip(phrases, phrases[1:], phrases[2:], strict=False)):
        if number == 0 and thing.thing and off.join.kind == "peel" and off.substance and coat.says_what and not coat.region:
            thing.substance, thing.colors = off.substance, off.colors or thing.colors
            coat.join = Join("peel")  # "a boat with its paint flaking off the bare timber"
            return [thing, coat, *phrases[3:]]
    return phrases


def _coat_of(animal: str) -> str:
    return "glossy plastic" if animal in SHELLED else "cotton" if animal in PRINTED else "fur"


def _marked(phrases: list[Phrase]) -> list[Phrase]:
    """An animal's marks in colours that words name, on a ground of its own stuff: "zebra stripes, pink and purple"."""
    first, *rest = phrases
    after = rest[0] if rest else Phrase()
    bare = after.join.kind == "on" and after.substance and not (after.colors or after.region)
    if first.animal and not first.substance and bare:
        return [replace(first, substance=after.substance, region=None, where=""), *rest[1:]]  # "zebra striped, in cowhide"
    if first.color_only and after.animal and after.join.kind == "and":
        first.substance = _coat_of(after.animal)  # "pink and purple leopard print"
    elif first.animal and any(map(is_hue, first.colors)) and after.color_only and after.join.kind == "and" and not after.region:
        ground = replace(first, animal="", substance=first.substance or _coat_of(first.animal), region=None, where="")
        return [ground, replace(first, join=Join("with"), colors=after.colors), *rest[1:]]  # "zebra print in pink and black"
    elif first.animal and after.color_only and after.join.kind == "with" and after.where in SHAPES:
        colors = first.colors or [ANIMALS[first.animal][0]]  # "a brown cow with white patches"
        ground = replace(first, animal="", substance=first.substance or _coat_of(first.animal), colors=colors)
        return [ground, replace(after, animal=first.animal, region=None, where=""), *rest[1:]]
    if not first.animal or first.colors or first.substance or not rest or rest[0].region:
        return phrases
    coat = _coat_of(first.animal)
    pair = len(rest) > 1 and rest[1].color_only and rest[1].join.kind == "and" and not rest[1].region
    if rest[0].join.kind == "on" and rest[0].color_only and not pair:
        rest[0].substance = coat  # "leopard spots on tan"
    elif len(rest) > 1 and rest[0].color_only and rest[0].join.kind in ("comma", "on", "with") and not rest[1].region:
        one, other = rest[:2]
        if other.join.kind not in ("and", "on") or not (other.color_only or other.join.kind == "on"):
            return phrases
        ground, marks = (one, other) if other.join.kind == "and" else (other, one)
        ground = replace(ground, join=FIRST, substance=ground.substance or coat)
        return [ground, replace(first, join=Join("with"), colors=marks.colors), *rest[2:]]
    return phrases


def _within(before: Phrase, phrase: Phrase) -> bool:
    """Whether a phrase lies on the part of which the one before tells: "a bone handle wrapped in leather", "a red cap with
    white dots"."""
    nests = phrase.join.kind in ("cover", "partly", "spots", "inlay", "stripe", "check", "stud")
    nests = nests and (phrase.region is None or phrase.where in SHAPES)
    marks = phrase.join.kind == "with" and phrase.where in SHAPES
    marks |= phrase.join.kind in ("comma", "and") and phrase.where in STUDS  # "an ebony handle, brass rivets"
    return before.where in PARTS and before.join.kind != "" and phrase.says_what and (nests or marks)


STUDS = ("rivets", "studs", "nails", "screws", "bolts", "buttons")
"""Patterns that hold a part together."""


def _covering(before: Phrase, phrase: Phrase) -> Phrase:
    """The coat through which what was named first is seen: "steel visible under chipped paint"."""
    phrase.join, phrase.thing, phrase.shows = before.join, phrase.thing or before.thing, before
    if not any(word in SHOWS for word in phrase.weather):
        phrase.weather.append("worn")
    return phrase


ALONE = ("countertop", "tabletop", "table top", "desktop", "shelf", "door", "window", "helmet", "hat", "cushion", "screen")
"""Parts that are things of their own, too."""

CLEAR = frozenset([
    "glaze", "varnish", "glazed", "clear coat", "clearcoat", "clear lacquer", "clear varnish", "top coat", "clear resin",
])  # fmt: skip
"""Coats that one sees through."""


def _ground_of(phrase: Phrase, before: Phrase) -> bool:
    """Whether a phrase names the colour of what the chips of a stuff lie in."""
    mixed = bool(before.substance) and KNOWN[before.substance][0].look == "terrazzo" and not before.colors
    return mixed and phrase.color_only and phrase.where in ("base", "ground", "background")


def _glazes(glaze: Phrase, before: Phrase) -> bool:
    """Whether a clear coat is that of the whole: one without colour, or of one colour on what has none."""
    whole = not glaze.region and (not before.region or before.join is FIRST)
    dyes = not before.colors and all(word in COLORS for word in glaze.colors if is_hue(word))
    return whole and (not glaze.colors or dyes)


WEARS = {
    **dict.fromkeys(("scratches", "scrapes", "scuffs"), "scratched"), "stains": "stained", "cracks": "cracked",
    **dict.fromkeys(("streaks", "drips", "water stains", "rain streaks", "water streaks", "water marks"), "streaky"),
    **dict.fromkeys(("smudges", "smears"), "dirty"),
}  # fmt: skip
"""Patterns that are wear where no stuff is named for them."""


def _wears(before: Phrase, phrase: Phrase) -> bool:
    """Whether a phrase says how the one before is worn: "with scratches"; "painted wood, the paint worn at the edges"."""
    if phrase.where in WEARS and not phrase.says_what:
        return True
    again = phrase.coats and not phrase.colors and not before.region and (before.coats or bool(before.colors))
    return again and any(word in SHOWS for word in phrase.weather)


def _wears_all(phrase: Phrase, before: list[Phrase]) -> bool:
    """Whether paint of which no colour is said is that of all painted parts: "lower half red, upper half white,
    paint chipped"."""
    plain = phrase.coats and not (phrase.colors or phrase.region) and any(word in SHOWS for word in phrase.weather)
    return plain and sum(p.coats or p.color_only for p in before) > 1


def _add(words: list[str], more: list[str]) -> None:
    words += [word for word in more if word not in words]


def _heads(phrase: Phrase, after: Phrase) -> bool:
    """Whether a part stands before a comma or colon and its stuff after: "trim: copper"."""
    joined = after.join.kind in ("comma", "cover", "paint", "partly")  # "whose grip is wrapped in red leather"
    return not phrase.says_what and bool(phrase.region) and joined and after.says_what and not after.region


def _describes(before: Phrase, phrase: Phrase, after: Phrase | None) -> bool:
    """Whether a phrase after a comma says more of the one before: "a jar, glossy blue"; "oak, brown"."""
    paired = after and after.region and after.join.kind == "and" and after.where not in PARTS
    if phrase.region or phrase.thing or (phrase.part and not phrase.substance) or paired:
        return False
    bare = before.thing and not (before.substance or before.colors or before.unknown)
    dull = bool(before.substance) and not before.metal
    hue = phrase.color_only or (dull and phrase.substance in COLORS and not (phrase.colors or phrase.unknown or phrase.finish))
    unsaid = hue and bool(before.substance or before.unknown) and not before.colors and not before.region
    gathers = bool(gathering(phrase.substance))
    return bool(bare and phrase.says_what and not gathers) or unsaid


def _describe(before: Phrase, phrase: Phrase) -> None:
    if before.substance and phrase.substance in COLORS:
        before.colors.append(phrase.substance)  # "candle wax, ivory"
    before.substance = before.substance or phrase.substance
    before.boards |= phrase.boards
    before.colors += phrase.colors
    before.finish += phrase.finish
    before.unknown += phrase.unknown
    _add(before.weather, phrase.weather)


def _lend(before: Phrase, phrase: Phrase, after: Phrase | None, result: list[Phrase]) -> None:
    """A part without a stuff takes that of its neighbour: "gold rim and handle", "rim and handle of gold"."""
    if phrase.join.kind == "and" and before.region and before.says_what:
        result.append(replace(before, region=phrase.region, where=phrase.where, join=phrase.join))
    elif after and after.join.kind == "and" and after.region and after.says_what:
        result.append(replace(after, region=phrase.region, where=phrase.where, join=phrase.join))


def _show(result: list[Phrase], phrase: Phrase) -> None:
    """"worn red paint revealing steel": what is worn shows it; "worn edges showing brass" lends its place."""
    place = result[-1]
    if len(result) > 1 and place.region and not place.says_what:
        result.pop()
        result[-1].weather = [word for word in result[-1].weather if word not in SHOWS] + ["worn"]
        phrase.region, phrase.where = place.region._replace(wear=1.0), place.where
    if not any(word in SHOWS for word in result[-1].weather):
        result[-1].weather.append("worn")
    result[-1].shows = phrase


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


TWO_TONE = ("stripes", "bands", "checks", "zigzag", "gingham")
"""Kinds of patterns that two colours share between them."""


def _shared_between(whole: Phrase, marks: Phrase) -> bool:
    """Whether two colours of a pattern are all that one sees of a thing of which no colour is said."""
    two_tone = marks.region is not None and marks.region.kind in TWO_TONE
    return two_tone and not (whole.colors or whole.region or whole.animal)


def _in_pairs(phrases: list[Phrase]) -> list[Phrase]:
    """Colours side by side share what follows: "red and white striped canvas", "white with red and blue stripes"."""
    phrases = _on_ground(phrases)
    for number in range(len(phrases) - 2, -1, -1):
        first, second = phrases[number], phrases[number + 1]
        if first.join.kind == second.join.kind == "half":
            first.region, first.where = Region("left", 0.5), "half"
        if not first.color_only or first.region or second.join.kind not in ("and", "comma", "fade", "half"):
            continue
        second.finish = second.finish or list(first.finish)
        first.thing = first.thing or ("" if second.where in PARTS else second.thing)
        same = second.join.kind == "and" and family(second.substance or "stone") not in ("metal", "gem")
        said = second.substance and (second.colors or same)
        if said and second.where not in PARTS:
            first.substance, first.boards = second.substance, second.boards
        ground = second.within
        if ground and ground.region and second.join.kind == "and":  # "with a red and white striped awning"
            first.region, first.where, second.join = ground.region, ground.where, Join("with")
            ground.substance = first.substance
        elif number == 1 and second.join.kind == "and" and _shared_between(phrases[0], second):
            first.region, first.where = Region("all", 1.0), ""  # "a tent with red and white stripes"
        elif number and second.region and second.where in SHAPES:
            share = second.region.share
            first.region, first.where = second.region._replace(share=min(0.8, 1.3 * share)), second.where
            second.region = second.region._replace(share=0.6 * share)  # the second lies within the first
    return phrases


