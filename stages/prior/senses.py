"""Which of its senses a word has beside its neighbours: a colour or a thing, a stuff or what a thing is for."""

from collections.abc import Iterable
from itertools import takewhile

from stages.prior.colors import CHANGES, COLORS, COMMON, LEANINGS
from stages.prior.lexicon import PAINTED, Token, longest_known
from stages.prior.objects import OBJECTS
from stages.prior.places import PARTS, SHAPES, WEATHER, WORN, Region, parts_of
from stages.prior.stuffs import FINISH_LOOKS, GENERIC, KNOWN


def resolved(found: list[Token]) -> list[Token]:
    """Words that are both a colour and a thing or a substance are colours where another says what has it."""
    result: list[Token] = []
    for number, token in enumerate(found):
        if _depicts(token, result):
            while result[-1].kind != "thing" or any(t.kind == "thing" for t in result[:-1]):
                result.pop()
            hues = [word for word in result.pop().text.split(" ") if word in COMMON]  # "a knight on horseback statue"
            result += [Token("color", word) for word in hues]  # "a black cat statue"
        ahead = run_of(found[number + 1 :])
        if token.text == "stained" and result and _stained(result[-1], found[number + 1 :]):
            result[-1] = result[-1]._replace(kind="color", value=None)
            continue  # "dark stained pine"
        if _only_tells_how(token, result, ahead):
            continue
        if token.text in METALLIC and any(t.kind == "substance" and KNOWN[t.text][0].look in HAIRY for t in ahead[:2]):
            token = token._replace(kind="color", text=METALLIC[token.text], value=None)  # "golden fur"
        behind = run_of(reversed(result))
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
        if token.text == "frosted" and ahead and ahead[0].kind == "thing" and _of_growth(ahead[0]):
            token = Token("weather", "frosty", WEATHER["frosty"])  # "a frosted pine cone"
        if token.text == "stained" and token.kind == "postfix" and not result:
            token = Token("weather", "stained", WEATHER["stained"])  # "a stained wooden board"
        if token.kind == "thing" and result and result[-1].kind == "thing" and _furs(token, result[-1]):
            result[-1:] = hues_of(result[-1].text)  # "a snow leopard fur coat"
        pelt = bool(ahead) and ahead[0].text == "rug"  # "a polar bear rug"
        haired = token.kind == "thing" and ahead and (pelt or (result and ahead[0].text in HAIR))
        if haired and OBJECTS[token.text].made.split(" with ")[0].endswith("fur"):
            result += hues_of(token.text)
            if ahead[0].kind == "part" or pelt:
                name = "fur" if pelt else "bristles"
                found[number + 1] = Token("substance", name, KNOWN[name])
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


OUTSIDES = ("flesh", "skin", "hide", "rind", "crust", "shell", "peel", "husk", "horn", "bell", "rose", "spine")
"""Names of stuffs that are parts of things, too."""


def _depicts(token: Token, before: list[Token]) -> bool:
    """Whether a thing is an image of all that was named before."""
    if token.kind != "thing" or token.article or token.text.split(" ")[-1] not in IMAGES:
        return False
    at = next((k for k, t in enumerate(before) if t.kind == "thing"), len(before))
    named = (t.kind in ("thing", "unknown") or t.text in ("on", "with", "and", "of") for t in before[at:])
    return at < len(before) and all(named)


YOUNG = ("puppy", "pup", "kitten", "cub", "foal", "calf", "lamb", "chick")
"""Beasts that are of the kind that is named before them."""


def _of_growth(token: Token) -> bool:
    """Whether a thing is of what grows, on which frost is ice."""
    made = OBJECTS[token.text].made.split(" with ")[0].split(" ")[-1]
    return made in KNOWN and KNOWN[made][0].family in ("wood", "organic", "stone") and KNOWN[made][0].look not in FOODS


def _furs(worn: Token, beast: Token) -> bool:
    """Whether what is worn is of the fur of a beast."""
    return "fur" in worn.text.split(" ") and OBJECTS[beast.text].made.split(" with ")[0].endswith("fur")


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
        return any(t.text.startswith("thatch") for t in (*run_of(reversed(before)), *ahead))  # "thatched straw"
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
    opened = whole[0].article == "a" or len(before) < LONE
    return opened and all(t.kind in ("color", "finish", "weather", "size", "substance") for t in before)


LONE = 2
"""Words before a ring from which on an article tells that it is a thing."""


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

HELD = FOODS | {"hay", "toxic waste", "nuclear waste", "slime", "fuel", "petrol", "gasoline",
                "grass", "sand", "fine sand", "soil", "coal", "charcoal", "snow", "ice", "ash", "dust", "gravel", "leaves",
                "bark", "newspaper", "oil", "seashell", "jam", "ink", "water", "coffee beans", "acid", "rice", "red wine",
                "sugar", "peanut butter", "marmalade", "soy sauce", "mayonnaise", "yogurt", "engine oil",
                "motor oil"}  # fmt: skip
"""Looks of what things of other stuffs are for: "a plastic lawn chair", "a steel oil drum"."""


def _holds(token: Token, before: list[Token], after: list[Token]) -> bool:
    """Whether a name only says what a thing is for, whose own stuff stands before: "enamel bread bin"."""
    food = token.kind == "substance" and (KNOWN[token.text][0].look in HELD or token.text in HELD)
    named = bool(after) and after[0].kind in ("thing", "unknown", "name")
    return food and named and any(t.kind == "substance" and t.text not in PAINTED for t in run_of(reversed(before)))


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
           "tin", "drum", "barrel", "shovel", "cellar", "boots", "boot", "cart", "wagon")  # fmt: skip
PLAITED = ("bark", "leaves", "grass", "seashell", "newspaper")
"""Things that are for what is named before them, and looks of what may be made of, too."""


def _shades(token: Token, after: list[Token]) -> bool:
    """Whether a name only says which shade of a colour is meant, whose stuff follows."""
    run = run_of(after)
    hue = next((k for k, t in enumerate(run) if t.kind != "thing"), 0)
    plain = bool(run) and run[hue].kind == "color" and run[hue].text in COLORS
    stuff = any(t.kind == "substance" for t in run[hue + 1 :])
    coat = token.kind == "substance" and KNOWN[token.text][0].family == "paint"  # "powder coated mustard steel"
    return plain and stuff and not coat and (token.kind == "thing" or token.text not in GENERIC)


def run_of(tokens: Iterable[Token]) -> list[Token]:
    """The tokens up to what ends a phrase."""
    return list(takewhile(lambda token: token.kind not in ("join", "comma", "half", "postfix"), tokens))


def hues_of(thing: str) -> list[Token]:
    """The colour that everybody knows of a thing, as tokens: "the colour of a carrot"."""
    if thing in COLORS:
        return [Token("color", thing)]
    made = OBJECTS[thing].made.split(" with ")[0]
    token, _ = longest_known(made.split(" "), 0)
    if token and token.kind == "substance":
        return [Token("color", token.text)]
    hues = [Token("color", word) for word in made.split(" ") if word in COLORS or word in CHANGES or word in LEANINGS]
    stuff, _ = longest_known(made.split(" ")[-1:], 0)
    return hues or ([Token("color", stuff.text)] if stuff and stuff.kind == "substance" else [])
