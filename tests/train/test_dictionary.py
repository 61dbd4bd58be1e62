"""Words that were never taught are explained by taught ones; what is no look is left alone."""

from pathlib import Path

import pytest

from stages.train.dictionary import Explainer, by_word, color_words, senses
from stages.train.vocabulary import entry

LICENCE = "  1 This software and database is being provided to you ...\n"
NOUNS = """\
04982041 07 n 02 taupe 0 mole_gray(a) 0 001 @ 04975739 n 0000 | a greyish brown; "the taupe of a mole"
01893398 05 n 01 taupe 0 000 | an invented animal
04971000 07 n 02 crimson 0 ruby 1 000 | a deep and vivid red color
00000010 06 n 03 fabric 0 cloth 0 material 1 000 | artifact made by weaving
00000011 06 n 01 tweed 0 001 @ 00000010 n 0000 | thick woolen fabric used for clothing
00000012 06 n 01 ceramic_ware 0 000 | utensils made from ceramic material
00000013 06 n 01 stoneware 0 001 @ 00000012 n 0000 | a ware that is fired in high heat
00000014 06 n 01 train 1 001 @ 00000010 n 0000 | a long back section of a gown
00000015 06 n 01 train 0 000 | public transport provided by a line of railway cars
00000016 06 n 01 anvil 0 000 | a heavy block of iron or steel
00000017 20 n 01 teak 0 000 | tall East Indian timber tree; of iron hardness
00000018 20 n 01 teak 1 001 @ 00000019 n 0000 | hard yellowish brown wood of teak trees
00000019 27 n 01 wood 0 000 | the substance under the bark of trees
00000020 20 n 01 gardenia 0 000 | a shrub with white flowers
00000021 27 n 01 electrum 0 000 | an alloy of gold and silver
00000022 27 n 01 amazonite 0 000 | a green variety of microcline
00000023 13 n 01 chartreuse 0 000 | aromatic green liqueur
"""
ADJECTIVES = """\
00376152 00 s 02 fuscous 0 taupe 0 000 | of something having a dusky brownish grey color
00376153 00 s 01 chartreuse 0 000 | having the yellowish green color of the liqueur
00376154 00 s 02 crimson 0 violent 0 000 | characterized by red bloodshed
"""
INDEX = """\
taupe n 2 1 @ 2 0 04982041 01893398
crimson n 1 0 1 0 04971000
tweed n 1 1 @ 1 0 00000011
stoneware n 1 1 @ 1 0 00000013
train n 2 1 @ 2 1 00000015 00000014
anvil n 1 0 1 0 00000016
teak n 2 1 @ 2 0 00000018 00000017
gardenia n 1 0 1 0 00000020
electrum n 1 0 1 0 00000021
amazonite n 1 0 1 0 00000022
chartreuse n 1 0 1 0 00000023
fabric n 1 0 1 0 00000010
"""


@pytest.fixture
def wordnet(tmp_path: Path) -> Path:
    (tmp_path / "data.noun").write_text(LICENCE + NOUNS)
    (tmp_path / "data.adj").write_text(LICENCE + ADJECTIVES)
    (tmp_path / "index.noun").write_text(LICENCE + INDEX)
    return tmp_path


def test_the_meanings_that_matter_for_materials_come_first(wordnet: Path) -> None:
    found = by_word(senses(wordnet))
    assert {"taupe", "mole gray", "fuscous"} <= set(found)
    assert [sense.kind for sense in found["taupe"]] == ["07", "00", "05"]
    text = entry("taupe", found["taupe"])
    assert text.startswith("taupe: mole gray a greyish brown. fuscous of something")
    assert "the taupe of a mole" not in text


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("taupe", "brownish grey"),  # what an adjective says of a look comes first
        ("crimson", "ruby"),  # then a synonym that is taught; the red of bloodshed is no colour
        ("chartreuse", "yellowish green"),  # the noun is a drink
        ("tweed", "fabric cloth"),
        ("stoneware", "ceramic"),
        ("teak", "yellowish brown wood"),  # a plant is its wood
        ("electrum", "gold silver"),
        ("amazonite", "green"),
        ("train", ""),  # of which cloth is not the usual meaning
        ("anvil", ""),  # it may be made of anything
        ("gardenia", ""),
        ("nothing", ""),
    ],
)
def test_a_word_is_explained_by_taught_ones(wordnet: Path, word: str, told: str) -> None:
    explainer = Explainer(wordnet, {"fabric", "cloth", "ceramic", "wood", "gold", "silver", "iron", "steel"}, {"fabric"})
    assert " ".join(explainer.explain(word)) == told


def test_what_is_taught_is_not_explained(wordnet: Path) -> None:
    explained = Explainer(wordnet, {"cloth", "wood"}, {"taupe", "teak"}).all()
    assert "tweed" in explained and not {"taupe", "teak"} & set(explained)


def test_only_the_first_clause_names_a_colour() -> None:
    assert color_words("of a pale to moderate (not deep) greyish violet color; like red wine") == ("pale", "greyish", "violet")
    assert color_words("deep and dark") == ()
