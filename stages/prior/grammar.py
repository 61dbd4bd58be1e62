"""A prompt cut into phrases.

The grammar is that of a buyer's list, not of English: a phrase is a run of words about one substance. Words between phrases
join them ("with", "covered in", "peeling off"); parts ("sole", "rim") and patterns ("stripes") say where a phrase lies. What
no table knows, a dictionary may explain by colours; the rest is kept as unknown. """

from collections.abc import Callable, Container, Mapping, Sequence
from itertools import takewhile

from stages.prior.colors import COLORS
from stages.prior.context import understood
from stages.prior.implied import CHECKS, PLAIN_PATTERNS
from stages.prior.lexicon import PAINTED, Join, Token
from stages.prior.motifs import CLOTHS, PAINTS
from stages.prior.objects import OBJECTS
from stages.prior.palettes import gathered
from stages.prior.phrases import FIRST, Phrase, family, is_hue, lives
from stages.prior.places import BAND, CLOTHES, DETAILS, PARTS, SHAPES, Region, gathering
from stages.prior.stuffs import BOARDS, GENERIC, KNOWN, PATTERNED
from stages.prior.tokens import tokens_of


def split(
    prompt: str,
    explained: Mapping[str, Sequence[str]] | None = None,
    matters: Callable[[str], bool] = bool,
    real: Container[str] = (),
) -> list[Phrase]:
    """The phrases of a prompt, in its order; at least one.

    Args:
        explained: a dictionary, as `Vocabulary` has. matters: whether a word that no table knows may mean a material. real:
        words that are no slips of the pen.
    """
    phrases = [Phrase()]
    much, within, article = 1.0, False, ""
    tokens = [
        token if token.kind != "unknown" or matters(token.text) else token._replace(kind="name")
        for token in gathered(tokens_of(prompt, explained or {}, real))
    ]
    for number, token in enumerate(tokens):
        now, following = phrases[-1], tokens[number + 1] if number + 1 < len(tokens) else Token("end", "")
        if token.kind == "degree":
            much = token.value
            continue
        article = token.article if now.empty else article
        if token.text == "in" and _dresses(tokens[number + 1 :]):
            token = token._replace(value=Join("with"))  # "a bear in a blue jacket"
        told = tokens[number + 2].kind if following.text == "," and number + 2 < len(tokens) else ""
        itself = number == 0 and token.kind == "part" and token.text in OBJECTS and told in ("color", "substance", "finish")
        alone = itself or (len(phrases) == 1 and _stands_for_itself(token, now, following, article))
        halved = now.join.kind == "half" and token.kind == "part" and token.text in OBJECTS and now.says_what
        if alone or halved or (article == "a" and _is_painted(token, phrases)):
            token = Token("thing", token.text)
        pair = now.join.kind == "and" and any(map(is_hue, phrases[-2].colors)) and not phrases[-2].region
        if pair and article != "a" and token.text in ("stripe", "racing stripe"):
            token = token._replace(value=SHAPES["stripes"])  # "in blue and white ticking stripe"
        if token.kind == "weather":
            now.amount[token.text] = much
        elif token.kind in ("substance", "postfix") and much != 1:
            now.much = much
        much = much if token.kind in ("join", "color", "finish") else 1.0
        join = _join_of(token, now, following)
        if join is None:
            if token.text == "of":
                now.closed = True
            if token.kind == "join" and token.value.kind == "peel" and "peeling" not in now.weather:
                now.weather.append("peeling")
            starts = token.text == "in" and token.value.kind == "in"
            within = starts or (within and token.kind not in ("join", "postfix", "comma", "half"))
            if token.kind in ("join", "postfix", "comma", "half"):
                continue
            if token.kind == "part" and len(phrases) == 1 and (parted := _told_of_part(tokens[:number])):
                phrases = [Phrase(amount=now.amount), Phrase(Join("with"), amount=now.amount)]  # "a bowl gold inside"
                for which, run in zip(phrases, parted, strict=True):
                    for each in run:
                        _take(which, each, early=True)
                now = phrases[-1]
            if token.kind == "thing" and len(phrases) == 1 and now.placed and now.where in PARTS and not now.thing:
                now.join = Join("with")  # "a marble top table"
                phrases = [Phrase(thing=token.text, size=now.size), now]
                continue
            begins = _begins(token, now) and not (within and _lacks(token, now))
            if begins or _paints_part(token, now, tokens[number + 1 :]):
                now = Phrase(Join("paint" if token.text in PAINTED else "with"))
                phrases.append(now)
            _take(now, token, early=len(phrases) < 3)
        elif now.empty:
            now.join = join if len(phrases) > 1 else now.join
        else:
            free = now.region is None or now.where in SHAPES
            if join.kind in ("above", "below") and free and following.kind in ("comma", "end", "join"):
                now.region, now.where = Region(join.kind, 0.5), token.text  # "gold above, oak below"
                continue
            phrases.append(Phrase(join))
    said = [p for p in phrases if not p.empty]
    if said and _unnamed(tokens, said):
        said.insert(0, Phrase())  # "a gizmo with a brass handle"
        said[1].join = said[1].join if said[1].join != FIRST else Join("with")
    return understood(said) or [Phrase()]


def _unnamed(tokens: Sequence[Token], said: Sequence[Phrase]) -> bool:
    """Whether a thing that no table knows stands first, and then only parts of it."""
    head = list(takewhile(lambda token: token.kind not in ("join", "comma", "half", "postfix"), tokens))
    alone = bool(head) and all(token.kind == "name" for token in head)
    return alone and all(p.where in PARTS and p.says_what and p.region != PARTS["body"] and not p.thing for p in said)


def _join_of(token: Token, now: Phrase, following: Token) -> Join | None:
    """How the next phrase joins, or None where the token joins nothing."""
    if token.kind == "comma":
        return None if now.empty else Join("comma")
    if token.kind == "postfix":
        both = now.join.kind == "and" or bool(now.palette)
        if (now.color_only or now.substance) and both and token.text in SHAPES:
            now.region, now.where = SHAPES[token.text], token.text  # "red and white striped canvas"
            return None
        plain = bool(now.thing) and not now.says_stuff and following.kind == "color"
        if (not now.says_what or plain) and token.text in SHAPES:
            if now.region and now.where in PARTS:  # "lower half speckled"
                now.within, now.placed = Phrase(now.join, region=now.region, where=now.where), True
            now.region, now.where = SHAPES[token.text], token.text  # "striped canvas", "a blanket striped red and white"
            return None
        if following.kind == "part":  # "leather-wrapped grip"
            return None
        last = now.join.kind in ("comma", "and") and following.kind in ("comma", "end", "join")
        if last and now.says_what and not now.region:
            now.join = Join(token.value)  # "a copper pot, tin lined"
            return None
        return Join(token.value, True) if now.says_what and not now.animal else None
    if token.kind == "half":
        return Join("half")
    if token.kind != "join":
        return None
    laid_bare = next((word for stem, word in PEELING.items() if token.text.startswith(stem)), "")
    if token.value.kind == "show" and laid_bare and now.coats and laid_bare not in now.weather:
        now.weather.append(laid_bare)  # "white paint chipped to bare steel"
    if token.value.kind == "show" and following.kind in ("comma", "end") and now.says_what:
        now.join = token.value  # "peeling paint, gray wood showing"
        return None
    if token.value.kind == "peel" and following.kind == "part" and now.coats:
        return None  # "gilding worn off at the edges"
    if token.value.kind in ("peel", "through") and following.kind in ("comma", "end", "join"):
        return None  # "blue paint peeling off, ..."
    if token.value.kind in ("show", "through") and following.kind == "part" and now.says_what:
        return None  # "dark steel showing at the edges"
    if token.value.kind == "crevices" and not (gathering(now.substance) or now.substance in FILLS or now.coats):
        return Join("ends") if now.says_what else None  # "a pipe between two valves"
    if token.value.kind == "of":
        return Join("of", True) if now.region and now.says_what else None
    if token.value.kind == "in":
        return Join("on", True) if now.says_stuff and now.where in SHAPES else None
    if token.value.kind == "to":
        return Join("fade") if now.says_what or now.weather else None
    if token.value.kind in ("on", "over") and following.kind == "part" and now.says_what:
        return None  # "moss on the roof"
    return token.value  # type: ignore[no-any-return]



FILLS = ("gold", "silver", "resin", "epoxy", "mortar", "grout", "cement", "clay", "tar", "lead", "grass", "weeds",
         "plants", "water")
"""What else lies between pieces."""

PEELING = {"chipped": "chipped", "peel": "peeling", "flaking": "flaking"}
"""What words that bare what is beneath begin with, and what they say of the coat."""


def _stands_for_itself(token: Token, now: Phrase, following: Token, article: str) -> bool:
    """Whether what may be a part is the thing itself: "a helmet in olive drab", "a green door with a brass handle"."""
    bare = not now.says_what or (article == "a" and not (now.thing or (now.substance and following.kind != "comma")))
    ends = ("and",) if article == "a" else (",", ":", "", "and")  # "a helmet, brushed steel", but "hat, coat and boots"
    return token.kind == "part" and token.text in OBJECTS and bare and following.text not in ends


def _is_painted(token: Token, phrases: list[Phrase]) -> bool:
    """Whether what may be a part is what a coat named before is on: "peeling paint on an old wooden door"."""
    coat, now = phrases[0], phrases[-1]
    laid = coat.coats or bool(coat.weather) or bool(gathering(coat.substance))
    lies = len(phrases) > 1 and now.join.kind in ("on", "over", "peel") and laid
    own = token.kind == "part" and token.text in OBJECTS and not now.region
    return lies and own and not any(phrase.thing for phrase in phrases)


def _begins(token: Token, now: Phrase) -> bool:
    """Whether a token begins a phrase although no word joins it to the one before: "gold rim white porcelain"."""
    text = token.text
    if token.kind == "substance":
        if now.where in SHAPES and not now.substance:
            return False  # "black and white checkerboard tiles", "red gingham cotton"
        if _is_of(now, text) and not now.placed:
            return False  # "a knitted bear in grey wool"
        again = bool(now.substance) and text in (*GENERIC, *BOARDS) and family(text) == family(now.substance)
        if again and not now.placed:
            return False  # "a golem of cooled lava rock"
        return now.placed or bool(now.substance and (now.headed or (token.text in PAINTED and not now.coats)))
    if token.kind == "color" and now.where == "quartered" and not now.says_stuff:
        return False  # "a shield quartered red and yellow"
    return now.placed and (token.kind == "color" or (token.kind == "part" and now.where in PARTS and text in PARTS))


def _told_of_part(run: Sequence[Token]) -> tuple[Sequence[Token], Sequence[Token]] | None:
    """A thing and what is said after it, if anything is, which is that of the part that follows: "a barrel rotten at the
    bottom"."""
    at = max((k for k, token in enumerate(run) if token.kind == "thing"), default=len(run))
    after = [token.kind for token in run[at + 1 :] if token.kind not in ("size", "name", "unknown")]
    whole = not {"join", "comma", "half", "postfix"} & {token.kind for token in run}
    plain = whole and set(after) <= {"color", "substance", "finish", "weather"}
    named = "substance" in after and any(token.kind == "substance" for token in run[:at])
    return (run[: at + 1], run[at + 1 :]) if set(after) - {"finish"} and plain and not named else None


def _paints_part(token: Token, now: Phrase, after: Sequence[Token]) -> bool:
    """Whether what is painted is a part of a thing only: "a brick wall painted white on the lower half"."""
    run = list(takewhile(lambda t: t.kind not in ("join", "comma", "half", "postfix"), after))
    there = bool(run) and run[-1].kind == "part" and " " in run[-1].text
    return token.text in PAINTED and bool(now.thing) and not now.says_stuff and there


def _dresses(after: Sequence[Token]) -> bool:
    """Whether what follows is worn, or holds it, and has a colour or stuff of its own."""
    run = list(takewhile(lambda token: token.kind not in ("join", "comma", "half", "postfix"), after))
    return any(token.kind == "part" and token.text in (*CLOTHES, *HOLDERS) for token in run) and (
        len(run) > 1 or (len(after) > 1 and after[1].text == "of")
    )


HOLDERS = ("frame", "frames", "casing", "case", "housing", "stand", "mount", "enclosure", "scabbard", "sheath",
           "bezel", "setting", "filigree", "cage", "surround")
"""Parts in which another is: "a mirror in a brass frame"."""


def _is_of(now: Phrase, yarn: str) -> bool:
    """Whether a name says of what yarn a knit is, of which only that was said."""
    return bool(now.substance) and KNOWN[now.substance][0].look.endswith("knit") and family(yarn) == "fabric"


def _lacks(token: Token, now: Phrase) -> bool:
    """Whether a token says of a phrase what it does not say yet: "grips in charcoal", "handles in oak"."""
    if token.kind == "substance":
        return not now.substance or (now.substance in LAYERED and family(token.text) == "wood")
    return not any(map(is_hue, now.colors))


LAYERED = ("plywood", "veneer", "wood", "timber")
"""Stuffs that are of another that may be named after them: "a plywood seat in walnut"."""


def _take(phrase: Phrase, token: Token, early: bool) -> None:
    """Put a token where it belongs in a phrase. Args: early: one of the first two, which may be the thing itself."""
    kind, text = token.kind, token.text
    if kind == "substance":
        phrase.part = ""  # "white hex mosaic"
        _name(phrase, text)
    elif kind in ("color", "finish", "weather", "unknown", "size"):
        said = phrase.of_kind(kind)
        if text not in said:
            said.append(text)
        phrase.palette = token.value if kind == "color" and token.value else phrase.palette
    elif kind == "part" and phrase.thing and phrase.join is FIRST:
        if text in OBJECTS and (lives(phrase.thing) or text in DOORS):
            phrase.thing = text  # "a hobbit door", "a garage door"; but "a bicycle frame" is all frame
    elif kind == "part" and text in PARTS and phrase.where in SHAPES and phrase.says_what:
        if early and phrase.join.kind in ("", "and"):
            return  # "a checkerboard marble plinth", "blue and white gingham cushion"
        phrase.within, phrase.placed = Phrase(phrase.join, region=token.value, where=text), True  # "with a red gingham lid"
    elif kind == "part" and text.startswith("around") and phrase.where in ("trim", "edging", "border", "outline"):
        return  # "gold trim around the visor"
    elif kind == "part" and text.startswith(RINGED) and phrase.where in RINGS:
        region = token.value._replace(share=min(token.value.share, 2 * BAND if token.value.kind == "middle" else BAND))
        phrase.region, phrase.where, phrase.placed = region, text, phrase.says_what  # "a gold ring around the top"
    elif kind == "part" and phrase.where in SHAPES and _laid_on(phrase):
        phrase.within, phrase.placed = Phrase(phrase.join, region=token.value, where=text), True  # "studs around the rim"
    elif kind == "part" and phrase.join is FIRST and phrase.where in SHAPES and not phrase.says_what and text in OBJECTS:
        phrase.thing = text  # "striped cushion"
    elif kind == "part" and phrase.region and phrase.region.kind == "badge" and token.value.kind in ("middle", "front"):
        return  # "a brass boss in the middle"
    elif kind == "part" and text in SIDES and _is_small(phrase):  # "a brass valve on top"
        phrase.region, phrase.where, phrase.placed = Region(token.value.kind, SMALL), text, phrase.says_what
    elif kind == "part" and phrase.says_what and phrase.region and phrase.region.kind in WITHIN and text.startswith(PLACES):
        phrase.within, phrase.placed = Phrase(phrase.join, region=token.value, where=text), True  # "runes along the blade"
        phrase.region = WITHIN[phrase.region.kind] or phrase.region
    elif kind in ("part", "shape") and (phrase.region is None or kind == "part" or text in PAINTS):
        phrase.region, phrase.where, phrase.placed = token.value, text, phrase.says_what
    elif kind == "thing" and not phrase.closed:
        phrase.thing, phrase.headed = text, bool(phrase.substance)  # the last of a run says what it is: "school bus"
    elif kind == "name" and (phrase.substance or phrase.colors or phrase.animal or _worn_part(phrase)) and not phrase.region:
        phrase.part = text
    elif kind == "animal":
        phrase.animal = text


DOORS = ("door", "gate", "window")
"""Parts that are all of which is spoken where the name of what has them stands before."""


def _laid_on(phrase: Phrase) -> bool:
    """Whether a pattern is said to be there, with its colour or such that one knows it."""
    plain = phrase.join.kind == "with" and phrase.where in (*PLAIN_PATTERNS, *CHECKS, *CLOTHS)
    return phrase.says_what or plain or phrase.where.split(" ")[0] in PAINTS


SIDES = frozenset([f"{at} {side}" for at in ("on", "on the", "at the", "near the", "on its", "at its")
                   for side in ("top", "bottom", "back", "rear", "left side", "right side", "base")])  # fmt: skip
"""Where a small part may be, and its share of the extent there."""

SMALL = 0.12


PLACES = ("along the", "along its", "on the", "on its", "around the", "over the", "across the")
WITHIN = {"crevices": None, "badge": Region("spots", 0.2, 0.25)}
"""Words before the part on which another lies, and the kinds that do, with where they lie on it if it is elsewhere."""


def _worn_part(phrase: Phrase) -> bool:
    """Whether all that is said of a part is its wear: "a parking meter, yellow top, rusty pole"."""
    return phrase.join.kind in ("comma", "and", "with") and bool(phrase.weather)


def _is_small(phrase: Phrase) -> bool:
    """Whether what a phrase is of is a small part, of which may be said where it is."""
    return bool(phrase.part) or (phrase.region is not None and phrase.region.kind in ("badge", "details"))


RINGED = ("around", "along the", "on top", "on the top", "at top", "at the top", "near the top", "near top", "at the base",
          "at bottom", "at the bottom", "near the base")
RINGS = ("ring", "rings", "band", "bands", "stripe", "stripes", "line", "lines", "strap", "hoop", "hoops")
"""Patterns of which one lies around a place."""

ROUGHENED = ("frosted", "matte")
"""Words of finish that are part of a stuff's name."""


def _name(phrase: Phrase, text: str) -> None:
    """A substance's name, which may stand after another: "oak planks", "stone bricks", "gold fabric", "pine wood"."""
    old = phrase.substance
    first = text.split(" ")[0]
    if " " in text and first in ROUGHENED and first not in phrase.finish:
        phrase.finish.append(first)
    if text.endswith((" wall", " walls", " sole")) and phrase.region is None:
        phrase.where = "sole" if text.endswith("sole") else "walls"
        phrase.region = PARTS[phrase.where]
    phrase.boards = phrase.boards or text in BOARDS
    if not old:
        phrase.substance = text
    elif (KNOWN[old][0].look == "tartan" and family(old) == family(text)) or _is_of(phrase, text):
        return  # "green tartan wool"
    elif old in ("twill", "herringbone"):
        phrase.substance = text  # "twill carbon fibre"
    elif family(old) == "wood" and KNOWN[text][0].look == "leaves":
        phrase.substance = text  # "oak leaves"
    elif text in FIGURES and old not in (*GENERIC, *PAINTED):  # "a brass horn", "with an obsidian hide"
        if phrase.join is not FIRST and phrase.region is None:
            phrase.region, phrase.where = (PARTS["body"], "body") if text in COATS else (DETAILS, text)
    elif old == "painted" and text in GILDING:
        phrase.substance = text  # "a lion painted gold"
        phrase.join = Join("paint") if phrase.join.kind in ("comma", "with") else phrase.join
    elif old in ("painted", "powder-coated", "powder coated") and family(text) in ("metal", "wood"):
        phrase.substance = f"painted {family(text)}"  # "painted yellow metal", "powder-coated black steel"
        phrase.colors += [word for word in text.split(" ") if word in COLORS and not phrase.colors]
    elif KNOWN[text][0].look in (KNOWN[old][0].look, KNOWN[old][0].look.split(" ")[-1]) and old not in GENERIC:
        return  # "thatched straw"
    elif text == "shell" and family(old) in ("plastic", "metal", "paint"):
        return  # "a plastic shell"
    elif old == "molten" or (old == "lacquer" and family(text) == "metal" and not phrase.colors):
        phrase.substance = text  # "molten gold"
    elif old in ("verdigris", "patina") and family(text) == "metal":
        phrase.substance = "verdigris metal"  # "verdigris copper"
    elif family(old) == "rust" and family(text) == "metal":
        return  # "verdigris copper"
    elif old.endswith("plated") or old in ("gilt", "gilded"):
        return  # "silver-plated copper", "gilt bronze", "gilded gesso"
    elif text in BOARDS or (text in GENERIC and family(old) == family(text)):
        return  # the first says which
    else:
        phrase.substance = text
        if family(old) != family(text) or text in PATTERNED:
            phrase.colors = phrase.colors or ([] if phrase.animal else [old])


GILDING = ("gold", "golden", "silver", "bronze", "copper", "brass", "chrome")
"""Metals that are paints, too."""


COATS = frozenset(["skin", "hide", "scales", "feathers", "fur", "hair", "pelt", "shell", "flesh"])
"""Those of `FIGURES` that are all that one sees of a beast."""

FIGURES = COATS | frozenset([
    "horn", "antler", "seashell", "shells", "conch", "bone", "skull", "skulls", "plumes",
    "leaf", "leaves", "ivy", "vine", "vines", "comb", "roots", "twigs", "crust", "ribbon", "ribbons", "rope", "cord",
    "string", "netting", "card", "tusk", "tusks", "tooth", "teeth", "fangs", "claw", "claws", "hoof", "foliage",
    "mane", "grass",
])  # fmt: skip
"""Names of stuffs that are shapes of another stuff that stands before them."""
