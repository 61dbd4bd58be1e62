"""A prompt read as a recipe: its phrases as coats, what joins them as masks.

Words that a table knows mean what it says. Words that none knows are read by the prior's reader, which was trained on the
same tables and explains other words by a dictionary, and look like the substance whose name means most nearly the same. """

from dataclasses import replace

import numpy as np

from stages.material.recipe import Coat, Layer, Mask, Recipe
from stages.material.substances import LOOKS, METRES
from stages.prior.colors import CHANGES, COLORS, LEANINGS, named, rgb
from stages.prior.model import Prior
from stages.prior.names import FINISHES, FINISHES_METAL, SUBSTANCES, Substance
from stages.prior.objects import OBJECTS
from stages.prior.phrases import Phrase, split
from stages.prior.places import ANIMALS, FADED, WEATHER, WET, Region
from stages.prior.stuffs import FAMILY_LOOKS, GATHERS, LAYERED, LOOK_OF, STUFFS

BY_NAME = {name: substance for substance in reversed(SUBSTANCES) for name in substance.names}

COVERED = Region("patches", 0.75, 0.3, 0.6)
PARTLY = Region("patches", 0.35, 0.2, 0.7)
JOINED = {
    "cover": COVERED, "partly": PARTLY, "spots": Region("spots", 0.3, 0.14), "inlay": Region("bands", 0.16, 0.2),
    "edge": Region("edges", 0.1, 0.04, 0.1), "stripe": Region("stripes", 0.5, 0.14), "band": Region("bands", 0.3, 0.22),
    "with": PARTLY, "on": PARTLY, "above": Region("above", 0.5), "below": Region("below", 0.5),
}  # fmt: skip
"""Where a phrase lies that only its joining word tells."""

PEELED = Mask("chips", 0.35, 0.14, 0.9, invert=True)
"""What is left of a coat that peels."""


def read_prompt(prompt: str, prior: Prior, seed: int, metres: float | None = None) -> Recipe:
    """What the words of a prompt call for. Args: metres: longest edge of the object, where it is known."""
    return Reading(prior, metres).recipe(prompt, seed)


class Reading:
    """One reading of a prompt. Args: as `read_prompt`."""

    def __init__(self, prior: Prior, metres: float | None = None) -> None:
        self._prior, self._metres = prior, metres

    def recipe(self, prompt: str, seed: int) -> Recipe:
        """See `read_prompt`."""
        phrases = split(prompt)
        things = [OBJECTS[p.thing] for p in phrases if p.thing]
        if self._metres is None and things:
            self._metres = things[0].metres
        base, over = _ordered(phrases)
        coat, layers = self._coat(base), self._weather(base)
        if base.animal:
            ground, marks, region = ANIMALS[base.animal]
            coat = replace(coat, color=_triple(rgb(ground)))
            layers.insert(0, Layer(replace(coat, color=_triple(rgb(marks))), (region.mask(),)))
        for phrase in over:
            layers += self._layers(phrase, coat)
        return Recipe(coat, tuple(layers), seed)

    def _layers(self, phrase: Phrase, beneath: Coat) -> list[Layer]:
        """What a phrase lays over the base."""
        coat = self._coat(phrase, beneath)
        if phrase.join in ("peel", "over") and phrase.region is None:
            return [Layer(coat, (PEELED,), 2e-4)]
        gathers = GATHERS.get(phrase.substance)
        region = phrase.region or (gathers if gathers and phrase.join in ("with", "on", "cover") else None) or JOINED[phrase.join]
        if gathers and phrase.join == "cover" and phrase.region is None:
            region = gathers._replace(share=max(gathers.share, 0.65))
        thick = LAYERED.get(coat.look, 0.0)
        return [Layer(coat, (region.mask(),), thick), *self._weather(phrase, (region.mask(),))]

    def _coat(self, phrase: Phrase, beneath: Coat | None = None) -> Coat:
        """The substance of a phrase, with the colour and finish that it asks for."""
        made = OBJECTS[phrase.thing].made if phrase.thing else ""
        if phrase.substance:
            name = phrase.substance
        elif phrase.unknown:
            return self._unknown(phrase)
        elif made:
            inner = split(made)[0]
            inner.colors, inner.finish = phrase.colors or inner.colors, phrase.finish or inner.finish
            return self._coat(inner)
        elif beneath is not None:  # a colour alone: of the same stuff
            return replace(beneath, color=_color(phrase), said=_said(phrase))
        else:
            name = "paint" if phrase.colors else "stone"
        substance = _chosen(name, bool(phrase.colors))
        mean = np.array(_color(phrase)) if phrase.colors else np.mean([rgb(text) for text in substance.colors], 0)
        finish = _finish(phrase, substance)
        roughness = np.mean(finish or substance.roughness)
        for word in phrase.weather:
            roughness *= WET.get(word, 1.0)
        look = look_of(name, substance, phrase.finish)
        return self._sized(Coat(look, _faded(mean, phrase), float(roughness), substance.metallic, said=_said(phrase)))

    def _unknown(self, phrase: Phrase) -> Coat:
        """A phrase with words that no table knows: its means by the reader, its look by the nearest name."""
        reading = self._prior.read([" ".join(phrase.words)])
        *color, roughness, metallic = reading.coats[0, 0].tolist()
        name = self._nearest(" ".join(phrase.unknown), metallic > 0.5)
        if phrase.colors:
            color = list(_color(phrase))
        finish = _finish(phrase, BY_NAME[name])
        look = look_of(name, BY_NAME[name], phrase.finish)
        mean = _faded(np.array(color), phrase)
        return self._sized(Coat(look, mean, float(np.mean(finish)) if finish else roughness, float(metallic > 0.5), said=_said(phrase)))

    def _nearest(self, words: str, metal: bool) -> str:
        """The name of a substance, metal or not, whose words mean most nearly the same."""
        vocabulary = self._prior.vocabulary

        def meaning(text: str) -> np.ndarray:
            total = np.sum([vocabulary.vector(word) for word in vocabulary.read(text)], 0)
            return total / max(float(np.linalg.norm(total)), 1e-9)

        names = [name for name, substance in BY_NAME.items() if bool(substance.metallic) == metal]
        wanted = meaning(words)
        return max(names, key=lambda name: float(meaning(name) @ wanted))

    def _weather(self, phrase: Phrase, where: tuple[Mask, ...] = ()) -> list[Layer]:
        """What words of wear and weather lay over a phrase's coat."""
        layers = []
        for word in phrase.weather:
            if word not in WEATHER:
                continue
            weather = WEATHER[word]
            coat = self._stuff(weather.substance) if weather.substance else self._beneath(phrase)
            layers += [Layer(coat, (*where, region.mask()), weather.thickness, weather.strength) for region in weather.regions]
        return layers

    def _stuff(self, name: str) -> Coat:
        """Dust, dirt and their like."""
        look, color, roughness = STUFFS[name]
        return self._sized(Coat(look, _triple(rgb(color)), roughness, 0.0, said=name))

    def _beneath(self, phrase: Phrase) -> Coat:
        """What shows where a coat is worn through."""
        own = self._coat(phrase)
        family = BY_NAME[phrase.substance].family if phrase.substance in BY_NAME else ""
        if family == "paint":
            return self._coat(Phrase(substance="pine" if "wood" in phrase.substance else "steel", words=["bare"]))
        if family == "metal":
            return replace(own, roughness=max(0.12, (own.roughness or 0.3) * 0.55), said=f"bare {own.said}")
        color = None if own.color is None else _triple(np.array(own.color) + 0.35 * (1 - np.array(own.color)) * 0.6)
        return replace(own, color=color, roughness=min(1.0, (own.roughness or 0.5) + 0.15), said=f"worn {own.said}")

    def _sized(self, coat: Coat) -> Coat:
        return replace(coat, metres=self._metres or METRES[coat.look])


def _ordered(phrases: list[Phrase]) -> tuple[Phrase, list[Phrase]]:
    """The base, and what lies over it from below: "spots on tan", "paint peeling off wood" name the upper one first."""
    first, rest = phrases[0], phrases[1:]
    if rest and rest[0].join in ("on", "over", "peel") and rest[0].region is None:
        base = rest[0]
        over = replace(first, join=rest[0].join)
        return replace(base, thing=base.thing or first.thing), [over, *rest[1:]]
    if rest and rest[0].join in ("above", "below") and first.region and not rest[0].region:
        rest[0] = replace(rest[0], region=Region("below" if first.region.kind == "above" else "above", 0.5))
    if rest and first.thing and not (first.substance or first.colors or first.unknown) and rest[0].region is None and rest[0].substance:
        rest[0] = replace(rest[0], thing=first.thing, weather=first.weather + rest[0].weather)  # "a chair, oak"
        return rest[0], rest[1:]
    return first, rest


def look_of(name: str, substance: Substance, finish: list[str]) -> str:
    """The look of a substance by name: its own, under its finish where there is one for it, or that of its family."""
    own = LOOK_OF.get(name, name)
    for word in finish:
        if f"{word} {own}" in LOOKS:
            return f"{word} {own}"
    return own if own in LOOKS else FAMILY_LOOKS[substance.family]


def _chosen(name: str, colored: bool) -> Substance:
    """Of substances with a name, the one that takes colours where a colour is named."""
    found = [s for s in SUBSTANCES if name in s.names]
    return next((s for s in found if s.paintable == colored), found[0])


def _color(phrase: Phrase) -> tuple[float, float, float]:
    """sRGB of a phrase's colour words: the last names it, those before it change it; two colours are mixed."""
    base = [word for word in phrase.colors if word in COLORS]
    changes = [word for word in phrase.colors if word in CHANGES or word in LEANINGS]
    if not base:
        base, changes = ["grey"], changes
    colors = [named(" ".join([*changes, word]) if word in (base[-1],) else word) for word in base]
    return _triple(np.mean(colors, 0))


def _finish(phrase: Phrase, substance: Substance) -> tuple[float, float] | None:
    table = {**FINISHES, **FINISHES_METAL} if substance.metallic else {**FINISHES_METAL, **FINISHES}
    found = [table[word] for word in phrase.finish if word in table]
    return found[0] if found else None


def _faded(color: np.ndarray, phrase: Phrase) -> tuple[float, float, float]:
    keep = float(np.prod([FADED.get(word, 1.0) for word in phrase.weather]))
    return _triple(np.mean(color) + keep * (np.asarray(color) - np.mean(color)))


def _triple(color: np.ndarray) -> tuple[float, float, float]:
    red, green, blue = np.clip(color, 0, 1).tolist()
    return red, green, blue


def _said(phrase: Phrase) -> str:
    return " ".join([*phrase.finish, *phrase.colors, *phrase.unknown, phrase.substance or phrase.thing]).strip()


def explained(recipe: Recipe) -> list[tuple[str, str, str, str, str, str]]:
    """A recipe as rows for people: what, where, look, colour, roughness, metal."""
    rows = [_row(recipe.base, "everywhere")]
    rows += [_row(layer.coat, " and ".join(map(_place, layer.masks))) for layer in recipe.layers]
    return rows


def _row(coat: Coat, where: str) -> tuple[str, str, str, str, str, str]:
    color = "its own" if coat.color is None else "#" + "".join(f"{round(255 * c):02x}" for c in coat.color)
    rough = "its own" if coat.roughness is None else f"{coat.roughness:.2f}"
    return coat.said or coat.look, where, coat.look, color, rough, "metal" if coat.metallic else ""


def _place(mask: Mask) -> str:
    share = f"{mask.share:.0%}"
    names = {"below": f"lowest {share}", "above": f"highest {share}", "up": f"facing up, {share}", "edges": f"edges, {share}",
             "crevices": f"crevices, {share}", "hidden": f"inside, {share}"}  # fmt: skip
    return ("all but " if mask.invert else "") + names.get(mask.kind, f"{mask.kind}, {share}")
