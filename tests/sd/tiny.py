"""Stable Diffusion with random weights, small enough for a test, in the files and folders of the real one.

The VAE halves pictures (the real one divides by 8) and the UNet has two levels: edges are multiples of 4. Text is 24 wide.
"""

import json
from pathlib import Path

import torch
from torch import nn

SEED = 0
WIDTH = 24
TOKENS = 77
LEVELS = (16, 32)
MULTIPLE = 4


def write_models(folder: Path, prediction: str = "epsilon") -> Path:
    """Write sd/ and controlnet/ into the folder, as diffusers saves them."""
    from diffusers import AutoencoderKL, ControlNetModel, DDIMScheduler, UNet2DConditionModel
    from transformers import CLIPTextConfig, CLIPTextModel

    base, level = folder / "sd", {"block_out_channels": LEVELS, "layers_per_block": 1, "norm_num_groups": 4}
    with torch.random.fork_rng():
        torch.manual_seed(SEED)
        unet = UNet2DConditionModel(
            cross_attention_dim=WIDTH,
            attention_head_dim=4,
            down_block_types=("CrossAttnDownBlock2D", "DownBlock2D"),
            up_block_types=("UpBlock2D", "CrossAttnUpBlock2D"),
            **level,
        )
        controlnet = ControlNetModel.from_unet(
            unet, conditioning_channels=22, conditioning_embedding_out_channels=(8, 16), load_weights_from_unet=True
        )
        for parameter in controlnet.parameters():  # a fresh one changes nothing: its last layers are 0
            parameter.data += 0.1 * torch.randn_like(parameter)
        vae = AutoencoderKL(down_block_types=("DownEncoderBlock2D",) * 2, up_block_types=("UpDecoderBlock2D",) * 2, **level)
        sizes = {"num_hidden_layers": 2, "num_attention_heads": 2, "max_position_embeddings": TOKENS}
        ids = {"bos_token_id": 0, "eos_token_id": 1, "pad_token_id": 2}
        text = CLIPTextModel(CLIPTextConfig(vocab_size=515, hidden_size=WIDTH, intermediate_size=32, **sizes, **ids))
    for name, network in {"unet": unet, "vae": vae, "text_encoder": text}.items():
        network.save_pretrained(base / name)
    controlnet.save_pretrained(folder / "controlnet")
    scheduler = DDIMScheduler(1000, 0.00085, 0.012, "scaled_linear", prediction_type=prediction)
    scheduler.save_pretrained(base / "scheduler")
    _write_tokenizer(base / "tokenizer")
    return folder


def _write_tokenizer(folder: Path) -> None:
    """Single letters and nothing longer, in the four files that Stable Diffusion 2.1 comes with; padding is "!"."""
    start, end, letters = "<|startoftext|>", "<|endoftext|>", _letters()
    words = [start, end, "!", *(w for w in letters if w != "!"), *(letter + "</w>" for letter in letters), "zz", "zzz"]
    tokens = {"bos_token": start, "eos_token": end, "unk_token": end, "pad_token": "!"}
    config = {"tokenizer_class": "CLIPTokenizer", "model_max_length": TOKENS, "do_lower_case": True, **tokens}
    folder.mkdir()
    (folder / "vocab.json").write_text(json.dumps({word: i for i, word in enumerate(words)}), encoding="utf-8")
    (folder / "merges.txt").write_text("#version: 0.2\nz z\nzz z\n", encoding="utf-8")
    (folder / "tokenizer_config.json").write_text(json.dumps(config))
    (folder / "special_tokens_map.json").write_text(json.dumps(tokens))


def _letters() -> list[str]:
    """The 256 letters that byte-pair encoding gives bytes."""
    plain = [*range(ord("!"), ord("~") + 1), *range(ord("¡"), ord("¬") + 1), *range(ord("®"), ord("ÿ") + 1)]
    return [chr(b) for b in plain] + [chr(256 + i) for i in range(256 - len(plain))]


def as_released(folder: Path) -> Path:
    """Turn every weight file into the pickled `.bin` of 2022, with the names that weights then had."""
    from safetensors.torch import load_file

    old = {"to_q": "query", "to_k": "key", "to_v": "value", "to_out.0": "proj_attn"}
    for path in sorted(folder.rglob("*.safetensors")):
        state = load_file(path)
        if path.parent.name == "vae":
            for new, then in old.items():
                state = {name.replace(f"attentions.0.{new}.", f"attentions.0.{then}."): w for name, w in state.items()}
        if path.parent.name == "text_encoder":
            state = {f"text_model.{name.removeprefix('text_model.')}": w for name, w in state.items()}
            state["text_model.embeddings.position_ids"] = torch.arange(TOKENS)[None]
        name = "pytorch_model.bin" if path.name == "model.safetensors" else "diffusion_pytorch_model.bin"
        torch.save(state, path.with_name(name))
        path.unlink()
    return folder


def change_config(path: Path, **changes: object) -> None:
    """Change entries of a JSON file."""
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def parameters(network: nn.Module) -> torch.Tensor:
    """All of a network's parameters in one row."""
    return torch.cat([p.detach().float().flatten() for p in network.parameters()])
