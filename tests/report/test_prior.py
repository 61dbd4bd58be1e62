"""The evaluation of the prior: its list, its shapes, and a small run from beginning to end."""

import csv
from pathlib import Path

import numpy as np
import pytest
import trimesh

from stages.core.color import srgb_decode
from stages.distill import base, start
from stages.light import lights
from stages.prior.colors import WORDS
from stages.prior.model import VOCABULARY_FILE
from stages.prior.names import FINISHES, OBJECTS, SUBSTANCES
from stages.prior.vocabulary import Vocabulary
from stages.report import ground, prior
from stages.report.options import PriorReportOptions
from stages.report.prompts import IDENTIFIED, PROMPTS, Meaning, Prompt
from stages.report.shapes import SHAPES


def test_the_list_is_as_long_and_as_new_as_it_claims() -> None:
    assert len({prompt.text for prompt in PROMPTS}) == len(PROMPTS) >= 60
    taught = {w for phrase in (*WORDS, *FINISHES, *OBJECTS, *(n for s in SUBSTANCES for n in s.names)) for w in phrase.split()}
    for prompt in PROMPTS:
        if prompt.unseen:
            assert not set(prompt.text.split()) <= taught, prompt.text
        assert all(0 <= value <= 1 for value in prompt.meaning.row())
    assert sum(prompt.unseen for prompt in PROMPTS) * 3 >= len(PROMPTS)


def test_every_prompt_has_a_word_that_the_vocabulary_knows() -> None:
    _, present = Vocabulary.load(VOCABULARY_FILE).encode([prompt.text for prompt in PROMPTS])
    assert bool(present.any(1).all())


def test_truths_to_identify_are_far_apart() -> None:
    rows = np.stack([prompt.meaning.row() for prompt in IDENTIFIED])
    distance = np.linalg.norm(rows[:, None] - rows[None], axis=-1) + 9 * np.eye(len(rows))
    assert len(IDENTIFIED) == 10 and distance.min() > 0.2


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_are_whole(name: str) -> None:
    mesh = SHAPES[name]()
    assert mesh.volume > 0 and len(mesh.faces) > 1000 and np.isfinite(mesh.vertices).all()


def test_regions_are_told_by_height() -> None:
    z = np.linspace(-0.5, 0.5, 101)
    gold, oak = Meaning((1.0, 0.9, 0.6), 0.3, 1.0), Meaning((0.7, 0.5, 0.3), 0.6, 0.0)
    prompt = Prompt("oak base and gold top", oak, top=gold)
    maps = np.where((z > 0)[:, None], gold.row(), oak.row()).astype(np.float32)
    maps[:, :3] = srgb_decode(maps[:, :3])

    def right(maps: np.ndarray) -> float:
        return prior.regions_right(prompt, z, maps)

    assert right(maps) == 1 and right(maps[::-1].copy()) == 0
    assert right(np.broadcast_to(oak.row(), (101, 5)).astype(np.float32)) == 0.5


def test_small_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module, name, less in (
        (ground, "POINTS", 300), (ground, "TEXELS", 3000), (prior, "GIVEN", ("geometry", "full")), (start, "DRAWS", 3),
        (start, "LIT_POINTS", 500), (base, "SETTLE_POINTS", 500), (ground, "TURNS", (0.0,)),
        (ground, "read_lights", lambda _: ([lights.preview_light()], {}, {})),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, less)
    pipe = tmp_path / "pipe.obj"
    trimesh.creation.annulus(0.2, 0.3, 1.0).export(pipe)
    options = PriorReportOptions(mesh=(str(pipe),), seeds=2, prompts=1, steps=2, views=1)
    lines = prior.report_prior(tmp_path, options)
    with (tmp_path / "prior.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert {(row["given"], row["lights"], row["alone"]) for row in rows} == {
        ("full", "all", "False"), ("full", "all", "True"), ("geometry", "all", "True"), ("full", "one", "True"),
    }  # fmt: skip
    assert all(0 <= float(row["decided"]) <= 1 and float(row["relight_percent"]) >= 0 for row in rows if not row["regions"])
    assert all(bool(row["shared_pattern"]) == (row["seed"] == "1") for row in rows)
    assert all(-1 <= float(row["shared_pattern"]) < 0.9 for row in rows if row["seed"] == "1"), "another seed, another pattern"
    assert {line.measure for line in lines} >= {
        "roughness error", "identified, %", "baked light, |correlation|", "baked light in cavities, |correlation|"
    }  # fmt: skip
    openness = ground.Ground.of(tmp_path / "meshes/pipe/prep.npz", tmp_path / "meshes/pipe/conditions", 512).openness[:, 0]
    assert 0 < openness.min() < 0.5 and openness.max() == pytest.approx(0.96, rel=0.02)
    assert all(line.runs for line in lines)
    assert (tmp_path / "prior.png").stat().st_size > 10_000
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("material.npz")}
    again = {prior.carry_out(run, tmp_path, options) for run in prior.plan(options, {"pipe": 1.0})}
    assert before == {path: path.stat().st_mtime_ns for path in again}, "a second call works on what is there"
