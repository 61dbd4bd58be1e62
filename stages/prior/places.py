"""Words that say where something lies: parts of things, patterns, and what wear and weather do."""

from typing import NamedTuple

from stages.material.recipe import Mask


class Region(NamedTuple):
    """kind, share: of a mask. sharp: parts end where they end; weather does not."""

    kind: str
    share: float
    size: float = 0.05
    wear: float = 0.0

    def mask(self) -> Mask:
        return Mask(self.kind, self.share, self.size, self.wear)


def _table(text: str, region: Region) -> dict[str, Region]:
    return {word.strip(): region for word in text.split(",")}


PARTS: dict[str, Region] = {
    **_table("sole, soles, outsole, tread, treads", Region("below", 0.08)),
    **_table("base, bottom, foot, feet, pedestal, plinth, stand, underside, lower half, lower part, bottom half", Region("below", 0.5)),
    **_table("plinth, pedestal, stand, socle, foundation, hem", Region("below", 0.22)),
    **_table("foot, feet, legs, leg, paws, hooves, castors, wheels, tyres, tires", Region("below", 0.3)),
    **_table("top, upper half, upper part, top half, upper", Region("above", 0.5)),
    **_table("lid, cap, cover, roof, hood, dome, crown, crest, hat, bonnet", Region("above", 0.22)),
    **_table("rim, lip, brim, collar, mouth", Region("above", 0.06)),
    **_table("neck, spout", Region("above", 0.3)),
    **_table("head, face, helmet, canopy, backrest, back rest, seat back", Region("above", 0.35)),
    **_table("seat, cushion, cushions, tabletop, table top, shelf", Region("up", 0.3)),
    **_table("tip, point, spire, finial, tips", Region("above", 0.1)),
    **_table("blade", Region("above", 0.7)), **_table("handle, grip, hilt, haft, pommel, shaft", Region("below", 0.3)),
    **_table("front, front side, fascia, door", Region("front", 0.3)), **_table("back side, rear, reverse", Region("back", 0.3)),
    **_table("trim, trims, edges, edging, edge, borders, border, trimming, piping, frame, rims, corners, outline, accents, "
             "edge trim, gilding, highlights", Region("edges", 0.1, 0.04, 0.1)),
    **_table("crevices, grooves, cracks, recesses, joints, hollows, crannies, folds, engraving, engravings, gaps, seams",
             Region("crevices", 0.22, 0.08, 0.6)),
    **_table("inside, interior, lining, cavity", Region("hidden", 0.3, 0.05, 0.1)),
}  # fmt: skip
"""Parts of things that name a region."""

SHAPES: dict[str, Region] = {
    **_table("stripes, stripe, striped, pinstripes", Region("stripes", 0.5, 0.14)),
    **_table("bands, band, hoops, rings, ring, straps, belts, banded", Region("bands", 0.3, 0.22)),
    **_table("spots, spot, dots, polka dots, polka, spotted, dotted, speckles, freckles, flecks", Region("spots", 0.3, 0.14)),
    **_table("checks, checkered, chequered, checkerboard, squares, check, checked", Region("checks", 0.5, 0.12)),
    **_table("patches, patch, stains, stained, splotches, blotches, areas, camouflage, marbling, swirls, mottled, splashes, "
             "splatters", Region("patches", 0.35, 0.16, 0.7)),
    **_table("streaks, drips, runs, streaked", Region("streaks", 0.2, 0.12, 0.8)),
    **_table("scratches", Region("scratches", 0.06, 0.1, 0.8)),
    **_table("inlay, inlays, inlaid, veins, filigree, lines", Region("bands", 0.16, 0.2)),
}  # fmt: skip
"""Patterns in which one thing lies on another."""

ANIMALS = {
    "leopard": ("#c79a5b", "#2a1a10", Region("spots", 0.32, 0.1, 0.8)),
    "cheetah": ("#d6ac6a", "#1c130d", Region("spots", 0.22, 0.08, 0.2)),
    "jaguar": ("#bf8c48", "#1f140c", Region("spots", 0.38, 0.13, 0.8)),
    "zebra": ("#ece8e0", "#161514", Region("stripes", 0.5, 0.12, 0.6)),
    "tiger": ("#cf7a28", "#1a120c", Region("stripes", 0.35, 0.16, 0.7)),
    "giraffe": ("#a8682f", "#e0c898", Region("crevices", 0.2, 0.1)),
    "cow": ("#ece8e2", "#1b1918", Region("patches", 0.4, 0.3, 0.1)),
    "dalmatian": ("#efece6", "#151414", Region("spots", 0.25, 0.12, 0.3)),
    "ladybird": ("#c4181c", "#121212", Region("spots", 0.25, 0.22)),
    "ladybug": ("#c4181c", "#121212", Region("spots", 0.25, 0.22)),
    "camouflage": ("#5a5c3a", "#3a3324", Region("patches", 0.45, 0.2, 0.2)),
    "camo": ("#5a5c3a", "#3a3324", Region("patches", 0.45, 0.2, 0.2)),
}
"""Coats that everybody knows: ground, marks, and how these lie."""


class Weather(NamedTuple):
    """What a word of wear or weather lays over a thing. substance: words for it, "" where what is beneath shows. regions:
    where. thickness: metres. strength: most that it covers. """

    substance: str
    regions: tuple[Region, ...]
    thickness: float = 0.0
    strength: float = 1.0


WEATHER: dict[str, Weather] = {
    **dict.fromkeys(("rusty", "rusted", "rusting", "corroded"), Weather("rust", (Region("chips", 0.42, 0.12, 1.0),), 2e-4)),
    **dict.fromkeys(("dusty", "sandy"), Weather("dust", (Region("up", 0.5, 0.2, 1.0),), 1e-4, 0.6)),
    **dict.fromkeys(("dirty", "grimy", "muddy", "filthy", "soiled"), Weather("dirt", (Region("crevices", 0.4, 0.15, 1.0),), 1e-4, 0.85)),
    **dict.fromkeys(("mossy", "overgrown"), Weather("moss", (Region("crevices", 0.42, 0.18, 1.0),), 3e-3)),
    **dict.fromkeys(("snowy", "snow-covered", "snow-capped", "frosted over", "frosty"), Weather("snow", (Region("up", 0.42, 0.12, 0.4),), 8e-3)),
    **dict.fromkeys(("worn", "battered", "battle-worn", "distressed", "used", "chipped edges"), Weather("", (Region("edges", 0.1, 0.06, 1.0),), -1e-4)),
    **dict.fromkeys(("chipped", "peeling", "flaking", "flaky", "crackled paint"), Weather("", (Region("chips", 0.2, 0.08, 0.9),), -2e-4)),
    **dict.fromkeys(("scratched", "scuffed", "scraped"), Weather("", (Region("scratches", 0.05, 0.1, 0.9),), -5e-5)),
    **dict.fromkeys(("stained", "water-stained", "streaked"), Weather("grime", (Region("streaks", 0.3, 0.14, 0.9),), 0.0, 0.6)),
    **dict.fromkeys(("charred", "burnt", "burned", "scorched"), Weather("soot", (Region("patches", 0.4, 0.3, 1.0),), 0.0, 0.9)),
    **dict.fromkeys(("tarnished", "patinated", "oxidised", "oxidized"), Weather("tarnish", (Region("crevices", 0.4, 0.15, 0.9),), 0.0, 0.8)),
    **dict.fromkeys(("weathered", "aged", "old", "ancient", "antique", "vintage", "worn out"),
                    Weather("grime", (Region("crevices", 0.3, 0.15, 1.0),), 0.0, 0.55)),
}  # fmt: skip
"""Words of wear and weather."""

FADED = {"weathered": 0.85, "aged": 0.9, "old": 0.95, "faded": 0.7, "bleached": 0.6, "sun-bleached": 0.6, "vintage": 0.92}
"""Words that take colour out: factor of the saturation."""

WET = {"wet": 0.35, "damp": 0.6, "oily": 0.45, "slimy": 0.35}
"""Words of wetness: factor of the roughness."""
