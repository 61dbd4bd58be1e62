"""Reading the dictionary that the word vectors are made from."""

from pathlib import Path

from stages.train.vocabulary import dictionary, entry

LICENCE = "  1 This software and database is being provided to you ...\n"
COLOR = "04982041 07 n 02 taupe 0 mole_gray(a) 0 001 @ 04975739 n 0000 | a greyish brown; \"the taupe of a mole\"  \n"
ANIMAL = "01893398 05 n 01 taupe 0 000 | an invented animal  \n"
ADJECTIVE = "00376152 00 s 02 fuscous 0 taupe 0 000 | of something having a dusky brownish grey color  \n"


def test_the_meanings_that_matter_for_materials_come_first(tmp_path: Path) -> None:
    (tmp_path / "data.noun").write_text(LICENCE + ANIMAL + COLOR)
    (tmp_path / "data.adj").write_text(LICENCE + ADJECTIVE)
    found = dictionary(tmp_path)
    assert set(found) == {"taupe", "mole gray", "fuscous"}
    assert [kind for kind, _, _ in found["taupe"]] == ["07", "00", "05"]
    text = entry("taupe", found["taupe"])
    assert text.startswith("taupe: mole gray a greyish brown. fuscous of something")
    assert "the taupe of a mole" not in text
