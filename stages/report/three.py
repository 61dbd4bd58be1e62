"""What headless Chromium draws of an asset with three.js: its standard material and image-based lighting, no tone mapping.

A server of this process gives the page what it loads, from this machine alone, and takes the pixels back.
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

BROWSERS = ("chromium", "chromium-browser", "google-chrome")

SUPERSAMPLE = 4
"""Along each edge of a pixel."""

SECONDS = 300
"""A page that has not drawn by then will not."""

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
  const light = await new EXRLoader().setDataType(THREE.FloatType).loadAsync("/asset/preview_light.exr");
  light.mapping = THREE.EquirectangularReflectionMapping;
  scene.environment = new THREE.PMREMGenerator(renderer).fromEquirectangular(light).texture;
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
        """Only what lies in the asset or in the module three."""
        for prefix, folder in (("/asset/", self.desk.asset), ("/modules/three/", self.desk.modules / "three")):
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

    def __init__(self, modules: Path, asset: Path, job: dict[str, Any]) -> None:
        self.modules, self.asset, self.job = modules, asset, job
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
    job = {"size": studio["size"], "supersample": SUPERSAMPLE, "fov_y": studio["fov_y"], "views": [_reach(v) for v in views]}
    desk = Desk(Path(modules), asset, job)
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, desk)) as server, tempfile.TemporaryDirectory() as profile:
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
    return [_halved(pixels, studio["size"]) for pixels in desk.pictures]


def _reach(view: dict[str, Any]) -> dict[str, Any]:
    """A view with the nearest and farthest distance that it shows: preview cameras look at the object's middle."""
    distance = float(np.linalg.norm(np.array(view["c2w"])[:3, 3]))
    return view | {"near": distance * 1e-2, "far": distance * 1e2}


def _halved(pixels: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """The mean of each pixel's samples, first row on top. Args: (S^2 4,) from the bottom up. Returns: (size, size, 4)."""
    return pixels.reshape(size, SUPERSAMPLE, size, SUPERSAMPLE, 4).mean((1, 3))[::-1]
