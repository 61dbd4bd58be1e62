"""Light between surfaces as distillation sees it: for a material of the whole object, what it adds to any of its pixels."""

from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path
from threading import Lock

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from stages.core.artifact import intact, load_npz, read_exr
from stages.core.errors import ArtifactError
from stages.core.schemas import BOUNCES, VIEW_BOUNCES
from stages.core.shading import Transport
from stages.core.views import view_folder
from stages.light.ends import Ends
from stages.light.environment import Environment
from stages.light.exchange import Exchange
from stages.light.leaving import OwnLight
from stages.light.own_light import with_own_light
from stages.light.reconstruction import Neighbours

FILE = "bounces.npz"

HELD_BYTES = 1 << 29
"""Memory that the ends of views' rays may take."""


class Bounces:
    """Light between surfaces of a finished conditions folder.

    points, normals: (C, 3), where the material of each cell is asked for; label: (C,) int64; footprint: (C,).
    count: of bounces.
    """

    def __init__(self, folder: Path, files: Mapping[str, str], environments: list[str], bounces: int) -> None:
        self._folder, self._files, self.count = folder, files, bounces
        arrays = load_npz(intact(folder, FILE, files), BOUNCES).arrays
        ends, sides = Ends.from_arrays(arrays), len(arrays["direct"])
        expected = (2 * len(arrays["cell_label"]), len(environments), 3)
        if len(ends.mirror) != sides or arrays["direct"].shape != expected:
            raise ArtifactError(f"{folder / FILE}: its cells and their sides do not fit; make the conditions again")
        lights = tuple(read_environment(folder, name, files) for name in environments)
        self._exchange = Exchange(arrays["direct"], ends, arrays["weight"], arrays["angle"], lights)
        self._counts = arrays["lobe_rays"].astype(np.int64)
        self.points, self.normals, scale = (torch.from_numpy(arrays[f"cell_{n}"]) for n in ("point", "normal", "scale"))
        self.label = torch.from_numpy(arrays["cell_label"].astype(np.int64))
        self.footprint = scale * float(arrays["cell_width"])
        self._held: OrderedDict[int, Ends] = OrderedDict()
        self._lock = Lock()

    def solved(self, material: Tensor) -> list[OwnLight]:
        """The light of an object whose cells are of these materials (C, 5), under each environment."""
        return self._exchange.solved(material.detach().cpu().numpy().astype(np.float32).repeat(2, 0), self.count).by_light()

    def added(
        self,
        own: list[OwnLight],
        transport: Transport,
        place: tuple[int, int],
        rows: NDArray[np.int64],
        near: Neighbours,
        wo: NDArray[np.float32],
    ) -> Transport:
        """Transport of some pixels of a view under one environment, with what the object adds.

        Args: place: view and environment. rows: of the view's object pixels. near: how they lie in the picture, and their
        normals. wo: (P, 3) world.
        """
        view, environment = place
        seen = (self.ends(view)[rows], own[environment], self._exchange.skies[environment], self._counts)
        return with_own_light(transport.to(torch.float32), near.n, wo, *seen, near)

    def ends(self, view: int) -> Ends:
        """Where the blocked rays of a view's object pixels end."""
        with self._lock:
            if view in self._held:
                self._held.move_to_end(view)
                return self._held[view]
        name = f"{view_folder(view)}/{FILE}"
        found = Ends.from_arrays(load_npz(intact(self._folder, name, self._files), VIEW_BOUNCES).arrays)
        with self._lock:
            self._held[view] = found
            while len(self._held) > 1 and sum(ends.nbytes for ends in self._held.values()) > HELD_BYTES:
                self._held.popitem(last=False)
        return found


def read_environment(folder: Path, name: str, files: Mapping[str, str]) -> Environment:
    """An environment that conditions kept. Args: files: of the manifest. Raises: ArtifactError."""
    path = intact(folder, f"environments/{name}.exr", files)
    channels = read_exr(path).channels
    if not all(c in channels for c in "RGB"):
        raise ArtifactError(f"{path}: expected channels R, G and B; make the conditions again")
    return Environment(name, np.ascontiguousarray(np.stack([channels[c] for c in "RGB"], -1), np.float32))
