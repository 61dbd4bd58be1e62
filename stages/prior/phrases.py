"""A phrase of a prompt: what is named, its colour and finish, its wear, and where it lies."""

from collections.abc import Container
from dataclasses import dataclass, field

from stages.prior.colors import COLORS
from stages.prior.lexicon import Join
from stages.prior.objects import OBJECTS
from stages.prior.places import Region
from stages.prior.stuffs import COATINGS, KNOWN

FIRST = Join("")
"""Before what nothing stands."""


@dataclass
class Phrase:
    """One run of words. join: how it and the phrase before lie.

    substance: a name of `KNOWN`. boards: sawn. colors: words that make up its colour, names of substances among them. finish:
    words. weather: of `WEATHER`, `FADED`, `WET`. unknown: words that no table knows. thing: of `OBJECTS`. animal: of `ANIMALS`.
    region: where it lies. where: the word that said so. placed: whether that word came last. shows: what is beneath, where
    it is said. much: factor of the share that it covers; amount: the same of each word of weather. part: the name of a part
    that no table knows. closed: whether what it is was said, "a statue of". headed:
    whether the thing was named after its stuff. within: the part that it lies on.
    palette: three colours and more, of which `colors` has the first. """

    join: Join = FIRST
    substance: str = ""
    boards: bool = False
    colors: list[str] = field(default_factory=list)
    finish: list[str] = field(default_factory=list)
    weather: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    size: list[str] = field(default_factory=list)
    thing: str = ""
    animal: str = ""
    region: Region | None = None
    where: str = ""
    placed: bool = False
    shows: "Phrase | None" = None
    much: float = 1.0
    amount: dict[str, float] = field(default_factory=dict)
    part: str = ""
    closed: bool = False
    headed: bool = False
    within: "Phrase | None" = None
    palette: list[list[str]] = field(default_factory=list)

    @property
    def says_what(self) -> bool:
        """Whether it names a stuff or a colour; "dark" alone is none."""
        return bool(self.substance or self.thing or self.animal or self.unknown or any(map(is_hue, self.colors)))

    @property
    def says_stuff(self) -> bool:
        """Whether it names what a thing is made of, or its colour."""
        return bool(self.substance or self.animal or self.unknown or any(map(is_hue, self.colors)))

    @property
    def color_only(self) -> bool:
        """Whether all it says of the stuff is its colour."""
        return any(map(is_hue, self.colors)) and not (self.substance or self.thing or self.animal or self.unknown)

    @property
    def coats(self) -> bool:
        """Whether it is a thin coat on something, such as paint."""
        coating = self.substance in COATINGS or self.substance.startswith("gilded ")
        return bool(self.substance) and (family(self.substance) == "paint" or coating)

    @property
    def metal(self) -> bool:
        """Whether its substance is one."""
        return bool(self.substance) and family(self.substance) == "metal"

    @property
    def empty(self) -> bool:
        """Whether it says nothing at all."""
        return not (self.says_what or self.region or self.finish or self.weather or self.size or self.colors)

    def amount_of(self, words: Container[str]) -> bool:
        """Whether it is said how much there is of one of some weathers: "slightly charred"."""
        return any(word in words and much != 1 for word, much in self.amount.items())

    def of_kind(self, kind: str) -> list[str]:
        """The words of a kind of token."""
        kinds = {"color": self.colors, "finish": self.finish, "weather": self.weather, "unknown": self.unknown}
        return kinds.get(kind, self.size)


def is_hue(word: str) -> bool:
    """Whether a word of colour is a colour of itself, not a change of one."""
    return word in COLORS or word in KNOWN or word.startswith("#")


LIVING = ("fur", "feathers", "leaves", "scales", "skin", "velvet", "tomato skin")
"""Looks of beasts and plants."""


def lives(thing: str) -> bool:
    """Whether a thing is a beast or a plant, by the last word of what it is made of."""
    made = OBJECTS[thing].made.split(" with ")[0].split(" ")[-1]
    return made in KNOWN and KNOWN[made][0].look in LIVING


def family(name: str) -> str:
    """The family of a substance."""
    return KNOWN[name][0].family
