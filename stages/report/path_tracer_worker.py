"""What Mitsuba 3's path tracer makes of a view whose object has glTF's material: the truth for light between surfaces.

It follows given rays, not a camera, so that nothing is averaged over a pixel. This file runs as a script in Mitsuba's own
Python environment, which knows nothing of this project: it reads and writes folders of .npy files, as
`stages.report.renderers` does. The material is glTF 2.0's, here as a BSDF of its own: Lambert's lobe
reduced by Fresnel's, and GGX with alpha = r², height-correlated Smith and Schlick. Albedo, roughness and metallic are those of
the one or the other of two materials, by the side of a plane on which a point lies.

One convention is the project's and not the renderer's: where smooth normals turn away from a viewer in front of the triangle,
they are bent back until N·V = `MIN_COSINE`. Mitsuba would light the point from behind the surface.
"""

import sys
from pathlib import Path

import drjit as dr  # type: ignore[import-not-found]
import mitsuba as mi  # type: ignore[import-not-found]
import numpy as np

mi.set_variant("llvm_ad_rgb")

F0 = 0.04

MIN_COSINE = 1e-3
"""As of `stages.core.albedo`."""

BATCH = 64
"""Samples a pixel of one pass, which bounds memory."""


class Gltf(mi.BSDF):  # type: ignore[misc]
    """glTF's metallic-roughness material. materials: (2, 5), for points with x·plane below 0 and above."""

    def __init__(self, properties: mi.Properties) -> None:
        mi.BSDF.__init__(self, properties)
        self.values = [[float(properties[f"v{i}{k}"]) for k in range(5)] for i in range(2)]
        self.plane = mi.Vector3f(*(float(properties[f"p{k}"]) for k in range(3)))
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.DiffuseReflection
        flags = flags | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [flags]
        self.m_flags = flags

    def material(self, si):  # type: ignore[no-untyped-def]
        """Albedo, alpha and metallic at a point."""
        second = dr.dot(si.p, self.plane) > 0
        a, b = self.values
        color = dr.select(second, mi.Color3f(*b[:3]), mi.Color3f(*a[:3]))
        roughness = dr.select(second, mi.Float(b[3]), mi.Float(a[3]))
        return color, roughness * roughness, dr.select(second, mi.Float(b[4]), mi.Float(a[4]))

    def facing(self, si):  # type: ignore[no-untyped-def]
        """A frame, in that of the surface, whose normal is the smooth one on the viewer's side, bent towards a viewer that it
        turns away from."""
        side = dr.select(dr.dot(si.n, si.to_world(si.wi)) >= 0, mi.Float(1), mi.Float(-1))
        cosine = side * si.wi.z
        across = dr.normalize(mi.Vector3f(0, 0, side) - cosine * si.wi)
        bent = MIN_COSINE * si.wi + (1 - MIN_COSINE**2) ** 0.5 * across
        return mi.Frame3f(dr.select(cosine < MIN_COSINE, bent, mi.Vector3f(0, 0, side)))

    def sample(self, ctx, si, sample1, sample2, active=True):  # type: ignore[no-untyped-def]
        """Half of the samples by the cosine, half by the visible normals."""
        _, alpha, metallic = self.material(si)
        frame = self.facing(si)
        wi = frame.to_local(si.wi)
        matt = dr.select(metallic < 1, mi.Float(0.5), mi.Float(0))
        lobe = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, True)
        wm, _ = lobe.sample(wi, sample2)
        wo = dr.select(sample1 < matt, mi.warp.square_to_cosine_hemisphere(sample2), mi.reflect(wi, wm))
        wo = frame.to_world(wo)
        value, density = self.eval_pdf(ctx, si, wo, active)
        good = active & (density > 0)
        bs = mi.BSDFSample3f()
        bs.wo, bs.pdf, bs.eta = wo, dr.select(good, density, 0), 1.0
        bs.sampled_type, bs.sampled_component = mi.UInt32(+self.m_flags), mi.UInt32(0)
        return bs, dr.select(good, value / density, 0)

    def eval(self, ctx, si, wo, active=True):  # type: ignore[no-untyped-def]
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):  # type: ignore[no-untyped-def]
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):  # type: ignore[no-untyped-def]
        """BRDF times cosine, and the density of `sample`."""
        color, alpha, metallic = self.material(si)
        frame = self.facing(si)
        wi, wo = frame.to_local(si.wi), frame.to_local(wo)
        n_v, n_l = wi.z, wo.z
        active = active & (n_v > 0) & (n_l > 0)
        wm = dr.normalize(wi + wo)
        s = (1 - dr.dot(wi, wm)) ** 5
        a2 = alpha * alpha
        q = wm.x * wm.x + wm.y * wm.y + a2 * wm.z * wm.z
        D = a2 / (dr.pi * q * q)
        lambda_v = 0.5 * (dr.sqrt(1 + a2 * (1 - n_v * n_v) / (n_v * n_v)) - 1)
        lambda_l = 0.5 * (dr.sqrt(1 + a2 * (1 - n_l * n_l) / (n_l * n_l)) - 1)
        f0 = F0 * (1 - metallic) + metallic * color
        gloss = (f0 * (1 - s) + s) * D / ((1 + lambda_v + lambda_l) * 4 * n_v)
        diffuse = (1 - metallic) * color * (1 - F0) * (1 - s) * n_l / dr.pi
        matt = dr.select(metallic < 1, mi.Float(0.5), mi.Float(0))
        density = matt * n_l / dr.pi + (1 - matt) * D / ((1 + lambda_v) * 4 * n_v)
        return dr.select(active, diffuse + gloss, 0), dr.select(active, density, 0)


mi.register_bsdf("gltf", Gltf)


def material(job: dict[str, np.ndarray]) -> dict:
    """The plugin's description."""
    values = {f"v{i}{k}": float(job["materials"][i, k]) for i in range(2) for k in range(5)}
    return {"type": "gltf", **values, **{f"p{k}": float(job["plane"][k]) for k in range(3)}}


def view(job: dict[str, np.ndarray]) -> dict:
    """Mesh and light."""
    corners = job["triangles"].reshape(-1)
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(material(job))
    mesh = mi.Mesh("mesh", len(corners), len(job["triangles"]), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = job["vertices"][corners].ravel()
    parameters["vertex_normals"] = job["normals"].reshape(-1, 3).ravel()
    parameters["faces"] = np.arange(len(corners), dtype=np.uint32)
    parameters.update()
    turned = mi.ScalarTransform4f([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    light = {"type": "envmap", "bitmap": mi.Bitmap(job["radiance"]), "to_world": turned}
    return {"type": "scene", "mesh": mesh, "light": light}


def radiance(scene: mi.Scene, depth: int, job: dict[str, np.ndarray]) -> np.ndarray:
    """What comes along the job's rays, (R, 3), over paths of up to `depth` segments."""
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 100})
    rays, total = len(job["directions"]), np.zeros(job["directions"].shape)
    passes = max(1, int(job["samples"]) // BATCH)
    origin, direction = (np.repeat(job[name].astype(np.float32), BATCH, 0) for name in ("origins", "directions"))
    sampler = mi.load_dict({"type": "independent", "sample_count": 1})
    for number in range(passes):
        sampler.seed(number, rays * BATCH)
        ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(origin.T.copy()), mi.Vector3f(direction.T.copy())))
        found, _, _ = integrator.sample(scene, sampler, ray)
        total = total + np.array(found).T.reshape(rays, BATCH, 3).mean(1, dtype=np.float64)
    return total / passes


def main(given: str, made: str) -> None:
    """What comes along a job's rays for each of its depths, (D,); 2 is direct light alone. Writes `radiance`, (D, R, 3)."""
    job = {path.stem: np.load(path, allow_pickle=False) for path in Path(given).glob("*.npy")}
    scene = mi.load_dict(view(job))
    found = np.stack([radiance(scene, depth, job) for depth in job["depths"].tolist()])
    Path(made).mkdir()
    np.save(Path(made) / "radiance.npy", found, allow_pickle=False)


if __name__ == "__main__":
    main(*sys.argv[1:])
