"""What became of jobs, and what is left of them, from files alone."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from dreammat_cli.jobs import needs
from stages.batch import costs
from stages.batch.jobs import Job
from stages.batch.plan import plan, speeds
from stages.batch.summary import last_words, logs, outcome, outputs, run_logs, summarise
from stages.core.images import read_image, write_png


@pytest.fixture
def jobs(tmp_path: Path) -> list[Job]:
    """Five jobs on two meshes: done, failed at bake, begun, waiting, and one whose mesh is bad."""
    for name in ("cup.obj", "bad.obj"):
        (tmp_path / name).write_bytes(b"0" * 80_000)
    jobs = [Job(name, tmp_path / "cup.obj", f"{name} <clay>") for name in ("done", "baking", "begun", "waiting")]
    jobs.append(Job("bad", tmp_path / "bad.obj", "clay"))
    done, baking, begun, _, bad = jobs
    out = tmp_path / "out"
    there = [*outputs(done, out).values(), outputs(baking, out)["distill"]]
    for path in there:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")
    write_png(out / "done/asset/preview.png", np.full((960, 1280, 3), 0.25, np.float32))
    (out / "done/asset/report.html").write_text("report")
    for stage, path in run_logs(done, out).items():
        path.write_text(json.dumps({"seconds": 10, "cpu_seconds": 5 if stage == "bake" else 2, "peak_memory_gib": 0.5}))
    said = [(logs(baking, out)["bake"], "bake 3/7\nerror: asset: no space left on device\n"), (logs(begun, out)["distill"], ""),
            (logs(bad, out)["prep"], "bash: line 1: dreammat: command not found\n")]  # fmt: skip
    for (log,), text in said:
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(text)
    return jobs


def test_every_job_has_a_row_a_picture_and_its_error(jobs: list[Job], tmp_path: Path) -> None:
    told = summarise(jobs, ["jobs.csv, line 9: no mesh; expected a path"], tmp_path / "out")
    assert told.startswith("1 done, 2 failed, 1 begun, 1 waiting, 1 left out; 0.00 CPU hours, at most 0.5 GiB")
    with open(tmp_path / "out/summary.csv", newline="") as stream:
        rows = {row["name"]: row for row in csv.DictReader(stream)}
    assert [row["status"] for row in rows.values()] == ["done", "failed", "begun", "waiting", "failed", "left out"]
    assert rows["baking"]["stage"] == "bake" and rows["baking"]["error"] == "asset: no space left on device"
    assert rows["bad"]["stage"] == "prep" and rows["bad"]["error"].endswith("dreammat: command not found")
    assert rows["jobs.csv, line 9"]["error"] == "no mesh; expected a path"
    assert (rows["done"]["seconds"], rows["done"]["cpu_seconds"], rows["begun"]["stage"]) == ("20", "7", "distill")
    page = (tmp_path / "out/summary.html").read_text()
    assert page.index("<b>bad</b>") < page.index(">done</a>") and "done &lt;clay&gt;" in page
    assert 'src="thumbnails/done.png"' in page and 'href="done/asset/report.html"' in page and page.count("<img") == 1
    small = read_image(tmp_path / "out/thumbnails/done.png")
    assert small.shape == (160, 320, 3) and small.mean() == pytest.approx(0.25, abs=0.01)


def test_conditions_that_were_removed_are_not_missed(jobs: list[Job], tmp_path: Path) -> None:
    outputs(jobs[0], tmp_path / "out")["conditions"].unlink()
    assert summarise(jobs[:1], [], tmp_path / "out").startswith("1 done;")


def test_an_error_of_a_part_of_the_views_is_that_of_the_conditions(jobs: list[Job], tmp_path: Path) -> None:
    bad = jobs[-1]
    prep = outputs(bad, tmp_path / "out")["prep"]
    log = tmp_path / "out/logs/part" / bad.shape / f"{bad.lit}.2-of-4.log"
    for path, text in {prep: "x", log: "error: sky.hdr: no such file\n"}.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    one = outcome(bad, tmp_path / "out")
    assert (one.status, one.stage, one.error) == ("failed", "conditions", "sky.hdr: no such file")


def test_what_was_begun_has_failed_once_nothing_runs(jobs: list[Job], tmp_path: Path) -> None:
    assert outcome(jobs[2], tmp_path / "out").status == "begun"
    ended = outcome(jobs[2], tmp_path / "out", ended=True)
    assert ended.status == "failed" and ended.error.startswith("ended without a word")
    assert outcome(jobs[3], tmp_path / "out", ended=True).status == "waiting"


def test_an_error_is_one_line_wherever_it_stands(tmp_path: Path) -> None:
    log = tmp_path / "log"
    log.write_text("reading\nerror: cup.obj: empty\n\nslurmstepd: cancelled\n")
    assert last_words(log) == "cup.obj: empty"
    log.write_bytes(b"one\n\xff two  three\n\n")
    assert last_words(log) == "\ufffd two three"


def test_a_plan_counts_what_is_shared_once_and_what_is_done_not(jobs: list[Job], tmp_path: Path) -> None:
    made = plan(jobs, needs, tmp_path / "out")
    assert made.done == {"prep": 1, "conditions": 1, "distill": 2, "bake": 1}
    assert made.left == {"prep": 1, "conditions": 1, "distill": 3, "bake": 4}
    one = needs(jobs[0], tmp_path / "none.npz")
    assert made.needs["bake"].cpu == pytest.approx(4 * one["bake"].cpu) and made.needs["bake"].files == 4 * one["bake"].files
    assert made.total.memory == max(need.memory for need in one.values()) and made.records == 0
    whole = plan(jobs, needs, tmp_path / "elsewhere")
    assert whole.left == {"prep": 2, "conditions": 2, "distill": 5, "bake": 5} and whole.total.cpu > made.total.cpu


def test_a_machine_is_as_fast_as_its_records_say(jobs: list[Job], tmp_path: Path) -> None:
    law = costs.conditions(1000, 8, 256**2, 5).cpu - costs.START
    seen = {"views_made": 8, "pixels": 256**2, "environments": 5, "triangles": 1000, "quality": "standard"}
    runs = [seen | {"cpu_seconds": 2 * law}, seen | {"cpu_seconds": 4 * law}, {"seconds": 3}, {"views_made": 3}]
    assert speeds(runs) == ({"conditions": 3.0}, 2)
    (tmp_path / "old").mkdir()
    (tmp_path / "old/run.json").write_text(json.dumps(runs[0]))
    slow, plain = plan(jobs, needs, tmp_path / "out", [tmp_path / "old"]), plan(jobs, needs, tmp_path / "out")
    assert slow.records == 1 and slow.needs["bake"] == plain.needs["bake"]
    assert slow.needs["conditions"].cpu - costs.START == pytest.approx(2 * (plain.needs["conditions"].cpu - costs.START))


def test_triangles_are_those_of_prep_once_it_has_run(tmp_path: Path) -> None:
    (tmp_path / "cup.obj").write_bytes(b"0" * 80_000)
    assert costs.triangles_of(tmp_path / "cup.obj", tmp_path / "prep.npz") == 1000
    (tmp_path / "prep.npz.run.json").write_text('{"triangles": 77}')
    assert costs.triangles_of(tmp_path / "cup.obj", tmp_path / "prep.npz") == 77
