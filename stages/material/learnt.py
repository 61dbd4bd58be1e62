"""What material.npz holds: a recipe, the survey of the object that it follows, and what was learnt on top."""

from dataclasses import dataclass
from pathlib import Path

from stages.core.artifact import Artifact
from stages.core.errors import ArtifactError
from stages.material.recipe import Recipe
from stages.material.residual import Residual
from stages.material.survey import Lookup, Survey


@dataclass(frozen=True)
class LearntMaterial:
    """recipe: settled on the object. lookup: its survey. residual: logits to add, see `residual.combined`."""

    recipe: Recipe
    lookup: Lookup
    residual: Residual

    @staticmethod
    def of(path: Path, made: Artifact) -> "LearntMaterial":
        """From material.npz as loaded. Raises: ArtifactError when header and arrays disagree."""
        try:
            extra = made.provenance.extra
            recipe, residual = Recipe.from_json(extra["recipe"]), Residual.from_arrays(extra["residual"], made.arrays)
        except (KeyError, TypeError, ValueError) as error:
            raise ArtifactError(f"{path}: its material does not fit its header ({error}); distill it again") from error
        return LearntMaterial(recipe, Lookup(Survey.from_arrays(made.arrays)), residual)
