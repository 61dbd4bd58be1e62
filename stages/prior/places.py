"""Words that say where something lies: parts of things, patterns, and what wear and weather do."""

from typing import NamedTuple

from stages.material.recipe import Mask


class Region(NamedTuple):
    """kind, share, size, wear, soft: of a mask. Parts end where they end; weather does not, and powders and stains thin out."""

    kind: str
    share: float
    size: float = 0.05
    wear: float = 0.0
    soft: float = 0.0

    def mask(self, said: str = "") -> Mask:
        return Mask(self.kind, self.share, self.size, self.wear, said=said, soft=self.soft)


def _table(*entries: tuple[str, Region]) -> dict[str, Region]:
    return {word.strip(): region for text, region in entries for word in text.split(",")}


PARTS = _table(
    ("body, bodies, walls, sides, main body, bodywork, exterior, outside, background, ground, rest, siding, cladding, casing, "
     "housing, enclosure, chassis, outer shell, plating, armour plating, armor plating, body panels, fuselage, main part, "
     "everything else, remainder", Region("all", 1.0)),
    ("hull", Region("below", 0.6)),
    ("below the waterline, under the waterline, below the water line", Region("below", 0.4)),
    ("above the waterline, above the water line", Region("above", 0.6)),
    ("lower body", Region("below", 0.5)), ("upper body", Region("above", 0.5)),
    ("label, sticker, decal, screen print", Region("badge", 0.6)),
    ("lettering, letters, numerals, writing", Region("badge", 0.3)),
    ("logo, emblem, badge, insignia, crest, coat of arms, lock, padlock, keyhole, latch, boss, shield boss, umbo, hub, "
     "doorknob, door knob, doorbell, belt buckle", Region("badge", 0.2)),
    ("dial, dials, watch face, clock face", Region("badge", 0.7)),
    ("middle, waist, midsection, centre, center, central part, middle section, middle part", Region("middle", 0.33)),
    ("bottom, underside, lower half, lower part, bottom half, lower, lower section", Region("below", 0.5)),
    ("sole, soles, outsole, tread, treads", Region("below", 0.08)),
    ("base, pedestal, plinth, stand, socle, foundation, foundations, hem, skirting", Region("below", 0.2)),
    ("exhaust, exhausts, exhaust pipe, exhaust pipes, muffler, tailpipe, chin strap, chinstrap, drawer, drawers, "
     "skids, tracks, caterpillar tracks, undercarriage, suspension, tank treads", Region("below", 0.25)),
    ("ankle, ankles, knee, knees", Region("below", 0.3)), ("carapace", Region("up", 0.55)),
    ("window frames, window frame, door frames, door frame, sills", Region("edges", 0.06, 0.04)),
    ("raised areas, raised parts, high points, high spots, raised details", Region("edges", 0.3, 0.1, 0.3)),
    ("pommel", Region("below", 0.08)),
    ("guard, crossguard, cross-guard, cross guard, handguard, hand guard, tsuba, quillons, bolster", Region("below", 0.36)),
    ("end, one end, far end", Region("above", 0.25)),
    ("shirt, tunic, torso, vest, jacket, sweater, robe, breastplate, chestplate", Region("middle", 0.4)),
    ("trousers, pants, jeans, shorts, skirt", Region("below", 0.5)),
    ("boots, shoes, sneakers, sandals", Region("below", 0.12)),
    ("arms, arm, wings, wing, hands, gloves, gauntlets, sleeves, fins, armrests, arm rests, side panels",
     Region("sides", 0.45)),
    ("stern", Region("back", 0.25)), ("bow, prow, figurehead", Region("front", 0.2)),
    ("sails, sail, rigging", Region("above", 0.6)),
    ("deck", Region("up", 0.3)), ("fretboard, fingerboard", Region("above", 0.45)),
    ("foot, feet, legs, leg, paws, hooves, castors, casters, wheels, tyres, tires, stem, stalk", Region("below", 0.3)),
    ("top, upper half, upper part, top half, upper, upper section", Region("above", 0.5)),
    ("roof, roofing, rooftop", Region("above", 0.42)),
    ("lid, cap, cover, hood, dome, crown, hat, bonnet, lids, stopper, hair, comb, mane, beret, hood ornament, turban, "
     "awning, ceiling", Region("above", 0.22)),
    ("lower third, bottom third, lowest third", Region("below", 0.33)),
    ("lower quarter, bottom quarter", Region("below", 0.25)),
    ("upper third, top third", Region("above", 0.33)), ("upper quarter, top quarter, capital", Region("above", 0.25)),
    ("shade, lampshade", Region("above", 0.5)),
    ("rim, lip, brim, collar, mouth, rims", Region("above", 0.06)),
    ("neck, spout, shoulders", Region("above", 0.3)),
    ("head, face, helmet, canopy, backrest, back rest, seat back, headboard", Region("above", 0.35)),
    ("seat, cushion, cushions, tabletop, table top, shelf, shelves, upholstery, desktop, countertop", Region("up", 0.3)),
    ("tip, point, spire, finial, tips, horns, antlers, knob", Region("above", 0.1)),
    ("blade, blades, barrel of it", Region("above", 0.7)),
    ("handle, grip, hilt, haft, shaft, wrapping, wrap, wraps, binding, handles, handlebar, stock", Region("below", 0.3)),
    ("front, front side, fascia, door, front half, screen, windows, window, windshield, windscreen, visor, faceplate, "
     "face plate, grille, grill, panel, panels, chest plate, chest, beard", Region("front", 0.3)),
    ("beak, nose, snout, eyes, nozzle, toe, toes, toe cap, toe caps, toecap, toecaps", Region("front", 0.12)),
    ("back, back side, rear, reverse, back half, tail, backside", Region("back", 0.3)),
    ("left half, left side, left", Region("left", 0.5)), ("right half, right side, right", Region("right", 0.5)),
    ("belly, underbelly, bottom side", Region("down", 0.3)),
    ("trim, trims, edges, edging, edge, borders, border, trimming, piping, frame, corners, corner, outline, outlines, accents, "
     "edge trim, highlights, details, detailing, decoration, decorations, ornaments, fittings, hardware, hinges, "
     "beams, ribs, fringe, tassels, moulding, molding, ridges, bezel, stitching, laces, "
     "shoelaces, scabbard, sheath, rivet heads",
     Region("edges", 0.1, 0.04, 0.1)),
    ("crevices, grooves, cracks, recesses, joints, hollows, crannies, folds, engraving, engravings, gaps, seams, crevice, "
     "carvings, between the scales, between its scales, between the bricks, between the stones, "
     "between the planks, between the tiles, "
     "engraved lines, creases, corners inside, cavities, pits", Region("crevices", 0.22, 0.08, 0.6)),
    ("inside, interior, lining, cavity, inner side", Region("hidden", 0.3, 0.05, 0.1)),
)
"""Parts of things that name a region."""

WORN = frozenset([
    "chest", "shirt", "tunic", "vest", "jacket", "sweater", "robe", "breastplate", "trousers", "pants", "jeans", "shorts",
    "skirt", "boots", "shoes", "sneakers", "sandals", "panel", "panels",
])  # fmt: skip
"""Parts that are things of their own unless another thing has them: "an orc with brown boots"."""


def _of_things(*entries: tuple[str, dict[str, Region]]) -> dict[str, dict[str, Region]]:
    return {thing.strip(): places for text, places in entries for thing in text.split(",")}


_LACES = Region("up", 0.15)
PARTS_OF = _of_things(
    ("table, desk, bench, stool, chair, nightstand, dresser, cabinet, sideboard",
     {"top": Region("above", 0.12), "legs": Region("below", 0.6), "seat": Region("up", 0.3)}),
    ("shield, kite shield, round shield, tower shield, buckler, door, mirror, window, picture frame, playing card, sign, "
     "road sign, traffic sign, rug", {"rim": Region("edges", 0.12, 0.04), "face": Region("badge", 3.0)}),
    ("shoe, shoes, sneaker, sneakers, boot, boots, trainers, running shoe, running shoes, hiking boot, hiking boots",
     {"laces": _LACES, "shoelaces": _LACES}),
    ("penguin, emperor penguin, king penguin, teddy bear, teddy, owl, robin, snowman, gnome, robot, doll, action figure, "
     "squirrel, meerkat, kangaroo, hamster, plush toy", {"belly": Region("front", 0.3)}),
    ("guitar, acoustic guitar, electric guitar, violin, cello, ukulele, banjo, lute",
     {"top": Region("badge", 3.0), "back": Region("back", 0.3)}),
    ("lamp, floor lamp, table lamp, desk lamp, street lamp, lamp post",
     {**dict.fromkeys(("stem", "arm", "pole", "stand"), Region("below", 0.7)), "base": Region("below", 0.15),
     "shade": Region("above", 0.35)}),
    ("container, cargo container, shipping container, robot, mech, spaceship, locker, fridge, spacecraft, gas pump",
     dict.fromkeys(("panel", "panels"), PARTS["body"])),
    ("armchair, sofa, couch, settee, ottoman, lounge chair", {"upholstery": PARTS["body"], "cushions": Region("up", 0.45)}),
    ("house, cottage, stone cottage, building, villa, church, chapel, shop, cabin, hut, barn, townhouse",
     {"door": Region("badge", 0.25), "doors": Region("badge", 0.25)}),
    ("drum, war drum, snare drum, bongo, tambourine", {"top": Region("up", 0.3)}),
    ("car, sports car, race car, pickup truck, truck, van, bus, taxi, tram, train",
     {"roof": Region("above", 0.2), "wheels": Region("below", 0.25), "bonnet": Region("front", 0.3),
      "hood": Region("front", 0.3)}),
)  # fmt: skip
"""Things whose parts lie elsewhere than those of others."""

SHAPES = _table(
    ("polka dots, polka dot, polka, polka-dotted, dots, dotted", Region("dots", 0.25, 0.11)),
    ("zigzag, zigzags, chevrons, chevron, herringbone pattern", Region("zigzag", 0.5, 0.14)),
    ("gingham, buffalo check, tattersall", Region("gingham", 0.5, 0.1)),
    ("stripes, stripe, striped, vertical stripes, diagonal stripes, "
         "racing stripes, racing stripe, hazard stripes, warning stripes",
     Region("stripes", 0.5, 0.14)),
    ("pinstripes, pinstripe, pinstriped, thin stripes, narrow stripes, fine stripes", Region("stripes", 0.12, 0.08)),
    ("bands, band, hoops, rings, ring, straps, strap, strips, strip, belts, belt, banded, horizontal stripes, "
     "horizontal bands, banding, sash",
     Region("bands", 0.3, 0.22)),
    ("spots, spot, spotted, speckles, freckles, flecks, speckled, flecked",
     Region("spots", 0.3, 0.14)),
    ("studs, rivets, eyelets, grommets, sequins, screws, buttons, knobs, bolts, nails, studded, "
     "riveted", Region("spots", 0.06, 0.07)),
    ("chess board, chessboard, checkerboard pattern, checks, checkered, chequered, checkerboard, squares, check, checked, "
         "check pattern, chessboard pattern, houndstooth, harlequin, argyle, chequerboard, "
         "checker, chequers",
     Region("checks", 0.5, 0.12)),
    ("water stains, patches, patch, stains, stained, splotches, blotches, areas, marbling, swirls, swirl, swirled, swirly, "
         "mottled, splashes, "
         "splatters, splattered, "
     "spattered, splashed, patched, blotchy, smudges, smears, puddles, flames, graffiti, spills",
     Region("patches", 0.35, 0.16, 0.7)),
    ("rain streaks, water streaks, water marks, streaks, drips, runs, streaked, drippings, dripping",
     Region("streaks", 0.2, 0.12, 0.8, 0.25)),
    ("scratches, scrapes, scuffs", Region("scratches", 0.06, 0.1, 0.8)),
    ("sprinkles, confetti", Region("spots", 0.25, 0.05)),
    ("markings, marking", Region("patches", 0.2, 0.12, 0.3)),
    ("clasps, clasp, buckle, buckles", Region("spots", 0.05, 0.08)),
    ("floral, floral pattern, floral motif, floral print, floral design, flower pattern, flower print, flowers, paisley",
     Region("flowers", 0.3, 0.13)),
    ("armour plates, armor plates", Region("patches", 0.5, 0.25)),
    ("lights, leds, led lights, indicator lights", Region("spots", 0.05, 0.06)),
    ("seeds, pips, specks", Region("spots", 0.1, 0.06)),
    ("rainbow, rainbow stripes, rainbow striped, rainbow bands", Region("bands", 0.9, 0.2)),
    ("veins, veining, veined, filigree, inlay, inlays, inlaid, cracks, lines, kintsugi, "
     "lightning", Region("veins", 0.06, 0.22)),
)  # fmt: skip
"""Patterns in which one thing lies on another."""

ANIMALS = {
    "leopard": ("#c79a5b", "#2a1a10", Region("spots", 0.32, 0.1, 0.8)),
    "cheetah": ("#d6ac6a", "#1c130d", Region("spots", 0.22, 0.08, 0.2)),
    "jaguar": ("#bf8c48", "#1f140c", Region("spots", 0.38, 0.13, 0.8)),
    "zebra": ("#ece8e0", "#161514", Region("stripes", 0.5, 0.12, 0.6)),
    "tiger": ("#cf7a28", "#1a120c", Region("stripes", 0.35, 0.16, 0.7)),
    "giraffe": ("#a8682f", "#e0c898", Region("veins", 0.2, 0.2)),
    "cow": ("#ece8e2", "#1b1918", Region("patches", 0.4, 0.3, 0.1)),
    "dalmatian": ("#efece6", "#151414", Region("spots", 0.25, 0.12, 0.3)),
    "panda": ("#ece8e0", "#161514", Region("patches", 0.4, 0.4, 0.1)),
    "ladybird": ("#c4181c", "#121212", Region("spots", 0.25, 0.22)),
    "ladybug": ("#c4181c", "#121212", Region("spots", 0.25, 0.22)),
    "tortoiseshell": ("#b0702a", "#38200f #6e4018", Region("patches", 0.45, 0.16, 0.4)),
    "desert camouflage": ("#b89a70", "#8a6a48 #d6c29a #6e5a40", Region("patches", 0.4, 0.2, 0.2)),
    "snow camouflage": ("#dfe2e2", "#a4aaae #f2f3f3 #6e7478", Region("patches", 0.4, 0.2, 0.2)),
    "urban camouflage": ("#8c9094", "#55595d #b8bcc0 #2a2c2e", Region("patches", 0.4, 0.2, 0.2)),
    "camouflage": ("#5a5c3a", "#3a3324 #8c7c54 #1b1a16", Region("patches", 0.4, 0.2, 0.2)),
    "camo": ("#5a5c3a", "#3a3324 #8c7c54 #1b1a16", Region("patches", 0.4, 0.2, 0.2)),
}
"""Coats that everybody knows: ground, marks of one colour or of several, and how these lie."""

GATHERS = {
    "moss": Region("crevices", 0.4, 0.18, 1.0), "rust": Region("chips", 0.4, 0.12, 1.0),
    "dirt": Region("crevices", 0.35, 0.15, 1.0),
    "mud": Region("below", 0.25, 0.15, 1.0), "soil": Region("crevices", 0.35, 0.15, 1.0),
    "snow": Region("up", 0.42, 0.12, 0.4, 0.02),
    "verdigris": Region("crevices", 0.35, 0.14, 1.0), "frost": Region("edges", 0.35, 0.1, 1.0),
    "ice": Region("up", 0.3, 0.15, 0.6), "icicles": Region("edges", 0.2, 0.1, 0.8),
    "lichen": Region("patches", 0.25, 0.1, 1.0), "gold leaf": Region("patches", 0.5, 0.25, 0.8),
    "ash": Region("up", 0.45, 0.2, 1.0, 0.12),
    "soot": Region("patches", 0.4, 0.3, 1.0, 0.5), "dust": Region("up", 0.5, 0.2, 1.0, 0.2),
    "sand": Region("up", 0.4, 0.2, 1.0, 0.08),
    "flour": Region("up", 0.4, 0.12, 1.0, 0.15), "limescale": Region("streaks", 0.25, 0.14, 0.9, 0.2),
    "bird droppings": Region("up", 0.1, 0.12, 0.9),
    "ivy": Region("patches", 0.5, 0.2, 0.8), "leaves": Region("patches", 0.5, 0.12, 0.8),
    "algae": Region("below", 0.4, 0.15, 1.0),
    "icing": Region("above", 0.45, 0.1, 0.6), "frosting": Region("above", 0.45, 0.1, 0.6),
    "icing sugar": Region("up", 0.45, 0.15, 1.0),
    "cobwebs": Region("crevices", 0.25, 0.12, 1.0), "grime": Region("crevices", 0.35, 0.15, 1.0, 0.06),
    "barnacles": Region("below", 0.4, 0.1, 1.0), "patina": Region("crevices", 0.35, 0.14, 1.0),
    "vines": Region("patches", 0.4, 0.15, 0.9),
    "whipped cream": Region("above", 0.4, 0.1, 0.6), "blood": Region("patches", 0.3, 0.18, 0.8),
    "grass": Region("up", 0.45, 0.1, 0.8),
}  # fmt: skip
"""What gathers of itself, and where it does when nobody says."""

ONCE = {"lichens": "lichen", "vine": "ivy", "hedge": "ivy", "creepers": "ivy", "creeper": "ivy", "soil": "dirt",
        "earth": "dirt", "dried mud": "mud", "cracked mud": "mud", "dried blood": "blood", "powdered sugar": "icing sugar",
        "hard water stains": "limescale", "calcium deposits": "limescale", "droppings": "bird droppings",
        "guano": "bird droppings",
        "green patina": "verdigris", "copper patina": "verdigris", "oxidized copper": "verdigris"}
"""Other names of what gathers."""

def gathering(name: str) -> str:
    """What of `GATHERS` a substance is: of "fresh snow" it is snow; "" where it is none."""
    known = ONCE.get(name, name)
    return next((word for word in (known, known.split(" ")[-1]) if word in GATHERS), "")


LAYERED = {"moss": 3e-3, "snow": 8e-3, "rust": 2e-4, "grass": 5e-3}
"""Looks that stand proud of what is beneath, metres."""


class Weather(NamedTuple):
    """What a word of wear or weather lays over a thing. stuff: its name, "" where what is beneath shows. region: where.
    thickness: metres. strength: most that it covers. """

    stuff: str
    region: Region
    thickness: float = 0.0
    strength: float = 1.0


def _weather(*entries: tuple[str, Weather]) -> dict[str, Weather]:
    return {word.strip(): weather for text, weather in entries for word in text.split(",")}


WEATHER = _weather(
    ("rusty, rusted, rusting, corroded", Weather("rust", Region("chips", 0.42, 0.12, 1.0), 2e-4)),
    ("dirty, grimy, filthy, soiled", Weather("dirt", Region("crevices", 0.4, 0.15, 1.0), 1e-4, 0.85)),
    ("muddy", Weather("mud", Region("below", 0.3, 0.2, 1.0), 2e-4, 0.95)),
    ("weathered, aged, old, ancient, antique, vintage, "
     "worn out", Weather("grime", Region("crevices", 0.3, 0.15, 1.0, 0.06), 0.0, 0.55)),
    ("stained, water-stained, streaky, rain-streaked, "
     "water-streaked", Weather("grime", Region("streaks", 0.3, 0.14, 0.9, 0.3), 0.0, 0.6)),
    ("charred, burnt, burned, scorched, sooty", Weather("charcoal", Region("patches", 0.4, 0.3, 1.0, 0.4), 0.0, 0.95)),
    ("tarnished", Weather("tarnish", Region("crevices", 0.4, 0.15, 0.9, 0.08), 0.0, 0.8)),
    ("patinated, oxidised, oxidized", Weather("verdigris", Region("crevices", 0.4, 0.15, 0.9), 0.0, 0.85)),
    ("worn, battered, battle-worn, distressed, used, well-worn, worn-out", Weather("", Region("edges", 0.1, 0.06, 1.0), -1e-4)),
    ("chipped, peeling, flaking, flaky, flaked, peeled", Weather("", Region("chips", 0.2, 0.08, 0.9), -2e-4)),
    ("cracked, crazed, fissured, fractured, cracking", Weather("grime", Region("veins", 0.04, 0.2, 0.3), -2e-4, 0.85)),
    ("crackled, craquelure, crackle", Weather("grime", Region("veins", 0.05, 0.07, 0.2), -2e-5, 0.7)),
    ("scratched, scuffed, scraped", Weather("", Region("scratches", 0.05, 0.1, 0.9), -5e-5)),
    ("mossy, overgrown", Weather("moss", Region("crevices", 0.42, 0.18, 1.0), 3e-3)),
    ("marbled", Weather("", Region("patches", 0.4, 0.2, 0.4, 0.1))),
    ("moldy, mouldy, mildewed", Weather("mildew", Region("patches", 0.35, 0.14, 1.0), 0.0, 0.85)),
    ("bloody, bloodstained, blood-stained", Weather("blood", Region("patches", 0.25, 0.18, 0.9))),
    ("dusty, sandy", Weather("dust", Region("up", 0.5, 0.2, 1.0, 0.2), 5e-5, 0.75)),
    ("frosty, frosted over, icy, iced over, frozen over, iced, frozen",
     Weather("frost", Region("edges", 0.35, 0.1, 1.0), 1e-3, 0.85)),
    ("snowy", Weather("snow", Region("up", 0.42, 0.12, 0.4, 0.02), 8e-3)),
)
"""Words of wear and weather, from below: what lies lowest first."""

CORRODES = {
    **dict.fromkeys(("copper", "brass", "bronze"), "verdigris"), **dict.fromkeys(("iron", "steel"), "rust"),
    **dict.fromkeys(("silver", "gold", "aluminium", "chrome", "lead", "titanium", "foil"), "tarnish"),
}  # fmt: skip
"""The last word of a metal's look → what air makes of it."""

SHOWS = frozenset(word for word, weather in WEATHER.items() if not weather.stuff)
"""Those that let show what is beneath."""

PEELS = frozenset(["peeling", "flaking", "flaky", "flaked", "peeled", "chipped"])
"""Those that leave only parts of a coat."""

FADED = {"weathered": 0.85, "aged": 0.9, "old": 0.95, "faded": 0.7, "bleached": 0.6, "sun-bleached": 0.6, "vintage": 0.92}
"""Words that take colour out: factor of the saturation."""

WET = {"wet": 0.35, "damp": 0.6, "oily": 0.45, "slimy": 0.35}
"""Words of wetness: factor of the roughness."""

SOAKED, POROUS, SOAK = frozenset(["wet", "damp"]), 0.6, 0.72
"""Words of water, the roughness from which on a stuff drinks it, and how much darker it is then."""

DETAILS = Region("edges", 0.1, 0.04, 0.1)
"""Where a part lies that no table knows."""

SHELLED = frozenset(["ladybird", "ladybug", "tortoiseshell"])
"""Animals of `ANIMALS` that have no fur."""

PRINTED = frozenset(name for name in ANIMALS if name.endswith(("camouflage", "camo")))
"""Those that are printed on cloth."""

COVERED = Region("patches", 0.75, 0.3, 0.6)
PARTLY = Region("patches", 0.35, 0.2, 0.7)
FADE = Region("fade", 0.5, 0.6)
JOINED = {
    "cover": COVERED, "partly": PARTLY, "spots": Region("spots", 0.3, 0.14), "inlay": SHAPES["inlay"], "edge": PARTS["trim"],
    "stripe": SHAPES["stripes"], "band": SHAPES["bands"], "with": PARTLY, "and": PARTLY, "comma": PARTLY, "on": PARTLY,
    "of": PARTLY,
    "over": COVERED, "above": Region("above", 0.5), "below": Region("below", 0.5), "check": SHAPES["checks"],
    "patch": SHAPES["patches"],
    "streak": SHAPES["streaks"], "vein": SHAPES["veins"], "cap": Region("up", 0.4, 0.12, 0.4), "rim": PARTS["rim"],
    "tip": PARTS["tip"], "sole": PARTS["sole"], "handle": PARTS["handle"], "line": PARTS["lining"], "stud": SHAPES["studs"],
    "all": Region("all", 1.0), "top": PARTS["lid"], "fade": FADE, "half": Region("right", 0.5),
    "swirl": Region("patches", 0.45, 0.25, 0.3),
    "bottom": PARTS["base"], "legs": PARTS["legs"], "seat": PARTS["seat"], "paint": Region("all", 1.0),
}  # fmt: skip
"""Where a phrase lies that only its joining word tells."""

PEELED, WHOLE = Mask("chips", 0.35, 0.14, 0.9, invert=True), Mask("chips", 0.06, 0.1, 0.9, invert=True)
"""What is left of a coat that peels, and of one that is nearly whole."""
