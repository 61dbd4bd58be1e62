"""The words of a prompt as tokens: each phrase that a table knows, the longest first, and each word that none knows. Words that
say nothing are in fillers.tsv, those that join phrases in joins.tsv."""

import re
import unicodedata
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import takewhile
from string import ascii_lowercase
from typing import Any, NamedTuple

from stages.prior.colors import CHANGES, COLORS, COMMON, LEANINGS, LIKENED
from stages.prior.names import FINISHES, FINISHES_METAL
from stages.prior.objects import OBJECTS, rows, words
from stages.prior.places import ANIMALS, FADED, GATHERS, PARTS, SHAPES, WEATHER, WET, WORN, Region, parts_of
from stages.prior.sizes import TIMES
from stages.prior.stuffs import FINISH_LOOKS, GENERIC, KNOWN, LOOK_OF

FILLER = [word for row in rows("fillers.tsv") for word in words(row[0])]
"""Words that say nothing of a material."""

ENDINGS = ("ware", "work", "works", "like", "grain", "toned", "look", "ette")
"""What may be grown to the end of a stuff's name: "brassware"."""

DEGREES = {
    **dict.fromkeys(words(
        "slightly, lightly, a bit, a little bit, a touch, somewhat, mildly, subtly, faintly, barely, gently, "
        "a light dusting of, light dusting of, a dusting of, dusting of, a hint of, hint of, hints of, a touch of, touch of, "
        "touches of, traces of, a trace of, a thin layer of, thin layer of, a thin coat of, thin coat of, "
        "a light coat of, a thin coating of, "
        "sprinkling of, a sprinkling of, small amounts of, a few, a bit of, a little bit of, partly, partially"), 0.55),
    **dict.fromkeys(words(
        "heavily, extremely, badly, severely, thickly, totally, utterly, deeply, fully, completely, thoroughly, "
        "a thick layer of, "
        "thick layer of, a heavy layer of, a thick coat of, thick coat of, lots of, plenty of, a lot of, very"), 1.6),
}  # fmt: skip
"""How much of what follows: factor of the share that it covers."""

DENIALS = words(
    "without, without any, no, not, never, free of, minus, excluding, instead of, rather than, lacking, devoid of, non, "
    "neither, nothing, "
    "other than, than, no longer"
)
"""Words that say that what follows is not there."""

SPARED = words("or, nor")
"""Words that go on with what is denied."""


class Join(NamedTuple):
    """How a phrase and the one before it lie. kind: a key of `JOINED`, or "peel", "show". beneath: the second is beneath."""

    kind: str
    beneath: bool = False


JOINS = {
    word: Join(kind, bool(beneath))
    for kind, beneath, place, told in rows("joins.tsv") if place == "between" for word in words(told)
}  # fmt: skip
"""Words between two phrases, and how these lie."""

POSTFIX = {word: kind for kind, _, place, told in rows("joins.tsv") if place == "after" for word in words(told)}
"""Words after what lies on the thing that follows ("moss-covered stone"), and how it does."""

ASIDE = words("near, beside, beside the, next to, next to the, behind, behind the, in front of, in front of the, "
              "close to, close to the, by the")
"""Words before a thing that only says where another is: "rust streaks beside the tap"."""

PAINTED = ("painted", "lacquer", "enamel", "whitewash", "gilded", "japanned")
"""What is said of a stuff after its name: "iron painted black"."""

DYED = ("colored", "coloured", "tinted", "dyed", "toned", "hued", "color", "colour")
"""Words that make a substance's name that of a colour."""


class Token(NamedTuple):
    """kind: as in `_table`. text: as the table spells it. value: of the table. article: "a" or "the" that stood before it."""

    kind: str
    text: str
    value: Any = None
    article: str = ""


def tokens_of(prompt: str, explained: Mapping[str, Sequence[str]], real: Container[str] = ()) -> list[Token]:
    """Each known phrase, the longest first, and each word that none knows. Args: real: words that are no slips of the pen."""
    prompt = re.sub(r"\s[-–—]+\s|[–—]", " , ", prompt)  # "rust - a ship"
    plain = unicodedata.normalize("NFKD", prompt.lower()).encode("ascii", "ignore").decode()
    plain = re.sub(rf"\b([a-z]{{3,}}[^s\W])s (?=(?:{BELONGINGS})\b)", r"\1's ", plain)
    plain = re.sub(r"(?:\b([a-z]+) )?\b([a-z-]+)(?:'s|(?<=s)') ([a-z-]+(?: [a-z-]+)?)", _owned, plain)
    for simile, meant in SIMILES:
        plain = re.sub(simile, meant, plain)
    plain = re.sub(LIKENESS, _likened, plain)
    plain = re.sub(WORN_OFF, _worn_off, plain)
    plain = re.sub(r"\b(on|at|along|around|near|over|inside|across) (the|its) ([a-z]+) ([a-z]+)\b", _at_part, plain)
    plain = re.sub(r"(?<![#\w])\d+\w*", " ", plain)  # "4k", "8k", "3d"
    heard = re.findall(r"#[0-9a-f]{6}\b|[a-z]+(?:-[a-z]+)*|[,;.:()/&+]", plain)
    found: list[Token] = []
    at, article = 0, ""
    while at < len(heard):
        if heard[at][0] == "#":
            found.append(Token("color", heard[at]))
            at += 1
            continue
        if not heard[at][0].isalpha():
            found.append(Token("join", heard[at], Join("and")) if heard[at] in "&+/" else Token("comma", heard[at]))
            at += 1
            continue
        degree = bool(found) and found[-1].kind == "degree"
        alone = _alone(heard[at]) if degree else None  # "slightly rusty | steel"
        token, length = (alone, 1) if alone else _longest(heard, at)
        if token is None and (again := _respelt(heard[at], explained, real)):
            heard[at : at + 1] = again
            found, at, article = [], 0, ""  # for it may belong to words before it: "desert camoflage"
            continue
        if token is None:
            found += [part._replace(article=article) for part in _explained(heard[at], explained)]
        elif token.kind != "filler":
            found.append(token._replace(article=article))
        article = ARTICLES.get(heard[at], "")
        at += length
    return _resolved(_indoors(_aside(_dyed(_denied(found)))))


def _owned(found: re.Match[str]) -> str:
    """What somebody has, without him: a frost giant's axe is no frost; but a king's crown, where a table has it, and an egg of
    a robin are."""
    before, owner, owned = found.groups()
    table = _table()[0]
    kinds = {word: table[word].kind for word in (before, owner, owned, owned.split(" ")[0]) if word in table}
    named = {kinds.get(owned), kinds.get(owned.split(" ")[0])} & {"thing", "size"}
    whose = kinds.get(owner, "thing") in ("thing", "size", "animal") and bool(named)
    if f"{owner} {owned}" in table or f"{owner} {owned.split(' ')[0]}" in table or not whose:
        return " ".join(filter(None, (before, owner, owned)))
    return " ".join(filter(None, ("" if kinds.get(before, "") in ("substance", "thing") else before, owned)))


BELONGINGS = "helmet|sword|shield|hat|crown|armou?r|mask|cloak|robe|staff|boots|chest|axe|hammer|throne|goblet"
"""What somebody has, whose name people write without an apostrophe: "a knights helmet"."""

LIKENESS = (r"\b(?:that )?(?:looks? |gleams? |shines? |glows? |shimmers? )?like an? ([a-z][a-z -]*?)"
            r"(?=$|[,;.]| and | with | on | but )")


def _likened(found: re.Match[str]) -> str:
    """What is like a thing has its colour: "a hat like a ripe aubergine"."""
    *_, last = words_of = found[1].split(" ")
    token = _table()[0].get(" ".join(words_of[-2:])) or _table()[0].get(last)
    return f" {found[1]} coloured" if token and token.kind == "thing" else found[0]


def _at_part(found: re.Match[str]) -> str:
    """Where something is, without what else the place is: "on the broken edge"."""
    at, the, which, part = found.groups()
    known = _table()[0].get(which)
    plain = f"{at} {the} {part}" in _table()[0] and (known is None or known.kind == "filler")
    return f"{at} {the} {part}" if plain and f"{which} {part}" not in _table()[0] else found[0]


WORN_OFF = (r"\b([a-z]+) (paint|enamel|lacquer|glaze) (?:peeling|flaking|chipping|chipped|worn|rubbed|scraped|coming) "
            r"(?:away )?off the ([a-z]+)\b")


def _worn_off(found: re.Match[str]) -> str:
    """A coat that is gone from a part only: "white paint worn off the armrests"."""
    hue, coat, part = found.groups()
    known = _table()[0].get(part)
    place = known is not None and known.kind == "part" and known.value.kind not in ("all", "edges", "crevices")
    return f"{hue} {coat}, chipped at the {part}" if place and hue in COLORS else found[0]


ARTICLES = {"a": "a", "an": "a", "the": "the"}

TURNED = (r"((?:sun-?|rain-?|smoke-?|age-?)?(?:weathered|greyed|grayed|aged|bleached|darkened|yellowed|seasoned|silvered|"
          r"smoked|tarnished|patinated|oxidi[sz]ed|mellowed|gone|turned|discolou?red|worn|faded|browned|stained|burnished|rubbed|smooth))")
HUES = "|".join(COMMON)
HANDS = ("rain|sun|sunlight|age|time|years|use|decades|centuries|weather|wind|sea|salt air|handling|touch|hands|wear|traffic|"
         "fire|generations|elements|heat|washing|feet|footsteps|sweat")
"""Words of what becomes of a stuff, the colours that it may take, and who does it."""

NOUNS = r"(?:an? |the )?([a-z' -]+?)(?=$|[,;.:()]| and | with | but | on | in | that | which )"
SIMILES = (
    (r"\bas (?!well|soon|long|much|many|far)([a-z]+(?:-[a-z]+)?) as " + NOUNS, r"\1"),  # "as black as a raven's wing"
    (r"\blike an? (?:(?!with |and |but |on )[a-z]+ ){1,4}?"
     r"(?=(?:in|of|made of|cast in|carved from) )", ""),  # "a ring like a coiled snake in silver"
    (r"\boil[- ]painted\b", "painted"), (r"\bcreosoted\b", "dark brown"),
    (r"\bhalf[- ](?=(?:melted|eaten|peeled|rotten|rotted|burnt|burned|charred|opened|broken|ruined|frozen|faded|rusted)\b)",
     "partly "),
    (r"\b[a-z]+[- ]shaped\b(?! (?:like|as|into))", ""),  # "a leaf shaped blade"
    (r"\b(?:shaped|formed|sculpted|modelled|modeled) (?:like|as|into) " + NOUNS, ""),  # "a jug shaped like a pineapple"
    (r"\bin the (?:shape|form) of " + NOUNS, ""),
    (rf"\b((?:dark |light |pale )?(?:{HUES})) over ((?:dark |light |pale )?(?:{HUES}))(?=$|[,;.]| with | and )",
     r"\2, upper half \1"),  # "a helicopter, red over white"
    (r"\b(?:hanging|dangling|sprouting|rising|protruding|sticking out|hung) (?:from|out of|off) (?=the |its )", "at "),
    (r"(?<=carved )((?:from|out of) [a-z ]+? )with an? [a-z-]+\b", r"\1"),  # "carved from a log with a chainsaw"
    (rf"\b({HUES}) as " + NOUNS, r"\1"),  # "legs black as coal"
    (r"\b(?:(?:in|of|with) )?(?:the )?(?:exact |same |deep |rich |dark |pale )?"
     r"(?:colou?r|shade|hue|tint|tone)(?: and [a-z]+)? of " + NOUNS,
     r"\1 coloured"),  # "the colour of honey"
    (r"\b(?:with|in|and) (?:an? |the )?((?:(?!(?:with|and|or) )[a-z-]+ ){0,3}?[a-z-]+) "
     r"(?:finish|coating|paint job|paintwork|surface|texture|look)\b", r"finished in \1"),
    (r"\b(?:an? )?(?:crackled?|cracked|crazed|craquelure) (?:glaze|glazing)\b", "glaze crackled"),
    (r"(?:,\s*(?:on |against )?|\s(?:on|against) )(?:an? )?(?:plain |clean )?"
     r"(?:white|black|gr[ea]y|dark|neutral|transparent|plain|clean|studio) background\b", ","),
    (r"(?:(?<=with )|(?<=and )|(?<=, )|^)(?:hazard|warning|caution) (?:stripes|striping|tape)\b",
    "yellow and black stripes"),
    (r",? half[- ](?:dipped|submerged|buried) in\b", ", lower half"),
    (r"(?:,| with| in)(?: an?)? ((?:light |dark |medium |warm |deep |rich )?)"
     r"(?!coffee|water|blood|rust|grass|oil|wine|ink|tea|dirt)([a-z]+) stain\b", r", \1\2 coloured"),
    (r"^(?:an? |some )?([a-z ]+?) in an? ((?:[a-z-]+ ){0,3}?)(mug|cup|bowl|tankard|goblet|bucket)\b",
     r"\2\3 with \1 inside"),
    (r"\bin an? ((?:[a-z-]+ ){0,3}?)(pot|planter|plant pot|flower pot|flowerpot|holder|saucer|basket)\b",
     r"with a \1\2 at the lower third"),
    (r"\b(iron|steel|brass|bronze|copper|silver|gold|metal|rope|cord|twine)[- ]bound\b", r"\1 banded"),
    (r"\bpaint-(chipped|peeling|flaking|worn)\b", r"\1 painted"),
    (r"^((?:an? )?(?:(?!high|with|and)[a-z-]+ ){1,4})heels\b", r"\1high heels"),
    (r"\bblack[- ]figure(?: greek)? ([a-z]+)(?!.*figures)", r"\1 of orange clay with black figures"),
    (r"\bred[- ]figure(?: greek)? ([a-z]+)(?!.*figures)", r"\1 of black clay with orange figures"),
    (r"\b(?:stone|acid)[- ]?washed (?=jeans|denim|jacket)", "faded "),
    (r"\bon (?:the )?(?:north|south|east|west|shady|sunny|far|near|windward|lee|left or right)(?:ern)? side\b", "on one side"),
    (r"\b(cobweb|vine|lichen|barnacle)(?:bed|ed|d|by)\b", r"\1 covered"), (r"\bcandy[- ](?=striped)", ""),
    (r"^(?:an? )?((?:[a-z]+ )*?(?:stone|gem|jewel|diamond|ruby|emerald|sapphire|pearl|opal|amber|jade|crystal)s?) "
     r"set in(?:to)? (?!the )([a-z ]+?)(?=$|[,.;])", r"\2 with \1 studs"),
    (r"\b(?:make|makes|making) (?:it|this|that|them|these) look like an? ", ""),
    (r"\b(?:left|abandoned|allowed|starting|beginning) to rot\b", "rotten"),
    (r"\b(?:leaking|oozing|spilling|seeping|bubbling) (?:from|out of|over) (?=the |its )", "at "),
    (r"\bin (?:bright|vivid|vibrant|many|different|various|mixed|assorted) colou?rs\b", "in rainbow patches"),
    (r"\btopiary (?=(?!bush|tree|hedge)[a-z])", "green leaves "),
    (r"\b(?:to )?look(?:s|ing)? (?:like|as if|as though) (?:it|they|he|she) (?:is|was|were|are)\b", "of"),
    (r"\b(?:burnt|burned|scorched|charred) and blackened\b", "charred"),
    (r"\bblackened (?=at|on|along|around|near|in)", "charred "),
    (r"\b(?:and |but )?(?:worn|rubbed|polished) (?:shiny|smooth|bright)(?: (?:where|from|by) [^,.;]*)?", "with polished edges"),
    (r"(?:^|\ban? )(slice|wedge|segment|half) of (?:an? |the )?([a-z]+)\b", r"\2 \1"),
    (r"\b(?:in|on) an? (?:waffle|sugar|wafer) cone\b|(?<=ice cream) cone\b", " with waffle at the lower half"),
    (r"\b(?:(?:in|with) )?(?:an? )?sunburst(?: finish)?\b", "glossy orange with dark brown edges"),
    (r"\bwith (?:the )?(?:word |words |text )?[\"']?[a-z]+[\"']? (?:stamped|stencill?ed|printed|written|embossed) "
     r"(?:on (?:it|the [a-z]+) )?in ([a-z]+)\b", r"with \1 lettering"),
    (r"(?:,| with| and)(?: (?!thin|gold|silver|copper|brass)[a-z]+){0,2} (?:grout|mortar)(?: lines| joints)?\b"
     r"(?=$|[,.;]| and | with )", ""),
    (r"\bwhite-?washed (?=brick|stone|rock)", "white "),
    (r"\bwhite-?washed (?=[a-z])", "white painted "),
    (r"\bcamouflage in ([a-z]+) (?:tones|colou?rs|shades)\b", r"\1 camouflage"),
    (r"\b(?:flakes|remnants|remains|scraps) of (?=(?:[a-z]+ ){0,3}paint\b)", "peeling "),
    (r"\b(cracks|gaps|seams|grooves|joints|holes|veins) (?:filled|inlaid|repaired|sealed|packed|fixed|mended) (?:with|in) "
     r"([a-z ]+?)(?=$|[,.;]| and | on )", r"\2 \1"),
    (r"\b(?:multi-?colou?red|colou?rful)\b", "rainbow patches"),
    (r"\b(?:bright |in )?(?:the )?primary colou?rs\b", "in red, yellow and blue"),
    (r"\b(?:soft )?pastel colou?rs\b", "pastel pink, pastel blue and pastel yellow"),
    (r"\bautumn(?:al)? (?:colou?rs|tones|shades)\b", "autumn leaves coloured"),
    (r"\b(?:two|2)[- ]ton(?:e|ed) ", ""),
    (r"\bwith (?:an? |the )?(?:wooden |wood )?(?:plank|board|formwork) (?:imprints?|marks|texture|lines)\b", ""),
    (r"\bglowing (cracks|veins|fissures)\b", r"bright orange \1"),
    (r"\b(?:gone|turned) green with (?:verdigris|patina|age)\b", "covered in verdigris"),
    (r"\b(?:blue and white )?(?:delft|willow[- ]pattern|blue willow|chinoiserie)(?:ware)?(?: blue)?(?: pattern)?"
     r"(?: pottery| porcelain| china| ware)? ([a-z]+(?: [a-z]+)?)(?=$|[,.;]| with | on | and )",
     r"\1 in white glazed ceramic with cobalt blue motifs"),
    (r"\b(?:multi)?colou?red (?:chips|specks|flecks)\b", "sprinkles"),
    (r"\bblue and white (?=willow)", ""),
    (r"\bpowder coated\b(?! in| with)", "powder-coated"),
    (r"\b([a-z]+) and ([a-z]+) marbled ([a-z]+(?: [a-z]+)?)(?=$|[,.;]| with | and )", r"\1 \3 swirled with \2"),
    (r"\b([a-z]+) and ([a-z]+) marbled\b", r"\1 and \2 swirled"),
    (r"\b(peeling|flaking|chipping|wearing|coming|crumbling|falling|breaking|cracking|rubbing|scraping|shedding|lifting|curling|"
     r"sloughing|peeled|flaked|crumbled|worn|rubbed|scraped|fallen)(?: away from| away off| off of| off from| from)\b",
     r"\1 off"),
    (rf"\b{TURNED} to (?:an? )?(?=(?:[a-z]+ )?(?:{HUES})\b)", ""),
    (rf"\b{TURNED} (?:by|with|from|in|through) (?:the |many )?(?:{HANDS})(?: and (?:the )?(?:{HANDS}))?\b", r"\1"),
    (rf"\b(?:by|from|through) (?:the |many |years of )?(?:{HANDS})\b", ""),
    (r"\b(copper|brass|bronze)((?: [a-z]+){1,2}) (?:gone|turned|going|turning) (green|turquoise|teal)\b", r"\3 \1\2"),
    (r"\b(?:8|number eight)[ -]?ball\b", "eight ball"),
)
"""What says in a roundabout way what an adjective says."""


def _dyed(found: list[Token]) -> list[Token]:
    """Names of substances whose colour alone is meant, as colours: "honey coloured glass"."""
    kept: list[Token] = []
    for token, after in zip(found, [*found[1:], Token("end", "")], strict=False):
        if token.kind != "dyed":
            kept.append(token)
        elif after.kind == "color":
            continue  # "shagreen dyed teal"
        elif kept and (kept[-1].kind == "substance" or kept[-1].text in LIKENED):
            kept[-1] = kept[-1]._replace(kind="color", value=None)
        elif kept and kept[-1].kind == "thing":
            kept[-1:] = _hues_of(kept[-1].text)
    return kept


def _hues_of(thing: str) -> list[Token]:
    """The colour that everybody knows of a thing, as tokens: "the colour of a carrot"."""
    if thing in COLORS:
        return [Token("color", thing)]
    made = OBJECTS[thing].made.split(" with ")[0]
    token, _ = _longest(made.split(" "), 0)
    if token and token.kind == "substance":
        return [Token("color", token.text)]
    hues = [Token("color", word) for word in made.split(" ") if word in COLORS or word in CHANGES or word in LEANINGS]
    stuff, _ = _longest(made.split(" ")[-1:], 0)
    return hues or ([Token("color", stuff.text)] if stuff and stuff.kind == "substance" else [])


OVER_OR_UNDER = ("under", "beneath", "below", "underneath", "above")


def _aside(found: list[Token]) -> list[Token]:
    """What is left without what something only is beside, or "under the tap"."""
    kept: list[Token] = []
    aside = False
    for token, after in zip(found, [*found[1:], Token("end", "")], strict=False):
        thing = after.kind == "thing" and after.article == "the" and any(t.kind == "thing" for t in kept)
        if (token.kind == "aside" and after.kind != "part") or (token.text in OVER_OR_UNDER and thing):
            aside = True
        elif token.kind in ("join", "comma", "postfix", "half"):
            aside = False
        if not aside:
            kept.append(token)
    return kept


def _indoors(found: list[Token]) -> list[Token]:
    """What is left without where a thing is or was: "fresh out of the oven". Snow and mud in which it lies lie on it."""
    kept: list[Token] = []
    at = 0
    while at < len(found):
        token, after = found[at], found[at + 1] if at + 1 < len(found) else Token("end", "")
        there = ("in", "into", "out of", "on") if any(t.kind == "thing" for t in kept) else ("in", "into", "out of")
        place = token.kind == "join" and token.text in there and after.article == "the" and bool(kept)
        if place and after.kind in ("thing", "substance") and not any(t.kind == "part" for t in _run(found[at + 1 :])):
            if after.text in GATHERS and token.text != "on":
                kept.append(Token("join", "with", JOINS["with"]))
            else:
                at += 1
        elif not (token.text == "out of" and kept and kept[-1].kind == "thing"):  # "a teapot out of amber"
            kept.append(token)
        at += 1
    return kept


GLOSS = 0.3
"""Roughness below which a finish is one of gloss."""


def _alone(word: str) -> Token | None:
    """A single word of wear or finish, if it is one."""
    token = _table()[0].get(word)
    return token if token and token.kind in ("weather", "finish") else None


def _denied(found: list[Token]) -> list[Token]:
    """What is left without that which words say is not there: "iron, no rust"; "silver, not gold"; what has no gloss is
    matte. """
    kept: list[Token] = []
    denying = denied = fresh = spare = False
    for token in found:
        if token.kind == "denial":
            denying = fresh = True
            spare = token.text == "than"
        elif token.kind in ("join", "comma", "half") and token.text != "of":
            if denying and not fresh and token.kind == "join" and token.text in SPARED:
                continue
            instead = (denying or denied) and token.text == "but"
            denying, denied = False, denying
            kept.append(Token("comma", ",") if instead else token)  # "not metal, but bone"
        elif not denying:
            denied = False
            kept.append(token)
        elif token.kind == "finish" and sum(FINISHES.get(token.text, (1, 1))) < 2 * GLOSS:
            kept.append(Token("finish", "matte"))
        elif spare:
            denying = False  # "darker than charcoal | rubber"
        fresh = False if token.kind != "denial" else fresh
    return kept


def _longest(heard: list[str], at: int) -> tuple[Token | None, int]:
    """The longest phrase that is known at a place, and its length in words."""
    table, longest = _table()
    for length in range(min(longest, len(heard) - at), 0, -1):
        *before, last = heard[at : at + length]
        plain = plain_forms(last)
        for spelling in (last, last.replace("-", " "), *singulars(last), f"{last}s", *plain):
            text = " ".join([*before, spelling])
            joined = [text.replace(" ", "")] if length == 2 and _compounds(text, table) else []  # "surf board"
            for known in (text, text.replace("-", " "), text.replace("-", ""), text.replace(" ", "-"), *joined):
                if known in table and (spelling not in plain or table[known].kind in COMPARED):
                    return table[known], length
    return None, 1


def _compounds(text: str, table: Mapping[str, Token]) -> bool:
    """Whether two words may be a thing's name that is written as one: neither is a colour, nor a word that joins."""
    known = [table[word].kind for word in text.split(" ") if word in table]
    whole = table.get(text.replace(" ", ""))
    return whole is not None and whole.kind == "thing" and set(known) <= {"thing", "substance", "part", "unknown"}


COMPARED = ("color", "finish", "weather", "size", "degree")
"""Kinds of words that have a comparative: a pitcher is not more pitch."""


def plain_forms(word: str) -> list[str]:
    """What a word may be the comparative or superlative of."""
    stems = [word.removesuffix(end) for end in ("er", "est") if word.endswith(end) and len(word) > len(end) + 3]
    return [plain for stem in stems for plain in (stem, f"{stem}e", f"{stem.removesuffix('i')}y")]


def _respelt(word: str, explained: Container[str], real: Container[str]) -> list[str]:
    """A word that no table knows as words that one does: its parts, or what it is a slip of the pen for; or nothing."""
    if "-" in word:
        *before, last = word.split("-")
        return ["than", before[-1]] if last == "free" else [*before, last]
    table = _table()[0]
    if word in explained or len(word) < LEAST_LETTERS:
        return []
    halves = ((word[:cut], word[cut:]) for cut in range(len(word) - 3, 2, -1))
    for first, second in halves:
        whole = second in ENDINGS or any(one in table for one in (second, *singulars(second)))
        if whole and second not in ("red", "bed") and _names_stuff(first):
            return [first, *([] if second in ENDINGS else [second])]
    if any(one in real for one in (word, *singulars(word))):
        return []
    known = {stem for stem in _stems(word) if stem in real}  # "potted" is of a pot
    slips = (slip for slip in _slips(word) if slip[:1] == word[0] and _worth(slip) and not _derived(word, slip))
    return next(([slip] for slip in slips if not known or known & set(_stems(slip))), [])


def _stems(word: str) -> list[str]:
    """What a word may be made of by an ending: "potted" of pot."""
    cut = [word.removesuffix(end) for end in ("ed", "ing", "er", "y", "ly", "s") if word.endswith(end)]
    return [stem for c in cut if len(c) > LEAST_STEM for stem in (c, f"{c}e", c[:-1] if c[-1] == c[-2] else c)]


LEAST_STEM = 2
"""Letters of the shortest stem, less one."""


def _derived(word: str, slip: str) -> bool:
    """Whether a word is no slip but made of another: what was done to a thing, "honed"; what it is like, "glassy", "platen"."""
    return word.startswith(slip) or (word.endswith("ed") and not slip.endswith("ed")) or word == f"{slip}y"


LEAST_LETTERS = 6
"""Letters of the shortest word that is taken for a slip of the pen."""


def _names_stuff(text: str) -> bool:
    token = _table()[0].get(text)
    return token is not None and token.kind in ("substance", "color")


def _worth(text: str) -> bool:
    token = _table()[0].get(text)
    short = token is not None and (token.kind == "thing" or (token.kind in ("part", "shape") and len(text) < LONG))
    return token is not None and not short and token.kind not in ("filler", "join", "size", "half")


LONG = 8
"""Letters of the shortest part for which another word may be a slip of the pen."""


def _slips(word: str) -> Iterator[str]:
    """Words that become this one by a letter left out, put in, exchanged with its neighbour or another. Source: Norvig 2007."""
    cuts = [(word[:k], word[k:]) for k in range(len(word) + 1)]
    yield from (a + b[1] + b[0] + b[2:] for a, b in cuts if len(b) > 1)
    yield from (a + b[1:] for a, b in cuts if b)
    yield from (a + letter + b for a, b in cuts for letter in ascii_lowercase)
    yield from (a + letter + b[1:] for a, b in cuts[1:] if b for letter in ascii_lowercase)


def _explained(word: str, explained: Mapping[str, Sequence[str]]) -> list[Token]:
    """A word that no table knows, as the colours by which a dictionary explains it, or as it is."""
    told = next((explained[w] for w in (word, *singulars(word)) if w in explained), ())
    if told and all(w in COLORS or w in CHANGES or w in LEANINGS for w in told):
        return [Token("color", w) for w in told]
    return [Token("unknown", word)]


def singulars(word: str) -> list[str]:
    """What a word may be the plural of."""
    endings = (("ies", "y"), ("ves", "f"), ("ves", "fe"), ("es", ""), ("s", ""))
    cut = [(word.removesuffix(e), e, instead) for e, instead in endings if word.endswith(e) and len(word) > len(e) + 2]
    return [stem + instead for stem, end, instead in cut if end != "es" or stem.endswith(HISSING)]  # "tines" are no tins


HISSING = ("s", "x", "z", "ch", "sh", "o", "ss")
"""What stems end with whose plural ends in -es."""


PLACED = words("near, near the, near its, towards the, toward the, on, on the, at, at the, to the, in the, around, "
               "around the, along, along the, on its, in its, over the, "
               "inside the")
"""What may stand before a part to say that something lies there."""


def _resolved(found: list[Token]) -> list[Token]:
    """Words that are both a colour and a thing or a substance are colours where another says what has it."""
    result: list[Token] = []
    for number, token in enumerate(found):
        if _depicts(token, result):
            while result[-1].kind != "thing" or any(t.kind == "thing" for t in result[:-1]):
                result.pop()
            result.pop()  # "a knight on horseback statue"
        ahead = _run(found[number + 1 :])
        if token.text == "stained" and result and _stained(result[-1], found[number + 1 :]):
            result[-1] = result[-1]._replace(kind="color", value=None)
            continue  # "dark stained pine"
        if _only_tells_how(token, result, ahead):
            continue
        if token.text in METALLIC and any(t.kind == "substance" and KNOWN[t.text][0].look in HAIRY for t in ahead[:2]):
            token = token._replace(kind="color", text=METALLIC[token.text], value=None)  # "golden fur"
        behind = _run(reversed(result))
        names = {t.kind for t in ahead} & {"substance", "thing"}
        token = _of_its_name(token, result, ahead, behind)
        if token.kind == "thing" and ahead and ahead[0].text in COLORS and any(t.kind == "thing" for t in result):
            continue  # "a mailbox in robin egg blue"
        if token.kind in ("substance", "thing") and _shades(token, found[number + 1 :]):
            continue  # "candy apple red paint"
        if token.kind == "thing" and token.text in YOUNG and result and result[-1].kind == "thing":
            continue  # "a golden retriever puppy"
        if token.text == "crust" and token.kind == "substance" and not any(map(_is_food, found[:number])):
            token = Token("substance", "mineral crust", KNOWN["mineral crust"])  # "a meteorite with a black crust"
        if token.kind == "substance" and KNOWN[token.text][0].family == "wood" and ahead and ahead[0].text in TREES:
            continue  # "a birch tree"
        if _holds(token, result, found[number + 1 :]) or _serves(token, ahead):
            continue  # "a tin biscuit box", "a tea bowl"
        haired = token.kind == "thing" and result and ahead and ahead[0].text in HAIR
        if haired and OBJECTS[token.text].made.split(" with ")[0].endswith("fur"):
            result += _hues_of(token.text)
            if ahead[0].kind == "part":
                found[number + 1] = Token("substance", "bristles", KNOWN["bristles"])
            continue  # "a brush of badger hair"
        if token.text in COLORS and token.kind in ("substance", "thing"):
            shaped = any(t.kind == "shape" or (t.kind == "part" and token.text not in KNOWN) for t in ahead)
            if token.text in KNOWN and KNOWN[token.text][0].family != "gem":
                names -= {"thing"}  # "an ivory comb", but "an emerald car"
            elif token.text in KNOWN and ahead and _is_jewel(ahead[0]):
                names = set()  # "an emerald brooch"
            if names or shaped or any(t.kind == "substance" for t in behind):
                token = token._replace(kind="color", value=None)
        if token.kind == "finish" and token.text in OBJECTS and not (ahead or behind or result):
            token = token._replace(kind="thing", value=None)  # "a mirror with a rusty frame"
        placed = bool(ahead) and ahead[0].kind == "part" and ahead[0].text.startswith("on ")  # "cherry on top"
        after = [t.text if t.kind == "join" else t.kind for t in found[number + 1 : number + 3]]
        told = found[number + 2].text in LENT if number + 2 < len(found) else False
        opens = after[:1] == ["with"] or after == ["comma", "color"] or (after[:1] == ["comma"] and told)  # "rose, red with"
        opens &= not result and not ahead
        if token.kind == "color" and token.text in OBJECTS and not behind and (placed or opens):
            token = token._replace(kind="thing", value=None)
        named = token.article or (any(t.article for t in behind) and any(t.text in COMMON for t in behind))
        if token.kind == "color" and named and not ahead and token.text in OBJECTS:
            token = token._replace(kind="thing", value=None)  # "an orange"
        elif token.text == "star" and behind and _hue(behind[0]) and not names and any(t.kind == "thing" for t in result):
            token = Token("part", "star emblem", PARTS["star emblem"])  # "a helicopter with a white star"
        elif place := _own_part(token, result):
            token = Token("part", token.text, place)  # "a drum with a white skin"
        elif token.text in ("shell", "carapace") and any(t.text in BEARERS for t in result):
            token = Token("part", "carapace", PARTS["carapace"])
        elif token.text == "shell" and any(t.kind in ("thing", "part") for t in result):
            token = Token("part", "body", PARTS["body"])  # "a helmet with a white shell"
        elif token.kind == "thing" and token.text in KNOWN and _is_stuff(token, ahead, behind) and not _consists(found, number):
            token = token._replace(kind="substance", value=None)
        elif token.text == "diamonds" and (not (behind and _hue(behind[0])) or any(map(_is_jewel, result))):
            token = Token("substance", "diamonds", KNOWN["diamonds"])  # "studded with diamonds"
        elif token.kind == "shape" and token.text in OBJECTS and not ahead and _opens(token, result):
            token = token._replace(kind="thing", value=None)  # "a silver ring"
        elif token.kind == "part" and token.text in WORN & OBJECTS.keys() and not any(t.kind == "thing" for t in result):
            token = token._replace(kind="thing", value=None)  # "faded jeans"
        elif token.kind == "thing" and token.text in PARTS and (result or ahead):
            token = Token("part", token.text, PARTS[token.text])
        elif token.kind == "thing" and not ahead and (place := PARTS.get(f"{token.text}s")) and _is_had(result, behind, place):
            token = Token("part", token.text, place)  # "a barrow with a rubber tyre"
        result.append(token)
    return result


def _is_had(before: list[Token], behind: list[Token], place: Region) -> bool:
    """Whether what stands after these is had by the thing among them, at a place of its own."""
    if place.kind in ("edges", "details"):
        return False
    join = next((t for t in reversed(before) if t.kind in ("join", "comma")), Token("", ""))
    joined = join.kind == "comma" or (join.kind == "join" and join.value.kind in ("with", "and"))
    return joined and any(t.kind == "thing" for t in before) and not any(t.kind == "thing" for t in behind)


def _consists(found: list[Token], number: int) -> bool:
    """Whether it is said what a thing is of: "a rug of sheepskin"."""
    join, stuff = (*found[number + 1 : number + 3], Token("", ""), Token("", ""))[:2]
    return join.text in ("of", "in") and stuff.kind == "substance"


def _own_part(token: Token, before: list[Token]) -> Region | None:
    """Where a skin lies of which the thing that was named first has one, as a drum has."""
    thing = next((t.text for t in before if t.kind == "thing"), "")
    places = parts_of(thing)
    return places.get(token.text) if token.kind in ("substance", "thing", "color") and token.text in OUTSIDES else None


OUTSIDES = ("flesh", "skin", "hide", "rind", "crust", "shell", "peel", "husk", "horn", "bell", "rose")
"""Names of stuffs that are parts of things, too."""


def _depicts(token: Token, before: list[Token]) -> bool:
    """Whether a thing is an image of all that was named before."""
    if token.kind != "thing" or token.article or token.text.split(" ")[-1] not in IMAGES:
        return False
    at = next((k for k, t in enumerate(before) if t.kind == "thing"), len(before))
    named = (t.kind in ("thing", "unknown") or t.text in ("on", "with", "and", "of") for t in before[at:])
    return len(before) > at + 1 and all(named)


YOUNG = ("puppy", "pup", "kitten", "cub", "foal", "calf", "lamb", "chick")
"""Beasts that are of the kind that is named before them."""


def _is_food(token: Token) -> bool:
    """Whether a token is of what is eaten."""
    made = OBJECTS[token.text].made.split(" with ")[0].split(" ")[-1] if token.kind == "thing" else token.text
    return made in KNOWN and KNOWN[made][0].look in FOODS


TREES = ("tree", "trees", "forest", "sapling", "hedge", "bush", "grove", "woodland")
"""What grows of the tree that is named before it."""

HAIR = ("hair", "fur", "bristles", "pelt")
"""What is that of the beast that is named before it."""

def _hue(token: Token) -> bool:
    return token.kind == "color" or token.text in LENT


LENT = ("gold", "amber", "silver", "copper", "bronze", "ivory", "coral", "cream", "rust", "turquoise", "jade", "emerald")
"""Stuffs that stand for their colours in a list of colours."""

IMAGES = ("statue", "statuette", "figurine", "sculpture", "figure", "bust", "carving", "ornament", "miniature", "monument")
"""Things that are images of others."""


def _only_tells_how(token: Token, before: list[Token], ahead: list[Token]) -> bool:
    """Whether a word says nothing of the stuff beside those of its run: "herringbone brick", "left unglazed"."""
    after = ahead[0] if ahead else Token("end", "")
    if token.text in ("herringbone", "twill"):
        beside = ahead or before
        return any(t.text in KNOWN and KNOWN[t.text][0].family in ("stone", "wood", "ceramic") for t in beside)
    if token.text in SPELLS:
        return after.kind == "thing" and not before  # "a frost sword"
    if token.text in SHAPES and token.kind == "postfix":
        return bool(before) and before[-1].text in ("in", "of")  # "a bowl in mottled raku"
    if token.text in SHIMMERING:
        return any(t.kind in ("substance", "color", "thing") for t in ahead)  # "iridescent emerald scales"
    if token.text in ("straw", "reed", "reeds"):
        return any(t.text.startswith("thatch") for t in (*_run(reversed(before)), *ahead))  # "thatched straw"
    return token.text == "left" and after.kind in ("finish", "weather")


def _of_its_name(token: Token, before: list[Token], ahead: list[Token], behind: list[Token]) -> Token:
    """A thing as the colour, hide or wood that has its name: "an upper in lemon", "a belt in stingray", "a cherry table"."""
    thing = token.kind == "thing" and not (token.article or ahead)
    after = bool(behind) and all(t.kind in ("finish", "color") for t in behind)
    named = after and any(t.kind == "thing" for t in before)  # "a beetle, glossy chestnut"
    hide = HIDES.get(token.text)
    if hide and ahead and ahead[0].text in ("skin", "hide", "leather") and token.kind in ("thing", "unknown"):
        return token._replace(kind="substance", text=hide, value=KNOWN[hide])  # "white ray skin"
    made = OBJECTS[ahead[0].text].made if ahead and ahead[0].kind == "thing" else ""
    if hide and token.kind == "thing" and made.endswith("leather"):
        return token._replace(kind="substance", text=hide, value=KNOWN[hide])  # "alligator shoes"
    if hide and thing and before and before[-1].text in ("in", "of"):
        return token._replace(kind="substance", text=hide, value=KNOWN[hide])
    if thing and token.text in COLORS and before and (before[-1].text == "in" or named):
        return token._replace(kind="color", value=None)
    bare = not ahead and not any(t.kind in ("substance", "color") for t in before)
    wooden = bare and any(map(_of_wood, before)) and before[-1].text in (",", "in", "of", *FINISH_LOOKS)
    wooden |= "of" in [t.text for t in before[-2:]] and any(t.kind == "part" for t in before[-4:])  # "a hilt of white ash"
    if token.text in TIMBER and (wooden or _of_timber(token.text, ahead[:2])):
        return Token("substance", f"{token.text} wood")
    return token


def _stained(before: Token, after: list[Token]) -> bool:
    """Whether wood is stained with a colour, or to look like another: "walnut stained oak"; and not by rust."""
    wood = bool(after) and after[0].text in KNOWN and KNOWN[after[0].text][0].family == "wood"
    stain = before.kind == "color" or (before.kind == "substance" and KNOWN[before.text][0].family == "wood")
    return wood and stain


SHIMMERING = ("iridescent", "holographic", "opalescent", "prismatic")
"""Words that say what a part is of where nothing else does."""

SPELLS = ("frost", "shadow", "void", "plasma", "energy")
"""What weapons of tales do, not what they are of."""

METALLIC = {"golden": "golden tan", "silver": "light grey", "copper": "copper colored", "bronze": "golden brown"}
HAIRY = ("fur", "skin", "feathers", "straw")
"""Metals that lend their colour to what stands after them, and the looks of what has it."""

HIDES = {
    "stingray": "shagreen", "shark": "shagreen", "ray": "shagreen", "ostrich": "ostrich leather",
    "python": "python leather", "eel": "eelskin",
    "crocodile": "crocodile leather", "alligator": "crocodile leather", "lizard": "lizard leather", "snake": "snakeskin",
    "goat": "goatskin", "sheep": "sheepskin", "lamb": "lambskin", "deer": "deerskin", "buffalo": "buffalo leather",
    "kangaroo": "kangaroo leather", "rabbit": "rabbit fur", "fox": "fox fur", "alpaca": "alpaca wool",
    "llama": "llama wool", "camel": "camel wool", "beaver": "beaver fur", "elk": "elk leather",
}  # fmt: skip
"""Beasts whose names are those of their hides where a thing is of them."""

TIMBER = ("ash", "cherry", "chestnut")
"""Trees whose names mean something else, too."""


def _of_timber(tree: str, ahead: list[Token]) -> bool:
    """Whether the name of a tree stands for its wood: before what is usually of it, or ash before a part."""
    part = tree == "ash" and any(t.kind == "part" and " the" not in t.text and " top" not in t.text for t in ahead)
    veneer = any(t.kind == "substance" and t.text in ("veneer", "timber", "planks", "boards", "ply") for t in ahead[:1])
    return part or veneer or any(map(_of_wood, ahead if tree == "ash" else ahead[:1]))


def _of_wood(token: Token) -> bool:
    """Whether a thing is usually of wood."""
    made = OBJECTS[token.text].made.split(" ")[-1] if token.kind == "thing" else ""
    return made in KNOWN and KNOWN[made][0].family == "wood"


BEARERS = ("turtle", "tortoise", "sea turtle", "snail", "crab", "lobster", "beetle", "armadillo", "ladybug",
           "ladybird")
"""Beasts with a shell."""


def _opens(token: Token, before: list[Token]) -> bool:
    """Whether a token ends the first run, which an article opens."""
    whole = [*before, token]
    opened = whole[0].article == "a" or not before
    return opened and all(t.kind in ("color", "finish", "weather", "size", "substance") for t in before)


def _is_jewel(token: Token) -> bool:
    """Whether a thing is made of precious metal and small."""
    thing = OBJECTS.get(token.text) if token.kind == "thing" else None
    return bool(thing) and thing.metres < 0.25 and thing.made.split(" ")[-1] in ("gold", "silver", "platinum")  # type: ignore[union-attr]


def _is_stuff(token: Token, ahead: list[Token], behind: list[Token]) -> bool:
    """Whether what may be a stuff or a thing is the stuff."""
    names = {t.kind for t in ahead} & {"substance", "thing"}
    if names:
        return _stands_before(ahead, behind)
    kind = KNOWN[token.text][0].family if token.text != "cane" else "stick"
    if any(t.kind == "substance" and t.text in GENERIC and KNOWN[t.text][0].family != kind for t in behind):
        return False  # "a wooden cane"
    return bool(ahead or behind) or " with " not in OBJECTS[token.text].made  # "a strawberry" has seeds


def _stands_before(ahead: list[Token], behind: list[Token]) -> bool:
    """Whether what may be a stuff stands right before a thing of which no stuff is said yet: "a meteorite pendant"."""
    return ahead[0].kind == "thing" and not any(t.kind == "substance" for t in (*ahead, *behind))


FOODS = frozenset(["bread", "cheese", "chocolate", "salt", "meat", "honeycomb", "honey"])
"""Looks of what is eaten."""

HELD = FOODS | {"toxic waste", "nuclear waste", "slime", "fuel", "petrol", "gasoline",
                "grass", "sand", "fine sand", "soil", "coal", "charcoal", "snow", "ice", "ash", "dust", "gravel", "leaves",
                "bark", "newspaper", "oil", "seashell", "jam", "ink", "water", "coffee beans", "acid", "rice", "red wine",
                "sugar", "peanut butter", "marmalade", "soy sauce", "mayonnaise", "yogurt", "engine oil",
                "motor oil"}  # fmt: skip
"""Looks of what things of other stuffs are for: "a plastic lawn chair", "a steel oil drum"."""


def _holds(token: Token, before: list[Token], after: list[Token]) -> bool:
    """Whether a name only says what a thing is for, whose own stuff stands before: "enamel bread bin"."""
    food = token.kind == "substance" and (KNOWN[token.text][0].look in HELD or token.text in HELD)
    named = bool(after) and after[0].kind in ("thing", "unknown", "name")
    return food and named and any(t.kind == "substance" and t.text not in PAINTED for t in _run(reversed(before)))


SERVED = ("tea", "coffee", "wine", "milk", "beer", "water", "sake", "whisky", "egg", "butter", "bread", "cheese", "salt",
          "sugar", "sauce", "soup", "fruit", "cake", "cookie", "biscuit", "flower", "plant")  # fmt: skip
"""What vessels and furniture are for."""


def _serves(token: Token, ahead: list[Token]) -> bool:
    """Whether a word only says what the vessel that is named next is for."""
    held = token.kind == "substance" and (token.text in HELD or KNOWN[token.text][0].look in HELD)
    if held and ahead and ahead[0].text.split(" ")[-1] in VESSELS and KNOWN[token.text][0].look not in PLAITED:
        return True  # "a sand bucket"
    vessel = bool(ahead) and ahead[0].kind == "thing" and OBJECTS[ahead[0].text].made.split(" ")[-1] in KNOWN
    family = KNOWN[OBJECTS[ahead[0].text].made.split(" ")[-1]][0].family if vessel else ""
    return token.text in SERVED and family in ("ceramic", "metal", "plastic", "wood")


VESSELS = ("bucket", "pail", "bin", "jar", "can", "bottle", "tank", "scuttle", "shaker", "dispenser", "mill", "grinder", "jug",
           "tin", "drum", "barrel", "shovel", "cellar")  # fmt: skip
PLAITED = ("bark", "leaves", "grass", "seashell", "newspaper")
"""Things that are for what is named before them, and looks of what may be made of, too."""


def _shades(token: Token, after: list[Token]) -> bool:
    """Whether a name only says which shade of a colour is meant, whose stuff follows."""
    run = _run(after)
    hue = next((k for k, t in enumerate(run) if t.kind != "thing"), 0)
    plain = bool(run) and run[hue].kind == "color" and run[hue].text in COLORS
    stuff = any(t.kind == "substance" for t in run[hue + 1 :])
    coat = token.kind == "substance" and KNOWN[token.text][0].family == "paint"  # "powder coated mustard steel"
    return plain and stuff and not coat and (token.kind == "thing" or token.text not in GENERIC)


def _run(tokens: Iterable[Token]) -> list[Token]:
    """The tokens up to what ends a phrase."""
    return list(takewhile(lambda token: token.kind not in ("join", "comma", "half", "postfix"), tokens))


@cache
def _table() -> tuple[dict[str, Token], int]:
    """Every phrase that is known, and the most words that one has. Later entries win."""
    table: dict[str, Token] = {}

    def enter(kind: str, entries: Mapping[str, Any] | Iterable[str]) -> None:
        values = entries if isinstance(entries, Mapping) else dict.fromkeys(entries)
        table.update({text: Token(kind, text, value) for text, value in values.items()})

    enter("unknown", LOOK_OF)
    enter("substance", KNOWN)
    enter("thing", OBJECTS)
    enter("part", PARTS)
    enter("shape", SHAPES)
    other = {*KNOWN, *OBJECTS, *LIKENED}
    enter("color", [word for word in (*COLORS, *CHANGES, *LEANINGS) if word in COMMON or word not in other])
    enter("finish", {**FINISHES, **FINISHES_METAL, **FINISH_LOOKS})
    enter("weather", {**WEATHER, **FADED, **WET})
    enter("animal", ANIMALS)
    enter("dyed", DYED)
    enter("size", TIMES)
    enter("filler", FILLER)
    enter("degree", DEGREES)
    enter("denial", DENIALS)
    enter("join", {word: Join("and") for word in SPARED})
    enter("postfix", POSTFIX)
    enter("join", JOINS)
    enter("part", {f"{word} {place}": PARTS[place] for word in PLACED for place in PARTS} | {"on top of it": PARTS["top"]})
    enter("filler", [f"{word} {place}" for word in ("from the", "from its", "down from the") for place in PARTS])
    enter("part", {f"up to {the}{place}": Region("below", 0.45) for the in ("", "the ", "its ") for place in PARTS})
    enter("part", {f"up from {the}{place}": Region("below", 0.45) for the in ("", "the ", "its ") for place in PARTS})
    for side, strip in (("base", "below"), ("bottom", "below"), ("top", "above")):
        enter("part", {f"{word} {side}": Region(strip, 0.18) for word in ("along the", "along its")})
    aside = [place for place, region in PARTS.items() if region.kind == "sides"]
    for side in ("left", "right"):
        enter("part", {f"{side} {place}": Region(side, 0.5 * PARTS[place].share) for place in aside})
    enter("part", {"on one half": Region("right", 0.5), "on the other half": Region("left", 0.5)})
    enter("part", {"on one side": Region("right", 0.4), "on the other side": Region("left", 0.4)})
    enter("aside", ASIDE)
    enter("half", ("half", "half of it", "the other half", "other half", "one half", "one side", "the other side", "and half"))
    for known, *others in rows("spellings.tsv"):
        table |= {other: table[known] for other in words(others[0]) if other not in table}
    return table, max(len(text.split()) for text in table)
