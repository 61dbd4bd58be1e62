"""Which look each name has, and what gathers on things."""

from stages.prior.places import Region

LOOK_OF = {"rusty iron": "rust", "rusty metal": "rust", "rusted metal": "rust"}
"""A substance's name → the look it has, where that has another name."""

FAMILY_LOOKS = dict.fromkeys(("metal", "rust", "wood", "stone", "ceramic", "plastic", "paint", "fabric", "organic", "leather", "paper",
                              "gem", "ice"), "granite")  # fmt: skip
"""Family of a substance → the look of one whose own is missing."""

GATHERS = {
    "moss": Region("crevices", 0.4, 0.18, 1.0), "rust": Region("chips", 0.4, 0.12, 1.0), "dirt": Region("crevices", 0.35, 0.15, 1.0),
    "verdigris": Region("crevices", 0.35, 0.14, 1.0), "snow": Region("up", 0.42, 0.12, 0.4), "frost": Region("edges", 0.35, 0.1, 1.0),
    "mud": Region("below", 0.25, 0.15, 1.0), "lichen": Region("patches", 0.25, 0.1, 1.0), "ice": Region("up", 0.3, 0.15, 0.6),
    "gold leaf": Region("patches", 0.5, 0.25, 0.8), "ash": Region("up", 0.45, 0.2, 1.0), "soot": Region("patches", 0.4, 0.3, 1.0),
}  # fmt: skip
"""What gathers of itself, and where it does when nobody says."""

LAYERED = {"moss": 3e-3, "snow": 8e-3, "rust": 2e-4}
"""Looks that stand proud of what is beneath, metres."""

STUFFS = {
    "rust": ("rust", "#7a4122", 0.88), "dust": ("granite", "#a39a8c", 0.95), "dirt": ("granite", "#3d3226", 0.95),
    "moss": ("granite", "#4a5a22", 0.95), "snow": ("granite", "#eef1f4", 0.85), "grime": ("granite", "#3a352c", 0.85),
    "soot": ("granite", "#1d1b1a", 0.92), "tarnish": ("granite", "#3a342c", 0.7),
}  # fmt: skip
"""What weather leaves: look, sRGB, roughness."""
