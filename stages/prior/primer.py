"""What lies between a paint and what it is on: paint comes off down to the primer first, and only within that to the ground."""

from dataclasses import replace

from stages.material.recipe import Coat, Layer, Mask

PAINTS = ("paint", "car paint", "painted wood")
"""Looks that lie on a primer."""

OXIDE, CHALK = (0.44, 0.23, 0.18), (0.72, 0.70, 0.65)
"""sRGB of primers on metal, and on all else."""

WORN = ("chips", "edges")
"""Masks of where paint comes off."""

TRIM = 0.5
"""Wear up to which an edge is trimmed with something, not worn."""

SEEN = 1.5
"""Of how much more the paint has come off than the primer."""


def primed(base: Coat, layers: list[Layer]) -> list[Layer]:
    """The layers, from below, with a primer wherever paint chips: its chips are the paint's, but smaller."""
    found: list[Layer] = []
    for layer in layers:
        chips = next((mask for mask in layer.masks if mask.kind in WORN and mask.wear > TRIM), None)
        if chips:
            paint, ground = (layer.coat, base) if chips.invert else (base, layer.coat)
            if paint.look in PAINTS and ground.look not in (*PAINTS, "rust"):  # rust creeps under paint and primer alike
                alike = tuple(replace(mask, draw=0) if mask is chips else mask for mask in layer.masks)
                layer = replace(layer, masks=alike)
                wider = tuple(_shared(mask) if mask.kind in WORN else mask for mask in alike)
                found.append(Layer(_primer(paint, ground), wider, layer.thickness / 2, layer.strength))
        found.append(layer)
    return found


def _shared(chips: Mask) -> Mask:
    """Where a primer is gone, inverted, or where it shows and what is beneath it will."""
    return replace(chips, share=chips.share / SEEN if chips.invert else chips.share * SEEN)


def _primer(paint: Coat, ground: Coat) -> Coat:
    color = OXIDE if (ground.metallic or 0.0) > 0.5 else CHALK
    return Coat("paint", color, 0.75, 0.0, metres=paint.metres, said="primer")
