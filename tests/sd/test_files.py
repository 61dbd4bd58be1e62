"""Models on disk that are missing, damaged or do not fit: each is one line that says what to do. Needs the extra `sd`."""

import pickle
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

pytest.importorskip("diffusers", reason='needs pip install ".[sd]"')

from stages.core.artifact import sha256_file
from stages.core.errors import InputError
from stages.sd import files
from stages.sd.files import find_models
from stages.sd.memory import Plan
from stages.sd.models import load_models
from stages.sd.options import SdOptions
from tests.sd import tiny


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny.write_models(tmp_path_factory.mktemp("files"))


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    """A copy to spoil."""
    return shutil.copytree(written, tmp_path / "models")


def options(folder: Path) -> SdOptions:
    return SdOptions(str(folder / "sd"), str(folder / "controlnet"))


def use(folder: Path) -> None:
    """All that a run does with the files."""
    load_models(find_models(options(folder)), torch.device("cpu"), Plan()).embed(["gold"])


def config(name: str, **changes: object) -> Callable[[Path], None]:
    return lambda folder: tiny.change_config(folder / name, **changes)


def remove(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def write(name: str, content: bytes) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_bytes(content) and None


def cut(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:-100]) and None


class Harm:
    """What a pickle may hold that is not weights."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return (exec, ("raise SystemExit('the file was executed')",))


def harmful(folder: Path) -> None:
    (folder / "sd/unet/diffusion_pytorch_model.safetensors").unlink()
    (folder / "sd/unet/diffusion_pytorch_model.bin").write_bytes(pickle.dumps(Harm()))


def half_of_the_unet(folder: Path) -> None:
    from safetensors.torch import load_file, save_file

    path = folder / "sd/unet/diffusion_pytorch_model.safetensors"
    state = load_file(path)
    save_file({name: weight for name, weight in state.items() if "mid_block" not in name}, path)


UNET, CONTROL = "sd/unet/config.json", "controlnet/config.json"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (config(CONTROL, conditioning_channels=3), ["controlnet: takes 3 condition channels, expected 22"]),
        (config(CONTROL, cross_attention_dim=32), ["controlnet: reads text of width 32", "unet of 24"]),
        (config(CONTROL, block_out_channels=[16, 64]), ["controlnet: its levels", "trained on"]),
        (config(CONTROL, conditioning_embedding_out_channels=[8, 16, 16]), ["controlnet: divides", "conditions by 4", "by 2"]),
        (config(UNET, in_channels=9), ["unet: takes 9 channels", "vae gives 4", "inpainting"]),
        (config(UNET, cross_attention_dim=32), ["unet: reads text of width 32", "text_encoder writes 24"]),
        (config("sd/scheduler/scheduler_config.json", prediction_type="sample"), ["predicts 'sample'", "v_prediction"]),
        (config("sd/scheduler/scheduler_config.json", num_train_timesteps=50), ["has 50 diffusion times, expected 1000"]),
        (remove(UNET), ["unet/config.json: missing"]),
        (write(UNET, b"{"), ["unet/config.json: missing or not JSON"]),
        (write(UNET, b"{}"), ["unet/config.json: has no 'in_channels'"]),
        (remove("sd/scheduler/scheduler_config.json"), ["scheduler_config.json: missing"]),
        (remove("sd/vae/diffusion_pytorch_model.safetensors"), ["sd/vae: no weights"]),
        (remove("sd/text_encoder/model.safetensors"), ["text_encoder: no weights"]),
        (remove("sd/tokenizer/vocab.json"), ["sd/tokenizer: "]),
        (cut("sd/unet/diffusion_pytorch_model.safetensors"), ["unet/diffusion_pytorch_model.safetensors: not readable"]),
        (cut("sd/text_encoder/model.safetensors"), ["text_encoder/model.safetensors: not readable"]),
        (write("controlnet/diffusion_pytorch_model.safetensors", b""), ["controlnet/diffusion_pytorch_model.safetensors"]),
        (config("sd/vae/config.json", block_out_channels=[16, 64]), ["vae/diffusion_pytorch_model.safetensors"]),
        (half_of_the_unet, ["weights are missing", "mid_block"]),
        (harmful, ["unet/diffusion_pytorch_model.bin: not readable"]),
    ],
)
def test_what_does_not_fit_is_one_line(folder: Path, spoil: Callable[[Path], None], words: list[str]) -> None:
    spoil(folder)
    with pytest.raises(InputError) as caught:
        use(folder)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 700
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("sd_model", "controlnet", "words"),
    [
        ("", "", "--sd-model: not given"),
        ("SD", "", "--controlnet: not given"),
        ("/nowhere/at/all", "CONTROL", "--sd-model /nowhere/at/all: no such folder"),
        ("./nowhere", "CONTROL", "--sd-model ./nowhere: no such folder"),
        ("SD", "SD", "sd/config.json: missing"),
        ("CONTROL", "CONTROL", "controlnet/unet/config.json: missing"),
    ],
)
def test_wrong_folders_are_one_line(written: Path, sd_model: str, controlnet: str, words: str) -> None:
    given = {"SD": str(written / "sd"), "CONTROL": str(written / "controlnet")}
    with pytest.raises(InputError) as caught:
        find_models(SdOptions(given.get(sd_model, sd_model), given.get(controlnet, controlnet)))
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_stable_diffusion_2_1_fits_and_takes_views_of_512(folder: Path) -> None:
    """The numbers of its config files."""
    levels = {"block_out_channels": [320, 640, 1280, 1280], "layers_per_block": 2, "cross_attention_dim": 1024}
    config(UNET, **levels)(folder)
    config(CONTROL, **levels, conditioning_embedding_out_channels=[16, 32, 96, 256])(folder)
    config("sd/vae/config.json", block_out_channels=[128, 256, 512, 512], layers_per_block=2)(folder)
    config("sd/text_encoder/config.json", hidden_size=1024)(folder)
    assert find_models(options(folder)).multiple == 64


def test_a_missing_package_is_named(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "PACKAGES", ("diffusers", "no_such_package"))
    with pytest.raises(InputError, match=r'needs no_such_package, not installed here; pip install "\.\[sd\]"'):
        find_models(options(written))


def test_a_folder_never_asks_the_network(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("the network was asked")

    monkeypatch.setattr("socket.socket.connect", refuse)
    use(written)


def test_files_of_2022_hold_the_same_models(written: Path, folder: Path) -> None:
    """Pickled weights under old names: what the released models come as."""
    tiny.as_released(folder)
    assert b"attentions.0.query.weight" in (folder / "sd/vae/diffusion_pytorch_model.bin").read_bytes()
    new, old = (load_models(find_models(options(f)), torch.device("cpu"), Plan()) for f in (written, folder))
    for name in ("denoiser", "vae"):
        assert torch.equal(tiny.parameters(getattr(new, name)), tiny.parameters(getattr(old, name)))
    assert torch.equal(new.embed(["gold"]), old.embed(["gold"]))


def test_half_precision_variant_is_taken_where_there_is_no_other(folder: Path) -> None:
    path = folder / "controlnet/diffusion_pytorch_model.safetensors"
    path.rename(path.with_name("diffusion_pytorch_model.fp16.safetensors"))
    found = find_models(options(folder))
    assert found.controlnet.weights.name == "diffusion_pytorch_model.fp16.safetensors"
    load_models(found, torch.device("cpu"), Plan())


def test_safetensors_come_before_bin(folder: Path) -> None:
    (folder / "controlnet/diffusion_pytorch_model.bin").write_bytes(b"not looked at")
    found = find_models(options(folder))
    assert found.controlnet.weights.suffix == ".safetensors"
    assert found.hashes()["controlnet"] == sha256_file(folder / "controlnet/diffusion_pytorch_model.safetensors")
    assert set(found.hashes()) == {"unet", "vae", "text_encoder", "controlnet"}


def test_an_id_is_asked_of_the_hub(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is wanted of it: configs, tokenizer and one weight file a part, not what else lies there."""
    asked = []

    def snapshot(model: str, allow_patterns: list[str]) -> str:
        asked.append((model, allow_patterns))
        return str(written / "sd")

    monkeypatch.setattr("huggingface_hub.snapshot_download", snapshot)
    found = find_models(SdOptions("someone/sd-2-1-base", str(written / "controlnet")))
    assert found.base == written / "sd"
    ((model, wanted),) = asked
    assert model == "someone/sd-2-1-base"
    assert "unet/diffusion_pytorch_model.safetensors" in wanted and "text_encoder/model.safetensors" in wanted
    assert not any(".bin" in pattern or "fp16" in pattern or pattern == "*.safetensors" for pattern in wanted)


def test_a_hub_that_does_not_answer_is_one_line(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def snapshot(*_: object, **__: object) -> str:
        raise ConnectionError("no route\nto the hub")

    monkeypatch.setattr("huggingface_hub.snapshot_download", snapshot)
    with pytest.raises(InputError, match=r"--sd-model someone/sd: no such folder, and the hub .*no route to the hub"):
        find_models(SdOptions("someone/sd", str(written / "controlnet")))
