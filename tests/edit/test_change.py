"""What edits do to values: known ones, those that add up, those that leave what can be shown."""

import numpy as np
import pytest

from stages.core.color import from_oklab, srgb_decode, to_oklab
from stages.core.errors import InputError
from stages.edit.change import changed, greyed
from stages.edit.options import EditOptions

SEAT = np.array([[0.6, 0.3, 0.05, 0.35, 0.8]], np.float32)


def after(material: np.ndarray, *edits: EditOptions) -> tuple[np.ndarray, dict[str, int]]:
    made, clamped = changed(material, edits, [np.ones(len(material), bool)] * len(edits))
    return made.astype(float), {name: int(flags.sum()) for name, flags in clamped.items() if flags.any()}


def some(count: int, seed: int = 0) -> np.ndarray:
    """Materials that stay within bounds under gentle edits."""
    return np.random.default_rng(seed).uniform(0.2, 0.6, (count, 5)).astype(np.float32)


def test_the_three_edits_of_the_paper() -> None:
    """Saturation, metallic inverted, a brighter roughness: values worked out by hand from Ottosson's numbers."""
    grey, _ = after(SEAT, EditOptions(saturation=0))
    long, middle, short = 0.41080, 0.33672, 0.16900  # cones of (0.6, 0.3, 0.05)
    lightness = 0.2104542553 * long ** (1 / 3) + 0.7936177850 * middle ** (1 / 3) - 0.0040720468 * short ** (1 / 3)
    np.testing.assert_allclose(grey[0], [*[lightness**3] * 3, 0.35, 0.8], atol=1e-4)
    half, _ = after(SEAT, EditOptions(saturation=0.5))
    (l0, a0, b0), (l1, a1, b1) = to_oklab(SEAT[0, :3].astype(float)), to_oklab(half[0, :3])
    np.testing.assert_allclose([l1, a1, b1], [l0, a0 / 2, b0 / 2], atol=1e-6)
    inverted, _ = after(SEAT, EditOptions(invert_metallic=True))
    np.testing.assert_allclose(inverted[0], [0.6, 0.3, 0.05, 0.35, 0.2], atol=1e-7)
    brighter, _ = after(SEAT, EditOptions(roughness_scale=1.5))
    np.testing.assert_allclose(brighter[0], [0.6, 0.3, 0.05, 0.525, 0.8], atol=1e-7)


def test_every_other_option_does_what_its_name_says() -> None:
    np.testing.assert_allclose(after(SEAT, EditOptions(brightness=0.5))[0][0, :3], [0.3, 0.15, 0.025], atol=1e-7)
    np.testing.assert_allclose(after(SEAT, EditOptions(roughness_offset=-0.1))[0][0, 3], 0.25, atol=1e-7)
    np.testing.assert_allclose(after(SEAT, EditOptions(metallic=1))[0][0, 4], 1)
    np.testing.assert_allclose(after(SEAT, EditOptions(metallic=1, invert_metallic=True))[0][0, 4], 0)
    tint = srgb_decode(np.array([0x88, 0xAA, 0x55]) / 255)
    for spelled in ("#8a5", "#88aa55", "88AA55"):
        np.testing.assert_allclose(after(SEAT, EditOptions(tint=spelled))[0][0, :3], tint * SEAT[0, :3], atol=1e-6)
    turned, _ = after(SEAT * 0.5, EditOptions(hue=90))
    (l0, a0, b0), (l1, a1, b1) = to_oklab(SEAT[0, :3] * 0.5), to_oklab(turned[0, :3])
    np.testing.assert_allclose([l1, a1, b1], [l0, -b0, a0], atol=1e-6)


def test_hue_and_saturation_leave_greys_alone() -> None:
    grey = np.linspace(0, 1, 11, dtype=np.float32)[:, None].repeat(5, 1)
    made, clamped = after(grey, EditOptions(hue=77, saturation=3))
    np.testing.assert_allclose(made, grey, atol=1e-6)
    assert not clamped


@pytest.mark.parametrize(
    ("each", "whole"),
    [
        (EditOptions(hue=4), EditOptions(hue=40)),
        (EditOptions(saturation=1.02), EditOptions(saturation=1.02**10)),
        (EditOptions(brightness=0.95, roughness_scale=0.97), EditOptions(brightness=0.95**10, roughness_scale=0.97**10)),
        (EditOptions(roughness_offset=0.02), EditOptions(roughness_offset=0.2)),
    ],
    ids=["hue", "saturation", "factors", "offset"],
)
def test_ten_edits_add_up_to_what_one_gives(each: EditOptions, whole: EditOptions) -> None:
    np.testing.assert_allclose(after(some(200), *[each] * 10)[0], after(some(200), whole)[0], atol=1e-6)


def test_what_one_edit_drives_out_of_range_the_next_brings_back() -> None:
    there = EditOptions(brightness=8, roughness_offset=0.9, saturation=5)
    back = EditOptions(brightness=1 / 8, roughness_offset=-0.9, saturation=0.2)
    assert after(some(50), there)[1] == {"albedo": 50, "roughness": 50}
    made, clamped = after(some(50), there, EditOptions(hue=120), EditOptions(hue=-120), back)
    np.testing.assert_allclose(made, some(50), atol=1e-5)
    assert not clamped


def test_colours_that_cannot_be_shown_go_towards_grey_at_their_lightness_and_hue() -> None:
    vivid = from_oklab(to_oklab(some(300)[:, :3].T) * np.array([[1], [6], [6]]))
    outside = (np.abs(vivid - 0.5) > 0.5).any(0)
    assert outside.sum() > 100
    shown = greyed(vivid[:, outside])
    assert shown.min() > -1e-5 and shown.max() < 1 + 1e-5
    (l0, a0, b0), (l1, a1, b1) = to_oklab(vivid[:, outside]), to_oklab(shown)
    np.testing.assert_allclose(l1, l0, atol=1e-5)
    np.testing.assert_allclose(np.arctan2(b1, a1), np.arctan2(b0, a0), atol=1e-3)
    assert (np.hypot(a1, b1) < np.hypot(a0, b0)).all()
    on_border = np.minimum(np.abs(shown).min(0), np.abs(1 - shown).min(0))
    assert on_border.max() < 1e-4  # no greyer than it must be
    np.testing.assert_allclose(greyed(np.array([[3.0], [2.5], [2.0]])), 1, atol=1e-5)


def test_only_the_texels_that_are_meant_change() -> None:
    where = np.arange(200) % 3 == 0
    made, _ = changed(some(200), [EditOptions(hue=30, metallic=1)], [where])
    np.testing.assert_array_equal(made[~where], some(200)[~where])
    assert (made[where] != some(200)[where]).any(1).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tint": "greenish"}, "tint: 'greenish'; expected a colour as #rgb or #rrggbb"),
        ({"hue": float("nan")}, "hue: nan; expected -360 to 360"),
        ({"saturation": -1.0}, "saturation: -1; expected 0 to 100"),
        ({"roughness_scale": float("inf")}, "roughness scale: inf; expected 0 to 100"),
        ({"metallic": 1.5}, "metallic: 1.5; expected 0 to 1"),
    ],
)
def test_what_cannot_be_asked_for(options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message.replace("#", ".")) as caught:
        EditOptions(**options)
    assert "\n" not in str(caught.value)


def test_an_edit_in_words_and_as_json() -> None:
    edit = EditOptions(part=("seat", "leg_*"), hue=20, invert_metallic=True, tint="#8a5", metallic=0)
    assert edit.told() == "hue 20, tint #8a5, metallic 0, invert metallic on seat, leg_*"
    assert EditOptions.of(edit.changes()) == edit
    with pytest.raises(InputError, match="nothing to change"):
        EditOptions(part=("seat",)).changes()
