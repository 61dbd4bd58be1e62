"""A prompt read as a recipe."""

from stages.material.recipe import Coat, Recipe
from stages.material.substances import METRES
from stages.prior.model import Prior


def read_prompt(prompt: str, prior: Prior, seed: int) -> Recipe:
    """What the words of a prompt call for."""
    reading = prior.read([prompt])
    red, green, blue, roughness, metallic = reading.coats[0, 0].tolist()
    look = next((name for name in METRES if name in prompt), "granite")
    return Recipe(Coat(look, (red, green, blue), roughness, metallic, metres=METRES[look]), (), seed)
