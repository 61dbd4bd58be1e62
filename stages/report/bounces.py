"""Light between surfaces beside Mitsuba's path tracer: error of what shades a view, without bounces and with them.

Each mesh is seen once, somewhat from above, in each of six materials. Ours is what distillation has: E, A and B of the view
with what the object adds to them. The truth is `stages.report.path_tracer_worker`, of the same BRDF, along the same rays,
with paths of bounces + 2 segments; its direct light alone tells what else the two differ by. Errors are tone-mapped,
x / (1 + x), over the object's pixels, in percent.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.asset.traced import traced_scene
from stages.conditions.cameras import framing_distance
from stages.core.artifact import load_npz
from stages.core.color import reinhard
from stages.core.errors import InputError
from stages.core.frames import look_at
from stages.core.schemas import PREP
from stages.core.shading import Material, shade
from stages.light.cells import Cells
from stages.light.environment import Environment
from stages.light.exchange import make_exchange
from stages.light.gbuffer import GBuffer, trace_view
from stages.light.lights import BUILTIN
from stages.light.own_light import with_own_light
from stages.light.reconstruction import Neighbours
from stages.light.scene import Scene
from stages.light.terms import BOUNCED
from stages.light.transport import QUALITY, cached_light_set, integrate_with_ends
from stages.report.renderers import NEEDS, pole_to_pole, read_arrays, write_arrays
from stages.report.rows import write_csv

SIZE = 160
"""Pixels along each side of a view."""

PIXELS, SAMPLES = 1500, 8192
"""Pixels that are compared, and their samples in Mitsuba, whose own noise is a few tenths of a percent."""

FOV, AZIMUTH, ELEVATION, FRAME = np.radians(30.0), np.radians(35.0), np.radians(38.0), 0.8

MATERIALS: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "white plaster": ((0.9, 0.9, 0.9, 0.9, 0.0),) * 2,
    "red plastic": ((0.7, 0.03, 0.03, 0.35, 0.0),) * 2,
    "chrome": ((0.55, 0.56, 0.56, 0.05, 1.0),) * 2,
    "rough gold": ((1.0, 0.77, 0.34, 0.45, 1.0),) * 2,
    "satin gold": ((1.0, 0.77, 0.34, 0.25, 1.0),) * 2,
    "two colours": ((0.8, 0.05, 0.05, 0.6, 0.0), (0.85, 0.85, 0.85, 0.6, 0.0)),
}
"""Albedo, roughness and metallic on either side of PLANE."""

PLANE = np.array([1.0, 0.3, 0.0])


@dataclass(frozen=True)
class Row:
    """Errors in percent. direct: of direct light beside direct light alone. without, with_bounces: beside all of the light.
    energy: mean radiance over the exact, less 1, percent. share: of the exact radiance that has met the object before."""

    mesh: str
    material: str
    environment: str
    direct: float
    without: float
    with_bounces: float
    energy: float
    share: float


def measure(python: str, mesh: str, scene: Scene, lights: Sequence[Environment], bounces: int) -> list[Row]:
    """A mesh in all materials under each light. Args: python: Mitsuba's interpreter. Raises: InputError."""
    towards = np.array([np.cos(ELEVATION) * np.cos(AZIMUTH), np.cos(ELEVATION) * np.sin(AZIMUTH), np.sin(ELEVATION)])
    distance = framing_distance(scene.vertices.astype(np.float64), towards[None], np.array([np.tan(FOV / 2) * FRAME]))
    c2w = look_at(towards * distance[0], np.zeros(3), np.array([0.0, 0.0, 1.0]))
    points, cells = trace_view(scene, c2w, float(FOV), SIZE, SIZE), Cells.of(scene)
    some = np.sort(np.random.default_rng(0).choice(len(points.n), min(PIXELS, len(points.n)), replace=False))
    eye = np.repeat(c2w[None, :3, 3], len(some), 0)
    rows = []
    for light in lights:
        exchange, light_set = make_exchange(scene, cells, [light], 0, bounces), cached_light_set((light,))
        transports, ends = integrate_with_ends(scene, points, light_set, QUALITY["standard"], 0, cells)
        counts, sides = BOUNCED.counts(QUALITY["standard"].lobe), cells.sides(scene)
        near = Neighbours.of(points)
        assert ends is not None
        for name, pair in MATERIALS.items():
            job = {name: getattr(scene, name) for name in ("vertices", "triangles", "normals")}
            job |= {"origins": eye, "directions": -points.wo[some], "radiance": pole_to_pole(light.radiance)}
            job |= {"samples": np.array(SAMPLES), "depths": np.array([2, bounces + 2])}
            job |= {"materials": np.array(pair), "plane": PLANE}
            direct, exact = path_traced(python, job)
            own = exchange.solved(material(sides, pair), bounces)
            lit = with_own_light(transports[0], points.n, points.wo, ends, own, exchange.sky, counts, near)
            values = Material.of(torch.from_numpy(material(points, pair)))
            alone, full = (shade(transport, values).numpy()[some] for transport in (transports[0], lit))
            errors = (rms(alone, direct), rms(alone, exact), rms(full, exact))
            means = (100 * (full.mean() / exact.mean() - 1), 100 * (1 - direct.mean() / exact.mean()))
            rows.append(Row(mesh, name, light.name, *errors, *map(float, means)))
            sys.stderr.write(f"{rows[-1]}\n")
    return rows


def material(points: GBuffer, pair: tuple[tuple[float, ...], tuple[float, ...]]) -> NDArray[np.float32]:
    """(P, 5)."""
    return np.where((points.point @ PLANE > 0)[:, None], pair[1], pair[0]).astype(np.float32)


def path_traced(python: str, job: dict[str, NDArray]) -> NDArray[np.float64]:
    """What Mitsuba says, (D, R, 3). Raises: InputError when the interpreter or the renderer fails."""
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder) / "job", Path(folder) / "result"
        write_arrays(given, job)
        script = Path(__file__).with_name("path_tracer_worker.py")
        done = subprocess.run([python, str(script), str(given), str(made)], capture_output=True, check=False)
        if done.returncode:
            said = done.stderr.decode(errors="replace").strip().splitlines() or ["it said nothing"]
            raise InputError(f"{python}: {said[-1][:200]}; expected a Python with {NEEDS['mitsuba']}")
        return read_arrays(made)["radiance"]


def rms(a: NDArray, b: NDArray) -> float:
    """Tone-mapped difference, percent."""
    x, y = (reinhard(torch.from_numpy(np.asarray(v, np.float64))) for v in (a, b))
    return 100 * float((x - y).square().mean().sqrt())


def main(python: str, out: str, lights: str, meshes: Iterable[str]) -> None:
    """Measure prep.npz files and write a table. Args: lights: names, with commas between."""
    rows: list[Row] = []
    for path in map(Path, meshes):
        scene, shown = traced_scene(load_npz(path, PREP)), [BUILTIN[name]() for name in lights.split(",")]
        rows += measure(python, path.stem, scene, shown, 2)
        write_csv(Path(out), rows)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4:])
