"""A BLIP model with random weights, small enough for a test, in the files of the real one. Needs the extra `sd`."""

from pathlib import Path

import numpy as np
import pytest
import torch

pytest.importorskip("transformers", reason='needs pip install ".[sd]"')

from stages.core.errors import InputError
from stages.train.blip import Captioner

WORDS = ("[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", "[DEC]", "red", "ball")
SIZE = 32


def write_blip(folder: Path) -> Path:
    from transformers import BertTokenizer, BlipConfig, BlipForConditionalGeneration, BlipImageProcessor, BlipProcessor

    size = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2, "intermediate_size": 16}
    ids = {"vocab_size": len(WORDS), "pad_token_id": 0, "bos_token_id": 5, "eos_token_id": 3, "sep_token_id": 3}
    text = {**size, **ids, "encoder_hidden_size": 16, "max_position_embeddings": 64}
    config = BlipConfig(text_config=text, vision_config={**size, "image_size": SIZE, "patch_size": 16}, projection_dim=16)
    with torch.random.fork_rng():
        torch.manual_seed(0)
        model = BlipForConditionalGeneration(config)
    with torch.no_grad():  # it says "ball" whatever it sees
        model.text_decoder.cls.predictions.decoder.bias[WORDS.index("ball")] += 100
    model.save_pretrained(folder)
    tokenizer = BertTokenizer(vocab={word: i for i, word in enumerate(WORDS)}, bos_token="[DEC]")
    BlipProcessor(BlipImageProcessor(size={"height": SIZE, "width": SIZE}), tokenizer).save_pretrained(folder)
    return folder


def test_a_caption_is_the_models_words(tmp_path: Path) -> None:
    caption = Captioner(write_blip(tmp_path)).caption(np.full((40, 40, 3), 200, np.uint8))
    assert set(caption.split()) == {"ball"}


def test_a_folder_without_blip_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--captioner .*: not a readable BLIP model"):
        Captioner(tmp_path)
