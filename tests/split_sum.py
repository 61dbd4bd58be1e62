"""Why a sun does not belong into the environment of three.js, in numbers: a view of a convex asset as preview.png has it, with
the BRDF summed over all texels of the light, with the split sum of three.js summed likewise, and as three.js draws it.

    python -m tests.split_sum ASSET NODE_MODULES [--view 3]

Split sum: light filtered by the GGX lobe of a viewer straight above the mirrored direction, times the albedo of the BRDF.
Source: Karis 2013, "Real Shading in Unreal Engine 4"; Fdez-Agüera 2019, "A Multiple-Scattering Microfacet Model for Real-Time
Image-Based Lighting"; three.js 0.187, envmap_physical_pars_fragment and lights_physical_pars_fragment.
"""

import argparse
import math
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import torch
from numpy.typing import NDArray

from stages.asset.folder import MESH
from stages.asset.textures import read_masters
from stages.bake import preview
from stages.bake.stage import Subject, shown_look, write_set
from stages.bake.studio import backdrop, cameras
from stages.core.albedo import specular_albedo
from stages.core.artifact import load_npz, read_json
from stages.core.brdf import alpha_from_roughness, ggx_d, schlick_weight, specular_over_f
from stages.core.color import srgb_encode
from stages.core.images import read_image
from stages.core.parallel import compiled
from stages.core.progress import silent
from stages.core.schemas import PREP
from stages.core.shading import F0
from stages.light.environment import Environment, directions_of_texels
from stages.light.gbuffer import GBuffer
from stages.light.lights import preview_light
from stages.report import three
from stages.report.preview import cell, psnr, shown

LEAST = 0.045
"""Roughness under which three.js does not go."""


@compiled(inline="always")
def dot(a, i, b, k):  # type: ignore[no-untyped-def]
    """Of row i of one array and row k of the other, (N, 3) each: slices would be made anew for each texel."""
    return a[i, 0] * b[k, 0] + a[i, 1] * b[k, 1] + a[i, 2] * b[k, 2]


@compiled
def summed(n, wo, alpha, towards, light):  # type: ignore[no-untyped-def]
    """E, A and B of points by the sum over texels (T, 3), each with radiance times solid angle (T, 3). Returns: (P, 3, 3)."""
    result = np.zeros((len(n), 3, 3))
    for i in range(len(n)):
        wo_z = max(dot(n, i, wo, i), 1e-4)
        for k in range(len(towards)):
            wi_z = dot(n, i, towards, k)
            if wi_z > 0:
                length = math.sqrt(2 + 2 * dot(wo, i, towards, k))  # of wo + wi
                m_z, cosine = (wo_z + wi_z) / length, length / 2
                m_x = math.sqrt(max(1 - m_z * m_z, 0.0))
                s, lobe = schlick_weight(cosine), specular_over_f(wo_z, wi_z, m_x, 0.0, m_z, alpha[i])
                diffuse = (1 - F0 - (1 - F0) * s) * wi_z / math.pi
                for c in range(3):
                    result[i, 0, c] += diffuse * light[k, c]
                    result[i, 1, c] += (1 - s) * lobe * light[k, c]
                    result[i, 2, c] += s * lobe * light[k, c]
    return result


@compiled
def filtered(axis, alpha, towards, solid_angle, light):  # type: ignore[no-untyped-def]
    """Radiance (P, 3) in the lobe of a viewer straight above: weights D(h) N·L, which sum to 1."""
    result = np.zeros((len(axis), 3))
    for i in range(len(axis)):
        total = 0.0
        for k in range(len(towards)):
            wi_z = dot(axis, i, towards, k)
            if wi_z > 0:
                weight = wi_z * ggx_d(math.sqrt(max(1 - wi_z, 0.0) / 2), 0.0, math.sqrt((1 + wi_z) / 2), alpha[i])
                total += weight * solid_angle[k]
                for c in range(3):
                    result[i, c] += weight * light[k, c]
        for c in range(3):
            result[i, c] /= total
    return result


class Texels:
    """A light as texels: few where it is even, its own where its lamps are."""

    def __init__(self, light: Environment, block: int = 2) -> None:
        height, width = light.radiance.shape[:2]
        towards, angle = directions_of_texels(height, width)
        size = np.broadcast_to(angle[:, None, None], (height, width, 1))
        bright = light.radiance.mean(-1) > 2 * light.radiance.mean()
        coarse = np.kron(bright.reshape(height // block, block, width // block, block).any((1, 3)), np.ones((block,) * 2)) > 0
        even = np.where(coarse[..., None], 0, np.concatenate([towards * size, size, light.radiance * size], -1))
        fine = np.concatenate([towards * size, size, light.radiance * size], -1)[coarse]
        few = even.reshape(height // block, block, width // block, block, 7).sum((1, 3)).reshape(-1, 7)
        rows = np.concatenate([few[few[:, 3] > 0], fine])
        self.towards = rows[:, :3] / np.linalg.norm(rows[:, :3], axis=1, keepdims=True)
        self.solid_angle, self.light = np.ascontiguousarray(rows[:, 3]), np.ascontiguousarray(rows[:, 4:])


def exact(points: GBuffer, material: NDArray, texels: Texels) -> NDArray:
    """Radiance (P, 3) by the BRDF of glTF."""
    alpha = np.maximum(alpha_from_roughness(material[:, 3]), 1e-3)
    E, A, B = summed(points.n.astype(float), points.wo.astype(float), alpha, texels.towards, texels.light).swapaxes(0, 1)
    c, m = material[:, :3], material[:, 4:5]
    return (1 - m) * c * E + (F0 * (1 - m) + m * c) * A + B


def split(points: GBuffer, material: NDArray, texels: Texels) -> NDArray:
    """Radiance (P, 3) by the split sum."""
    roughness = np.maximum(material[:, 3:4], LEAST).astype(float)
    n, wo = points.n.astype(float), points.wo.astype(float)
    cosine = (n * wo).sum(1, keepdims=True).clip(0, 1)
    mirrored = 2 * cosine * n - wo
    axis = mirrored + (n - mirrored) * roughness**4
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    one = np.ones(len(n))
    radiance = filtered(axis, alpha_from_roughness(roughness[:, 0]), texels.towards, texels.solid_angle, texels.light)
    irradiance = filtered(n, one, texels.towards, texels.solid_angle, texels.light)  # over pi: at alpha 1 the lobe is a cosine
    A, B = specular_albedo(*(torch.from_numpy(x[:, 0]) for x in (roughness, cosine))).numpy().T[..., None]
    c, m = material[:, :3], material[:, 4:5]

    def scattered(f0: NDArray) -> tuple[NDArray, NDArray]:
        once, lost, mean = f0 * A + B, 1 - A - B, f0 + (1 - f0) / 21
        return once, once * mean / (1 - lost * mean) * lost

    (plain, plain_more), (metal, metal_more) = scattered(np.full_like(c, F0)), scattered(c)
    more = plain_more + (metal_more - plain_more) * m
    return (plain + (metal - plain) * m) * radiance + (more + (1 - m) * c * (1 - plain - plain_more)) * irradiance


Shade = Callable[[GBuffer, NDArray, Texels], NDArray]


def reflected(
    shade: Shade, texels: Texels, _: Any, points: GBuffer, lights: Any, material: NDArray, *rest: Any, **seed: Any
) -> NDArray:
    """In place of the one that traces rays: nothing casts a shadow here."""
    return shade(points, material, texels)[None].astype(np.float32)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("asset", type=Path)
    parser.add_argument("modules")
    parser.add_argument("--view", type=int, default=3)
    chosen = parser.parse_args()
    asset, studio, light = chosen.asset, read_json(chosen.asset / "preview.json"), preview_light()
    mesh, texels = load_npz(asset / MESH, PREP), Texels(light)
    paths = {name: asset / f"{name}.exr" for name in ("albedo", "roughness", "metallic", "normal", "occlusion", "height")}
    maps = read_masters({name: path for name, path in paths.items() if path.exists()})
    subject = Subject.of(asset / MESH, mesh, len(maps.material))
    with tempfile.TemporaryDirectory() as folder:
        look = shown_look(subject, [write_set(Path(folder), subject, maps, silent)])
    c2w = cameras(mesh["vertices"], mesh["triangles"])[chosen.view]
    pictures = {"preview.png": cell(read_image(asset / "preview.png")[..., :3], studio, chosen.view)}
    for name, shade in (("exact", exact), ("exact split sum", split)):
        with mock.patch.object(preview, "reflected", partial(reflected, shade, texels)):
            pictures[name] = srgb_encode(preview.draw_view(look, light, c2w, studio["size"]).over(backdrop(studio["size"])))
    for name, lamps in (("three.js, sun in the environment", 0), ("three.js, sun as lamps", three.LAMPS)):
        with mock.patch.object(three, "LAMPS", lamps):
            drawn = three.draw(chosen.modules, asset, [studio["views"][chosen.view]], studio)[0]
        pictures[name], on = shown(drawn, studio)
    for name, picture in pictures.items():
        others = (f"{other} {psnr(picture, pictures[other], on):.1f}" for other in pictures if other != name)
        print(f"{name}: dB to " + ", ".join(others))


if __name__ == "__main__":
    main()
