"""The same view in Mitsuba 3, for comparison: speed and error of one light map, against its own converged result.

Mitsuba has an environment of its own. This file is run there as a script, which reads and writes folders of .npy files.
Its material is the `principled` one, white, roughness 0.5: the integral is the same kind, not the same to the last digit,
which is why each renderer is compared with itself.
"""

import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SAMPLES = (16, 64, 256)
"""Samples a pixel that are timed."""

CONVERGED = 1024

BATCH = 256
"""Samples a pixel of one pass, which bounds memory."""

MAPS = 6
"""Light maps of one environment, each a rendering of its own there."""


@dataclass(frozen=True)
class Render:
    """One timed rendering of the white dielectric of roughness 0.5. Errors in percent, tone-mapped, over the object.

    all_maps_seconds: of the six light maps of every environment, at this many samples.
    """

    environment: str
    samples: int
    seconds: float
    all_maps_seconds: float
    rmse_percent: float
    p999_percent: float


@dataclass(frozen=True)
class Job:
    """A view for Mitsuba: `stages.light.scene.Scene`, camera to world, fov in radians, pixels, environments."""

    scene: "object"
    c2w: np.ndarray
    fov_y: float
    size: int
    environments: tuple


def measure(python: str, job: Job, mask: np.ndarray) -> list[Render]:
    """Render every environment with the given interpreter.

    Raises: InputError when the interpreter or its mitsuba fails.
    """
    from stages.core.color import reinhard  # not to be had where this file runs as a script
    from stages.core.errors import InputError

    renders = []
    with tempfile.TemporaryDirectory() as folder:
        for environment in job.environments:
            given, made = Path(folder) / f"{environment.name}_job", Path(folder) / f"{environment.name}_result"
            mesh = {name: getattr(job.scene, name) for name in ("vertices", "triangles", "normals")}
            write_arrays(given, mesh | {"c2w": job.c2w, "fov_y": job.fov_y, "size": job.size, "radiance": environment.radiance})
            try:
                subprocess.run([python, __file__, str(given), str(made)], check=True, capture_output=True)
            except (OSError, subprocess.CalledProcessError) as error:
                raise InputError(
                    f"{python}: {error}; expected a Python with the package mitsuba and LLVM 15 or newer "
                    "(DRJIT_LIBLLVM_PATH names its library)"
                ) from error
            result = read_arrays(made)
            tone = {samples: reinhard(result[str(samples)][mask]) for samples in (*SAMPLES, CONVERGED)}
            seconds = dict(zip(SAMPLES, result["seconds"].tolist(), strict=True))
            for samples in SAMPLES:
                off = np.abs(tone[samples] - tone[CONVERGED])
                rmse, p999 = float(np.sqrt(np.square(off).mean())), float(np.quantile(off, 0.999))
                everything = seconds[samples] * MAPS * len(job.environments)
                row = (samples, seconds[samples], everything, rmse * 100, p999 * 100)
                renders.append(Render(environment.name, *row))
    return renders


def write_arrays(folder: Path, arrays: dict) -> None:
    """Each array as <name>.npy."""
    folder.mkdir()
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", array, allow_pickle=False)


def read_arrays(folder: Path) -> dict[str, np.ndarray]:
    """What `write_arrays` wrote."""
    return {path.stem: np.load(path, allow_pickle=False) for path in folder.glob("*.npy")}


def render(given: str, made: str) -> None:
    """What runs inside of Mitsuba's environment."""
    import mitsuba as mi  # type: ignore[import-not-found]

    mi.set_variant("llvm_ad_rgb")
    job = read_arrays(Path(given))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "mesh": mesh_of(mi, job),
            "light": {
                "type": "envmap",
                "bitmap": mi.Bitmap(job["radiance"]),
                "to_world": mi.ScalarTransform4f([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
            },
            "sensor": {
                "type": "perspective",
                "fov": float(np.degrees(job["fov_y"])),
                "fov_axis": "y",
                "to_world": mi.ScalarTransform4f((job["c2w"] @ np.diag([-1.0, 1.0, -1.0, 1.0])).tolist()),
                "film": {
                    "type": "hdrfilm",
                    "width": int(job["size"]),
                    "height": int(job["size"]),
                    "pixel_format": "rgb",
                    "rfilter": {"type": "box"},
                },
            },
        }
    )
    images, seconds = {}, []
    np.array(mi.render(scene, spp=4, seed=999))  # compiles
    for samples in SAMPLES:
        start = time.perf_counter()
        images[str(samples)] = np.array(mi.render(scene, spp=samples, seed=samples))
        seconds.append(time.perf_counter() - start)
    batches = [np.array(mi.render(scene, spp=BATCH, seed=10_000 + i)) for i in range(CONVERGED // BATCH)]
    write_arrays(Path(made), images | {"seconds": np.array(seconds), str(CONVERGED): np.mean(batches, 0)})


def mesh_of(mi, job):  # type: ignore[no-untyped-def]
    """The working mesh, its corners apart so that each keeps its normal."""
    corners = job["triangles"].reshape(-1)
    properties = mi.Properties()
    material = {"type": "principled", "base_color": {"type": "rgb", "value": 1.0}, "roughness": 0.5, "metallic": 0.0}
    properties["bsdf"] = mi.load_dict({"type": "twosided", "nested": material})
    mesh = mi.Mesh("mesh", len(corners), len(job["triangles"]), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = job["vertices"][corners].ravel()
    parameters["vertex_normals"] = job["normals"].reshape(-1, 3).ravel()
    parameters["faces"] = np.arange(len(corners), dtype=np.uint32)
    parameters.update()
    return mesh


if __name__ == "__main__":
    render(*sys.argv[1:])
