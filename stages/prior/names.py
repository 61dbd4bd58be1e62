"""What the prior is taught: substances, colours and finishes by name, with physically plausible values.

Colours are sRGB hex, the way one looks them up. Metals carry their measured normal
reflectance. Roughness is perceptual, [0, 1]. Words in `HELD_OUT` never occur in a training caption: they are for tests.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Substance:
    """One substance. names: words for it, one of which a caption uses. colors: sRGB anchors, mixed at random.

    roughness: range of its mean. paintable: a named colour may replace its own. weight: share of it in training.
    """

    names: tuple[str, ...]
    family: str
    colors: tuple[str, ...]
    roughness: tuple[float, float]
    metallic: float = 0.0
    paintable: bool = False
    weight: float = 1.0


def _metal(names: str, colors: str, roughness: tuple[float, float] = (0.08, 0.45), weight: float = 2.0) -> Substance:
    return Substance(_words(names), "metal", _words(colors), roughness, 1.0, weight=weight)


def _words(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(","))


METALS = (
    # Normal reflectance: refractiveindex.info by way of the tables in Lagarde 2014 and Physically Based (CC0), as sRGB.
    _metal("gold, golden, solid gold, yellow gold, pure gold", "#ffe49e, #ffe29b", weight=3),
    _metal("rose gold, pink gold", "#f7c4b0, #f0b9a0", weight=1),
    _metal("silver, sterling silver, pure silver", "#fcfaf5, #f6f3ec", weight=2.5),
    _metal("copper, polished copper, pure copper", "#fad1c2, #f8c4ae", weight=2.5),
    _metal("aluminium, aluminum", "#f5f6f6, #e9ebee", (0.15, 0.5)),
    _metal("brass, yellow brass", "#f4e2ae, #ecd28a", weight=2),
    _metal("bronze, cast bronze", "#d9a877, #cc9a66, #b98a55", (0.15, 0.5), 2),
    _metal("iron, raw iron", "#c4c6c8, #b0b0b0, #96979a", (0.3, 0.6), 2),
    _metal("cast iron, wrought iron", "#5a5958, #4e4d4c, #444343", (0.45, 0.7)),  # under its own black oxide
    _metal("steel, stainless steel, steel metal", "#c6c6c4, #cfd0d0, #b8babd", (0.1, 0.45), 3),
    _metal("chrome, chromium, chrome plated metal", "#c4c5c5, #d5d6d8", (0.0, 0.1), 2.5),
    _metal("titanium", "#c1b9b1, #b3aba4", (0.2, 0.5), 1.5),
    _metal("nickel", "#d5cbbe, #cbc1b4", weight=1),
    _metal("platinum", "#d6d1c9, #dcd7cf", (0.05, 0.35), 1),
    _metal("tin, pewter", "#d2cfc8, #bfbdb8", (0.25, 0.5), 1),
    _metal("lead", "#b5b5ba, #8f9096", (0.4, 0.65), 0.7),
    _metal("zinc, galvanized metal, galvanized steel", "#d0d3d6, #bcc2c8", (0.3, 0.55), 1),
    _metal("gunmetal, dark metal, black metal, blackened steel", "#6e7176, #5d6066, #55585c", (0.2, 0.5), 1.2),
    _metal("metal, shiny metal, metallic", "#c8c8c8, #d4d2cf, #b4b6b8", (0.08, 0.4), 1.5),
    _metal("gold leaf, gold foil, gold plated metal, gold plating", "#ffe29b, #ffe49e", (0.15, 0.4), 1),
    _metal("white gold", "#ece6da, #e4dfd4", (0.05, 0.3), 0.6),
    _metal("aluminium foil, tin foil, metal foil", "#eceef0, #e4e6e8", (0.08, 0.3), 0.7),
    _metal("mercury, quicksilver, liquid metal", "#dcdcde, #d4d4d6", (0, 0.08), 0.6),
    _metal("tungsten, cobalt metal", "#b4b2b4, #a8a6a6", (0.2, 0.5), 0.6),
    _metal("antique brass, aged brass, old brass", "#b8975a, #a88648", (0.3, 0.55), 0.7),
    _metal("antique bronze, dark bronze, aged bronze", "#86623e, #745232", (0.3, 0.55), 0.7),
    _metal("magnesium, cadmium", "#dadada, #d0d0ce", (0.25, 0.5), 0.4),
    _metal("pyrite", "#d2bc82, #c6ae70", (0.15, 0.4), 0.4),
    Substance(("anodized aluminum", "anodized metal", "colored metal"), "metal", ("#c05050", "#5070c0", "#50b080",
              "#b060c0", "#d09040"), (0.2, 0.4), 1.0, paintable=True, weight=1.0),
)

CORRODED = (
    Substance(("rust", "rusty iron", "rusted metal", "rusty metal", "rusty steel", "rusted iron"),
              "rust", ("#7a3b1d", "#8e4a25", "#5f2f1b", "#a35a2c"), (0.75, 0.97), weight=3.5),
    Substance(("verdigris", "oxidized copper", "copper patina"), "rust", ("#5fa08c", "#7ab8a4", "#4c8a78"),
              (0.65, 0.9), weight=1.2),
    Substance(("oxidized iron", "iron oxide", "flaking rust", "decayed metal"), "rust",
              ("#7a3b1d", "#6a3420", "#94522c"), (0.78, 0.97), weight=0.8),
    Substance(("weathering steel", "corten steel"), "rust",
              ("#8a4e2e", "#9a5a34"), (0.7, 0.9), weight=0.6),
)

WOODS = (
    Substance(("wood", "wooden", "timber", "wooden planks", "natural wood"), "wood",
              ("#9c6b3f", "#8a5a34", "#b08050", "#74492a"), (0.45, 0.8), weight=3),
    Substance(("oak", "oak wood", "oak timber"), "wood", ("#b48a56", "#a67c48", "#c09a68"), (0.45, 0.75),
              weight=2),
    Substance(("walnut", "walnut wood", "dark wood"), "wood", ("#5a3d28", "#4a3020", "#6a4a32"), (0.4, 0.7), weight=1.7),
    Substance(("pine", "pine wood", "spruce", "light wood"), "wood", ("#d3ab74", "#dcba86", "#c89c62"), (0.5, 0.8), weight=1.5),
    Substance(("cherry wood", "reddish wood", "rosewood"), "wood", ("#7c3a24", "#8a462c", "#6a2e1e"), (0.35, 0.65), weight=1.3),
    Substance(("birch", "birch wood", "maple", "maple wood", "ash wood", "pale wood"), "wood",
              ("#dcc49c", "#e4d0ac", "#d0b486"), (0.45, 0.75), weight=1.3),
    Substance(("ebony", "black wood"), "wood", ("#2a211c", "#332822"), (0.35, 0.6), weight=0.8),
    Substance(("bamboo",), "wood", ("#cdb06a", "#d8c080", "#b89c5a"), (0.4, 0.6), weight=0.8),
    Substance(("weathered wood", "driftwood", "old gray wood", "aged wood"), "wood", ("#8a8078", "#7a726a", "#9c948a"),
              (0.75, 0.95), weight=1.2),
    Substance(("cork",), "wood", ("#b98a5a", "#a87848"), (0.8, 0.95), weight=0.7),
    Substance(("bark", "tree bark"), "wood", ("#5a4a3c", "#4a3a2e", "#6a5848"), (0.85, 0.98), weight=0.8),
    Substance(("beech", "elm", "alder", "poplar"), "wood",
              ("#cfa878", "#c49a68"), (0.45, 0.75), weight=0.6),
    Substance(("chestnut wood", "hickory", "acacia wood"), "wood",
              ("#8e6038", "#a07044"), (0.4, 0.7), weight=0.6),
    Substance(("redwood", "larch", "fir", "cypress wood"), "wood",
              ("#a4603c", "#b4754a"), (0.5, 0.8), weight=0.6),
    Substance(("sandalwood", "olive wood"), "wood", ("#b48c5a", "#a47c4c"), (0.4, 0.65), weight=0.4),
    Substance(("plywood", "chipboard", "particle board", "fiberboard"), "wood",
              ("#c8a672", "#b8955f"), (0.65, 0.85), weight=0.6),
    Substance(("wicker", "rattan", "straw", "thatch", "hay"), "wood",
              ("#c4a05c", "#b08c4c", "#d0b070"), (0.75, 0.95), weight=0.8),
    Substance(("wenge", "blackwood"), "wood", ("#3a2a20", "#443428"), (0.4, 0.65), weight=0.4),
    Substance(("balsa wood",), "wood", ("#e2cda6", "#d8c298"), (0.6, 0.85), weight=0.4),
    Substance(("varnished wood", "lacquered wood", "parquet"), "wood",
              ("#9c6232", "#84502a", "#b0763e"), (0.06, 0.25)),
    Substance(("charred wood", "burnt wood"), "wood", ("#26211e", "#302a26"), (0.8, 0.96), weight=0.6),
)

STONES = (
    Substance(("stone", "rock", "carved stone", "natural stone"), "stone", ("#8c8880", "#7a766e", "#9c968c", "#6c6862"),
              (0.7, 0.95), weight=2.5),
    Substance(("marble", "white marble", "polished marble", "marble stone"), "stone", ("#e8e4de", "#dedad4", "#f0ece6"),
              (0.1, 0.35), weight=3),
    Substance(("black marble", "dark marble"), "stone", ("#222224", "#2c2c30"), (0.08, 0.3),
              weight=1.2),
    Substance(("green marble",), "stone", ("#2f5a46", "#3c6a54"), (0.1, 0.3), weight=0.8),
    Substance(("granite", "gray granite", "granite stone"), "stone", ("#8a8684", "#7c7876", "#a09a98"), (0.25, 0.6), weight=2),
    Substance(("sandstone", "sand", "sandy stone"), "stone", ("#c8a878", "#d4b688", "#b8966a"), (0.8, 0.97), weight=1.5),
    Substance(("limestone", "chalk", "plaster", "white plaster", "stucco"), "stone", ("#d8d2c4", "#e6e2d8", "#cac4b6"),
              (0.8, 0.97), weight=1.5),
    Substance(("slate", "slate stone", "dark stone", "basalt"), "stone", ("#4a5056", "#3e4348", "#565c62"),
              (0.55, 0.85), weight=1.5),
    Substance(("concrete", "cement", "raw concrete", "gray concrete"), "stone", ("#98968f", "#a4a29c", "#8a8882"),
              (0.75, 0.95), weight=2.5),
    Substance(("asphalt", "tarmac"), "stone", ("#3a3a3a", "#444444"), (0.8, 0.95), weight=0.8),
    Substance(("brick", "red brick", "bricks", "brick wall"), "stone", ("#94503c", "#a45a42", "#844434"),
              (0.75, 0.95), weight=2),
    Substance(("obsidian", "black volcanic glass"), "stone", ("#16161a", "#1c1c20"), (0.02, 0.12),
              weight=0.8),
    Substance(("coal", "charcoal"), "stone", ("#222222", "#2a2a2a"), (0.6, 0.95), weight=0.8),
    Substance(("lava rock", "volcanic rock"), "stone", ("#3a322e", "#2e2826"), (0.85, 0.98), weight=0.7),
    Substance(("dirt", "soil", "mud", "earth"), "stone", ("#5a4430", "#4c3a28", "#6a5038"), (0.88, 0.99),
              weight=1),
    Substance(("quartz", "rock crystal", "crystal"), "stone",
              ("#dedcd8", "#d0ccc8"), (0.05, 0.25), weight=0.6),
    Substance(("onyx", "jet"), "stone", ("#17171a", "#202024"), (0.04, 0.2), weight=0.6),
    Substance(("alabaster", "gypsum", "talc"), "stone",
              ("#ece6dc", "#e2dace"), (0.35, 0.65), weight=0.6),
    Substance(("gneiss", "schist"), "stone", ("#8a8886", "#76726e"), (0.5, 0.8), weight=0.5),
    Substance(("shale", "mudstone", "siltstone"), "stone",
              ("#6a645e", "#7a7268"), (0.7, 0.92), weight=0.6),
    Substance(("flint", "chert"), "stone", ("#5a5854", "#6e6a62"), (0.25, 0.5), weight=0.4),
    Substance(("pumice", "tuff"), "stone", ("#b8b0a6", "#a8a094"), (0.85, 0.98), weight=0.5),
    Substance(("gravel", "pebbles", "rubble"), "stone",
              ("#8c867e", "#9a948a", "#76716a"), (0.7, 0.95), weight=0.6),
    Substance(("serpentine",), "stone", ("#4e6a52", "#5a7860"), (0.25, 0.5), weight=0.4),
    Substance(("red granite", "porphyry", "pink granite"), "stone",
              ("#8e5a50", "#a26c60"), (0.2, 0.5), weight=0.6),
    Substance(("beige marble", "cream marble"), "stone",
              ("#dccdb2", "#d2c0a2"), (0.1, 0.35), weight=0.6),
    Substance(("pink marble",), "stone", ("#d8b0a4", "#cfa298"), (0.1, 0.35), weight=0.5),
    Substance(("terrazzo",), "stone", ("#d4cec6", "#c8c0b6"), (0.15, 0.4), weight=0.5),
    Substance(("adobe", "mud brick", "rammed earth"), "stone",
              ("#b07a52", "#9e6c46"), (0.88, 0.98), weight=0.6),
    Substance(("flagstone", "paving stone", "masonry"), "stone",
              ("#7c7870", "#8c867c"), (0.75, 0.92), weight=0.6),
    Substance(("dolomite", "chalkstone"), "stone", ("#cfc8bc", "#dad4c8"), (0.6, 0.85), weight=0.4),
)

CERAMICS = (
    Substance(("clay", "dried clay", "brown clay"), "ceramic", ("#a87a5c", "#98694c", "#b88a6c"), (0.75, 0.95), weight=1.5),
    Substance(("terracotta", "terra cotta", "earthenware"), "ceramic", ("#b8623f", "#c06c46", "#a85636"),
              (0.65, 0.9), weight=1.8),
    Substance(("porcelain", "white porcelain", "fine china", "bone china"), "ceramic",
              ("#f0eee8", "#eae8e2", "#f2f0ec"),
              (0.03, 0.2), weight=2.2),
    Substance(("ceramic", "glazed ceramic", "glazed pottery", "ceramic glaze"), "ceramic",
              ("#e8e2d6", "#dcd6ca", "#c8b89c", "#5a7a94", "#4a6a5a"), (0.05, 0.25), paintable=True,
              weight=3),
    Substance(("tile", "ceramic tiles"), "ceramic", ("#d8d4cc", "#9cb4c4", "#c4a48c"), (0.08, 0.3),
              paintable=True, weight=1),
    Substance(("enamel", "enameled metal"), "ceramic", ("#e4e2dc", "#2c4a80", "#902828"), (0.05, 0.2),
              paintable=True, weight=1),
    Substance(("bisque", "unglazed ceramic", "raw clay"), "ceramic",
              ("#d4b090", "#c8a282"), (0.7, 0.9), weight=0.6),
    Substance(("delftware", "majolica"), "ceramic", ("#e4e6ea", "#3050a0"), (0.05, 0.2), weight=0.4),
    Substance(("roof tiles", "clay tiles"), "ceramic",
              ("#a8563a", "#b4643f"), (0.6, 0.85), weight=0.6),
)

PLASTICS = (
    Substance(("plastic", "hard plastic", "molded plastic", "plastic toy"), "plastic",
              ("#d8d8d8", "#c03030", "#3050b0", "#e0b030", "#308040", "#202020"), (0.15, 0.5),
              paintable=True, weight=6),
    Substance(("glossy plastic", "shiny plastic", "acrylic"), "plastic", ("#d0d0d0", "#b02020", "#2040a0", "#181818"),
              (0.03, 0.15), paintable=True, weight=2.5),
    Substance(("rubber", "black rubber", "tire rubber"), "plastic", ("#1c1c1c", "#242424", "#2c2c2c"), (0.6, 0.95), weight=2.5),
    Substance(("rubber", "silicone", "latex"), "plastic", ("#b0b0b0", "#8090a0"), (0.5, 0.85),
              paintable=True, weight=1.2),
    Substance(("glass", "frosted glass", "opaque glass"), "plastic", ("#a8c4c0", "#90b4b0", "#b8ccc8"),
              (0.0, 0.2), paintable=True, weight=1),
    Substance(("wax", "candle wax"), "plastic", ("#e8dcc0", "#e0d0b0"), (0.35, 0.6), paintable=True,
              weight=0.7),
    Substance(("pvc", "polypropylene", "polycarbonate", "thermoplastic"), "plastic",
              ("#d4d4d4", "#3050a0", "#c03030", "#303030"), (0.15, 0.45), paintable=True, weight=1.2),
    Substance(("resin", "epoxy", "epoxy resin"), "plastic",
              ("#d8c8a0", "#b08040", "#40708a"), (0.04, 0.25), paintable=True, weight=0.8),
    Substance(("foam", "styrofoam", "polystyrene", "sponge"), "plastic",
              ("#eae8e2", "#e0dccc", "#e0c048"), (0.85, 0.98), paintable=True, weight=0.8),
    Substance(("bakelite",), "plastic", ("#4a2a1c", "#201814"), (0.12, 0.3), weight=0.4),
    Substance(("plexiglass", "perspex", "acrylic glass"), "plastic",
              ("#c8d4d8", "#b02020", "#2040a0"), (0.01, 0.1), paintable=True, weight=0.6),
    Substance(("carbon fiber", "carbon fibre", "fiberglass"), "plastic",
              ("#1e1e20", "#2a2a2c"), (0.15, 0.4), weight=0.8),
    Substance(("tar", "bitumen", "pitch"), "plastic", ("#141414", "#1c1b1a"), (0.15, 0.5), weight=0.5),
    Substance(("candy", "jelly", "gelatin", "bubble gum"), "plastic",
              ("#d83a5a", "#e89ab0", "#58a838"), (0.04, 0.3), paintable=True, weight=0.7),
    Substance(("soap",), "plastic", ("#e8e0d0", "#d4dcc8"), (0.3, 0.55), paintable=True, weight=0.4),
)

PAINTS = (
    Substance(("paint", "painted", "painted metal", "painted surface", "enamel paint", "lacquer"), "paint",
              ("#c03030", "#3060a0", "#e0e0e0", "#308050", "#e0b020"), (0.1, 0.6), paintable=True,
              weight=6),
    Substance(("painted wood",), "paint", ("#d8d4c8", "#5080a0", "#a04030"), (0.35, 0.75), paintable=True,
              weight=1.5),
    Substance(("car paint", "lacquered surface"), "paint", ("#a01818", "#183870", "#181818", "#d8d8d8"),
              (0.02, 0.15), paintable=True, weight=1.5),
    Substance(("chalk paint", "whitewash", "matte paint"), "paint",
              ("#e4e0d8", "#9ab0a8"), (0.75, 0.95), paintable=True),
    Substance(("powder coated metal", "powder coating"), "paint",
              ("#303234", "#c8c8c8", "#a02020"), (0.35, 0.6), paintable=True, weight=0.8),
    Substance(("spray paint",), "paint",
              ("#c03030", "#3060a0", "#e0b020"), (0.3, 0.6), paintable=True, weight=0.6),
)

FABRICS = (
    Substance(("fabric", "cloth", "cotton", "cotton fabric", "textile"), "fabric",
              ("#c8c0b0", "#5a6a8a", "#8a3a3a", "#6a7a5a"), (0.8, 0.98), paintable=True, weight=4),
    Substance(("wool", "knitted wool", "felt", "knitwear"), "fabric", ("#c8bca8", "#8a7a6a", "#5a5a62"),
              (0.88, 1.0), paintable=True, weight=2),
    Substance(("denim", "blue denim", "jeans fabric"), "fabric", ("#38507a", "#2e4468", "#48628e"),
              (0.8, 0.95), weight=1.5),
    Substance(("velvet",), "fabric", ("#6a1830", "#2a2a5a", "#1e4a38"), (0.75, 0.95), paintable=True,
              weight=1.3),
    Substance(("silk", "satin fabric"), "fabric", ("#d8c8b0", "#a03048", "#c8c8d4"), (0.3, 0.5),
              paintable=True, weight=1.3),
    Substance(("linen", "burlap", "canvas", "jute", "sackcloth"), "fabric", ("#b89c74", "#c8b08a", "#a88a62"),
              (0.88, 1.0), weight=1.5),
    Substance(("carpet", "plush"), "fabric", ("#8a7a6a", "#7a3a3a", "#4a5a7a"), (0.92, 1.0),
              paintable=True, weight=1),
    Substance(("fleece", "cashmere", "mohair"), "fabric",
              ("#d0c4b0", "#8a8a90"), (0.9, 1), paintable=True, weight=0.8),
    Substance(("corduroy",), "fabric",
              ("#7a5a3a", "#5a4a3a", "#3a4a5a"), (0.85, 0.97), paintable=True, weight=0.6),
    Substance(("lace", "tulle", "chiffon", "gauze"), "fabric",
              ("#ece6de", "#e0d8d0"), (0.7, 0.9), paintable=True, weight=0.6),
    Substance(("rope", "hemp", "twine", "sisal"), "fabric",
              ("#b89a6c", "#c8ac80"), (0.88, 1), weight=0.7),
    Substance(("synthetic fabric", "lycra", "spandex", "polyamide"), "fabric",
              ("#303034", "#a8a8b0", "#3050a0"), (0.5, 0.75), paintable=True, weight=0.9),
    Substance(("towel", "terry cloth"), "fabric",
              ("#e4e0d8", "#a8c0d0"), (0.92, 1), paintable=True, weight=0.5),
    Substance(("tartan", "plaid", "brocade"), "fabric",
              ("#8a2a2a", "#2a4a3a", "#3a3a6a"), (0.8, 0.95), weight=0.5),
)

ORGANICS = (
    Substance(("leather", "brown leather", "leather hide", "cowhide"), "leather", ("#5e3a22", "#70482c", "#4a2c1a"),
              (0.4, 0.7), weight=3),
    Substance(("black leather",), "leather", ("#1e1c1b", "#282523"), (0.35, 0.6), weight=1.2),
    Substance(("leather", "suede", "dyed leather"), "leather", ("#8a6a4a", "#7a2a24", "#2a3a5a"),
              (0.5, 0.9), paintable=True, weight=1.3),
    Substance(("paper", "cardboard", "parchment", "papier mache"), "paper", ("#d8c8a8", "#e8e0d0", "#b8946a"),
              (0.8, 0.97), weight=1.7),
    Substance(("skin", "human skin", "flesh"), "organic", ("#c8927a", "#d8a890", "#8a5a44", "#b47c64"),
              (0.35, 0.6), weight=1.2),
    Substance(("bone", "ivory", "old bone", "teeth"), "organic", ("#e0d4b8", "#d6c8a8", "#e8dec8"),
              (0.3, 0.65), weight=1.5),
    Substance(("leaves", "grass", "foliage", "plant", "leafy"), "organic", ("#4a6a28", "#3c5a20", "#5e7e34"),
              (0.5, 0.8), weight=1.3),
    Substance(("moss", "mossy", "lichen"), "organic", ("#4a5a22", "#5c6c2c", "#3c4a1c"), (0.88, 1.0),
              weight=1.5),
    Substance(("scales", "snake skin", "reptile skin", "crocodile leather"), "organic",
              ("#5a6238", "#4a4a30", "#6a5a3a"),
              (0.35, 0.6), weight=0.8),
    Substance(("chocolate", "dark chocolate", "milk chocolate"), "organic", ("#3c2418", "#4c2e1e", "#5e3a26"),
              (0.3, 0.55), weight=0.9),
    Substance(("pumpkin", "orange peel"), "organic", ("#d07820", "#dc8428"), (0.35, 0.6), weight=0.5),
    Substance(("cheese", "butter"), "organic", ("#e8c060", "#ecd080"), (0.4, 0.65), weight=0.5),
    Substance(("snow", "frost", "sugar", "salt"), "ice", ("#f0f2f4", "#e8ecf0"), (0.7, 0.95), weight=1),
    Substance(("ice", "frozen ice", "glacier ice"), "ice", ("#b4d0dc", "#c4dce6", "#a4c4d4"), (0.02, 0.25), weight=1.2),
    Substance(("patent leather",), "leather",
              ("#141414", "#6a1418"), (0.03, 0.15), paintable=True, weight=0.5),
    Substance(("nubuck", "suede leather", "buckskin"), "leather",
              ("#a8825a", "#8a6844"), (0.85, 0.98), paintable=True, weight=0.6),
    Substance(("fur", "animal fur", "brown fur"), "organic",
              ("#6a4c34", "#8a6a4a", "#4a3a2c"), (0.8, 0.95), weight=0.8),
    Substance(("sheepskin", "white fur"), "organic", ("#e6dccb", "#dcd0bc"), (0.9, 1), weight=0.5),
    Substance(("feathers",), "organic", ("#dcd8d0", "#6a5a4a"), (0.7, 0.9), weight=0.4),
    Substance(("newspaper", "newsprint"), "paper", ("#cfcabc", "#c4bead"), (0.88, 0.97), weight=0.4),
    Substance(("kraft paper", "paper bag"), "paper", ("#b08858", "#bc9464"), (0.85, 0.96), weight=0.5),
    Substance(("meat", "raw meat"), "organic", ("#a83a34", "#94302c"), (0.2, 0.45), weight=0.5),
    Substance(("bread", "crust", "cookie", "biscuit"), "organic",
              ("#b87a3c", "#c88e4e", "#a4682e"), (0.82, 0.97), weight=0.7),
    Substance(("eggshell",), "organic", ("#ecdcc4", "#e4d0b4"), (0.45, 0.65), weight=0.4),
    Substance(("seashell", "shell", "conch"), "organic",
              ("#e8d4c0", "#e0c4ac"), (0.15, 0.4), weight=0.5),
    Substance(("horn", "antler", "tortoiseshell"), "organic",
              ("#5e4630", "#7a5c3c"), (0.15, 0.4), weight=0.5),
    Substance(("seaweed", "algae"), "organic", ("#2e4a2a", "#3a5a30"), (0.2, 0.5), weight=0.4),
    Substance(("cactus", "succulent"), "organic", ("#4e7a44", "#5c8850"), (0.4, 0.65), weight=0.4),
    Substance(("hair",), "organic", ("#3a2a1e", "#5a4028"), (0.3, 0.5), weight=0.4),
    Substance(("lemon peel", "banana peel"), "organic",
              ("#e4c832", "#e8d040"), (0.35, 0.6), weight=0.4),
    Substance(("tomato", "strawberry"), "organic", ("#b8201c", "#c42a24"), (0.15, 0.4), weight=0.4),
    Substance(("beeswax", "honeycomb"), "organic", ("#d8a03c", "#c88e30"), (0.4, 0.65), weight=0.4),
    Substance(("ash", "soot", "cinder"), "organic",
              ("#5a5856", "#3a3938", "#7a7876"), (0.88, 0.99), weight=0.5),
    Substance(("cotton wool", "clouds"), "organic", ("#f0f0f0", "#e8eaec"), (0.9, 1), weight=0.4),
)

GEMS = (
    Substance(("jade", "polished jade"), "gem", ("#4a8a5e", "#5c9a6e", "#3c7a50"),
              (0.08, 0.25), weight=1),
    Substance(("ruby", "garnet"), "gem", ("#8a1024", "#9c182c"), (0.0, 0.1), weight=0.8),
    Substance(("sapphire", "lapis lazuli", "lapis"), "gem", ("#1c3a8a", "#24469c"), (0.02, 0.15),
              weight=0.8),
    Substance(("emerald", "malachite"), "gem", ("#0e6a40", "#187a4c"), (0.02, 0.15), weight=0.8),
    Substance(("amethyst", "purple crystal"), "gem", ("#6a3a94", "#7c4aa4"), (0.02, 0.12), weight=0.7),
    Substance(("turquoise stone", "opal"), "gem", ("#48b0a8", "#5cc0b8"), (0.1, 0.3), weight=0.6),
    Substance(("pearl", "mother of pearl"), "gem", ("#ece6e0", "#e4dcd8"), (0.1, 0.25), weight=0.7),
    Substance(("amber", "honey", "topaz"), "gem", ("#b8681c", "#c87a24"), (0.03, 0.15), weight=0.7),
    Substance(("diamond", "cubic zirconia"), "gem", ("#d8dce0", "#e2e6ea"), (0, 0.05), weight=0.6),
    Substance(("carnelian", "agate"), "gem", ("#a84a24", "#b85c30"), (0.05, 0.2), weight=0.5),
    Substance(("citrine",), "gem", ("#d8a42c", "#e0b440"), (0.02, 0.12), weight=0.3),
    Substance(("peridot", "tourmaline"), "gem", ("#6a9a2c", "#5a8a34"), (0.02, 0.12), weight=0.3),
    Substance(("moonstone",), "gem", ("#d4d8de", "#c8ced6"), (0.08, 0.25), weight=0.3),
    Substance(("rose quartz",), "gem", ("#e0b0b4", "#d8a4aa"), (0.05, 0.2), weight=0.4),
    Substance(("tiger eye",), "gem", ("#8a5a20", "#a06c28"), (0.05, 0.2), weight=0.3),
)

SUBSTANCES = METALS + CORRODED + WOODS + STONES + CERAMICS + PLASTICS + PAINTS + FABRICS + ORGANICS + GEMS

FINISHES = {
    # word: roughness range it asks for
    "matte": (0.7, 0.95), "dull": (0.7, 0.95), "flat": (0.75, 0.95), "satin": (0.35, 0.5), "semi-gloss": (0.22, 0.36),
    "glossy": (0.04, 0.18), "shiny": (0.05, 0.2), "polished": (0.03, 0.16), "smooth": (0.08, 0.3),
    "rough": (0.7, 0.95), "high gloss": (0.02, 0.1), "mirror-like": (0.0, 0.06), "lustrous": (0.12, 0.3),
    "coarse": (0.75, 0.97), "frosted": (0.45, 0.65), "sandblasted": (0.55, 0.75), "varnished": (0.08, 0.25),
    "wet": (0.03, 0.2), "unpolished": (0.55, 0.8), "hammered": (0.25, 0.45), "gleaming": (0.03, 0.15),
}
"""Finish words that say how rough a surface is."""

FINISHES_METAL = {**{word: FINISHES[word] for word in ("matte", "dull", "satin", "shiny", "polished", "smooth", "rough",
                  "mirror-like", "lustrous", "sandblasted", "unpolished", "hammered", "gleaming")},
                  "brushed": (0.28, 0.45), "mirror polished": (0.0, 0.06), "matte": (0.5, 0.7), "rough": (0.5, 0.75),
                  "dull": (0.5, 0.7), "machined": (0.2, 0.4)}
"""Finish words of metals; a rough metal is smoother than a rough stone."""

OBJECTS = (
    "chair", "statue", "skull", "vase", "table", "car", "robot", "teapot", "cup", "bowl", "helmet", "sword", "shield",
    "toy", "duck", "cow", "horse", "dragon", "bust", "figurine", "lamp", "clock", "ship", "airplane", "spider", "house",
    "gun", "bottle", "box", "crate", "barrel", "shoe", "boot", "bag", "hat", "ring", "crown", "coin", "bolt", "nut",
    "gear", "machine part", "engine", "pipe", "tool", "hammer", "knife", "monster", "animal", "bird", "fish", "cat",
    "dog", "rabbit", "bear", "head", "mask", "armor", "sofa", "bench", "shelf", "column", "fountain", "wheel", "cart",
    "sculpture", "ornament", "pot", "plate", "jar", "guitar", "piano", "phone", "camera", "ball", "sphere", "cube",
    "avocado", "apple", "mushroom", "tree", "gazebo", "tower", "castle", "bridge", "torus", "bracket", "buffalo",
)

HELD_OUT = (
    # word: nearest taught word; never in a training caption
    ("mahogany", "cherry wood"), ("teak", "wood"), ("cedar", "pine"), ("crimson", "red"), ("gilded", "gold"),
    ("ivory white", "cream"), ("vinyl", "plastic"), ("nylon", "fabric"), ("tweed", "wool"), ("flannel", "fabric"),
    ("quartzite", "stone"), ("travertine", "limestone"), ("stoneware", "ceramic"), ("faience", "ceramic"),
    ("corroded", "rusty"), ("tarnished", "dull"), ("cobblestone", "stone"), ("soapstone", "stone"),
    ("polyester", "fabric"), ("polythene", "plastic"), ("neoprene", "rubber"), ("electrum", "gold"),
    ("metallic silver", "silver"), ("vermilion", "red"), ("cerulean", "blue"), ("chartreuse", "lime"),
    ("ultramarine", "blue"), ("mauve", "lilac"), ("auburn", "brown"), ("taupe", "brown"), ("amaranth", "red"),
)
"""Words for tests of generalisation, with the nearest word that is taught."""
