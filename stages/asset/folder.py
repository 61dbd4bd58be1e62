"""The folder that `bake` wrote, opened for a reader: its manifest checked, its model read, its name made safe."""

from dataclasses import dataclass
from pathlib import Path

from stages.asset.read_glb import Look, TexturedModel, read_model
from stages.core.artifact import Provenance, read_manifest, sha256_file
from stages.core.errors import ArtifactError
from stages.core.naming import identifier, unique
from stages.core.schemas import ASSET
from stages.core.texture_sets import texture_sets

MODEL = "model.glb"

MESH = "mesh.npz"
"""The prep.npz that an asset is baked from."""


@dataclass(frozen=True)
class Asset:
    """A baked asset. name: of the source, in letters, digits and underscores. sha256: of its manifest."""

    folder: Path
    name: str
    provenance: Provenance
    model: TexturedModel
    sha256: str

    def stems(self) -> list[tuple[str, Look]]:
        """The distinct sets of pictures, each under a file stem of its own; all slots share one in most assets.

        A texture set goes by its name, else by that of the first material that shows it.
        """
        distinct: list[Look] = []
        for look in self.model.looks:
            if all(look.pictures != other.pictures for other in distinct):
                distinct.append(look)
        if len(distinct) == 1:
            return [(self.name, distinct[0])]
        named = {f"albedo{one.suffix}": one.name for one in texture_sets(self.provenance) if one.name}
        names = unique([identifier(named.get(look.pictures["albedo"].name, look.name)).lstrip("_") for look in distinct])
        return [(f"{self.name}_{name}", look) for name, look in zip(names, distinct, strict=True)]

    def stem_of(self, look: Look) -> str:
        """The stem of a material's pictures."""
        return next(stem for stem, other in self.stems() if other.pictures == look.pictures)


def read_asset(folder: Path) -> Asset:
    """Open an asset folder. Raises: ArtifactError that names the file and what to do."""
    provenance, files = asset_manifest(folder)
    if sha256_file(folder / MODEL) != files.get(MODEL):
        raise ArtifactError(f"{folder / MODEL}: not the file that {ASSET.manifest} lists; bake the asset again")
    name = identifier(Path(str(provenance.extra.get("source_name", "asset"))).stem)
    return Asset(folder, name, provenance, read_model(folder / MODEL), sha256_file(folder / ASSET.manifest))


def asset_manifest(folder: Path) -> tuple[Provenance, dict[str, str]]:
    """How an asset was made, and its files' hashes. Raises: ArtifactError."""
    if folder.is_dir() and not (folder / ASSET.manifest).exists():
        raise ArtifactError(f"{folder}: holds no {ASSET.manifest}; expected a folder that `dreammat bake` wrote")
    return read_manifest(folder, ASSET)
