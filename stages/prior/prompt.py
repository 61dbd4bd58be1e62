"""A prompt read as a recipe: its phrases as coats, what joins them as masks.

Words that a table knows mean what it says. Words that none knows are read by the prior's reader, which was trained on the
same tables and explains other words by a dictionary, and look like the substance whose name means most nearly the same. """

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from stages.material.evaluate import means
from stages.material.library import Library
from stages.material.recipe import Coat, Layer, Mask, Part, Recipe
from stages.material.substances import LOOKS, METRES
from stages.prior.colors import COLORS, TREATMENTS, rgb
from stages.prior.grammar import split
from stages.prior.implied import BURNT
from stages.prior.motifs import coat_of
from stages.prior.names import FINISHES_METAL
from stages.prior.objects import OBJECTS
from stages.prior.order import in_its_places, ordered
from stages.prior.phrases import Phrase, is_hue, lives
from stages.prior.places import (
    ANIMALS,
    CORRODES,
    DETAILS,
    FADE,
    FADED,
    JOINED,
    LAYERED,
    PEELED,
    PEELS,
    POROUS,
    PRINTED,
    SHAPES,
    SHELLED,
    SHOWS,
    SOAK,
    SOAKED,
    WEATHER,
    WET,
    WHOLE,
    Region,
    gathering,
)  # fmt: skip
from stages.prior.primer import primed
from stages.prior.regions import BESIDE, place_of, scaled, strands
from stages.prior.shades import (
    GAUDY,
    color_of,
    corroded,
    described,
    drawn_on,
    encoded,
    faded,
    family_of,
    family_of_look,
    gaudy,
    greenish,
    kin,
    painted,
    roughness_of,
    said_of,
    stuff_of_part,
    triple,
    weathers_of,
    worn,
)
from stages.prior.sizes import LEAST, MOST, TIMES, measured
from stages.prior.stuffs import FINISH_LOOKS, GENERIC, KNOWN, LOOK_OF, Stuff, boards_of, look_of, stuff
from stages.prior.vocabulary import Vocabulary

if TYPE_CHECKING:
    from torch import Tensor


ALIKE = 0.55
"""Least cosine of two meanings for an unknown word to be taken for a substance at all."""

STAIN = re.compile("stain|splat|spat|splash|smear")
"""Words of wear that leave most of a part as it is."""

UNSAID = "plaster"
"""What a thing is taken to be made of where neither words nor tables say."""


class Words(Protocol):
    """What knows words: a `Prior`, or `ShippedWords`."""

    @property
    def vocabulary(self) -> Vocabulary: ...

    def read(self, prompts: list[str]) -> "Tensor":
        """Mean sRGB albedo, roughness and metallic of B prompts, (B, 5)."""


def read_prompt(prompt: str, prior: Words, seed: int, metres: float | None = None, library: Library | None = None) -> Recipe:
    """What the words of a prompt call for.

    Args:
        metres: longest edge of the object, where it is known. library: scanned materials, which are preferred. """
    return Reading(prior, metres, library=library).recipe(prompt, seed)


def read_parts(
    parts: Sequence[tuple[str, str]], whole: Recipe, prior: Words, seed: int, library: Library | None = None
) -> tuple[Part, ...]:
    """What the words of parts call for, on a thing as large as its own recipe says. Args: parts: name and prompt of each."""
    return tuple(Part(name, text, (), read_prompt(text, prior, seed, whole.base.metres, library)) for name, text in parts)


class Reading:
    """One reading of a prompt. Args: as `read_prompt`; looks: names of those that there are."""

    def __init__(
        self, prior: Words, metres: float | None = None, looks: Collection[str] = LOOKS, library: Library | None = None
    ) -> None:
        self._prior, self._metres, self._looks, self._library = prior, metres, looks, library

    def recipe(self, prompt: str, seed: int) -> Recipe:
        """See `read_prompt`."""
        rest, said = measured(prompt)
        phrases = self._phrases(rest)
        self._metres = self._metres or said or _usual_size(phrases)
        base, over = ordered(phrases)
        layers = self._base_layers(base, {phrase.region for phrase in over})
        coat = layers.pop(0).coat
        usual = len(layers)
        for phrase in over:
            layers += self._over(phrase, _ground(phrase, layers[usual:]) or coat, base)
        return Recipe(coat, tuple(primed(coat, _once(layers))), seed)

    def _phrases(self, prompt: str) -> list[Phrase]:
        """The phrases of a prompt: of the words that tables know, or where there are none, of all that may mean a material."""
        vocabulary = self._prior.vocabulary
        phrases = split(prompt, vocabulary.explained, self._speaks, vocabulary.index)
        if any(phrase.says_what or phrase.weather for phrase in phrases):
            return phrases
        return split(prompt, vocabulary.explained, self._means_material, vocabulary.index)

    def _base_layers(self, base: Phrase, said: Collection[Region | None] = ()) -> list[Layer]:
        """The base's coat, as a layer, and what lies on it of itself: its weather, an animal's marks, a thing's own parts but
        for those of which words say what they are. Args: said: regions of which words speak."""
        made = split(OBJECTS[base.thing].made) if base.thing and not (base.substance or base.unknown or base.animal) else []
        if len(made) > 1 and base.colors in ([], made[0].colors):
            inner, over = in_its_places(*ordered(made), base.thing)
            inner = replace(inner, weather=[*inner.weather, *base.weather], finish=base.finish or inner.finish)
            coat = replace(self._coat(inner), said=f"{base.thing}: {said_of(inner)}")
            patterned = any(region and region.kind in PATTERNS for region in said)
            usual = [p for p in over if p.region not in said and not (patterned and p.where in SHAPES)]
            parts = [layer for part in usual for layer in self._over(part, coat, inner)]
            return [Layer(coat), *parts, *self._weather(inner)]
        coat = self._coat(base)
        if base.animal in PRINTED and not base.finish and (coat.roughness or 0.0) < MATT:
            coat = replace(coat, roughness=MATT)
        if base.animal and (coat.metallic or 0.0) > 0.5:
            coat = replace(self._of(stuff("paint", False), base), roughness=coat.roughness)  # marks are painted on metal
        layers = [Layer(coat)]
        if base.animal:
            ground, marks, region = ANIMALS[base.animal]
            if not base.colors:
                layers = [Layer(replace(coat, color=triple(rgb(ground))))]
            for k, mark in enumerate(marks.split()):
                marked = replace(coat, color=triple(rgb(mark)), said=f"{base.animal} marks")
                layers.append(Layer(marked, (scaled(region, 0.7**k).mask(base.animal),)))
        return [*layers, *self._weather(base)]

    def _over(self, phrase: Phrase, beneath: Coat, base: Phrase) -> list[Layer]:
        """What a phrase lays over the base."""
        if phrase.join.kind == "except" and phrase.region and not phrase.says_what:
            kept = self._coat(base.shows) if base.shows else beneath
            return [Layer(kept, (phrase.region.mask(phrase.where),))]
        if not phrase.says_what:
            return self._more(phrase, beneath, base)
        coat = self._coat(phrase, beneath)
        peels = [word for word in phrase.weather if word in PEELS]
        if phrase.region is None and (phrase.join.kind == "peel" or (peels and phrase.join.kind in BESIDE)):
            rest = replace(phrase, weather=[word for word in phrase.weather if word not in PEELS])
            return [Layer(coat, (PEELED,), 2e-4), *self._weather(rest, (PEELED,), beneath)]
        if phrase.region is None and phrase.join.kind in ("on", "over") and phrase.coats:
            return [Layer(coat, (WHOLE,), 2e-4), *self._weather(phrase, (), beneath)]
        if phrase.region is None and phrase.coats and phrase.join.kind in BESIDE and SHOWS & set(phrase.weather):
            return [Layer(coat, (WHOLE,), 2e-4), *self._weather(phrase, (WHOLE,), beneath)]  # "with scratched red paint"
        if phrase.animal:
            _, marks, region = ANIMALS[phrase.animal]
            mark = color_of(phrase) if phrase.colors else triple(rgb(marks.split()[0]))
            marked = replace(beneath, color=mark, said=said_of(phrase))
            on_part = bool(phrase.where or phrase.part) and phrase.where not in SHAPES
            if phrase.region and on_part:  # "a rifle with a camouflage stock"
                return self._printed(phrase, beneath)
            return [Layer(marked, (region.mask(phrase.animal),))]
        mask = place_of(phrase).mask(phrase.where or phrase.part)
        if phrase.within and phrase.within.region:
            part = phrase.within.region.mask(phrase.within.where)
            whole = phrase.join.kind == "cover" and not gathering(phrase.substance)
            masks = (part,) if whole and not (strands(phrase) or phrase.where in SHAPES) else (part, mask)
            return [Layer(coat, masks, LAYERED.get(coat.look, 0.0)), *self._weather(phrase, masks, beneath)]
        if phrase.join.kind == "fade":
            aside = bool(phrase.region) and mask.kind in ("front", "back", "left", "right")
            faded = replace(mask, size=FADE.size, wear=1.0) if aside else FADE.mask(phrase.where)
            mask = replace(faded, invert=bool(phrase.region) and mask.kind == "below")
        return [Layer(coat, (mask,), LAYERED.get(coat.look, 0.0)), *self._weather(phrase, (mask,), beneath)]

    def _printed(self, phrase: Phrase, beneath: Coat) -> list[Layer]:
        """An animal's coat, or camouflage, on a part."""
        ground, marks, region = ANIMALS[phrase.animal]
        assert phrase.region
        place = phrase.region.mask(phrase.where)
        coat = self._of(stuff(phrase.substance, False), phrase) if phrase.substance else beneath
        coat = self._of(stuff("paint", False), phrase) if (coat.metallic or 0.0) > 0.5 else coat
        color = color_of(phrase) if phrase.colors else triple(rgb(ground))
        layers = [Layer(replace(coat, color=color, said=said_of(phrase)), (place,))]
        for k, mark in enumerate(marks.split()):
            marked = replace(coat, color=triple(rgb(mark)), said=f"{phrase.animal} marks")
            layers.append(Layer(marked, (place, scaled(region, 0.7**k).mask(phrase.animal))))
        return layers

    def _more(self, phrase: Phrase, beneath: Coat, base: Phrase) -> list[Layer]:
        """A part of which only finish or wear is said: "polished edges", "dirty cracks"."""
        where = (phrase.region or (DETAILS if phrase.part else JOINED["with"])).mask(phrase.where or phrase.part)
        layers = []
        if phrase.finish:
            metal = (beneath.metallic or 0.0) > 0.5
            rough = roughness_of(phrase, metal) or beneath.roughness
            glass = "mirror-like" in phrase.finish and not metal  # "a cabinet with a mirrored door"
            coat = self._named("silvered glass") if glass else replace(beneath, roughness=rough, said=said_of(phrase))
            layers = [Layer(coat, (where,))]
        for word in weathers_of(phrase):
            weather = WEATHER[word]
            coat = self._named(weather.stuff) if weather.stuff else self._beneath(base, None)
            drawn = STAIN.search(word) or weather.region.kind in ("veins", "scratches") or word in PEELS
            drawn = drawn and where.kind not in ("edges", "crevices", "details")
            stains = (weather.region.mask(word),) if drawn else ()
            place = (weather.region.mask(word),) if where.kind == "all" else (replace(where, wear=1.0), *stains)
            layers.append(Layer(coat, place, weather.thickness, weather.strength))
        return layers


    def _coat(self, phrase: Phrase, beneath: Coat | None = None) -> Coat:
        """The substance of a phrase, with the colour and finish that it asks for."""
        made = OBJECTS[phrase.thing].made if phrase.thing else ""
        if made and not any(map(self._speaks, phrase.unknown)):
            phrase = replace(phrase, unknown=[])  # "a deere tractor"
        if phrase.unknown and (not phrase.substance or phrase.substance in GENERIC):
            return self._unknown(phrase)
        if phrase.substance and family_of(phrase) == "wood" and BURNT & set(phrase.weather) and not phrase.amount_of(BURNT):
            rest = [word for word in phrase.weather if word not in BURNT]
            coal = self._coat(replace(phrase, substance="charred wood", weather=rest))
            return replace(coal, said=f"charred {phrase.substance}")
        if phrase.substance:
            usual = split(made)[0] if made else Phrase()
            if not phrase.colors and kin(phrase, usual):  # "a plastic traffic cone"
                phrase = replace(phrase, colors=usual.colors)
            named = GAUDY.get(phrase.substance, phrase.substance) if gaudy(phrase) else phrase.substance
            if CORRODES.get(KNOWN[named][0].look) == "verdigris" and greenish(phrase):
                named, phrase = "verdigris", replace(phrase, colors=[])  # "copper gone green"
            return self._of(stuff(named, any(map(is_hue, phrase.colors))), phrase)
        if of_part := stuff_of_part(phrase, beneath):
            return self._of(stuff(of_part, True), phrase)
        horny = phrase.animal in SHELLED and not beneath and not (phrase.thing and lives(phrase.thing))
        if made and not horny and not (phrase.colors and beneath is not None and drawn_on(split(made)[0], beneath)):
            inner = split(made)[0]
            inner.colors, inner.finish = phrase.colors or inner.colors, phrase.finish or inner.finish
            inner.weather, inner.region, inner.where = phrase.weather, None, ""
            inner.substance = painted(inner) if phrase.colors else inner.substance
            rusts = bool(RUSTED & set(phrase.weather)) and not inner.colors
            if rusts and family_of(inner) in ("wood", "stone", "ceramic", "plastic"):
                inner.substance = "iron"  # "a rusty chair"
            if inner.substance == "painted metal" and any(word in FINISHES_METAL for word in inner.finish):
                inner.substance = "paint"
            return replace(self._coat(inner), said=f"{said_of(phrase)}: {said_of(inner)}" if phrase.thing else said_of(inner))
        if phrase.colors and BURNT & set(phrase.weather) and phrase.region:
            return self._of(stuff("charcoal", True), replace(phrase, weather=[]))  # "charred black at the legs"
        if beneath is not None and phrase.colors:  # of the same stuff
            kind = place_of(phrase).kind
            made_of = CORRODES.get(beneath.look.split(" ")[-1]) if beneath.metallic else ""
            stained = (kind in ("streaks", "patches", "crevices") or phrase.where.startswith("on ")) and phrase.color_only
            if made_of == "verdigris" and stained and greenish(phrase):
                return self._named("verdigris")  # "a copper still with green streaks"
            raw = family_of_look(beneath.look) in ("metal", "rust", "wood", "stone") and beneath.look not in ("straw", "wicker")
            shade = not any(word in COLORS or word.startswith("#") for word in phrase.colors)  # darker than its own
            coated = beneath.metallic or (raw and kind not in ("veins", "spots", "patches"))
            look = "paint" if coated and not shade else beneath.look
            metallic = 0.0 if look == "paint" else beneath.metallic
            rough = roughness_of(phrase, bool(metallic)) or (0.35 if look == "paint" else beneath.roughness)
            look = look_of(stuff("paint", True), available=self._looks) if look == "paint" else look
            return replace(beneath, color=color_of(phrase), look=look, metallic=metallic, roughness=rough, said=said_of(phrase))
        if phrase.animal:
            return self._of(stuff(coat_of(phrase.animal, phrase.thing), False), phrase)
        weathers = [WEATHER[word].stuff for word in weathers_of(phrase) if WEATHER[word].stuff]
        name = "paint" if phrase.colors else weathers[0] if weathers else UNSAID
        if weathers and not phrase.colors:
            phrase.weather = []  # "rusty" alone is rust
        return self._of(stuff(name, bool(phrase.colors)), phrase)

    def _of(self, wanted: Stuff, phrase: Phrase, name: str = "") -> Coat:
        """A stuff as a phrase wants it. Args: name: what people call it, in place of the table's."""
        if wanted.family == "wood" and SILVERED & set(phrase.weather) and not any(map(is_hue, phrase.colors)):
            grey = KNOWN["weathered wood"][0]
            color = triple((1 - SILVER) * np.array(wanted.color) + SILVER * np.array(grey.color))
            wanted = wanted._replace(look=grey.look, color=color, roughness=max(wanted.roughness, grey.roughness))
        wanted = boards_of(wanted) if phrase.boards else wanted
        roughness = roughness_of(phrase, bool(wanted.metallic)) or wanted.roughness
        for word in phrase.weather:
            roughness *= WET.get(word, 1.0)
        named = color_of(phrase, wanted.color)
        treated = any(word in TREATMENTS for word in phrase.colors)
        color = faded(np.array(named if treated else described(wanted, named)), phrase)
        if wanted.roughness > POROUS and not wanted.metallic and any(word in SOAKED for word in phrase.weather):
            color = triple(np.array(color) * SOAK)
        look = look_of(wanted, phrase.finish, self._looks)
        metallic = wanted.metallic
        hue = any(word in COLORS or word.startswith("#") for word in phrase.colors)
        if metallic and hue and wanted.look != "brushed aluminium":
            color = triple(0.6 * np.array(color_of(phrase)) + 0.4 * np.array(color_of(phrase)) * np.array(wanted.color))
        coat = Coat(look, color, float(roughness), metallic, said=f"{name} {said_of(phrase)}".strip())
        return self._sized(self._scanned(coat, wanted, phrase))

    def _scanned(self, coat: Coat, wanted: Stuff, phrase: Phrase) -> Coat:
        """The same coat as the library has it, with the scan's own colour and roughness where words name none."""
        if self._library is None or wanted.family == "paint":
            return coat
        own = set() if phrase.substance in GENERIC else set(wanted.look.split())
        head = {word.removesuffix("s") for word in {*phrase.substance.split(), *phrase.unknown} | own - set(FINISH_LOOKS)}
        also = (*phrase.weather, *phrase.finish, wanted.family, *phrase.thing.split())
        found = self._library.match(head | {word.removesuffix("s") for word in also}, head)
        if found is None:
            return coat
        look = self._library.use(found)
        mean = means(look)
        named = any(map(is_hue, phrase.colors)) or any(word in COLORS for word in phrase.substance.split())
        color = coat.color if named else encoded(mean.lab)
        rough = coat.roughness if roughness_of(phrase, bool(wanted.metallic)) else mean.roughness
        metal = None if {"metallic", "packed"} & set(found.maps) else coat.metallic
        return replace(coat, look=look, color=color, roughness=rough, metallic=metal)

    def _unknown(self, phrase: Phrase) -> Coat:
        """A phrase with words that no table knows: its means by the reader, its look by the nearest name."""
        own = next((LOOK_OF[word] for word in phrase.unknown if word in LOOK_OF), "")
        kind = self._kind_of(phrase.unknown[0])
        if kind:  # a dictionary says no more than that it is a kind of wood, or of cloth
            wanted = stuff(kind, bool(phrase.colors))
            return self._of(wanted._replace(look=own or wanted.look), replace(phrase, unknown=[]), " ".join(phrase.unknown))
        words = " ".join([*phrase.finish, *phrase.colors, *phrase.unknown, phrase.substance]).strip()
        *color, roughness, metallic = self._prior.read([words])[0].tolist()
        near = stuff(self._nearest(phrase, metallic > 0.5), False)
        means = {"color": triple(np.array(color)), "roughness": roughness, "metallic": float(metallic > 0.5)}
        return self._of(near._replace(look=own or near.look, paintable=True, **means), phrase)

    def _kind_of(self, word: str) -> str:
        """The substance that a dictionary names a word by, where that is all it says of it; or ""."""
        told = self._prior.vocabulary.explained.get(word, ())
        families = {KNOWN[w][0].family for w in told if w in KNOWN}
        plain = all(w in KNOWN and w not in COLORS for w in told)
        return told[-1] if plain and len(families) == 1 and families != {"metal"} else ""

    def _speaks(self, word: str) -> bool:
        """Whether a table or a dictionary knows a word for that of a material."""
        if word.endswith("ed") and word not in LOOK_OF:
            return False  # what was done to a thing, not what it is made of
        return word in LOOK_OF or any(w in KNOWN for w in self._prior.vocabulary.explained.get(word, ()))

    def _means_material(self, word: str) -> bool:
        """Whether a word that no table knows says anything of a material."""
        if self._speaks(word):
            return True
        if not self._prior.vocabulary.knows(word):
            return False
        meaning = self._meaning(word)
        return max(float(self._meaning(name) @ meaning) for name in KNOWN) > ALIKE

    def _nearest(self, phrase: Phrase, metal: bool) -> str:
        """The name of a substance, metal or not, whose words mean most nearly the same."""
        if phrase.substance and bool(KNOWN[phrase.substance][0].metallic) == metal:
            return phrase.substance
        names = [name for name, found in KNOWN.items() if bool(found[0].metallic) == metal]
        wanted = self._meaning(" ".join(phrase.unknown))
        return max(names, key=lambda name: float(self._meaning(name) @ wanted))

    def _meaning(self, text: str) -> np.ndarray:
        """(D,) mean direction of the words of a text; zero for what resembles nothing."""
        vocabulary = self._prior.vocabulary
        total = np.zeros(vocabulary.vectors.shape[1], np.float32)
        for word in vocabulary.read(text):
            total += vocabulary.vector(word)
        length = float(np.linalg.norm(total))
        return total / length if length > 0 else total

    def _weather(self, phrase: Phrase, where: tuple[Mask, ...] = (), under: Coat | None = None) -> list[Layer]:
        """What words of wear and weather lay over a phrase's coat. Args: under: what shows where it is worn, if known."""
        layers = []
        for word in weathers_of(phrase):
            weather = WEATHER[word]
            coat = self._named(corroded(weather.stuff, phrase)) if weather.stuff else self._beneath(phrase, under)
            if word == "marbled" and coat.color is not None:
                coat = replace(coat, color=triple(np.array(coat.color) + MARBLING * (1 - np.array(coat.color))))
            mask = scaled(weather.region, phrase.amount.get(word, 1.0)).mask(word)
            if not weather.stuff and phrase.shows and phrase.shows.region:
                mask = phrase.shows.region.mask(phrase.shows.where)
            layers.append(Layer(coat, (*where, mask), weather.thickness, weather.strength))
        return layers

    def _named(self, name: str) -> Coat:
        """What weather leaves: dust, dirt and their like."""
        return self._of(stuff(name, False), Phrase(substance=name))

    def _beneath(self, phrase: Phrase, under: Coat | None) -> Coat:
        """What shows where a coat is worn through."""
        if phrase.shows:
            return self._coat(phrase.shows)
        if under and (phrase.coats or phrase.color_only):
            return under
        own = self._coat(phrase)
        if own.look == "enamel":
            return self._named("black iron")
        if phrase.substance in GILT:
            return replace(self._named("clay"), color=BOLE, said="bole")
        family = KNOWN[phrase.substance][0].family if phrase.substance else ""
        if family == "paint" or own.look in ("paint", "car paint", "painted wood"):
            made = split(OBJECTS[phrase.thing].made)[0] if phrase.thing else Phrase()
            if made.substance and not made.coats:
                return self._coat(made)
            wooden = "wood" in phrase.substance + made.substance or own.look == "painted wood"
            grey = any(word in FADED for word in phrase.weather)
            return self._named(("weathered wood" if grey else "pine") if wooden else "steel")
        return worn(own)

    def _sized(self, coat: Coat) -> Coat:
        return replace(coat, metres=self._metres or METRES.get(coat.look, 1.0))


def _ground(phrase: Phrase, layers: list[Layer]) -> Coat | None:
    """What a pattern lies on that is on a part of which is told, if anything."""
    part = phrase.within.where if phrase.within else ""
    named = (layer.coat for layer in reversed(layers) if part and len(layer.masks) == 1 and layer.masks[0].said == part)
    return next(named, None)


PATTERNS = ("stripes", "bands", "checks", "zigzag", "gingham", "dots")
"""Kinds of patterns of which a thing has one: its usual is not there where words tell of another."""

RUSTED = frozenset(["rusty", "rusted", "rusting"])
"""Words that say that what they tell of is of iron."""


def _usual_size(phrases: list[Phrase]) -> float | None:
    """Metres of the thing that is named first, if any, as large as words say."""
    things = [OBJECTS[phrase.thing] for phrase in phrases if phrase.thing]
    if not things:
        return None
    factor = np.prod([TIMES[word] for phrase in phrases for word in phrase.size] or [1.0])
    return float(min(max(things[0].metres * factor, LEAST), MOST))


def _once(layers: list[Layer]) -> list[Layer]:
    """No layer twice."""
    return list({(layer.coat.look, layer.coat.color, layer.masks): layer for layer in reversed(layers)}.values())[::-1]


GILT, BOLE = ("gilded", "gilt", "gilding", "gold leaf", "gold foil"), (0.42, 0.16, 0.11)
"""What lies on red clay, and its sRGB: bole, on which gilders lay leaf."""

MARBLING = 0.4
"""How much of white lighter the veins are of what is only called marbled."""

MATT = 0.65
"""Least roughness of what is camouflaged."""

SILVERED, SILVER = frozenset(["weathered", "sun-bleached"]), 0.6
"""Words that say of bare wood that sun and rain have turned it grey, and how far."""
