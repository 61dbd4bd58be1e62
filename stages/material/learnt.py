"""What material.npz holds: a recipe, the survey of the object that it follows, and what was learnt on top."""

from dataclasses import dataclass
from pathlib import Path

from stages.core.artifact import Artifact
from stages.core.errors import ArtifactError
from stages.material.library import Library
from stages.material.recipe import Recipe
from stages.material.stored import StoredResidual
from stages.material.substances import LOOKS
from stages.material.survey import Lookup, Survey


@dataclass(frozen=True)
class LearntMaterial:
    """recipe: settled on the object. lookup: its survey. residual: logits to add, see `stored.with_residual`."""

    recipe: Recipe
    lookup: Lookup
    residual: StoredResidual

    @staticmethod
    def of(path: Path, made: Artifact, library: Path | None = None) -> "LearntMaterial":
        """From material.npz as loaded. Args: library: folder of the scans that it uses, if it uses any.

        Raises: ArtifactError when header and arrays disagree, or a scan is missing; InputError of the library."""
        try:
            extra = made.provenance.extra
            recipe, residual = Recipe.from_json(extra["recipe"]), StoredResidual.of(extra["residual"], made.arrays)
        except (KeyError, TypeError, ValueError) as error:
            raise ArtifactError(f"{path}: its material does not fit its header ({error}); distill it again") from error
        looks = {coat.look for coat in recipe.coats}
        missing = Library(library).restore(looks) if library else sorted(looks - set(LOOKS))
        if missing:
            raise ArtifactError(f"{path}: it is made of {missing[0]}, a scan; give --library, the folder that has it unchanged")
        return LearntMaterial(recipe, Lookup(Survey.from_arrays(made.arrays)), residual)
