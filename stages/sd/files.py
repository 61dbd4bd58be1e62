"""Where the models lie, in the layout of diffusers: found, and checked against each other, before any of them is loaded.

    SD_MODEL/    unet/ vae/ text_encoder/   config.json and weights, each
                 tokenizer/                 as transformers writes it
                 scheduler/                 scheduler_config.json
    CONTROLNET/  config.json and weights

Weights are `.safetensors`, else `.bin`, of either the half precision variant where there is no other. An id of the
Hugging Face hub is looked up in its cache, else downloaded; nothing else asks the network.
"""

import importlib.util
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stages.core.artifact import read_json, sha256_file
from stages.core.errors import InputError, one_line
from stages.sd.options import SdOptions
from stages.sd.profile import CHANNELS

PACKAGES = ("diffusers", "transformers", "safetensors", "accelerate")

FORMATS = ("safetensors", "bin")

WEIGHTS = tuple(
    f"{stem}{variant}.{format}"
    for format in FORMATS
    for variant in ("", ".fp16")
    for stem in ("diffusion_pytorch_model", "model" if format == "safetensors" else "pytorch_model")
)
"""What diffusers and transformers call a file of weights, the one to be preferred first."""

TIMES = 1000
"""Diffusion times, which the schedules of a run are stated in."""


@dataclass(frozen=True)
class Network:
    """One network on disk: its folder, its config and the file of its weights."""

    folder: Path
    config: dict[str, Any]
    weights: Path

    def __getitem__(self, key: str) -> Any:
        if key not in self.config:
            raise InputError(f"{self.folder / 'config.json'}: has no '{key}'; expected the file that diffusers writes")
        return self.config[key]

    @property
    def factor(self) -> int:
        """How many times an edge shrinks on the way through the network's levels."""
        return 2 ** (len(self["block_out_channels"]) - 1)


@dataclass(frozen=True)
class ModelFiles:
    """A base and a ControlNet that fit each other. See `find_models`."""

    sources: SdOptions
    base: Path
    unet: Network
    vae: Network
    text_encoder: Network
    controlnet: Network
    prediction: str  # "epsilon" or "v_prediction"

    @property
    def networks(self) -> dict[str, Network]:
        """All four by name."""
        return {name: getattr(self, name) for name in ("unet", "vae", "text_encoder", "controlnet")}

    @property
    def multiple(self) -> int:
        """Pixels of which an image's edge must be a multiple."""
        return self.vae.factor * self.unet.factor

    def hashes(self) -> dict[str, str]:
        """SHA-256 of each network's weights."""
        return {name: sha256_file(network.weights) for name, network in self.networks.items()}


def find_models(options: SdOptions) -> ModelFiles:
    """The files of the models that the options name.

    Raises: InputError when packages or files are missing, or the models do not fit each other or the 22 channels.
    """
    base, (unet, vae, text_encoder) = find_base(options.sd_model)
    controlnet = _network(_folder("--controlnet", options.controlnet, ("",)))
    scheduler = read_json(base / "scheduler" / "scheduler_config.json")
    if not isinstance(scheduler, dict):
        raise InputError(f"{base}/scheduler/scheduler_config.json: missing or not JSON; expected the layout of diffusers")
    prediction = scheduler.get("prediction_type", "epsilon")
    files = ModelFiles(options, base, unet, vae, text_encoder, controlnet, prediction)
    for fits, problem in _conditions(files, scheduler.get("num_train_timesteps", TIMES)):
        if not fits:
            raise InputError(problem)
    return files


def need_packages() -> None:
    """Raises: InputError when the packages of the extra `sd` are not installed."""
    if missing := [name for name in PACKAGES if importlib.util.find_spec(name) is None]:
        raise InputError(f'Stable Diffusion: needs {", ".join(missing)}, not installed here; pip install ".[sd]"')


def find_base(source: str) -> tuple[Path, tuple[Network, Network, Network]]:
    """The base's folder, and in it unet, vae and text encoder. Raises: InputError when packages or files are missing."""
    need_packages()
    parts = ("unet", "vae", "text_encoder")
    base = _folder("--sd-model", source, parts)
    unet, vae, text_encoder = (_network(base / name) for name in parts)
    return base, (unet, vae, text_encoder)


def _conditions(files: ModelFiles, times: int) -> list[tuple[bool, str]]:
    """What must hold for the models to work together, and what to say where it does not."""
    unet, vae, text, control = files.unet, files.vae, files.text_encoder, files.controlnet
    shape = ("block_out_channels", "layers_per_block")
    shrunk = 2 ** (len(control["conditioning_embedding_out_channels"]) - 1)
    return [
        (
            unet["in_channels"] == vae["latent_channels"],
            f"{unet.folder}: takes {unet['in_channels']} channels, but {vae.folder} gives {vae['latent_channels']}; "
            "give a text-to-image model, not one for inpainting, depth or upscaling",
        ),
        (
            unet["cross_attention_dim"] == text["hidden_size"],
            f"{unet.folder}: reads text of width {unet['cross_attention_dim']}, but {text.folder} writes "
            f"{text['hidden_size']}; give a Stable Diffusion 1.x or 2.x whose parts belong together",
        ),
        (
            control["conditioning_channels"] == CHANNELS,
            f"{control.folder}: takes {control['conditioning_channels']} condition channels, expected {CHANNELS} "
            "(depth, normal, six light maps); give DreamMat's light-geo-controlnet or one trained like it",
        ),
        (
            control["cross_attention_dim"] == unet["cross_attention_dim"],
            f"{control.folder}: reads text of width {control['cross_attention_dim']}, but {unet.folder} of "
            f"{unet['cross_attention_dim']} (1024: Stable Diffusion 2.x, 768: 1.x); give the base it was trained on",
        ),
        (
            all(control[key] == unet[key] for key in shape),
            f"{control.folder}: its levels {[control[key] for key in shape]} differ from {[unet[key] for key in shape]} "
            f"of {unet.folder}; give the base it was trained on",
        ),
        (
            shrunk == vae.factor,
            f"{control.folder}: divides the size of conditions by {shrunk}, but {vae.folder} that of pictures by "
            f"{vae.factor}; give the base it was trained on",
        ),
        (
            files.prediction in ("epsilon", "v_prediction"),
            f"{files.base}: predicts '{files.prediction}', expected epsilon or v_prediction; give another base",
        ),
        (times == TIMES, f"{files.base}: has {times} diffusion times, expected {TIMES}; give another base"),
    ]


def _folder(option: str, source: str, parts: tuple[str, ...]) -> Path:
    """The local folder of what a user gave: a path, or an id of the hub."""
    if not source:
        raise InputError(f"{option}: not given; expected a folder in the layout of diffusers, or an id of the hub")
    path = Path(source).expanduser()
    if path.is_dir():
        return path
    if not re.fullmatch(r"\w[\w.-]*/[\w.-]+", source):
        raise InputError(f"{option} {source}: no such folder; expected one in the layout of diffusers, or an id of the hub")
    try:
        return _download(source, parts)
    except Exception as error:  # the hub's library raises its own, the network's and the file system's
        raise InputError(
            f"{option} {source}: no such folder, and the hub does not give it ({one_line(error)}); give a folder instead"
        ) from error


def _download(model: str, parts: tuple[str, ...]) -> Path:
    """The hub's copy of a model, of one weight format alone."""
    from huggingface_hub import snapshot_download

    for format in FORMATS:
        names = [name for name in WEIGHTS if name.endswith(format) and ".fp16." not in name]
        wanted = [str(Path(part, name)) for part in parts for name in names]
        folder = Path(snapshot_download(model, allow_patterns=["*.json", "*.txt", *wanted]))
        if all(_weights(folder / part) for part in parts):
            break
    return folder


def _network(folder: Path) -> Network:
    config, weights = read_json(folder / "config.json"), _weights(folder)
    if not isinstance(config, dict):
        raise InputError(f"{folder}/config.json: missing or not JSON; expected the layout of diffusers")
    if weights is None:
        raise InputError(f"{folder}: no weights there; expected a .safetensors or .bin file as diffusers names it")
    return Network(folder, config, weights)


def _weights(folder: Path) -> Path | None:
    """The file of a folder's weights."""
    return next((folder / name for name in WEIGHTS if (folder / name).is_file()), None)
