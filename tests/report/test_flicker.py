"""A view is the same whatever the size of the textures that it is rendered with."""

import pytest

from stages.report.flicker import flicker

LOOKS = ("oak", "marble", "brick", "rust", "leather", "concrete", "linen", "bark", "fur", "onyx", "brushed iron", "tenmoku")


@pytest.mark.parametrize("look", LOOKS)
def test_textures_of_1024_and_of_4096_texels_give_the_same_colours(look: str) -> None:
    """To 1 %, with the default samples."""
    assert flicker(look, 1 / 32, supersample=2, relief=0.0) <= 0.01


def test_relief_and_point_samples_are_measured_too() -> None:
    smooth, rough = flicker("marble", 1 / 32), flicker("stucco", 1 / 32)
    assert 0 < smooth < 0.01 < rough  # a normal map of coarse texels leans less than the mean of fine ones
