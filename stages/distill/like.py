"""The recipe of another material, for another mesh: the same stuff, drawn with the same seed, at the same physical scale."""

from dataclasses import dataclass, replace
from pathlib import Path

from stages.core.artifact import load_npz, sha256_file
from stages.core.errors import InputError
from stages.core.schemas import MATERIAL
from stages.distill.options import DistillOptions
from stages.material.learnt import LearntMaterial
from stages.material.recipe import EVEN, Coat, Mask, Recipe
from stages.prior.places import PARTS


@dataclass(frozen=True)
class Like:
    """recipe: as settled on its own object. prompt: its words. extent: longest edge of that object, in its source's units.
    digest: SHA-256 of the file."""

    recipe: Recipe
    prompt: str
    extent: float
    digest: str

    def carried(self, extent: float, metres: float | None) -> Recipe:
        """The recipe on another object, not settled, its structure as large in space as on its own; its parts nowhere yet.

        Args:
            extent: the other object's, in the same units. metres: its longest edge, where it is told.
        """
        return _carried(self.recipe, metres / self.recipe.base.metres if metres is not None else extent / self.extent)


def _carried(recipe: Recipe, times: float) -> Recipe:
    layers = []
    for layer in recipe.layers:
        masks = tuple(_unsettled(mask, times) for mask in layer.masks)
        layers.append(replace(layer, coat=_resized(layer.coat, times), masks=masks))
    parts = (replace(part, labels=(), recipe=_carried(part.recipe, times)) for part in recipe.parts)
    return replace(recipe, base=_resized(recipe.base, times), layers=tuple(layers), parts=tuple(parts))


def _unsettled(mask: Mask, times: float) -> Mask:
    """A mask before any mesh was known; where it was found on one, what its word says, to be found again."""
    if mask.kind in ("pieces", "along", "level"):
        kind = PARTS[mask.said].kind if mask.said in PARTS else "below"
        mask = replace(mask, kind=kind, pieces=(), axis=())
    return replace(mask, size=mask.size / times, level=None)


def _resized(coat: Coat, times: float) -> Coat:
    """A coat on an object so many times as large."""
    return replace(coat, metres=coat.metres * times)


def read_like(path: Path, options: DistillOptions) -> Like:
    """The material to be like. Raises: InputError, ArtifactError."""
    if options.guidance != "prior":
        raise InputError(f"--like with --guidance {options.guidance}: it follows no recipe; expected --guidance prior")
    if options.prompt.strip():
        raise InputError(f"--like: {path} brings its own words; leave --prompt out")
    made = load_npz(path, MATERIAL)
    extra = made.provenance.extra
    recipe = LearntMaterial.of(path, made, options.library).recipe
    if recipe == EVEN or not str(extra["prompt"]).strip():
        raise InputError(f"{path}: has no recipe to be like, expected a material distilled from words with --guidance prior")
    if "extent" not in extra:
        raise InputError(f"{path}: does not say how large its object is; distill it again")
    return Like(recipe, str(extra["prompt"]), float(extra["extent"]), sha256_file(path))
