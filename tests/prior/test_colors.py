"""Names of colours and the words that change them."""

import numpy as np
import pytest
from numpy.random import default_rng

from stages.prior.colors import CHANGES, COLORS, COMMON, LEANINGS, RARE, draw_named, named


def test_names_are_drawn_with_what_they_mean() -> None:
    drawn = [draw_named(default_rng(seed)) for seed in range(2000)]
    names = {name for name, _ in drawn}
    assert all(np.array_equal(color, named(name)) and color.min() >= 0 and color.max() <= 1 for name, color in drawn)
    assert all(any(name.startswith(word + " ") for name in names) for word in (*CHANGES, *LEANINGS))
    assert not set(COMMON) & set(RARE)


@pytest.mark.parametrize("color", ["teal", "red", "brown", "gray"])
def test_words_change_a_colour_as_they_say(color: str) -> None:
    def lightness(name: str) -> float:
        return float(named(name).mean())

    assert lightness(f"dark {color}") < lightness(f"deep {color}") < lightness(color)
    assert lightness(color) < lightness(f"light {color}") < lightness(f"pale {color}")
    assert np.ptp(named(f"vivid {color}")) >= np.ptp(named(color)) >= np.ptp(named(f"muted {color}"))


def test_a_leaning_colour_lies_between_two() -> None:
    between = named("bluish green")
    blue, green = named("blue"), named("green")
    assert np.linalg.norm(between - green) < np.linalg.norm(between - blue) < np.linalg.norm(green - blue)
    assert COLORS["green"] != COLORS["blue"]
