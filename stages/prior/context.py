"""What phrases of a prompt lend each other: a part its stuff, a coat what it peels off, a thing its finish."""

from dataclasses import replace
from itertools import pairwise

from stages.prior.colors import COLORS, LEANINGS
from stages.prior.implied import WEARS, implied
from stages.prior.lexicon import PAINTED, Join
from stages.prior.motifs import grounded, in_pairs
from stages.prior.objects import OBJECTS
from stages.prior.palettes import spread
from stages.prior.phrases import FIRST, Phrase, family, is_hue, lives
from stages.prior.places import BAND, FADED, PARTS, PEELS, SHAPES, SHOWS, Region, gathering, parts_of
from stages.prior.senses import FOODS
from stages.prior.stuffs import GENERIC, KNOWN


def understood(phrases: list[Phrase]) -> list[Phrase]:
    """What phrases lend each other."""
    if not phrases:
        return []
    implied(phrases)
    for phrase in phrases:
        if phrase.join.kind == "half" and phrase.weather and not (phrase.says_what or phrase.region):
            phrase.region, phrase.where = Region("right", 0.5), "half"  # "pots, one side mossy"
    for roof, walls in pairwise(phrases[1:]):
        if roof.join.beneath and roof.thing in PARTS and walls.where in PARTS and not roof.region:
            roof.region, roof.where, roof.thing = PARTS[roof.thing], roof.thing, ""  # "snow on a slate roof, stone walls"
    if phrases[0].substance in CLEAR and not phrases[0].colors and phrases[1:] and phrases[1].join.kind in ("over", "on"):
        phrases[1].finish += phrases[0].finish or ["glossy"]  # "varnish over oak"
        phrases = [replace(phrases[1], join=FIRST), *phrases[2:]]
    phrases = grounded(_peeled(phrases))
    result: list[Phrase] = []
    for number, phrase in enumerate(phrases):
        before = result[-1] if result else None
        after = phrases[number + 1] if number + 1 < len(phrases) else None
        if not before and phrase.where in ALONE and after and after.join.kind == "comma" and after.color_only:
            phrase.region, phrase.where = None, ""  # "quartz countertop, white"
        lies = after is not None and after.join.beneath
        painted = phrase.substance in PAINTED or (number == 1 and not lies and _is_paint(phrase, before))
        if painted and phrase.join.kind == "comma" and not phrase.region:
            phrase.join = Join("paint")
        if after and not before and after.join.kind == "comma" and not (phrase.says_what or phrase.region):
            after.join = phrase.join  # "matte, dark red paint"
            after.finish += phrase.finish
            after.colors[:0] = phrase.colors
            _add(after.weather, phrase.weather)
        elif before and (
            _takes_paint(before, phrase, result)
            or _takes_wear(before, phrase, result)
            or _says_again(before, phrase, result, number, after)
        ):
            continue
        elif after and _heads(phrase, after):
            after.region, after.where, after.join = phrase.region, phrase.where, Join("with")  # "trim: copper"
        elif before and not phrase.says_what and not (phrase.weather or phrase.finish or phrase.join.kind == "except"):
            _lend(before, phrase, after, result)
        else:
            if before and not phrase.within and _within(before, phrase):
                phrase.within = before
            result.append(phrase)
    return spread(in_pairs(_laid(_countershaded(result))))


def _countershaded(phrases: list[Phrase]) -> list[Phrase]:
    """A beast of which its upper side and its belly are told is like its upper side: "a dragon, black above, red belly"."""
    whole, *rest = phrases
    above = next((p for p in rest if p.where == "above" and p.says_what), None)
    beneath = any(p.region and p.region.kind == "down" for p in rest)
    if not (whole.thing and lives(whole.thing) and above and beneath) or whole.says_stuff or whole.region:
        return phrases
    like = replace(whole, substance=above.substance, colors=above.colors, finish=whole.finish + above.finish)
    return [like, *(p for p in rest if p is not above)]


def _is_paint(phrase: Phrase, before: Phrase | None) -> bool:
    """Whether a phrase is all the paint of a thing of whose stuff was told: "a steel girder, red oxide primer"."""
    bare = before is not None and bool(before.substance) and not (gathering(before.substance) or before.coats or before.region)
    paint = phrase.coats and family(phrase.substance) == "paint" and not (phrase.thing or phrase.part or phrase.weather)
    return bare and paint and phrase.much == 1


def _takes_paint(before: Phrase, phrase: Phrase, result: list[Phrase]) -> bool:
    """Whether a phrase names what others are of, or a paint or glaze on them, which they then have."""
    if _only_names(phrase, result):
        body = next((p for p in reversed(result) if p.join.beneath), result[0])
        body.thing = body.thing or phrase.thing
        _add(body.weather, phrase.weather)
    elif phrase.join.kind == "show":
        _show(result, phrase)
    elif phrase.join.kind == "through" and phrase.says_what and (not phrase.region or _there(phrase)):
        if phrase.region:  # "rust showing through white paint at the edges"
            before.region, before.where, phrase.region, phrase.where = phrase.region, phrase.where, None, ""
        result[-1] = _covering(before, phrase)
    elif phrase.join.kind == "paint" and not (phrase.says_what or phrase.region):  # "with a satin finish"
        result[0].finish += phrase.finish
        _add(result[0].weather, phrase.weather)
    elif phrase.join.kind == "paint" and before.placed and phrase.substance in PAINTED and phrase.colors and not phrase.region:
        before.shows = Phrase(substance=before.substance, boards=before.boards) if before.substance else before.shows
        before.substance, before.colors = phrase.substance, phrase.colors  # "a bench, cast iron ends painted green"
        _add(before.weather, phrase.weather)
    elif phrase.join.kind == "paint" and before.region and _finishes(phrase, result[0]):
        result[0].substance, result[0].colors = phrase.substance or result[0].substance, phrase.colors
        result[0].finish += phrase.finish  # "with ivory grips and a nickel finish"
    elif phrase.join.kind == "paint" and not (before.region or phrase.region) and before.says_what:
        phrase.join, phrase.thing = before.join, phrase.thing or before.thing
        _add(phrase.weather, before.weather)
        if before.substance:
            phrase.shows = Phrase(substance=before.substance, boards=before.boards, colors=before.colors)
        result[-1] = phrase
    elif _ground_of(phrase, before):
        before.colors += phrase.colors  # "terrazzo, white base"
    elif phrase.substance in CLEAR and _glazes(phrase, before):
        before.finish += phrase.finish or ["glossy"]
        before.colors += phrase.colors if "varnish" not in phrase.substance else []
        _add(before.weather, phrase.weather)
    else:
        return False
    return True


def _takes_wear(before: Phrase, phrase: Phrase, result: list[Phrase]) -> bool:
    """Whether a phrase says how others are worn or finished, and they then are."""
    if not (phrase.says_what or phrase.region or phrase.part):  # "bronze, polished"
        laid = bool(before.region) and (phrase.join.kind == "comma" or bool(gathering(before.substance)))
        whole = result[0] if laid else before  # "a boot with a red sole, worn"
        if any(word in SHOWS for word in phrase.weather):
            whole = next((p for p in result if p.coats), whole)  # "green paint over wood, peeling"
        whole.finish += phrase.finish
        whole.colors += [word for word in phrase.colors if word in LEANINGS]
        _add(whole.weather, phrase.weather)
    elif _paint_of_whole(phrase, result[0]):
        _repaint(result[0], phrase)
    elif len(result) > 1 and _wears_all(phrase, result):
        for painted in result:
            if painted.coats or painted.color_only:
                _add(painted.weather, phrase.weather)
    elif _cracks(phrase) and any(p.color_only for p in result):
        _add(next(p for p in result if p.color_only).weather, phrase.weather)  # "a duck, green head, cracked paint"
    elif _fades(phrase):
        _add(result[0].weather, phrase.weather)  # "a gnome, faded paint"
    elif _wears(before, phrase):
        if phrase.coats and phrase.region and phrase.where in PARTS and phrase.region.kind not in ("edges", "crevices", "all"):
            whole = before if before.coats or before.color_only else result[0]
            result.append(replace(phrase, substance="", colors=[], finish=[], shows=whole.shows))
            return True  # "a stool painted blue, paint flaking off the seat"
        if phrase.coats and not before.coats:  # "a white fence with flaking paint"
            bare = not before.substance and bool(_made(before)) and family(_made(before)) == "paint"
            before.shows = phrase.shows or (None if bare else Phrase(substance=before.substance, thing=before.thing))
            if before.metal:  # "a red metal toolbox, the paint chipped"
                before.substance = "painted metal"
        laid = bool(before.region or gathering(before.substance))  # "with moss around the base and water stains"
        worn = result[0] if phrase.join.kind in ("comma", "and") and laid and not phrase.coats else before
        _add(worn.weather, phrase.weather or [WEARS[phrase.where]])  # "..., steel joints, some scratches"
    else:
        return False
    return True


def _says_again(before: Phrase, phrase: Phrase, result: list[Phrase], number: int, after: Phrase | None) -> bool:
    """Whether a phrase says more of what was named before, which then has it. Args: number: of the phrase; after: the next."""
    if _rusty_cloth(before, phrase):
        before.colors.append("rust colored")
    elif phrase.join.kind == "comma" and _describes(before, phrase, after):
        _describe(before, phrase)
    elif number == 1 and before and _restates(before, phrase, after):
        before.substance, before.colors = phrase.substance, phrase.colors or before.colors
        before.finish += phrase.finish
        _add(before.weather, phrase.weather)
    elif result and _again(result[0], phrase):
        result[0].finish += phrase.finish
        _add(result[0].weather, phrase.weather)
    else:
        return False
    return True


def _finishes(phrase: Phrase, whole: Phrase) -> bool:
    """Whether a finish that is named last is that of a thing of which no stuff is said."""
    return bool(whole.thing) and not (whole.substance or whole.colors or phrase.region) and phrase.says_what


def _again(whole: Phrase, phrase: Phrase) -> bool:
    """Whether a phrase after a comma only says again what the whole is of: "a red fox with a white chest, fluffy fur"."""
    made = _made(whole)
    plain = bool(phrase.substance) and not (phrase.colors or phrase.region or phrase.thing or phrase.part)
    return plain and phrase.join.kind == "comma" and bool(made) and KNOWN[phrase.substance][0].look == KNOWN[made][0].look


def _restates(whole: Phrase, phrase: Phrase, after: Phrase | None) -> bool:
    """Whether a phrase after a comma says more exactly what the whole is of: "a leather helmet, cracked tan leather"; "a plush
    rabbit, grey fur"."""
    plain = bool(phrase.substance and whole.substance) and not (phrase.region or phrase.thing or phrase.part or whole.region)
    if not plain or phrase.join.kind != "comma" or gathering(phrase.substance) or phrase.coats or whole.coats:
        return False
    if after and after.join.kind == "and" and after.substance and not after.region:
        return False  # "a chessboard, maple and walnut"
    one, other = KNOWN[whole.substance][0], KNOWN[phrase.substance][0]
    generic = whole.substance in (*GENERIC, *SOFT) and (one.family == other.family or {one.family, other.family} <= PELTS)
    return one.look == other.look or generic


SOFT, PELTS = ("plush", "tweed", "knit", "knitted", "knitwear", "glass", "fur"), {"fabric", "organic"}
"""Stuffs of which another name says more, and families of what is soft."""


def _made(whole: Phrase) -> str:
    """The stuff of a phrase, or what its thing is usually made of; "" where none is known."""
    words = OBJECTS[whole.thing].made.split(" ") if whole.thing else []
    return whole.substance or next((word for word in words if word in KNOWN and word not in COLORS), "")


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
    return bool(alone) and phrase.join.kind == "comma" and bool(before[0].substance) and not phrase.region


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


def _within(before: Phrase, phrase: Phrase) -> bool:
    """Whether a phrase lies on the part of which the one before tells: "a bone handle wrapped in leather", "a red cap with
    white dots"."""
    nests = phrase.join.kind in ("cover", "partly", "spots", "inlay", "stripe", "check", "stud", "band")
    nests = nests and (phrase.region is None or phrase.where in SHAPES)
    marks = phrase.join.kind == "with" and phrase.where in SHAPES
    marks |= phrase.join.kind in ("comma", "and") and phrase.where in STUDS  # "an ebony handle, brass rivets"
    return before.where in PARTS and before.join.kind != "" and phrase.says_what and (nests or marks)


STUDS = ("rivets", "studs", "nails", "screws", "bolts")
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
    dyes = not before.colors and all(word in COLORS or family(word) == "gem" for word in glaze.colors if is_hue(word))
    return whole and (not glaze.colors or dyes)


def _fades(phrase: Phrase) -> bool:
    """Whether a phrase only says of paint, of which no colour is said, that it is faded or old."""
    plain = phrase.coats and not (phrase.colors or phrase.region or phrase.shows)
    return plain and phrase.join.kind == "comma" and bool(phrase.weather) and set(phrase.weather) <= FADED.keys()


def _cracks(phrase: Phrase) -> bool:
    """Whether a phrase only says of paint, of which no colour is said, that it is broken."""
    plain = phrase.coats and family(phrase.substance) == "paint" and not (phrase.colors or phrase.region or phrase.shows)
    return plain and phrase.join.kind in ("comma", "and") and any(word in BROKEN for word in phrase.weather)


def _wears(before: Phrase, phrase: Phrase) -> bool:
    """Whether a phrase says how the one before is worn: "with scratches"; "painted wood, the paint worn at the edges"."""
    if phrase.where in WEARS and not phrase.says_what:
        return True
    again = phrase.coats and not phrase.colors and not before.region and (before.coats or bool(before.colors))
    return again and any(word in BROKEN for word in phrase.weather)


def _paint_of_whole(phrase: Phrase, whole: Phrase) -> bool:
    """Whether worn paint of which no colour is said is what gives metal its colour: "a black steel crowbar, chipped paint"."""
    plain = phrase.coats and not (phrase.colors or phrase.region) and any(word in SHOWS for word in phrase.weather)
    made = _made(whole)
    return plain and bool(made) and family(made) == "metal" and bool(_hues_of(whole))


def _hues_of(whole: Phrase) -> list[str]:
    """Colours that a phrase names, be it in the name of its stuff or in what its thing is made of."""
    told = [*whole.substance.split(" "), *(OBJECTS[whole.thing].made.split(" ") if whole.thing else [])]
    named = [word for word in whole.colors if is_hue(word)]
    return named or [word for word in told if word in COLORS and word not in KNOWN][:1]


def _repaint(whole: Phrase, paint: Phrase) -> None:
    """Metal as painted metal, of the same colour, which shows where the paint is worn."""
    whole.colors, whole.shows = _hues_of(whole), paint.shows or Phrase(substance="steel")
    whole.substance = "painted metal"
    whole.finish += paint.finish
    _add(whole.weather, paint.weather)


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
    if after and after.join.kind in ("on", "over") and after.substance and phrase.coats and set(phrase.weather) & PEELS:
        return False  # "a chair, peeling white paint on grey wood"
    paired = after and after.region and after.join.kind == "and" and after.where not in PARTS
    if phrase.region or phrase.thing or phrase.part or paired or phrase.substance in parts_of(before.thing):
        return False
    bare = before.thing and not (before.substance or before.colors or before.unknown)
    dull = bool(before.substance) and not before.metal
    if before.metal and before.join is FIRST and before.thing and phrase.color_only and not (before.colors or before.region):
        return phrase.join.kind == "comma"  # "a steel desk, grey"
    hue = phrase.color_only or (dull and phrase.substance in COLORS and not (phrase.colors or phrase.unknown or phrase.finish))
    whole = not before.region or before.region.kind == "all"
    unsaid = hue and bool(before.substance or before.unknown) and not before.colors and whole
    gathers = bool(gathering(phrase.substance))
    return bool(bare and phrase.says_what and not gathers) or unsaid


def _rusty_cloth(before: Phrase, phrase: Phrase) -> bool:
    """Whether rust is the colour of what does not rust: "a sofa in velvet, rust"."""
    alone = phrase.substance == "rust" and not (phrase.colors or phrase.region or phrase.weather or phrase.thing or phrase.part)
    cloth = bool(before.substance) and family(before.substance) in ("fabric", "leather", "ceramic")
    return alone and phrase.join.kind == "comma" and cloth and not before.colors


def _describe(before: Phrase, phrase: Phrase) -> None:
    if before.substance and phrase.substance in COLORS:
        before.colors.append(phrase.substance)  # "candle wax, ivory"
    before.substance = before.substance or phrase.substance
    before.boards |= phrase.boards
    before.colors += phrase.colors
    before.finish += phrase.finish
    before.unknown += phrase.unknown
    before.palette = before.palette or phrase.palette
    _add(before.weather, phrase.weather)


def _lend(before: Phrase, phrase: Phrase, after: Phrase | None, result: list[Phrase]) -> None:
    """A part without a stuff takes that of its neighbour: "gold rim and handle", "rim and handle of gold"."""
    if phrase.join.kind == "and" and before.region and before.says_what:
        ring = before.where.startswith(("at ", "near ", "around ")) and before.region.share <= BAND
        region = phrase.region._replace(share=before.region.share) if ring and phrase.region else phrase.region
        result.append(replace(before, region=region, where=phrase.where, join=phrase.join))
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
