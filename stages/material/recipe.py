"""What a thing is made of, as a procedure: a base and layers over it, each a substance and a mask that says where it lies.
Parts of the thing may have recipes of their own.

A recipe is plain data, so that it can be printed, stored in material.npz and edited. It has no resolution and knows no mesh.
What follows a mesh (the lowest tenth, a fifth of the edges) is settled by `masks.settled` once the surface is known. """

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

KINDS = (
    "all", "below", "above", "middle", "front", "back", "left", "right", "sides", "badge", "fade",
    "edges", "details", "crevices", "up", "down", "hidden",
    "spots", "dots", "flowers", "stripes", "bands", "zigzag", "checks", "gingham", "veins",
    "patches", "streaks", "scratches", "chips", "pieces", "along", "level",
)  # fmt: skip
"""Ways to say where a layer lies; see `masks.py`."""

SURVEYED = ("edges", "details", "crevices", "hidden", "chips")
"""Those of them that ask for what a survey knows."""


@dataclass(frozen=True)
class Coat:
    """A substance as a recipe has it.

    look: its name in `substances.LOOKS`. color: sRGB mean that its dyed share is turned to, or None for its own. roughness,
    metallic: means that it is turned to, or None. contrast: of its colours about their mean. metres: how long the object's
    longest edge counts, for the size of its structure. relief: of its heights. """

    look: str
    color: tuple[float, float, float] | None = None
    roughness: float | None = None
    metallic: float | None = None
    contrast: float = 1.0
    metres: float = 1.0
    relief: float = 1.0
    said: str = ""


@dataclass(frozen=True)
class Mask:
    """Where a layer lies. kind: one of `KINDS`. share: of the surface, or of the extent for heights and sides. size: of its
    shapes or of its border's noise, as a share of the object. wear: 0 a border as sharp as paint … 1 a ragged one. invert:
    everywhere else. level: threshold of what the mask is made of, once settled; None before. said: the word that asked for
    it, for people. pieces: rows of the survey's, of kind "pieces"; axis: a direction, of kind "along", and the centre of a
    kind that has one. soft: how far it thins
    out at its border, in units of what it follows; chance has deviation 1. draw: masks of one draw share their chance, as a
    paint's chips and its primer's do; −1: its own. """

    kind: str = "all"
    share: float = 0.3
    size: float = 0.08
    wear: float = 0.5
    invert: bool = False
    level: float | None = None
    said: str = ""
    pieces: tuple[int, ...] = ()
    axis: tuple[float, ...] = ()
    soft: float = 0.0
    draw: int = -1


@dataclass(frozen=True)
class Layer:
    """A coat over what is beneath. masks: it lies where all of them say so. thickness: metres, negative where it is sunk.
    strength: most that it covers, 1 for what hides all beneath it.
    """

    coat: Coat
    masks: tuple[Mask, ...] = (Mask(),)
    thickness: float = 0.0
    strength: float = 1.0


@dataclass(frozen=True)
class Recipe:
    """Base and layers, from below. seed: of everything left to chance; it changes patterns, not stuff. parts: what has another
    recipe, with borders as sharp as the mesh's own; none shares a label with another."""

    base: Coat
    layers: tuple[Layer, ...] = field(default=())
    seed: int = 0
    parts: tuple["Part", ...] = field(default=())

    def to_json(self) -> dict[str, Any]:
        """As JSON types."""
        return asdict(self)

    @staticmethod
    def from_json(data: dict[str, Any]) -> "Recipe":
        """Of what `to_json` gave. Raises: KeyError, TypeError where it is something else."""
        layers = tuple(
            Layer(_coat(raw["coat"]), tuple(map(_mask, raw["masks"])), raw["thickness"], raw["strength"])
            for raw in data["layers"]
        )
        return Recipe(_coat(data["base"]), layers, data["seed"], tuple(map(_part, data["parts"])))

    @property
    def has_relief(self) -> bool:
        """Whether any of it stands out or is sunk."""
        return any(coat.relief and coat.look != EVEN.base.look for coat in self.coats)

    @property
    def follows_surface(self) -> bool:
        """Whether any mask asks for edges, creases or what is hidden."""
        own = any(mask.kind in SURVEYED for layer in self.layers for mask in layer.masks)
        return own or any(part.recipe.follows_surface for part in self.parts)

    @property
    def coats(self) -> tuple[Coat, ...]:
        """The base's and each layer's, then those of the parts."""
        own = (self.base, *(layer.coat for layer in self.layers))
        return own + tuple(coat for part in self.parts for coat in part.recipe.coats)

    def with_coats(self, coats: Sequence[Coat]) -> "Recipe":
        """The same with other coats, in the order of `coats`."""
        base, *rest = coats
        layers = tuple(replace(layer, coat=rest.pop(0)) for layer in self.layers)
        parts = []
        for part in self.parts:
            own, rest = rest[: len(part.recipe.coats)], rest[len(part.recipe.coats) :]
            parts.append(replace(part, recipe=part.recipe.with_coats(own)))
        return replace(self, base=base, layers=layers, parts=tuple(parts))


@dataclass(frozen=True)
class Part:
    """A part of a thing. name: what it was called by. prompt: its words. labels: of its surface, see `Surface.label`; none
    before any mesh is known. recipe: without parts."""

    name: str
    prompt: str
    labels: tuple[int, ...]
    recipe: Recipe


def _mask(data: dict[str, Any]) -> Mask:
    return Mask(**{**data, **{name: tuple(data.get(name, ())) for name in ("pieces", "axis")}})


def _part(data: dict[str, Any]) -> Part:
    return Part(data["name"], data["prompt"], tuple(data["labels"]), Recipe.from_json(data["recipe"]))


def _coat(data: dict[str, Any]) -> Coat:
    color = data["color"]
    return Coat(**{**data, "color": None if color is None else (color[0], color[1], color[2])})


EVEN = Recipe(Coat("even"))
"""The same everywhere: where no words are read, all is learnt."""
