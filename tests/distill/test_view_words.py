import math

import pytest

from stages.distill.guidance.view_words import view_words


@pytest.mark.parametrize(
    "azimuth, elevation, words",
    [(0, 0, "front view"), (44, 20, "front view"), (90, 0, "side view"), (-90, 0, "side view"), (180, 10, "back view"),
     (-150, 0, "back view"), (400, 0, "front view"), (0, 75, "overhead view")],
)
def test_view_words(azimuth: float, elevation: float, words: str) -> None:
    assert view_words(math.radians(azimuth), math.radians(elevation)) == words
