"""CLIP score and FID by torchmetrics, with networks from local files alone."""

from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from stages.core.errors import InputError, one_line

HESSEL = 2.5
"""Scale of the published CLIP score: 2.5 times the cosine. Source: Hessel et al. 2021, "CLIPScore", Eq. 1."""


class _Clip(nn.Module):
    """A CLIP model whose features are tensors in every version of transformers, as torchmetrics expects them."""

    def __init__(self, model: Any) -> None:
        super().__init__()
        self.model, self.config = model, model.config

    def get_image_features(self, pixel_values: Tensor) -> Tensor:
        return _pooled(self.model.get_image_features(pixel_values=pixel_values))

    def get_text_features(self, input_ids: Tensor, attention_mask: Tensor) -> Tensor:
        return _pooled(self.model.get_text_features(input_ids=input_ids, attention_mask=attention_mask))


def _pooled(features: Any) -> Tensor:
    return features if isinstance(features, Tensor) else features.pooler_output


class _Inception(nn.Module):
    """A TorchScript network as a module that gives features."""

    def __init__(self, network: Any) -> None:
        super().__init__()
        self.network = network

    def forward(self, pictures: Tensor) -> Tensor:
        return self.network(pictures, return_features=True)


def clip_score(folder: Path, device: torch.device) -> Any:
    """torchmetrics' CLIPScore (100 times the cosine) of a local model. Raises: InputError."""
    from torchmetrics.multimodal import CLIPScore
    from transformers import CLIPModel, CLIPProcessor

    try:
        processor = CLIPProcessor.from_pretrained(folder, local_files_only=True)
        model = CLIPModel.from_pretrained(folder, local_files_only=True).eval()
    except Exception as error:  # whatever a malformed folder makes the loaders trip over
        raise InputError(
            f"--clip {folder}: not a readable CLIP model ({one_line(error)}); expected a folder as transformers writes it"
        ) from error
    tools: Any = (_Clip(model), processor)
    return CLIPScore(lambda: tools).to(device)


def frechet_distance(file: Path, device: torch.device) -> Any:
    """torchmetrics' FID by the features of a TorchScript file. Raises: InputError."""
    from torchmetrics.image.fid import FrechetInceptionDistance

    try:
        network = torch.jit.load(file, map_location=device).eval()
        return FrechetInceptionDistance(_Inception(network)).to(device)
    except Exception as error:  # whatever a malformed file, or another kind of network, makes torch trip over
        raise InputError(
            f"--inception {file}: not a TorchScript feature network ({one_line(error)}); expected inception-2015-12-05.pt"
        ) from error
