"""Text encoder of the prior: a small transformer over the vectors of words, trained with the diffusion model."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from stages.prior.vocabulary import MAX_WORDS


@dataclass(frozen=True)
class TextEmbedding:
    """What the network reads of B prompts. tokens: (B, L, W); present: (B, L) bool; pooled: (B, W)."""

    tokens: Tensor
    present: Tensor
    pooled: Tensor

    def expand(self, count: int) -> "TextEmbedding":
        """One prompt's embedding, `count` times."""
        return TextEmbedding(*(part.expand(count, *part.shape[1:]) for part in self.parts()))

    def parts(self) -> tuple[Tensor, Tensor, Tensor]:
        """The three tensors."""
        return self.tokens, self.present, self.pooled

    @staticmethod
    def cat(embeddings: list["TextEmbedding"]) -> "TextEmbedding":
        """Several batches as one."""
        return TextEmbedding(*(torch.cat(parts) for parts in zip(*(e.parts() for e in embeddings), strict=True)))


class TextEncoder(nn.Module):
    """A transformer over word vectors; the tokens put before them, `roots`, stand for the whole prompt, the empty one too."""

    def __init__(self, dims: int = 64, width: int = 128, layers: int = 2, heads: int = 4, roots: int = 1) -> None:
        super().__init__()
        self.project = nn.Linear(dims, width)
        self.whole = nn.Parameter(torch.randn(1, roots, width) * 0.02)
        self.position = nn.Parameter(torch.randn(1, roots + MAX_WORDS, width) * 0.02)
        self.blocks = nn.ModuleList(TextBlock(width, heads) for _ in range(layers))
        self.norm = nn.LayerNorm(width)

    def forward(self, vectors: Tensor, present: Tensor) -> TextEmbedding:
        """Args: as `Vocabulary.encode` returns them, on the module's device."""
        whole = self.whole.expand(len(vectors), -1, -1)
        x = torch.cat([whole, self.project(vectors * vectors.shape[-1] ** 0.5)], 1) + self.position
        present = torch.cat([torch.ones_like(present[:, : whole.shape[1]]), present], 1)  # (B, L)
        for block in self.blocks:
            x = block(x, present)
        x = self.norm(x)
        return TextEmbedding(x, present, x[:, 0])


class Reader(TextEncoder):
    """Reads words as a material on average: what is asked where no table knows a word."""

    def __init__(self, dims: int = 64, width: int = 128) -> None:
        super().__init__(dims, width, roots=3)
        self.coat = nn.Sequential(nn.Linear(width, width), nn.SiLU(), nn.Linear(width, 5))

    def read(self, vectors: Tensor, present: Tensor) -> Tensor:
        """sRGB albedo, roughness and metallic in (0, 1), (B, 5). Args: as `Vocabulary.encode` returns them."""
        return torch.sigmoid(self.coat(self(vectors, present).pooled))


class TextBlock(nn.Module):
    """Pre-norm self-attention and MLP."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.norm_1, self.norm_2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.qkv, self.out = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.mlp = nn.Sequential(nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, width))

    def forward(self, x: Tensor, present: Tensor) -> Tensor:
        """Args: x (B, L, W); present (B, L), tokens that may be attended to."""
        b, length, width = x.shape
        q, k, v = self.qkv(self.norm_1(x)).view(b, length, 3, self.heads, -1).permute(2, 0, 3, 1, 4)
        mixed = nn.functional.scaled_dot_product_attention(q, k, v, attn_mask=present[:, None, None, :])
        x = x + self.out(mixed.transpose(1, 2).reshape(b, length, width))
        return x + self.mlp(self.norm_2(x))
