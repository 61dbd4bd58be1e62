"""Organic things: skin, bone, horn, fur, feathers, and what one eats."""

import numpy as np

from stages.material.look import Look, mix, palette, shade, tint
from stages.material.patterns import (
    Spectrum,
    cells,
    cracks,
    edge,
    exceeds,
    fading,
    fbm,
    hexagons,
    line,
    lost,
    marks,
    noise,
    pebbles,
    repeats,
    scales,
    spots,
    threshold,
    tiles,
    warped,
)
from stages.material.place import Place


def skin(at: Place) -> Look:
    """Human skin: a net of fine furrows, pores, blood that shines through in patches, a freckle here and there."""
    bent = warped(at, 0.0008, 0.01, 1, 2)
    net = pebbles(warped(bent, 0.00008, 0.0005, 2, 2), 0.00085, 0.00004, 0.2, 3, 0.9, (1, 0.75, 1))
    wide_net = cracks(bent, 0.0045, 0.00014, 0.35, 4, 2, 0.05)
    pore = spots(at, 0.0016, (0.00005, 0.00016), 0.7, 5).cover
    blood = fbm(warped(at, 0.004, 0.03, 6), Spectrum(0.04, 0.0012, 0.85, tails=0.2, patch=0.5), 7)
    fine = fbm(at, Spectrum(0.0012, 0.00012, 1.0, tails=0.4, skew=-0.1, patch=0.4), 8)
    freckle = spots(warped(at, 0.0006, 0.003, 9), 0.02, (0.0004, 0.0018), 0.35, 10).cover
    bump = net.dome - 0.75
    color = palette(0.5 + 0.09 * blood + 0.16 * bump + 0.05 * fine, "#b17f66", "#c99a80", "#d9b198", "#e3c2ab")
    color = tint(color, 0.05 * blood + 0.02 * noise(at, 0.012, 11), -0.02 * blood)
    color = mix(color, palette(0 * fine, "#8f5f45"), 0.45 * freckle)
    color = shade(color, 0.03 * fine - 0.22 * wide_net.cover - 0.35 * pore)
    height = 1.4e-5 * bump + 2e-6 * fine - 6e-6 * wide_net.cover - 2.5e-5 * pore + 1e-5 * blood
    return Look(color, np.clip(0.46 - 0.1 * bump + 0.05 * fine + 0.12 * wide_net.cover + 0.04 * blood, 0, 1), 0.0, height)


def bone(at: Place) -> Look:
    """Old bone: cream, fine-fibred along its length, pitted with tiny pores, split along by drying, brown where earth lay on
    it, its outer skin flaked off here and there down to a rougher layer."""
    bent = warped(at, 0.003, 0.03, 1, 3)
    stain = fbm(bent, Spectrum(0.08, 0.0008, 0.85, (1, 1.8, 1), 0.2, -0.1, 0.5), 2)
    fine = fbm(at, Spectrum(0.003, 0.0002, 1.0, (1, 6, 1), 0.5, -0.2, 0.5), 3)
    pore = fbm(at, Spectrum(0.0011, 0.0003, 1.0, (1, 2.2, 1), 0.5, patch=0.7), 4)
    pit = np.clip(pore - 2.0 + 0.6 * noise(at, 0.03, 5), 0, 1.2)
    grown = cells(warped(at, 0.0008, 0.05, 11, 2), 0.013, 6, 1.0, (1, 14, 1))
    gape = np.clip(0.7 * noise(at, 0.02, 7, (1, 6, 1)) - 0.15, 0, 1)
    gape = gape * np.clip(0.5 + (abs(grown.offset[0]) - abs(grown.offset[1])) / 0.003, 0, 1)  # along the bone, not across
    split = line(grown.border, 0.00022 * gape, at.footprint) * fading(0.006, at.footprint)
    soil = np.exp(-grown.border / 0.0009) * gape * fading(0.006, at.footprint)
    shape = Spectrum(0.06, 0.0006, 0.75, (1, 1.6, 1), patch=0.4)
    field, hidden = fbm(bent, shape, 8), lost(at, shape)
    worn, edge_of = exceeds(field, 1.6, 0.12, hidden), exceeds(field, 1.3, 0.3, hidden)
    swell = fbm(at, Spectrum(0.05, 0.008, 0.6), 9)
    color = palette(0.58 + 0.10 * stain + 0.03 * fine, "#b59d74", "#d6c6a2", "#e5dac0", "#f0e9d9")
    rough_layer = palette(0.5 + 0.16 * fine + 0.2 * pore, "#a48d66", "#c4b28d", "#dccfb0")
    color = mix(shade(color, 0.04 * fine + 0.10 * (edge_of - worn)), rough_layer, 0.85 * worn)
    earth = np.clip(0.75 * split + 0.3 * soil + 0.5 * pit * (1 + worn), 0, 1)
    color = mix(color, palette(0.5 + 0.2 * fine, "#46331f", "#6b5233"), 0.75 * earth)
    height = 4e-4 * swell + 1.5e-5 * fine - 2e-4 * split - 1.5e-4 * pit - 1.6e-4 * worn * (1 + 0.3 * pore)
    rough = 0.5 + 0.05 * fine - 0.05 * stain + 0.25 * earth + 0.2 * worn
    return Look(tint(color, 0.03 * stain + 0.03 * noise(at, 0.02, 10)), np.clip(rough, 0, 1), 0.0, height)


def horn(at: Place) -> Look:
    """Buffalo horn, polished: nearly black, with honey that one sees into where it thins, in bands that flow and part; fine
    layers, scratches of the scraper."""
    flat = at.flat
    bent = warped(warped(flat, 0.010, 0.10, 1, 2), 0.002, 0.012, 6, 2)
    band = fbm(bent, Spectrum(0.034, 0.004, 0.6, (1, 5, 1), 0.2, patch=0.3), 2)
    fibre = fbm(bent, Spectrum(0.0024, 0.00015, 0.9, (1, 9, 1), 0.3, patch=0.5), 4)
    cloud = fbm(bent, Spectrum(0.10, 0.02, 0.5, (1, 2, 1)), 3)
    scratch = marks(at, 0.03, 0.00016, 4, 1.5, 0.9, 5, 0.7, 0.1).cover
    glow = 0.39 + 0.20 * band + 0.13 * cloud + 0.025 * fibre
    color = palette(glow, "#15100e", "#221813", "#4a3018", "#8f6430", "#c79a5c", "#ead6ae")
    color = tint(shade(color, 0.07 * fibre + 0.10 * scratch), 0.04 * cloud)
    rough = 0.14 + 0.02 * fibre + 0.12 * scratch
    return Look(color, np.clip(rough, 0.05, 1), 0.0, 2e-6 * fibre + 5e-6 * band - 4e-6 * scratch)


HAIRS = Spectrum(0.0014, 0.00012, 0.95, (1, 26, 1), 0.35, -0.1, 0.3)


def fur(at: Place) -> Look:
    """A pelt: fine hairs that flow down the body in waves, gathered in pointed locks, dark at the roots, pale at the tips."""
    flat = at.flat
    sway = [fbm(flat, Spectrum(0.09, 0.02, 0.45), seed) for seed in (1, 2)]
    flow = flat.moved(np.stack([0.0028 * sway[0], 0.002 * sway[1], 0 * sway[0]]).astype(np.float32))
    body = fbm(flat, Spectrum(0.2, 0.015, 0.7, (0.8, 1.3, 1), patch=0.4), 3)
    color = height = np.zeros(len(at), np.float32)
    for k, (size, share) in enumerate(((0.0085, 1.0), (0.0065, 0.75))):
        lock = cells(flow, size, 4 + k, 0.95, (1, 3.4, 1))
        seen = fading(0.6 * size, at.footprint)
        x, y, _ = lock.offset
        fan = x + (lock.random(1) - 0.5) * 0.5 * y + np.float32(0.5 / size) * x * y  # locks close towards their tips
        own = np.stack([fan, flow.p[1], 0.3 * lock.random(2) + 0 * y]).astype(np.float32)
        hairs = Place(own, at.uv, at.face, at.footprint, (0, at.period[1], 0), at.seed)
        strand = fbm(hairs, HAIRS, 6 + k)
        hidden = lost(hairs, HAIRS)
        tip = np.clip(0.5 - y / (1.3 * size), 0, 1)
        ragged = lock.border + np.float32(0.12 * size) * (0.3 + tip) * strand
        edge_of = threshold(ragged, 0.0004 + 0.0014 * tip, 0.0011) * seen + 0.72 * (1 - seen)
        tone = 0.42 + 0.30 * (tip - 0.5) * seen + 0.10 * body + 0.22 * (lock.random(3) - 0.5) * seen + 0.13 * strand
        here = share * edge_of if k else np.ones(len(at), np.float32)
        layer = shade(palette(tone, "#2e2015", "#573c25", "#86633e", "#b08b5e", "#d6bb92"),
                      0.17 * strand + 0.36 * hidden**2 - 0.55 * (1 - edge_of))  # fmt: skip
        color = layer if not k else mix(color, layer, here)
        height = mix(height, 6e-4 * k + 7e-4 * (edge_of - 0.6) + 5e-4 * (tip - 0.5) * seen + 5e-5 * strand, here)
    color = tint(color, 0.03 * sway[0] + 0.03 * body)
    return Look(color, np.clip(0.6 - 120 * (height - 2e-4), 0.25, 1), 0.0, height - 3e-4)


def feathers(at: Place) -> Look:
    """Plumage: rounded feathers in rows, a thin pale shaft, barbs slanting from it that part here and there, dark bars that
    follow the barbs, soft edges over the shadow that they throw."""
    flat = at.flat
    bent = warped(flat, 0.0026, 0.05, 1, 2)
    wobble = fbm(flat, Spectrum(0.008, 0.0012, 0.8), 3)
    vane = scales(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.030, 0.019, 2)
    side = abs(vane.across)
    own = (vane.random(1) - 0.5) * vane.seen
    slant = 9 * vane.along + 4.5 * side  # barbs leave the shaft towards the tip
    barb = np.cos(2 * np.pi * 4 * slant + 3 * own) * fading(0.0011, at.footprint)
    tuft = fbm(flat, Spectrum(0.0016, 0.00015, 1.0, (0.7, 1.5, 1), 0.4, patch=0.4), 4)
    split = np.clip(np.cos(2 * np.pi * (0.35 * slant + vane.random(5))) - 0.96, 0, 1) / 0.04
    split = split * np.clip(side - 0.25, 0, 1) * (vane.random(6) < 0.45) * vane.seen
    fray = 0.0011 * (1 + barb) * (0.4 + side)  # the rim is the ends of barbs
    shadow = np.exp(-np.clip(vane.under + fray, 0, 1) / 0.0022) * vane.seen
    soft = np.exp(-np.clip(vane.rim, 0, 1) / 0.0016) * vane.seen
    shaft = np.exp(-((vane.across / 0.028) ** 2)) * np.clip(1.15 - vane.along, 0, 1) * vane.seen
    bars = np.cos(2 * np.pi * (0.19 * slant + 0.5 * own - 0.1)) + 0.3 * wobble + 0.1 * tuft
    bar = threshold(bars, 0.35, 0.25) * vane.seen + 0.36 * (1 - vane.seen)
    color = mix(
        palette(0.5 + 0.6 * own + 0.06 * tuft, "#8a7358", "#a98f70", "#c4ad8e"),
        palette(0.5 + 0.35 * own + 0.08 * tuft, "#3a2c20", "#54402d", "#6d553d"),
        (0.62 + 0.5 * own) * bar,
    )
    color = mix(color, palette(0.5 + 0.2 * tuft, "#c9b897", "#e6dbc4"), np.clip(0.28 * soft + 0.55 * shaft, 0, 1))
    color = shade(color, 0.12 * barb + 0.07 * tuft - 0.9 * shadow - 0.4 * split + 0.1 * (0.5 - vane.along) * vane.seen)
    lift = (1 - soft - 0.9 * vane.along + 0.25 * shaft) * vane.seen - 0.3
    rough = np.clip(0.6 + 0.05 * barb + 0.05 * tuft + 0.15 * shadow, 0, 1)
    return Look(tint(color, 0.06 * own), rough, 0.0, 6e-4 * lift + 2e-5 * barb - 8e-5 * split)


def bread(at: Place) -> Look:
    """The crust of a loaf: golden, browner where it stood out, wrinkled and blistered as it dried, pores, flour in drifts."""
    bent = warped(at, 0.006, 0.05, 1, 3)
    bake = fbm(bent, Spectrum(0.14, 0.008, 0.62, patch=0.2), 2)
    scorch = fbm(warped(at, 0.003, 0.02, 11, 2), Spectrum(0.022, 0.0015, 0.85, tails=0.3, skew=0.2, patch=0.6), 12)
    fine = fbm(at, Spectrum(0.0018, 0.00015, 1.0, tails=0.4, skew=0.1, patch=0.4), 3)
    wrinkle = fbm(warped(at, 0.003, 0.02, 4, 2), Spectrum(0.011, 0.0014, 0.7, patch=0.4), 5)
    blister = spots(warped(at, 0.0005, 0.003, 6), 0.0080, (0.0004, 0.0022), 0.35, 7)
    dome = np.clip(blister.inside / 0.0014, 0, 1) * fading(0.003, at.footprint)
    pore = spots(warped(at, 0.0002, 0.001, 8), 0.0045, (0.00015, 0.0006), 0.3, 9).cover
    split = cells(warped(at, 0.002, 0.012, 13, 2), 0.020, 14).border
    crackle = line(split, 0.00012, at.footprint) * fading(0.004, at.footprint)
    baked = 0.42 + 0.15 * bake + 0.07 * scorch + 0.03 * wrinkle + 0.06 * dome
    color = palette(baked, "#e8c68e", "#d6a45c", "#bb7f3a", "#985b24", "#6e3c17")
    color = shade(color, 0.07 * fine + 0.05 * wrinkle - 0.4 * pore - 0.25 * crackle)
    drift = Spectrum(0.05, 0.0006, 0.75, tails=0.3, patch=0.6)
    flour = exceeds(fbm(bent, drift, 10) - 0.2 * wrinkle, 1.25, 0.45, lost(bent, drift)) * np.clip(0.7 + 0.3 * fine, 0, 1)
    color = tint(mix(color, palette(0.6 + 0.2 * fine, "#e6dccb", "#f4eee2"), 0.6 * flour), 0.03 * bake)
    rough = 0.60 + 0.05 * fine - 0.04 * bake + 0.25 * flour + 0.2 * pore
    height = 3.0e-4 * wrinkle + 2.5e-4 * dome - 4e-4 * pore - 1.2e-4 * crackle + 2e-5 * fine + 1.2e-3 * bake + 3e-5 * flour
    return Look(color, np.clip(rough, 0.2, 1), 0.0, height, np.clip(1 - 0.7 * flour, 0, 1))


def chocolate(at: Place) -> Look:
    """A moulded bar: bevelled pieces, gloss with a bloom, pinholes of air, crumbs and scratches."""
    piece = tiles(at, 0.030, 0.020, "stack", 1)
    shown = fading(0.01, at.footprint)
    cloud = fbm(warped(at, 0.003, 0.02, 2, 3), Spectrum(0.04, 0.0012, 0.85, tails=0.2, patch=0.5), 3)
    fine = fbm(at, Spectrum(0.0016, 0.00015, 1.0, tails=0.5, skew=0.15, patch=0.5), 4)
    hole = spots(at, 0.006, (0.0001, 0.0005), 0.5, 5).cover
    scratch = marks(at, 0.02, 0.00022, 3, 0.3, 6.28, 6, 0.8, 0.2).cover
    crumb = spots(warped(at, 0.0003, 0.001, 7), 0.007, (0.0001, 0.0006), 0.3, 8).cover
    bevel = np.clip(piece.border / 0.0038, 0, 1) * shown + 0.75 * (1 - shown)
    seam = np.exp(-piece.border / 0.0008) * shown
    lip = np.exp(-(((piece.border - 0.0038) / 0.0005) ** 2)) * shown
    color = palette(0.5 + 0.10 * cloud + 0.08 * fine + 0.1 * (bevel - 0.75), "#33190d", "#482615", "#5c3520", "#74492f")
    color = shade(color, 0.05 * fine - 0.5 * seam + 0.14 * lip - 0.7 * hole)
    color = mix(color, palette(0.5 + 0.2 * fine, "#6f472f", "#8b6347"), np.clip(0.4 * scratch + 0.7 * crumb, 0, 1))
    rough = 0.30 + 0.06 * cloud + 0.05 * fine + 0.2 * scratch + 0.25 * crumb
    return Look(
        color, np.clip(rough, 0.08, 1), 0.0, 0.0030 * (bevel - 0.75) + 3e-6 * fine - 2e-4 * hole + 1.5e-4 * crumb + 4e-5 * cloud
    )


def cheese(at: Place) -> Look:
    """Cut Emmental: pale yellow, smooth-walled holes, small blind ones, drops of fat, the drag of the knife."""
    bent = warped(at, 0.0015, 0.02, 1, 2)
    hole, small = spots(bent, 0.045, (0.006, 0.018), 0.9, 2), spots(bent, 0.02, (0.0005, 0.003), 0.5, 3)
    cloud = fbm(at, Spectrum(0.08, 0.002, 0.85, patch=0.4), 4)
    drag = fbm(at.flat, Spectrum(0.004, 0.0003, 1.0, (6, 0.6, 1), 0.4, -0.15, 0.5), 5)
    fine = fbm(at, Spectrum(0.0022, 0.0002, 1.0, tails=0.5, skew=-0.2, patch=0.5), 6)
    deep = np.clip(hole.inside / np.maximum(hole.radius, 1e-4), 0, 1)
    tip = np.clip(hole.cells.offset[1] / np.maximum(hole.radius, 1e-3), -1, 1)
    color = palette(0.5 + 0.10 * cloud + 0.05 * fine, "#d9a548", "#e8bd63", "#f0cf83", "#f4dc9f")
    wall = shade(palette(0.5 + 0.1 * fine, "#cf9a42", "#e3b75f"), -0.5 * np.sqrt(deep) - 0.35 * tip * (1 - deep) + 0.1)
    color = mix(shade(color, 0.04 * fine + 0.04 * drag), wall, hole.cover)
    color = shade(color, -0.4 * small.cover * (1 - hole.cover))
    sphere = hole.radius * (np.sqrt(np.clip(1 - (1 - deep) ** 2, 0, 1)))
    height = -0.9 * hole.cover * sphere - 0.6 * small.cover * np.clip(small.inside, 0, 1) + 3e-5 * drag + 2e-5 * fine
    return Look(
        tint(color, 0.03 * cloud), np.clip(0.45 + 0.05 * fine + 0.05 * drag - 0.1 * hole.cover, 0.05, 1), 0.0, height + 0.0015
    )


def meat(at: Place) -> Look:
    """Raw beef: bundles of dark red fibres, seams of white fat that branch between them, wet."""
    bent = warped(at, 0.005, 0.06, 1, 3)
    bundle = pebbles(warped(bent, 0.0003, 0.002, 2, 2), 0.0032, 0.00012, 0.2, 3, 1.0, (1, 1.8, 1))
    fibre = fbm(bent, Spectrum(0.0020, 0.00015, 1.0, (1, 3, 1), 0.4, -0.15, 0.4), 4)
    cloud = fbm(bent, Spectrum(0.06, 0.003, 0.8, patch=0.5), 5)
    seam = cracks(bent, 0.055, 0.0042, 0.14, 6, 3, 0.08, (0.8, 1.5, 1))
    vein = cracks(warped(bent, 0.002, 0.008, 7, 3), 0.015, 0.0008, 0.02, 8, 2, 0.10, (0.8, 1.6, 1))
    fat = np.clip(seam.cover + 0.85 * vein.cover, 0, 1)
    own = (bundle.cells.random(1) - 0.5) * bundle.shown
    color = palette(
        0.5 + 0.13 * cloud + 0.25 * own + 0.3 * (bundle.dome - 0.75) + 0.07 * fibre, "#560e12", "#7d1b1d", "#a0302c", "#bb4c42"
    )
    color = mix(
        shade(color, 0.07 * fibre), palette(0.55 + 0.2 * fibre + 0.1 * cloud, "#d8b39a", "#ead3bd", "#f2e6d6"), 0.92 * fat
    )
    color = tint(color, 0.04 * noise(at, 0.03, 9), -0.04 * own)
    rough = 0.26 + 0.05 * fibre - 0.1 * (bundle.dome - 0.75) + 0.14 * fat
    return Look(
        color, np.clip(rough, 0.05, 1), 0.0, 2e-4 * (bundle.dome - 0.75) + 3e-5 * fibre + 3e-4 * fat + 3e-4 * cloud - 5e-5
    )


def orange_peel(at: Place) -> Look:
    """The rind of an orange: soft swells between round dimples of many sizes, each over an oil gland that shows dark, waxy."""
    bent = warped(at, 0.0003, 0.004, 1, 2)
    large, small = spots(bent, 0.0024, (0.0006, 0.0013), 0.97, 2), spots(bent, 0.0013, (0.0003, 0.0007), 0.8, 3)
    seen, fine_seen = fading(0.0014, at.footprint), fading(0.0007, at.footprint)
    dimple = np.exp(-np.square(large.cells.near / (0.75 * large.radius))) * seen
    prick = np.exp(-np.square(small.cells.near / (0.8 * small.radius))) * fine_seen
    cloud = fbm(at, Spectrum(0.05, 0.002, 0.85, patch=0.4), 4)
    swell = fbm(at, Spectrum(0.004, 0.0012, 0.7), 5)
    fine = fbm(at, Spectrum(0.0012, 0.00012, 1.05, tails=0.4, skew=0.1, patch=0.4), 6)
    sunk = 0.7 * (dimple - 0.2 * seen) + 0.3 * (prick - 0.2 * fine_seen)
    color = palette(0.52 + 0.08 * cloud - 0.35 * sunk + 0.05 * fine, "#d25c06", "#ea7a10", "#f69427", "#fbb04e")
    color = shade(color, 0.07 * fine - 0.35 * sunk)
    height = 6e-5 * swell - 2.6e-4 * sunk + 4e-6 * fine + 3e-5 * cloud
    return Look(tint(color, 0.05 * cloud), np.clip(0.34 + 0.05 * fine + 0.16 * sunk, 0.05, 1), 0.0, height)


def tomato_skin(at: Place) -> Look:
    """A ripe tomato: tight glossy red, yellow flecks under it, faint streaks from the stalk, fine corky scars."""
    fleck = spots(at, 0.0032, (0.0001, 0.0005), 0.75, 1).cover
    streak = fbm(at.upright, Spectrum(0.02, 0.001, 0.85, (1, 5, 1), 0.2, patch=0.4), 2)
    cloud = fbm(warped(at, 0.006, 0.03, 3), Spectrum(0.06, 0.004, 0.75, patch=0.4), 4)
    fine = fbm(at, Spectrum(0.0016, 0.00012, 1.05, tails=0.5, skew=0.2, patch=0.4), 5)
    scar = cracks(warped(at, 0.001, 0.006, 6, 2), 0.03, 0.0003, -0.5, 7, 2, 0.06).cover
    net = pebbles(at, 0.0009, 0.0, 0.4, 8, 1.0)
    color = palette(
        0.5 + 0.12 * cloud + 0.08 * streak + 0.06 * fine + 0.1 * (net.dome - 0.7), "#a50f0a", "#c11a10", "#d42d18", "#e04c22"
    )
    color = mix(color, palette(0.5 + 0.3 * fine, "#dd6a2a", "#eb9747"), 0.4 * fleck)
    color = mix(shade(color, 0.05 * fine), palette(0.5 + 0.2 * fine, "#a8743e", "#c89a62"), 0.7 * scar)
    rough = 0.16 + 0.03 * fine + 0.03 * cloud + 0.05 * fleck + 0.4 * scar
    return Look(
        tint(color, 0.04 * streak),
        np.clip(rough, 0.03, 1),
        0.0,
        1.5e-4 * cloud + 4e-6 * (net.dome - 0.7) + 1e-5 * fleck + 6e-5 * scar,
    )


def seashell(at: Place) -> Look:
    """A scallop: rounded ribs, growth lines across them, bands of rose and cream, chalk in the grooves."""
    flat = at.flat
    bent = warped(flat, 0.0005, 0.03, 1, 2)
    across, _, _ = repeats(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.0085, 0)
    shown = fading(0.005, at.footprint)
    dome = 0.785 + (np.sqrt(np.clip(1 - across * across, 0, 1)) - 0.785) * shown
    lag = bent.moved(np.stack([0 * across, 0.0014 * (1 - across * across), 0 * across]).astype(np.float32))
    growth = fbm(lag, Spectrum(0.008, 0.00025, 1.0, (9, 1, 1), 0.4, -0.15, 0.4), 3)
    band = fbm(lag, Spectrum(0.035, 0.008, 0.6, (6, 1, 1)), 4)
    ray = fbm(flat, Spectrum(0.012, 0.002, 0.8, (1, 12, 1)), 5)
    fine = fbm(flat, Spectrum(0.0016, 0.00015, 1.0, (1.5, 0.7, 1), 0.4, -0.1, 0.4), 6)
    t = 0.48 + 0.22 * band + 0.10 * growth + 0.10 * ray
    color = palette(t, "#a35a46", "#c98a70", "#e2b99c", "#efdcc6", "#f3e9db")
    color = shade(color, 0.09 * growth + 0.09 * fine + 0.55 * (dome - 0.785))
    chalk = np.exp(-(1 - abs(across)) / 0.10) * shown
    color = mix(color, palette(0.5 + 0.2 * fine, "#cdbfae", "#e2d8ca"), 0.35 * chalk)
    return Look(
        tint(color, 0.04 * band),
        np.clip(0.34 + 0.05 * growth + 0.04 * fine + 0.3 * chalk, 0.05, 1),
        0.0,
        0.0019 * (dome - 0.785) + 7e-5 * growth + 6e-6 * fine,
    )


def honeycomb(at: Place) -> Look:
    """A comb: wax walls in hexagons, open cells full of honey that gleams, others sealed with pale wax."""
    flat = at.flat
    bent = warped(flat, 0.0003, 0.012, 1, 2)
    comb = hexagons(Place(bent.p, bent.p[:2], at.face, at.footprint, at.period, at.seed), 0.0054, 2)
    fine = fbm(flat, Spectrum(0.0012, 0.0001, 1.05, tails=0.4, skew=0.1, patch=0.4), 3)
    wide = fbm(flat, Spectrum(0.03, 0.002, 0.85, patch=0.4), 4)
    # beside a sealed cell there is mostly another: the field decides, the cell's own number at the edge
    middle = bent.moved(-np.stack([comb.x, comb.y, 0 * comb.x]).astype(np.float32) * comb.seen)
    sealed = threshold(noise(middle, 0.03, 5) + 0.5 * (comb.random(1) - 0.5), 0.55, 0.05) * comb.seen + 0.29 * (1 - comb.seen)
    wall = edge(0.00042 + 0.00006 * fine - comb.border, at.footprint) * comb.seen + 0.29 * (1 - comb.seen)
    depth = np.clip((comb.border - 0.0004) / 0.0022, 0, 1)
    gleam = np.exp(-(((comb.x + 0.0007) ** 2 + (comb.y - 0.0008) ** 2) / 0.0006**2)) * comb.seen
    own = (comb.random(2) - 0.5) * comb.seen
    honey = palette(
        0.5 + 0.5 * own - 0.35 * (depth - 0.5) * comb.seen + 0.10 * wide + 0.03 * fine,
        "#6d2f05",
        "#a9590d",
        "#d68a1c",
        "#eeb23e",
    )
    honey = mix(honey, palette(0 * fine, "#ffe7a6"), 0.4 * gleam)
    wax = palette(0.5 + 0.14 * fine + 0.12 * wide + 0.2 * own, "#c08c3c", "#d9ae60", "#ebcb8a", "#f3deab")
    cap = shade(wax, 0.22 * (depth - 0.5) * comb.seen + 0.08 * fine)
    color = mix(mix(honey, cap, sealed), shade(wax, 0.06 * fine - 0.06), wall)
    height = (
        mix(-0.0016 - 3e-4 * depth + 1.2e-3 * sealed * (0.6 + 0.6 * depth), 0 * wall, wall)
        + 1.2e-5 * fine * np.maximum(wall, sealed)
        + 8e-4
    )
    rough = mix(mix(0.10 + 0 * fine, 0.55 + 0.05 * fine, sealed), 0.5 + 0.05 * fine, wall)
    return Look(tint(color, 0.04 * wide), np.clip(rough, 0.04, 1), 0.0, height)


def sponge(at: Place) -> Look:
    """A bath sponge: yellow skeleton riddled with holes from fine to wide, tattered rims, dark depths."""
    bent = warped(at, 0.0010, 0.006, 1, 4)
    fine = fbm(at, Spectrum(0.0014, 0.0001, 1.05, tails=0.5, skew=-0.2, patch=0.4), 2)
    wide = fbm(at, Spectrum(0.05, 0.003, 0.8, patch=0.4), 3)
    color, height = (
        palette(0.55 + 0.10 * wide + 0.14 * fine, "#b98a35", "#d4a94f", "#e6c272", "#efd391"),
        5e-5 * fine + 4e-4 * wide,
    )
    for k, (size, radius, share) in enumerate(
        ((0.0013, 0.0005, 0.9), (0.0030, 0.0012, 0.85), (0.0068, 0.0028, 0.8), (0.015, 0.0055, 0.45))
    ):
        hole = spots(bent, size, (0.5 * radius, 1.15 * radius), share, 4 + k)
        deep = np.clip(hole.inside / (0.7 * radius), 0, 1)
        floor = palette(0.75 - 0.75 * deep + 0.1 * fine, "#3a260c", "#6f4c19", "#a37a30", "#c79c48")
        color = mix(color, floor, 0.92 * hole.cover)
        height = height - hole.cover * 0.9 * radius * np.sqrt(deep)
    return Look(
        tint(shade(color, 0.09 * fine), 0.04 * noise(at, 0.02, 9)), np.clip(0.92 + 0.03 * fine, 0, 1), 0.0, height + 6e-4
    )


LOOKS = {
    "skin": skin, "bone": bone, "horn": horn, "fur": fur, "feathers": feathers, "bread": bread, "chocolate": chocolate,
    "cheese": cheese, "meat": meat, "orange peel": orange_peel, "tomato skin": tomato_skin, "seashell": seashell,
    "honeycomb": honeycomb, "sponge": sponge,
}  # fmt: skip
METRES = {
    "skin": 0.04, "bone": 0.12, "horn": 0.2, "fur": 0.16, "feathers": 0.24, "bread": 0.12, "chocolate": 0.12, "cheese": 0.2,
    "meat": 0.16, "orange peel": 0.06, "tomato skin": 0.06, "seashell": 0.1, "honeycomb": 0.07, "sponge": 0.1,
}  # fmt: skip
