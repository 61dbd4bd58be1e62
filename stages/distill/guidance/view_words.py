"""What a prompt says about the camera, so that a front is not painted on every side.

Source: Poole et al. 2022, "DreamFusion", Section 3.2; the bounds are those of the released DreamMat code.
"""

import math

import numpy as np

from stages.distill.sampling import Images

VIEW_WORDS = ("front view", "side view", "back view", "overhead view")

FRONT, BACK = math.radians(45), math.radians(135)
OVERHEAD = math.radians(60)


def view_words(azimuth: float, elevation: float) -> str:
    """One of `VIEW_WORDS`. Args: radians; the object's front is at azimuth 0."""
    if elevation > OVERHEAD:
        return "overhead view"
    turned = abs(math.remainder(azimuth, 2 * math.pi))
    return "front view" if turned < FRONT else "back view" if turned > BACK else "side view"


def words_of(images: Images) -> list[str]:
    """The words of each image's camera."""
    places = zip(np.atleast_1d(images.azimuth), np.atleast_1d(images.elevation), strict=True)
    return [view_words(float(azimuth), float(elevation)) for azimuth, elevation in places]
