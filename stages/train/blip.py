"""Captions of pictures by BLIP, where a captions file has none. Source: Li et al. 2022, "BLIP"."""

import importlib.util
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from stages.core.errors import InputError, one_line
from stages.sd.models import be_quiet

TOKENS = 40
"""A caption has at most so many."""


class Captioner:
    """A BLIP model for captions, from a local folder as transformers writes it. Raises: InputError."""

    def __init__(self, folder: Path) -> None:
        if importlib.util.find_spec("transformers") is None:
            raise InputError('--captioner: needs transformers, not installed here; pip install ".[sd]"')
        from transformers import BlipForConditionalGeneration, BlipProcessor

        be_quiet()
        try:
            self._processor = BlipProcessor.from_pretrained(folder, local_files_only=True)
            self._model = BlipForConditionalGeneration.from_pretrained(folder, local_files_only=True).eval()
        except Exception as error:  # whatever a malformed folder makes the loaders trip over
            raise InputError(
                f"--captioner {folder}: not a readable BLIP model ({one_line(error)}); expected what transformers writes"
            ) from error
        if torch.cuda.is_available():
            self._model.cuda()

    def caption(self, picture: NDArray[np.uint8]) -> str:
        """What a picture (H, W, 3) shows."""
        inputs = self._processor(images=picture, return_tensors="pt").to(self._model.device)
        with torch.no_grad():
            tokens = self._model.generate(**inputs, max_new_tokens=TOKENS)
        return self._processor.decode(tokens[0], skip_special_tokens=True).strip()
