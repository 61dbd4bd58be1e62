"""Words that say where something lies: parts of things, patterns, and what wear and weather do (places.tsv, weather.tsv,
animals.tsv)."""

from typing import NamedTuple

from stages.material.recipe import Mask
from stages.prior.objects import rows, words


class Region(NamedTuple):
    """kind, share, size, wear, soft: of a mask. Parts end where they end; weather does not, and powders and stains thin out."""

    kind: str
    share: float
    size: float = 0.05
    wear: float = 0.0
    soft: float = 0.0

    def mask(self, said: str = "") -> Mask:
        return Mask(self.kind, self.share, self.size, self.wear, said=said, soft=self.soft)


def _region(kind: str, *numbers: str) -> Region:
    """Of a table's columns, of which those that are empty are as usual."""
    given = {name: float(text) for name, text in zip(Region._fields[1:], numbers, strict=True) if text}
    return Region(kind, **given)


def _places(wanted: str) -> dict[str, Region]:
    """The words of places.tsv of one sort."""
    found = ((names, row) for sort, *row, names in rows("places.tsv") if sort == wanted)
    return {word: _region(*row) for names, row in found for word in words(names)}


PARTS = _places("part")
"""Parts of things that name a region."""

CLOTHES = frozenset([
    "shirt", "tunic", "vest", "jacket", "sweater", "robe", "trousers", "pants", "jeans", "shorts", "skirt", "coat", "waistcoat",
    "hoodie", "jumper", "cardigan", "blouse", "dress", "gown", "kimono", "apron", "overalls", "dungarees", "uniform", "cloak",
    "cape", "robes", "jumpsuit", "scarf", "neckerchief", "bandana",
])  # fmt: skip
"""Parts of who wears them; of cloth, but on what is cast, carved or painted."""

PERSONS = frozenset(words(
    "wizard, pirate, warrior, soldier, ranger, rogue, peasant, villager, farmer, hunter, archer, cowboy, sheriff, monk, "
    "blacksmith, merchant, witch, ninja, vampire, priest, nun, mage, sorcerer, sorceress, warlock, necromancer, assassin, "
    "businessman, butler, king, queen, prince, princess, clown, jester, jedi, elf, fairy, santa claus, sailor, postman"
))  # fmt: skip
"""Those of whom skin shows beside the clothes that words give them."""

HEADED = PERSONS | frozenset(words(
    "knight, astronaut, cosmonaut, spacesuit, space suit, robot, android, cyborg, gnome, garden gnome, snowman, skeleton, "
    "zombie, alien, orc, goblin, troll, dwarf, doll, action figure, man, woman, boy, girl, barbarian, paladin, crusader, mech"
))  # fmt: skip
"""Those that have a head on top, on which a beard or a visor is."""

WORN = CLOTHES | frozenset([
    "chest", "armour", "armor", "breastplate", "boots", "shoes", "sneakers", "sandals", "panel", "panels",
])  # fmt: skip
"""Parts that are things of their own unless another thing has them: "an orc with brown boots"."""


def _of_things() -> dict[str, dict[str, Region]]:
    """The rows of parts_of.tsv: thing → part → where it lies."""
    found: dict[str, dict[str, Region]] = {}
    for things, *row, parts in rows("parts_of.tsv"):
        for thing in words(things):
            found.setdefault(thing, {}).update(dict.fromkeys(words(parts), _region(*row)))
    return found


PARTS_OF = _of_things()
"""Things whose parts lie elsewhere than those of others."""

def parts_of(thing: str) -> dict[str, Region]:
    """Where parts lie on a thing that has them elsewhere than others: on a side table as on tables."""
    return {**PARTS_OF.get(thing.split(" ")[-1], {}), **PARTS_OF.get(thing, {})}


MADE = {(part, on): stuff for stuff, on, _, parts in rows("parts_made.tsv") for part in words(parts)}
"""What parts are made of, by their name and what they are on: "soft", "hard" or anything."""

GROWN = {
    **dict.fromkeys(("teeth", "fangs", "tusks", "tusk", "tooth"), Region("front", 0.12)),
    **dict.fromkeys(("horn", "horns", "antler", "antlers"), PARTS["horns"]),
    **dict.fromkeys(("claws", "claw", "talons", "hoof", "hooves"), Region("below", 0.15)),
}  # fmt: skip
"""Stuffs that are parts of beasts, and where these are."""

OWN = {
    part: (stuff, [own] if own != "own" else [])
    for stuff, _, own, parts in rows("parts_made.tsv") if own for part in words(parts)
}  # fmt: skip
"""Parts that are of the same stuff on all things, and its colours where none is said."""

SHAPES = _places("shape")
"""Patterns in which one thing lies on another."""

ANIMALS = {
    name: (ground, marks, _region(*row))
    for names, ground, marks, *row in rows("animals.tsv") for name in words(names)
}  # fmt: skip
"""Coats that everybody knows: ground, marks of one colour or of several, and how these lie."""

GATHERS = _places("gathers")
"""What gathers of itself, and where it does when nobody says."""

ONCE = {**dict.fromkeys(("ice cream", "strawberry ice cream", "chocolate ice cream", "mint ice cream"), "icing"),
        **dict.fromkeys(("fungus", "fungi", "toadstools", "bracket fungus"), "mushrooms"),
        "lichens": "lichen", "vine": "ivy", "hedge": "ivy", "creepers": "ivy", "creeper": "ivy", "soil": "dirt",
        "earth": "dirt", "dried mud": "mud", "cracked mud": "mud", "dried blood": "blood", "powdered sugar": "icing sugar",
        "hard water stains": "limescale", "calcium deposits": "limescale", "droppings": "bird droppings",
        "guano": "bird droppings",
        "green patina": "verdigris", "copper patina": "verdigris", "oxidized copper": "verdigris"}
"""Other names of what gathers."""

def gathering(name: str) -> str:
    """What of `GATHERS` a substance is: of "fresh snow" it is snow; "" where it is none."""
    known = ONCE.get(name, name)
    return next((word for word in (known, known.split(" ")[-1]) if word in GATHERS), "")


LAYERED = {"moss": 3e-3, "snow": 8e-3, "rust": 2e-4, "grass": 5e-3}
"""Looks that stand proud of what is beneath, metres."""


class Weather(NamedTuple):
    """What a word of wear or weather lays over a thing. stuff: its name, "" where what is beneath shows. region: where.
    thickness: metres. strength: most that it covers. """

    stuff: str
    region: Region
    thickness: float = 0.0
    strength: float = 1.0


WEATHER = {
    word: Weather(stuff, _region(*row), float(thickness or 0), float(strength or 1))
    for stuff, *row, thickness, strength, told in rows("weather.tsv") for word in words(told)
}  # fmt: skip
"""Words of wear and weather, from below: what lies lowest first."""

CORRODES = {
    **dict.fromkeys(("copper", "brass", "bronze"), "verdigris"), **dict.fromkeys(("iron", "steel"), "rust"),
    **dict.fromkeys(("silver", "gold", "aluminium", "chrome", "lead", "titanium", "foil"), "tarnish"),
}  # fmt: skip
"""The last word of a metal's look → what air makes of it."""

SHOWS = frozenset(word for word, weather in WEATHER.items() if not weather.stuff)
"""Those that let show what is beneath."""

PEELS = frozenset(["peeling", "flaking", "flaky", "flaked", "peeled", "chipped"])
"""Those that leave only parts of a coat."""

FADED = {"weathered": 0.85, "aged": 0.9, "old": 0.95, "faded": 0.7, "bleached": 0.6, "sun-bleached": 0.6, "vintage": 0.92}
"""Words that take colour out: factor of the saturation."""

WET = {"wet": 0.35, "damp": 0.6, "oily": 0.45, "slimy": 0.35}
"""Words of wetness: factor of the roughness."""

SOAKED, POROUS, SOAK = frozenset(["wet", "damp"]), 0.6, 0.72
"""Words of water, the roughness from which on a stuff drinks it, and how much darker it is then."""

BAND = 0.08
"""Share of the extent of a single band."""

DETAILS = Region("details", 0.1, 0.04, 0.1)
"""Where a part lies that no table knows."""

SHELLED = frozenset(["ladybird", "ladybug", "tortoiseshell"])
"""Animals of `ANIMALS` that have no fur."""

PRINTED = frozenset(name for name in ANIMALS if name.endswith(("camouflage", "camo")))
"""Those that are printed on cloth."""

COVERED = Region("patches", 0.75, 0.3, 0.6)
PARTLY = Region("patches", 0.35, 0.2, 0.7)
FADE = Region("fade", 0.5, 0.6)
JOINED = {
    "cover": COVERED, "partly": PARTLY, "spots": Region("spots", 0.3, 0.14), "inlay": SHAPES["inlay"], "edge": PARTS["trim"],
    "stripe": SHAPES["stripes"], "band": SHAPES["bands"], "with": PARTLY, "and": PARTLY, "comma": PARTLY, "on": PARTLY,
    "of": PARTLY,
    "over": COVERED, "above": Region("above", 0.5), "below": Region("below", 0.5), "check": SHAPES["checks"],
    "patch": SHAPES["patches"],
    "streak": SHAPES["streaks"], "vein": SHAPES["veins"], "cap": Region("up", 0.4, 0.12, 0.4), "rim": PARTS["rim"],
    "tip": PARTS["tip"], "sole": PARTS["sole"], "handle": PARTS["handle"], "line": PARTS["lining"], "stud": SHAPES["studs"],
    "all": Region("all", 1.0), "top": PARTS["lid"], "fade": FADE, "half": Region("right", 0.5),
    "swirl": Region("patches", 0.45, 0.25, 0.3),
    **{part: PARTS[part] for part in ("head", "wings", "eyes", "blade", "lid", "neck", "belly", "back", "feet", "roof", "front",
                                      "tail", "beak", "hair", "horns", "sleeves", "base")},
    "dip": Region("below", 0.5, wear=0.2), "except": PARTS["body"], "crevices": PARTS["crevices"],
    "ends": Region("sides", 0.15), "stuck": Region("below", 0.3), "toe": PARTS["toe"],
    "shell": PARTS["carapace"], "bottom": PARTS["base"], "legs": PARTS["legs"], "seat": PARTS["seat"],
    "paint": Region("all", 1.0),
}  # fmt: skip
"""Where a phrase lies that only its joining word tells."""

PEELED, WHOLE = Mask("chips", 0.35, 0.14, 0.9, invert=True), Mask("chips", 0.06, 0.1, 0.9, invert=True)
"""What is left of a coat that peels, and of one that is nearly whole."""
