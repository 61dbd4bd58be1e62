"""One value everywhere: what distillation begins from when no words are read."""

import numpy as np

from stages.material.look import Look
from stages.material.place import Place

DARK_DIELECTRIC = 0.27, 0.55, 0.12
"""Linear albedo, roughness, metallic of a start from which metals and dielectrics both are reached."""


def even(at: Place) -> Look:
    """A dark grey dielectric."""
    albedo, roughness, metallic = (np.full(len(at), value, np.float32) for value in DARK_DIELECTRIC)
    return Look(np.stack([albedo] * 3), roughness, metallic)


LOOKS = {"even": even}
METRES = {"even": 1.0}
