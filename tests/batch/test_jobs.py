"""Jobs files: what they may say, and every mistake named at once, a line each."""

from pathlib import Path

import pytest

from dreammat_cli.jobs import given, needs, read
from stages.batch.jobs import Job, safe, shared
from stages.core.errors import InputError


@pytest.fixture(autouse=True)
def meshes(tmp_path: Path) -> None:
    for name in ("chair.obj", "a lamp.glb", "cup.ply"):
        (tmp_path / name).write_bytes(b"0" * 8000)


def written(folder: Path, text: str, name: str = "jobs.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_csv_file_says_what_each_job_is(tmp_path: Path) -> None:
    (tmp_path / "parts.toml").write_text('"*" = "oak"\n"wheel_*" = "rubber"\n')
    lines = ["mesh,prompt,seed,parts,conditions,export", "chair.obj,a carved chair,7,,--views 4,web usd",
             "a lamp.glb,brass,,,,", ",,,,,", '"cup.ply",,,parts.toml,,']  # fmt: skip
    jobs, mistakes = read(written(tmp_path, "\ufeff" + "\n".join(lines)))
    assert mistakes == []
    chair, lamp, cup = jobs
    assert chair.name == "chair" and chair.mesh == tmp_path / "chair.obj" and chair.export == ("web", "usd")
    assert chair.words("distill") == ["--prompt", "a carved chair", "--seed", "7"]
    assert chair.words("conditions") == ["--views", "4"]
    assert lamp.name == "a_lamp" and lamp.words("distill") == ["--prompt", "brass", "--seed", "0"] and lamp.words("bake") == []
    assert cup.prompt == "oak" and cup.words("distill")[2:5] == ["--part", "wheel_*", "rubber"]


def test_a_toml_file_has_defaults_and_a_table_a_job(tmp_path: Path) -> None:
    text = '[defaults]\nmesh = "chair.obj"\nbake = "--size 512"\nexport = ["web", "usd"]\n[oak]\nprompt = "oak"\nseed = 3\n'
    jobs, mistakes = read(written(tmp_path, text + '[pine]\nprompt = "pine"\nbake = ""\n', "jobs.toml"))
    assert mistakes == [] and [(job.name, job.seed, job.words("bake")) for job in jobs] == [
        ("oak", 3, ["--size", "512"]), ("pine", 0, [])]  # fmt: skip
    assert jobs[0].export == ("web", "usd")


def test_a_folder_of_jobs_is_read_as_make_batch_reads_it(tmp_path: Path) -> None:
    folders = {"b c": ("x.stl", "prompt.txt"), "a": ("prep.npz", "prompt.txt"), "none": ("prompt.txt",), "other": ("x.obj",)}
    for name, files in folders.items():
        (tmp_path / "jobs" / name).mkdir(parents=True)
        for file in files:
            (tmp_path / "jobs" / name / file).write_text("old\n oak")
    jobs, mistakes = read(tmp_path / "jobs")
    assert [(job.name, job.mesh.name, job.prompt) for job in jobs] == [
        ("a", "prep.npz", "old oak"), ("b_c", "x.stl", "old oak")]  # fmt: skip
    assert len(mistakes) == 1 and "none: no mesh" in mistakes[0]


def test_every_mistake_is_named_in_a_line_of_its_own(tmp_path: Path) -> None:
    rows = [
        "mesh,prompt,seed,name,colour,conditions,bake,distill,parts,export",
        "chair.obj,oak,,,red,,,,,",
        "chair.obj,pine,,,,,,,,",
        "stool.obj, ,,stool,,,,,,",
        "cup.ply,clay,-1,cup/2,,,,,,",
        "cup.ply,clay,,shapes,,--views none,--size 5,,,",
        "cup.ply,clay,,quoted,,\"--env 'sky\",,--prompt tin,,cinema",
        "cup.txt,clay,,text,,,--help,--library,none.toml,",
        "cup.ply,clay,,fine,,,,,,",
    ]
    jobs, mistakes = read(written(tmp_path, "\n".join(rows)))
    assert [job.name for job in jobs] == ["chair", "fine"]
    for line, expected in [
        (None, "unknown column 'colour'; expected name, mesh"),
        (3, "name 'chair' is taken by"),
        (4, "stool.obj: no such file"),
        (4, "the prompt is empty"),
        (5, "seed '-1': expected a number"),
        (5, "name 'cup/2'; expected letters, digits, _ . and -, such as 'cup_2'"),
        (6, "name 'shapes': the batch has a folder of that name"),
        (6, "conditions: Invalid value for '--views'"),
        (6, "bake: Invalid value for '--size'"),
        (7, "No closing quotation"),
        (7, "distill: --prompt: the jobs file has a column for it"),
        (7, "export: Invalid value for '--for'"),
        (8, "cup.txt: expected one of .obj"),
        (8, "bake: --help: does nothing; leave it out"),
        (8, "distill: Option '--library' requires an argument"),
        (8, "none.toml: no such file"),
    ]:
        where = "jobs.csv: " if line is None else f"jobs.csv, line {line}: "
        assert any(where in text and expected in text for text in mistakes), f"{where}{expected}\n" + "\n".join(mistakes)
    assert len(mistakes) == 16 and not any("\n" in text for text in mistakes)


@pytest.mark.parametrize(("name", "text", "expected"), [
    ("jobs.csv", "", "first line is empty"),
    ("jobs.csv", "chair.obj,oak\n", "first line is chair.obj,oak; expected names of columns"),
    ("jobs.csv", "mesh,prompt\n", "holds no jobs"),
    ("jobs.csv", "mesh,mesh\n", "a column is there twice"),
    ("jobs.csv", 'mesh,prompt\nchair.obj,"oak\n', "not CSV"),
    ("jobs.toml", "mesh = ", "not TOML"),
    ("jobs.toml", 'mesh = "chair.obj"\n', "mesh is no table"),
])  # fmt: skip
def test_a_file_that_is_none_is_refused(tmp_path: Path, name: str, text: str, expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        read(written(tmp_path, text, name))
    with pytest.raises(InputError, match="no such file"):
        read(tmp_path / "absent.csv")


def test_a_spare_cell_is_a_mistake(tmp_path: Path) -> None:
    jobs, mistakes = read(written(tmp_path, "mesh,prompt\nchair.obj,oak, carved\n"))
    assert jobs == [] and "1 cell too many (carved); put quotes around what holds a comma" in mistakes[0]


def test_jobs_share_what_their_mesh_and_options_make() -> None:
    def job(name: str, prompt: str = "oak", seed: int = 0, mesh: str = "x/chair.obj", **options: str) -> Job:
        return Job(name, Path(mesh), prompt, seed=seed, options=options)

    jobs = [job("a"), job("b", "pine"), job("c", seed=5), job("d", conditions="--views 4"), job("e", prep="--uv new"),
            job("f", mesh="y/chair.obj"), job("g", distill="--steps 4", bake="--size 512")]  # fmt: skip
    shapes, lit = shared(jobs)
    assert len(shapes) == 3 and len(lit) == 4
    assert all(name.startswith("chair-") and safe(name) == name for name in shapes)
    assert {lit[one.shape, one.lit].name for one in jobs} == {"g", "d", "e", "f"}


def test_needs_follow_from_the_options(tmp_path: Path) -> None:
    def of(**options: str) -> dict:
        return needs(Job("a", tmp_path / "chair.obj", "oak", options=options), tmp_path / "none.npz")

    plain = of()
    assert given("conditions", "")["views"] == 128
    assert of(conditions="--views 32")["conditions"].cpu < 0.4 * plain["conditions"].cpu
    assert of(conditions="--views 32")["conditions"].files == pytest.approx(plain["conditions"].files / 4, rel=0.05)
    assert of(conditions="--size 512")["conditions"].memory > plain["conditions"].memory
    assert of(bake="--size 4096")["bake"].memory > 1.5 * plain["bake"].memory > 1.5 * of(bake="--size 512")["bake"].memory
    assert of(distill="--steps 240")["distill"].cpu == of(distill="--quality high")["distill"].cpu
    assert of(distill="--guidance sd")["distill"].gpu > 0 == plain["distill"].gpu
