"""What headless Chromium draws of an asset with three.js: its standard material, no tone mapping.

The sun and other lamps of preview_light.exr are directional lights, the rest is the scene's environment, as in scenes made for
three.js: it prefilters environments for a viewer who looks straight at a surface, which makes a lamp's highlight on a slanted
one too wide (`docs/numbers.md` says by how much). A server of this process gives the page what it loads, from this machine
alone, and takes the pixels back.
"""

import json
import shutil
import subprocess
import tempfile
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stages.core.errors import InputError
from stages.light.environment import Environment, directions_of_texels, load_environment, save_environment

BROWSERS = ("chromium", "chromium-browser", "google-chrome")

SUPERSAMPLE = 4
"""Along each edge of a pixel."""

SECONDS = 300
"""A page that has not drawn by then will not."""

LAMP = 20.0
"""Times the mean radiance from which on a texel of the light is a lamp's."""

LAMPS = 64
"""Directional lights at most, the brightest; three.js has room for as many."""

PAGE = """<!doctype html><script type="importmap">
{"imports": {"three": "/modules/three/build/three.module.js", "three/addons/": "/modules/three/examples/jsm/"}}
</script><script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { EXRLoader } from "three/addons/loaders/EXRLoader.js";
try {
  const job = await (await fetch("/job.json")).json(), side = job.size * job.supersample;
  const renderer = new THREE.WebGLRenderer();
  renderer.toneMapping = THREE.NoToneMapping;
  renderer.setClearColor(0, 0);
  const target = new THREE.WebGLRenderTarget(side, side, { type: THREE.FloatType, colorSpace: THREE.LinearSRGBColorSpace });
  const scene = new THREE.Scene();
  const light = await new EXRLoader().setDataType(THREE.FloatType).loadAsync("/light/rest.exr");
  light.mapping = THREE.EquirectangularReflectionMapping;
  scene.environment = new THREE.PMREMGenerator(renderer).fromEquirectangular(light).texture;
  for (const [direction, irradiance] of job.lamps) {
    const lamp = new THREE.DirectionalLight(new THREE.Color().setRGB(...irradiance));
    lamp.position.set(...direction);
    scene.add(lamp);
  }
  scene.add((await new GLTFLoader().loadAsync("/asset/model.glb")).scene);
  for (const [k, view] of job.views.entries()) {
    const camera = new THREE.PerspectiveCamera(job.fov_y * 180 / Math.PI, 1, view.near, view.far);
    camera.applyMatrix4(new THREE.Matrix4().set(...view.c2w.flat()));
    renderer.setRenderTarget(target);
    renderer.clear();
    renderer.render(scene, camera);
    const pixels = new Float32Array(4 * side * side);
    renderer.readRenderTargetPixels(target, 0, 0, side, side, pixels);
    await fetch("/view/" + k, { method: "POST", body: pixels });
  }
  await fetch("/done", { method: "POST", body: "" });
} catch (error) {
  await fetch("/done", { method: "POST", body: String(error) });
}
</script>"""


class Handler(SimpleHTTPRequestHandler):
    """Serves the page, the asset and the node modules; keeps what the page sends."""

    def __init__(self, desk: "Desk", *args: Any) -> None:
        self.desk = desk
        super().__init__(*args)

    def do_GET(self) -> None:
        answers = {"/": ("text/html", PAGE), "/job.json": ("application/json", json.dumps(self.desk.job))}
        if self.path not in answers:
            super().do_GET()
            return
        kind, text = answers[self.path]
        self._answer(kind, text.encode())

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self._answer("text/plain", b"")
        if self.path == "/done":
            self.desk.problem = body.decode(errors="replace")
            self.desk.done.set()
        else:
            self.desk.pictures.append(np.frombuffer(body, "<f4"))

    def translate_path(self, path: str) -> str:
        """Only what lies in the asset, beside the divided light, or in the module three."""
        desk = self.desk
        for prefix, folder in (("/asset/", desk.asset), ("/light/", desk.light), ("/modules/three/", desk.modules / "three")):
            found = (folder / path.removeprefix(prefix)).resolve()
            if path.startswith(prefix) and found.is_relative_to(folder.resolve()):
                return str(found)
        return ""

    def log_message(self, *args: Any) -> None:
        """Nothing is said of each request."""

    def _answer(self, kind: str, body: bytes) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


class Desk:
    """What one page needs, and what it has sent."""

    def __init__(self, modules: Path, asset: Path, light: Path, job: dict[str, Any]) -> None:
        self.modules, self.asset, self.light, self.job = modules, asset, light, job
        self.pictures: list[NDArray[np.float32]] = []
        self.problem, self.done = "", threading.Event()


def draw(modules: str, asset: Path, views: list[dict[str, Any]], studio: dict[str, Any]) -> list[NDArray[np.float32]]:
    """Views of model.glb under preview_light.exr.

    Args:
        modules: folder of node modules, with three. views, studio: of preview.json.
    Returns:
        radiance and alpha (S, S, 4), premultiplied, of each view.
    Raises: InputError where there is no browser, no three, or the page fails.
    """
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise InputError(f"no browser ({', '.join(BROWSERS)}); install Chromium")
    if not (Path(modules) / "three" / "build" / "three.module.js").is_file():
        raise InputError(f"{modules}: has no three; expected the folder node_modules in which npm has installed it")
    light, lamps = divided(load_environment(asset / "preview_light.exr")[0])
    job = {"size": studio["size"], "supersample": SUPERSAMPLE, "fov_y": studio["fov_y"], "views": [_reach(v) for v in views]}
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as profile:
        save_environment(Path(folder) / "rest.exr", light)
        desk = Desk(Path(modules), asset, Path(folder), job | {"lamps": lamps})
        pictures = _served(desk, browser, profile)
    return [_halved(pixels, studio["size"]) for pixels in pictures]


def divided(light: Environment) -> tuple[Environment, list[tuple[list[float], list[float]]]]:
    """A light as three.js takes it best. Args: light: its middle column towards glTF's +x, as preview_light.exr.

    Returns:
        the environment without what is brighter than LAMP times its mean; of each lamp the direction towards it, glTF's frame,
        and the irradiance that it gives a surface which faces it, RGB.
    """
    towards, solid_angle = directions_of_texels(*light.radiance.shape[:2])
    brightness = light.radiance.mean(-1)
    most = LAMP * np.average(brightness, axis=0, weights=solid_angle).mean()
    brightest = np.argsort(brightness, axis=None)[: -LAMPS - 1 : -1]
    row, column = np.unravel_index(brightest[brightness.flat[brightest] > most], brightness.shape)
    there = light.radiance[row, column].astype(np.float64)
    rest = there * most / brightness[row, column, None]
    irradiance = (there - rest) * solid_angle[row, None]
    x, y, z = towards[row, column].T  # its middle column is +x here too; up is z, and columns run clockwise
    environment = light.radiance.copy()
    environment[row, column] = rest
    lamps = list(zip(np.stack([x, z, -y], 1).tolist(), irradiance.tolist(), strict=True))
    return Environment(light.name, environment), lamps


def _served(desk: Desk, browser: str, profile: str) -> list[NDArray[np.float32]]:
    """What the page draws. Args: profile: a folder for the browser. Raises: InputError."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, desk)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        flags = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        command = [browser, *flags, f"--user-data-dir={profile}", f"http://127.0.0.1:{server.server_port}/"]
        page = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        finished = desk.done.wait(SECONDS)
        page.terminate()
        page.wait()
        server.shutdown()
    if desk.problem or not finished:
        raise InputError(f"{browser}: {desk.problem or 'nothing drawn'}; expected WebGL 2 and three 0.150 or newer")
    return desk.pictures


def _reach(view: dict[str, Any]) -> dict[str, Any]:
    """A view with the nearest and farthest distance that it shows: preview cameras look at the object's middle."""
    distance = float(np.linalg.norm(np.array(view["c2w"])[:3, 3]))
    return view | {"near": distance * 1e-2, "far": distance * 1e2}


def _halved(pixels: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """The mean of each pixel's samples, first row on top. Args: (S^2 4,) from the bottom up. Returns: (size, size, 4)."""
    return pixels.reshape(size, SUPERSAMPLE, size, SUPERSAMPLE, 4).mean((1, 3))[::-1]
