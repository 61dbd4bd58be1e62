"""Prompts as recipes: what is understood, on a table of prompts and for any string."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stages.material.recipe import Coat, Recipe
from stages.material.substances import ALONG_GRAIN, LOOKS, METRES
from stages.prior.colors import rgb
from stages.prior.explain import HEADINGS, explained, parts, table
from stages.prior.grammar import split
from stages.prior.lexicon import JOINS, POSTFIX
from stages.prior.model import Prior, load_prior
from stages.prior.names import SUBSTANCES
from stages.prior.objects import OBJECTS
from stages.prior.places import ANIMALS, GATHERS, JOINED, ONCE, PARTS, SHAPES, WEATHER
from stages.prior.prompt import Reading, read_prompt
from stages.prior.stuffs import FAMILY_LOOKS, FINISH_LOOKS, KNOWN, LOOK_OF, look_of
from stages.report.measures import color_difference
from stages.report.prompts import PROMPTS
from tests.prior.prompts import CORPUS, FORMS, WORDS, parsed

WANTED = {s.look for stuffs in KNOWN.values() for s in stuffs}
METALS = {s.look.split(" ")[-1] for stuffs in KNOWN.values() for s in stuffs if s.metallic}
ALL_LOOKS = WANTED | {f"{finish} {metal}" for finish in set(FINISH_LOOKS.values()) for metal in METALS}
ALL_LOOKS |= {f"{s.look.removesuffix(' boards')} boards" for stuffs in KNOWN.values() for s in stuffs if s.family == "wood"}
"""Every look that names ask for, whether it is there or not: what is understood does not depend on that."""


@pytest.fixture(scope="module")
def prior() -> Prior:
    return load_prior("cpu")


@pytest.fixture(scope="module")
def read(prior: Prior):  # type: ignore[no-untyped-def]
    return lambda prompt, seed=0, metres=None: Reading(prior, metres, ALL_LOOKS).recipe(prompt, seed)


def families(coat: Coat) -> set[str]:
    """Families of the stuffs that have a coat's look."""
    own = {s.family for stuffs in KNOWN.values() for s in stuffs if s.look == coat.look}
    return own or ({"wood"} if coat.look in ALONG_GRAIN else {"metal"})


def coats(recipe: Recipe, wheres: tuple[str, ...]) -> Iterator[Coat]:
    """Those that lie at one of the kinds of places."""
    if "all" in wheres:
        yield recipe.base
    for layer in recipe.layers:
        if "*" in wheres or any(mask.kind in wheres for mask in layer.masks):
            yield layer.coat


def wrong(recipe: Recipe, wanted: list[tuple[tuple[str, ...], tuple[str, ...], str]]) -> list[str]:
    """What of a prompt was not understood, for people."""

    def is_it(coat: Coat, kinds: tuple[str, ...], color: str) -> bool:
        if "*" not in kinds and not (families(coat) & set(kinds) and bool(coat.metallic) == ("metal" in kinds)):
            return False
        assert coat.color is not None
        return color_difference(np.array(coat.color), rgb(color)) <= 15

    return [
        f"{wheres} {kinds} {color}" for wheres, kinds, color in wanted
        if not any(is_it(coat, kinds, color) for coat in coats(recipe, wheres))
    ]  # fmt: skip


def test_prompts_of_many_parts_are_understood(read) -> None:  # type: ignore[no-untyped-def]
    missed = {prompt: wrong(read(prompt), wanted) for prompt, wanted in parsed(FORMS)}
    failed = {prompt: what for prompt, what in missed.items() if what}
    assert len(missed) >= 60 and len(failed) <= 0.05 * len(missed), failed


def test_words_are_understood(read) -> None:  # type: ignore[no-untyped-def]
    missed = {prompt: wrong(read(prompt), wanted) for prompt, wanted in parsed(WORDS)}
    failed = {prompt: what for prompt, what in missed.items() if what}
    assert len(missed) >= 40 and len(failed) <= 0.05 * len(missed), failed


def test_prompts_of_every_form_are_understood_as_they_were_judged(read) -> None:  # type: ignore[no-untyped-def]
    missed = {prompt: wrong(read(prompt), wanted) for prompt, wanted in parsed(CORPUS)}
    failed = {prompt: what for prompt, what in missed.items() if what}
    assert len(missed) >= 300 and not failed, failed


@pytest.mark.parametrize(
    ("prompt", "same"),
    [("iron anvil, no rust", "iron anvil"), ("stone statue without moss or lichen", "stone statue"),
     ("rust-free iron anvil", "iron anvil"), ("not gold but silver", "silver"),
     ("a steel bucket instead of a plastic one", "steel bucket"), ("shinier than glass, blue plastic", "shiny blue plastic"),
     ("marbel", "marble"), ("lether", "leather"), ("a woodden crate", "a wooden crate"), ("alluminium", "aluminium"),
     ("goldleaf", "gold leaf"), ("steelplate", "steel plate"), ("brassware", "brass"), ("Eichenholztisch", "oak table"),
     ("red brick, 4k, pbr, unreal engine 5", "red brick"),
     ("steel visible under chipped blue paint", "blue paint chipped to steel"),
     ("a frost giant's axe", "an axe"), ("a wok of carbon steel seasoned to black", "a black carbon steel wok"),
     ("a leather helmet, brown leather", "a brown leather helmet"), ("a cherry table", "a cherry wood table"),
     ("a jug shaped like a pineapple, glossy yellow", "a glossy yellow jug"),
     ("a hat like a ripe aubergine", "an aubergine hat"),
     ("a box of shagreen dyed teal", "a box of teal shagreen"), ("a white and black hex mosaic", "a white and black mosaic"),
     ("a kitchen chair with a plywood seat in walnut", "a kitchen chair with a walnut seat"),
     ("a bear carved from oak with a chainsaw", "a bear carved from oak"),
     ("a griffin with golden fur", "a griffin with golden tan fur"),
     ("a dragon with blue scales and a pale belly", "a dragon with blue scales, pale belly of blue scales"),
     ("a half melted candle in a silver holder", "a partly melted candle with a silver holder at the lower third"),
     ("a chest, moss-covered oak", "a chest, oak covered in moss"), ("clay on the broken edge", "clay on the edge"),
     ("a green hobbit door", "a green door"), ("a path of herringbone brick", "a path of brick"),
     ("a ceramic cat with a jade glaze", "a glossy jade ceramic cat"), ("a ski in ash veneer", "a ski of ash wood"),
     ("a cabinet of walnut stained pine", "a cabinet of walnut coloured pine"), ("a belt in stingray", "a belt in shagreen"),
     ("a black tea bowl", "a black bowl"),
     ("a ring like a coiled snake in silver", "a silver ring"),
     ("a cabinet with a mirrored door", "a cabinet, silvered glass door"),
     ("a headboard in mohair, rust", "a rust colored mohair headboard"), ("a frame of gilded gesso", "a gilded frame"),
     ("a bowl in mottled raku", "a bowl in raku"), ("a pendant of jade in a gold bezel", "a pendant of jade with a gold bezel"),
     ("a rack in powder coated mustard steel", "a rack of mustard powder coated steel"), ("a frost sword", "a sword"),
     ("a van, red over white", "a van, white, upper half red"), ("a red-roofed white cottage", "a white cottage, red roof"),
     ("a car the shade of a ripe tangerine", "a tangerine car"),
     ("a chair, steel legs black as coal", "a chair, steel legs black"),
     ("an oak toy, worn by years of use", "a worn oak toy"),
     ("matte, dark red paint", "matte dark red paint"), ("an iron radiator painted cream", "cream painted iron radiator")],
)  # fmt: skip
def test_one_thing_said_in_two_ways(read, prompt: str, same: str) -> None:  # type: ignore[no-untyped-def]
    one, other = read(prompt), read(same)
    assert [(c.look, c.color, c.roughness) for c in one.coats] == [(c.look, c.color, c.roughness) for c in other.coats]


def test_how_much_of_it_is_heard(read) -> None:  # type: ignore[no-untyped-def]
    little, some, much = (read(f"{degree}rusted steel").layers[0].masks[0].share for degree in ("slightly ", "", "heavily "))
    assert 0 < little < some < much < 1
    little, some = (read(f"a rock with {degree}moss").layers[0].masks[0].share for degree in ("a hint of ", ""))
    assert 0 < little < some


def test_what_lies_on_a_part_lies_nowhere_else(read) -> None:  # type: ignore[no-untyped-def]
    dots = read("a mushroom, beige skin, with a red cap with white dots").layers[-1]
    assert [mask.kind for mask in dots.masks] == ["above", "dots"]


@pytest.mark.parametrize(
    ("prompt", "kinds"),
    [("a glass jar with a red gingham lid", [["above"], ["above", "gingham"]]),
     ("a mahogany knife with an ebony handle, brass rivets", [["below"], ["below", "spots"]]),
     ("a walnut drum with bronze studs around the rim", [["above", "spots"]]),
     ("an oak table with a gold ring around the top", [["above"]]),
     ("a shop of brick with a red and white striped awning", [["above"], ["above", "stripes"]])],
)  # fmt: skip
def test_a_pattern_on_a_part_stays_on_it(read, prompt: str, kinds: list[list[str]]) -> None:  # type: ignore[no-untyped-def]
    assert [[mask.kind for mask in layer.masks] for layer in read(prompt).layers] == kinds


def test_two_colours_of_a_pattern_leave_nothing_of_what_is_beneath(read) -> None:  # type: ignore[no-untyped-def]
    base, marks = read("a circus tent with red and white stripes").coats
    assert base.look == marks.look == "canvas"
    assert base.color == read("red canvas").base.color and marks.color == read("white canvas").base.color
    painted = read("a white mug with red and blue stripes")
    assert painted.base.color == read("a white mug").base.color and len(painted.layers) == 2


@pytest.mark.parametrize(
    ("prompt", "base"),
    [("a revolver with ivory grips and a nickel finish", "steel"), ("a walnut sideboard with a satin finish", "walnut"),
     ("peeling blue paint on an old wooden door", "oak"), ("a red fox, fluffy fur", "fur"),
     ("a crate with white paint chipped to bare aluminium", "aluminium"), ("a stroller with grey fabric", "fabric"),
     ("a chair, peeling white paint on grey wood", "weathered wood"), ("a box that looks like tortoiseshell", "glossy plastic"),
     ("a Bluetooth speaker wrapped in linen", "linen")],
)  # fmt: skip
def test_what_the_whole_is_made_of_is_found(read, prompt: str, base: str) -> None:  # type: ignore[no-untyped-def]
    assert read(prompt).base.look == base


def test_dirt_lies_on_paint_whichever_is_named_first(read) -> None:  # type: ignore[no-untyped-def]
    looks = [layer.coat.look for layer in read("a crate with mud on the bottom and chipped green paint").layers]
    assert looks[-1] == "cracked mud" and "paint" in looks[:-1]


def test_two_trims_share_the_edges(read) -> None:  # type: ignore[no-untyped-def]
    orange, metal = (layer.masks[0] for layer in read("a plastic crate with orange corners and steel edges").layers)
    assert orange.kind == metal.kind == "edges" and 0 < metal.share < orange.share


def test_gilding_shows_bole(read) -> None:  # type: ignore[no-untyped-def]
    gilded, bole = read("a gilded picture frame with the gilding worn off at the edges").coats
    assert gilded.metallic == 1 and not bole.metallic and bole.said == "bole"


def test_what_is_smaller_lies_on_what_is_larger(read) -> None:  # type: ignore[no-untyped-def]
    one, other = (read(f"a steel sword with {parts}") for parts in ("a brass pommel and an oak grip",
    "an oak grip and a brass pommel"))
    assert [coat.look for coat in one.coats] == [coat.look for coat in other.coats] == ["steel", "oak", "brass"]


@pytest.mark.parametrize("prompt", ["a ceramic pitcher", "a silver fork with tines", "a green nylon bomber jacket"])
def test_words_that_only_look_like_a_stuff_are_none(read, prompt: str) -> None:  # type: ignore[no-untyped-def]
    """No pitch, tin or bomb."""
    assert [coat.look for coat in read(prompt).coats][1:] == []
    assert read(prompt).base.look == read(" ".join(prompt.split(" ")[:-1])).base.look or "fork" in prompt


@pytest.mark.parametrize(
    ("prompt", "looks"),
    [("an accordion with white keys", "plastic"), ("a fire extinguisher with a black hose", "rubber"),
     ("a steel helmet with a red plume", "feathers"), ("an iron box with a brown strap", "leather"),
     ("an orc with green skin and white tusks", "bone"),
     ("a blue hat, yellow ribbon", "linen"), ("a toy train of oak with a blue chimney", "paint")],
)  # fmt: skip
def test_a_part_is_of_what_such_parts_are_of(read, prompt: str, looks: str) -> None:  # type: ignore[no-untyped-def]
    assert read(prompt).layers[-1].coat.look == looks


@pytest.mark.parametrize(
    ("prompt", "look"),
    [("corroded copper", "verdigris"), ("corroded iron pipe", "rust"), ("oxidized silver ring", "soil")],
)
def test_metals_corrode_as_they_do(read, prompt: str, look: str) -> None:  # type: ignore[no-untyped-def]
    recipe = read(prompt)
    assert look in [coat.look for coat in recipe.coats]


def test_the_fixed_prompts_mean_what_they_truly_mean(read) -> None:  # type: ignore[no-untyped-def]
    """Before any picture: colour, metal and regions of `report prior`."""
    off: dict[bool, list[float]] = {True: [], False: []}
    for prompt in PROMPTS:
        recipe = read(prompt.text)
        found = [recipe.base, *(layer.coat for layer in recipe.layers)]
        meant = [prompt.meaning, *([prompt.top] if prompt.top else [])]
        assert len(found) == len(meant), prompt.text
        for coat, meaning in zip(found, meant, strict=True):
            assert coat.color is not None and bool(coat.metallic) == (meaning.metallic > 0.5), prompt.text
            off[prompt.unseen].append(color_difference(np.array(coat.color), np.array(meaning.color)))
        assert all(layer.masks[0].kind == "above" for layer in recipe.layers)
    assert np.median(off[False]) <= 1.8 and np.median(off[True]) <= 7.9


SPOKEN = {*KNOWN, *OBJECTS, *PARTS, *SHAPES, *WEATHER, *JOINS, *POSTFIX, *ANIMALS, "half", ",", "red", "dark", "brushed"}


@settings(max_examples=150, deadline=None)
@given(prompt=st.text(max_size=60) | st.lists(st.sampled_from(sorted(SPOKEN)), max_size=9).map(" ".join))
def test_any_string_is_a_recipe(prior: Prior, prompt: str) -> None:
    recipe = read_prompt(prompt, prior, 3)
    assert recipe == read_prompt(prompt, prior, 3) and recipe.seed == 3
    assert Recipe.from_json(recipe.to_json()) == recipe
    for coat in recipe.coats:
        assert coat.look in LOOKS and coat.color is not None and all(0 <= c <= 1 for c in coat.color)
        assert coat.roughness is not None and 0 <= coat.roughness <= 1 and coat.metallic in (0.0, 1.0) and coat.metres > 0
    assert all(len(row) == len(HEADINGS) for row in explained(recipe))


def test_a_seed_changes_patterns_and_no_stuff(read) -> None:  # type: ignore[no-untyped-def]
    assert replace(read("chipped red paint", 1), seed=2) == read("chipped red paint", 2)


@pytest.mark.parametrize("words", [("matte", "black", "worn"), ("dark", "reddish", "brown"), ("old", "rusty", "dusty")])
def test_the_order_of_adjectives_does_not_matter(read, words: tuple[str, ...]) -> None:  # type: ignore[no-untyped-def]
    def silent(coat: Coat) -> Coat:
        return replace(coat, said="")

    found = {
        (silent(r.base), tuple((silent(layer.coat), layer.masks, layer.thickness, layer.strength) for layer in r.layers))
        for r in (read(" ".join((*order, "plastic"))) for order in permutations(words))
    }
    assert len(found) == 1


@pytest.mark.parametrize(
    ("prompt", "stuffs"),
    [("rusty rusted corroded steel bucket", ["rust"]), ("old weathered ancient oak", ["grime"]),
     ("dusty mossy old stone", ["moss", "dust"]),
     ("rusty dusty scratched bucket", ["rust", "bare", "dust"])],
)
def test_weather_is_laid_once(read, prompt: str, stuffs: list[str]) -> None:  # type: ignore[no-untyped-def]
    assert [layer.coat.said.split(" ")[0] for layer in read(prompt).layers] == stuffs


@pytest.mark.parametrize(
    ("prompt", "look"),
    [("brushed steel", "brushed steel"), ("hammered copper", "hammered copper"), ("polished brass", "polished brass"),
     ("cast iron", "cast iron"), ("beaten silver", "hammered silver"), ("oak planks", "oak boards"),
     ("pine floorboards", "pine boards"),
     ("a terracotta roof", "roof tiles"), ("oak", "oak"), ("stone wall", "rock wall"), ("red brick", "brick"),
     ("tartan", "tartan"),
     ("crocodile leather", "crocodile"), ("corten steel", "weathering steel"), ("green marble", "green marble")],
)  # fmt: skip
def test_names_and_finishes_call_for_their_looks(read, prompt: str, look: str) -> None:  # type: ignore[no-untyped-def]
    assert read(prompt).base.look == look


@pytest.mark.parametrize(
    ("prompt", "metres"),
    [("a red brick house", 8.0), ("terracotta vase, 40 cm tall", 0.4), ("a 2 m statue", 2.0), ("6 foot oak door", 1.8288),
     ("a giant rubber duck", 2.4), ("tiny house", 1.6), ("a boat of oak, 12-metre long", 12.0)],
)
def test_things_have_a_size(read, prompt: str, metres: float) -> None:  # type: ignore[no-untyped-def]
    assert all(coat.metres == pytest.approx(metres) for coat in read(prompt).coats)
    assert read(prompt, metres=3.0).base.metres == 3.0


def test_a_stuff_without_a_thing_is_shown_at_its_own_size(prior: Prior) -> None:
    coats = [read_prompt(prompt, prior, 0).base for prompt in ("red brick", "black rubber", "oak")]
    assert all(coat.metres == METRES[coat.look] for coat in coats) and len({coat.metres for coat in coats}) > 1


def test_what_is_understood_is_told(read) -> None:  # type: ignore[no-untyped-def]
    recipe = read("a boot, brown leather with a black rubber sole")
    assert parts(recipe) == ["brown leather: everywhere", "black rubber: lowest 8 % (sole)"]
    lines = table(recipe)
    assert len(lines) == 3 and lines[0].split() == list(HEADINGS) and lines[2].split("  ")[0] == "black rubber"


def test_every_thing_is_made_of_something_known() -> None:
    assert len(OBJECTS) >= 400
    for name, thing in OBJECTS.items():
        assert 0.01 <= thing.metres <= 100, name
        for phrase in split(thing.made):
            known = phrase.substance or phrase.colors or all(word in LOOK_OF for word in phrase.unknown)
            assert known and not phrase.thing, f"{name}: {thing.made}"


def test_every_name_has_a_look_and_every_weather_a_stuff() -> None:
    assert {name for substance in SUBSTANCES for name in substance.names} <= set(LOOK_OF)
    assert {weather.stuff for weather in WEATHER.values() if weather.stuff} <= set(KNOWN)
    assert set(ONCE.values()) <= set(GATHERS) and set(GATHERS) <= set(KNOWN)
    assert {s.family for stuffs in KNOWN.values() for s in stuffs} <= set(FAMILY_LOOKS)
    placed = {join.kind for join in JOINS.values()} | set(POSTFIX.values())
    assert placed - {"peel", "show", "through", "to", "in", "all"} <= set(JOINED)


def test_a_look_that_is_missing_is_replaced_by_one_of_its_family() -> None:
    assert set(LOOKS) >= WANTED
    for stuffs in KNOWN.values():
        for s in stuffs:
            assert look_of(s) == s.look if s.look in LOOKS else look_of(s) in LOOKS, s.name
    assert look_of(KNOWN["oak"][0], available=["steel", "oak"]) == "oak"
    assert look_of(KNOWN["velvet"][0], available=["steel", "linen"]) == "linen"
