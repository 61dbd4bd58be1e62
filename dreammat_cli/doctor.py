"""dreammat doctor: whether this machine can run dreammat, and what to do where it cannot."""

import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import click

from dreammat_cli.common import Common, common_options, examples, show

NEEDED = {  # package: the module it brings
    "click": "click", "embreex": "embreex.mesh_construction", "numba": "numba", "numpy": "numpy", "OpenEXR": "OpenEXR",
    "OpenImageIO": "OpenImageIO", "pymeshlab": "pymeshlab", "rich": "rich", "scipy": "scipy", "torch": "torch",
    "trimesh": "trimesh", "xatlas": "xatlas",
}  # fmt: skip

EXTRAS = {
    "fbx": ("ufbx", "FBX meshes"),
    "gltf": ("DracoPy", "glTF files compressed by Draco or meshopt"),
    "usd": ("pxr", "USD meshes, and export --for usd"),
    "materialx": ("MaterialX", "export --for materialx"),
    "web": ("DracoPy", "export --for web"),
    "sd": ("diffusers", "distill --guidance sd"),
    "report": ("matplotlib", "dreammat report"),
}

MEMORY, DISK = 4.0, 4.0
"""GiB that a default run wants at most."""

OK, OPTIONAL, WRONG = "ok", "-", "WRONG"
CANNOT_RUN = 5


class Finding(NamedTuple):
    """One line of the report. state: `OK`, `OPTIONAL` for what may be absent, or `WRONG`. remedy: what to do, if anything."""

    state: str
    what: str
    found: str
    remedy: str = ""


@click.command(
    epilog=examples(
        "dreammat doctor",
        "dreammat doctor --json",
    )
)
@common_options
def command(common: Common) -> None:
    """Check this machine: packages, cores, memory, disk, GPU, models, and two seconds of real work.

    Ends with code 0 where the four stages can run and 5 where something that they need is wrong; each line says how to mend it.
    """
    findings = [finding for check in CHECKS for finding in check()]
    width = max(len(finding.what) for finding in findings)
    lines = [f"{f.state:5}  {f.what:{width}}  {f.found}" + (f"; {f.remedy}" if f.remedy else "") for f in findings]
    show(common, {"findings": [finding._asdict() for finding in findings]}, lines)
    wrong = [finding.what for finding in findings if finding.state == WRONG]
    if wrong:
        from stages.core.errors import OutputError

        raise OutputError(f"doctor: {', '.join(wrong)} must be mended before all four stages can run here")


def packages() -> Iterator[Finding]:
    """Python, dreammat and what it is built on, each really imported."""
    yield Finding(OK, "dreammat", f"{metadata.version('dreammat')}, Python {platform.python_version()}, {sys.platform}")
    for package, module in NEEDED.items():
        try:
            import_module(module)
        except Exception as error:  # what a broken binary package raises is anybody's guess
            yield Finding(WRONG, package, said(error), f"pip install --force-reinstall {package}")
        else:
            yield Finding(OK, package, metadata.version(package))


def extras() -> Iterator[Finding]:
    """What only some formats and commands need."""
    for extra, (module, purpose) in EXTRAS.items():
        if find_spec(module):
            yield Finding(OK, f"[{extra}]", purpose)
        else:
            yield Finding(OPTIONAL, f"[{extra}]", f"not installed: {purpose}", f"pip install 'dreammat[{extra}]'")


def machine() -> Iterator[Finding]:
    """Cores, memory, disk."""
    from stages.core.parallel import cores

    yield Finding(OK, "cores", str(cores()))
    free = free_memory()
    few = "a default run wants 4; use fewer --views, a smaller --size" if free < MEMORY else ""
    yield Finding(OK if free >= 1 else WRONG, "memory", f"{free:.1f} GiB free", few)
    for what, folder in {"disk here": Path.cwd(), "disk for temporary files": Path(tempfile.gettempdir())}.items():
        space = shutil.disk_usage(folder).free / 2**30
        remedy = "a default run writes up to 2 GiB, 128 views of 512² 3" if space < DISK else ""
        writable = os.access(folder, os.W_OK)
        found = f"{space:.0f} GiB free" if writable else f"{folder} cannot be written"
        yield Finding(OK if writable else WRONG, what, found, remedy if writable else "go to another folder, or set TMPDIR")


def free_memory() -> float:
    """GiB that this process may still take: of the machine, its control group, and its own limit."""
    limits = [float("inf"), float("inf")]
    try:
        lines = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        limits.append(int(lines["MemAvailable"].split()[0]) / 2**20)
        held = Path("/sys/fs/cgroup/memory.max").read_text().strip()
        limits.append((int(held) - int(Path("/sys/fs/cgroup/memory.current").read_text())) / 2**30)
    except (OSError, ValueError, KeyError):  # not Linux, or no limit
        pass
    try:
        import resource
    except ImportError:  # Windows
        return min(limits)
    own = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    return min(*limits, *(limit / 2**30 for limit in own if limit != resource.RLIM_INFINITY))


def accelerator() -> Iterator[Finding]:
    """A GPU, which nothing needs."""
    import torch

    if torch.cuda.is_available():
        yield Finding(OK, "GPU", f"{torch.cuda.get_device_name()}, CUDA {torch.version.cuda}")
    else:
        yield Finding(OPTIONAL, "GPU", "none that torch can use; everything but --guidance sd is meant for a CPU")


def models() -> Iterator[Finding]:
    """The embedded model, and the big ones on disk."""
    from stages.prior.model import load_prior

    yield Finding(OK, "embedded model", f"{load_prior().identity['weights'][:12]}, as it was shipped")
    home = Path(os.environ.get("HF_HOME", Path.home() / ".cache/huggingface"))
    found = sorted(path.name.removeprefix("models--").replace("--", "/") for path in home.glob("hub/models--*"))
    if found:
        yield Finding(OK, "models of the hub", ", ".join(found))
    else:
        yield Finding(OPTIONAL, "models of the hub", f"none in {home}; only --guidance sd, eval and captions want any")


def work() -> Iterator[Finding]:
    """A ray, a gradient, a picture on disk, a compiled kernel."""
    for what, attempt in {"Embree": trace, "torch": differentiate, "OpenEXR": write_and_read, "numba": compile_kernel}.items():
        try:
            yield Finding(OK, f"test of {what}", attempt())
        except Exception as error:
            yield Finding(WRONG, f"test of {what}", said(error), f"reinstall {what.lower()}, or try another version")


def trace() -> str:
    """A ray at a triangle. Returns: what was done."""
    import numpy as np

    from stages.light.scene import Scene

    corners, normals = np.eye(3, dtype=np.float32), np.ones((1, 3, 3), np.float32)
    scene = Scene(corners, np.arange(3, dtype=np.int32)[None], normals)
    ray = np.ones((1, 3), np.float32)
    hits = scene.intersect(ray, -ray)
    if not hits.mask[0] or abs(hits.t[0] - 2 / 3) > 1e-6:
        raise ArithmeticError(f"a ray met a triangle at {hits.t[0]}, expected 2/3")
    return "a ray met its triangle"


def differentiate() -> str:
    """The slope of a square. Returns: what was done."""
    import torch

    x = torch.tensor(3.0, requires_grad=True)
    x.square().backward()
    if x.grad is None or float(x.grad) != 6:
        raise ArithmeticError(f"the slope of x² at 3 is {x.grad}, expected 6")
    return "a gradient is right"


def write_and_read() -> str:
    """A picture to disk and back. Returns: what was done."""
    import numpy as np

    from stages.core.artifact import read_exr, write_exr

    pixels = np.linspace(0, 100, 16, dtype=np.float32).reshape(4, 4)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "test.exr"
        write_exr(path, {"Y": pixels})
        back = read_exr(path).full("Y")
    if not np.array_equal(back, pixels):
        raise ArithmeticError("a picture came back changed")
    return "a picture came back from disk as it was"


def compile_kernel() -> str:
    """A kernel through numba. Returns: whether machine code is kept for later runs."""
    from stages.core.parallel import compiled
    from stages.material.noise_kernels import add_octave

    if compiled(_double)(1.5) != 3:
        raise ArithmeticError("a compiled kernel is wrong")
    kept = add_octave.stats.cache_path
    if kept is None or not os.access(kept, os.W_OK):
        return f"kernels compile, but once more in every process: {kept or 'no folder'} to keep them in; set NUMBA_CACHE_DIR"
    return "kernels compile, and are kept for later runs"


def _double(x: float) -> float:
    return 2 * x


def said(error: BaseException) -> str:
    """What an error says, in one line."""
    from stages.core.errors import one_line

    return one_line(error)


CHECKS: tuple[Callable[[], Iterator[Finding]], ...] = (packages, extras, machine, accelerator, models, work)
