"""Pictures to train a ControlNet on: objects with known materials under known light, in the ControlNet's own conventions.

    out/objects/<as the model's path>/view_NN.npz     one view in all environments of its object
    out/objects/<as the model's path>/manifest.json   written last; its caption, or why it was refused
    out/manifest.json                                 counts, and what was refused why; manifest_2_of_8.json of a part

An object's pictures follow from its file, the options and the seed, so parts of the work can be done anywhere and in any
order. Pictures hold one sample a pixel, as those of distillation, and 8 bits, as those of the paper.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.random import Generator, default_rng
from numpy.typing import NDArray
from torch import Tensor

from stages.conditions.cameras import place_cameras
from stages.conditions.options import ConditionsOptions
from stages.conditions.stage import read_lights, view_normals
from stages.core.artifact import (
    MANIFEST,
    Field,
    Provenance,
    Schema,
    peek,
    plain_options,
    save_npz,
    sha256_file,
    write_json,
    write_manifest,
)
from stages.core.errors import InputError
from stages.core.progress import Progress, silent
from stages.core.shading import Material, light_maps, shade
from stages.light.environment import Environment
from stages.light.gbuffer import trace_view
from stages.light.transport import QUALITY, light_transport
from stages.sd import profile
from stages.sd.filmic import filmic
from stages.train.blip import Captioner
from stages.train.lights import random_light
from stages.train.objects import Entry, TrainingObject, read_captions, read_object
from stages.train.options import PicturesOptions

VIEW = Schema(
    "dreammat.training_view",
    1,
    {
        "mask": Field("?", ("S", "S")),
        # of the mask's pixels, in order; bytes are 255 times the value
        "geometry": Field("u1", ("P", 4)),  # `sd.profile`'s channels 0-3
        "light": Field("u1", ("L", "P", 18)),  # its channels 4-21 in each environment
        "picture": Field("u1", ("L", "P", 3)),
    },
)

OBJECT = Schema("dreammat.training_object", 1, extra=("caption", "lights", "refused"))
"""A folder of views. lights: environments of each. refused: why there are no views, or ""."""

MAX_MISSED = 0.02
"""With a larger share of points without a known material an object is refused."""


@dataclass(frozen=True)
class PicturesResult:
    """manifest: the file. content: what it says. made: objects that were not there before."""

    manifest: Path
    content: dict[str, Any]
    made: int


@dataclass(frozen=True)
class Studio:
    """What all objects are rendered with. lights: to draw from, none for random ones. hashes: of their files, by role."""

    options: PicturesOptions
    lights: list[Environment]
    hashes: dict[str, str]
    captioner: Captioner | None

    @staticmethod
    def of(options: PicturesOptions) -> "Studio":
        """Read lights and captioner. Raises: InputError."""
        lights, _, hashes = read_lights(options.env) if options.env else ([], {}, {})
        return Studio(options, lights, hashes, Captioner(options.captioner) if options.captioner else None)

    def request(self, file: Path, entry: Entry) -> Provenance:
        """What an object's folder follows from; the captioner only where there is no caption."""
        chosen = plain_options(self.options)
        for name in ("captions", "shard", *(["captioner"] if entry.caption else [])):
            del chosen[name]
        asked = {**chosen, "caption": entry.caption, "tags": list(entry.tags)}
        return Provenance(asked, self.options.seed, {"model": sha256_file(file), **self.hashes})

    @property
    def count(self) -> int:
        """Environments of an object: as many as asked for, or all there are to draw from."""
        return min(self.options.lights, len(self.lights) or self.options.lights)

    def draw(self, rng: Generator) -> list[Environment]:
        """The environments of an object."""
        if not self.lights:
            return [random_light(rng, f"light_{k}") for k in range(self.count)]
        return [self.lights[k] for k in rng.permutation(len(self.lights))[: self.count]]


def render_pictures(
    models: Path, out: Path, options: PicturesOptions, force: bool = False, progress: Progress = silent
) -> PicturesResult:
    """Render the training pictures of every GLB file in a folder; continues where it was stopped.

    Raises: InputError when there is nothing to read; OutputError. A model that cannot be used is listed, not raised.
    """
    files = sorted(models.rglob("*.glb"))
    if not files:
        raise InputError(f"{models}: no .glb files in it; expected a folder of textured models")
    part, parts = options.shard
    mine = files[part - 1 :: parts]
    entries, studio = read_captions(options.captions), Studio.of(options)
    refused, made = {}, 0
    for i, file in enumerate(mine):
        progress("objects", i, len(mine))
        name = file.relative_to(models).as_posix()
        entry = entries.get(name, Entry())
        folder, request = out / "objects" / Path(name).with_suffix(""), studio.request(file, entry)
        done = None if force else peek(folder, OBJECT)
        if done is None or not done.same_request(request):
            done, made = render_object(file, folder, entry, request, studio), made + 1
        if done.extra["refused"]:
            refused[name] = done.extra["refused"]
    objects = len(mine) - len(refused)
    pictures = objects * options.views * studio.count
    content = {"files": len(mine), "objects": objects, "pictures": pictures, "refused": refused}
    manifest = out / (MANIFEST if parts == 1 else f"manifest_{part}_of_{parts}.json")
    write_json(manifest, content)
    return PicturesResult(manifest, content, made)


def render_object(file: Path, folder: Path, entry: Entry, request: Provenance, studio: Studio) -> Provenance:
    """Write an object's folder, with its pictures or with the reason why it has none."""
    options, captioner = studio.options, studio.captioner
    (folder / MANIFEST).unlink(missing_ok=True)
    caption, names, refused = entry.caption, [], ""
    try:
        if not (caption or captioner):
            raise InputError(f"{file}: has no caption")
        rng = default_rng([options.seed, int(request.inputs["model"][:12], 16)])
        thing, lights = read_object(file, entry), studio.draw(rng)
        chosen = ConditionsOptions(views=options.views, seed=int(rng.integers(2**31)))
        cameras = place_cameras(thing.scene.vertices.astype(np.float64), chosen)
        for view, (c2w, fov_y) in enumerate(zip(cameras.c2w, cameras.fov_y, strict=True)):
            arrays = render_view(thing, (c2w, float(fov_y)), lights, options, int(rng.integers(2**31)))
            if not caption and captioner:
                caption = captioner.caption(whole(arrays))
            names.append(f"view_{view:02d}.npz")
            save_npz(folder / names[-1], VIEW, arrays, Provenance({}, None, {}))
    except InputError as error:
        names, refused = [], str(error).removeprefix(f"{file}: ")
    extra = {"caption": caption, "lights": studio.count, "refused": refused}
    made = Provenance(request.options, request.seed, request.inputs, extra)
    write_manifest(folder, OBJECT, made, names)
    return made


def render_view(
    thing: TrainingObject, camera: tuple[NDArray, float], lights: list[Environment], options: PicturesOptions, seed: int
) -> dict[str, NDArray]:
    """Arrays of one view. Args: camera: c2w (4, 4) and fov_y. Raises: InputError when too little of it is known."""
    c2w, fov_y = camera
    view = trace_view(thing.scene, c2w, fov_y, options.size, options.size)
    if not view.mask.any():
        raise InputError(f"{thing.model.path}: is not to be seen from all sides")
    values, found = thing.model.material_at(view.point, np.broadcast_to(c2w[:3, 3], view.point.shape))
    if (missed := 1 - found.mean()) > MAX_MISSED:
        raise InputError(f"{thing.model.path}: {missed:.0%} of a view have no material that can be read")
    material = Material.of(torch.from_numpy(values))
    transports = light_transport(thing.scene, view, lights, QUALITY[options.quality], seed)
    mask = torch.from_numpy(view.mask)
    depth, normal = torch.from_numpy(view.depth)[None], torch.from_numpy(view_normals(view, c2w)).movedim(-1, 0)
    conditions, pictures = [], []
    for transport in transports:
        shown = (depth[None], normal[None], mask[None, None].float(), paint(light_maps(transport).flatten(1), mask)[None])
        conditions.append(profile.prepare(*shown)[0][:, mask].T)
        pictures.append(filmic(shade(transport, material)))
    return {
        "mask": view.mask,
        "geometry": as_bytes(conditions[0][:, profile.GEOMETRY]),
        "light": as_bytes(torch.stack(conditions)[..., profile.LIGHT]),
        "picture": as_bytes(torch.stack(pictures)),
    }


def paint(values: Tensor, mask: Tensor, background: Tensor | float = 0.0) -> Tensor:
    """Values (P, C) of the mask's pixels as an image (C, S, S)."""
    image = torch.zeros(values.shape[1], *mask.shape) + background
    image[:, mask] = values.T.to(image.dtype)
    return image


def whole(arrays: dict[str, NDArray]) -> NDArray[np.uint8]:
    """The picture of a view in its first environment, (S, S, 3), on white."""
    image = np.full((*arrays["mask"].shape, 3), 255, np.uint8)
    image[arrays["mask"]] = arrays["picture"][0]
    return image


def as_bytes(values: Tensor) -> NDArray[np.uint8]:
    """Values in [0, 1], a highlight a little above, as bytes."""
    return (values.clamp(0, 1) * 255 + 0.5).to(torch.uint8).numpy()
