"""Colours by name, as sRGB, and words that change one: "dark teal", "reddish brown"."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

COMMON = {
    "white": "#eeeeee", "black": "#1a1a1a", "gray": "#808080", "grey": "#808080", "red": "#c01818",
    "green": "#1f8a2c", "blue": "#1f45b8", "yellow": "#e8cc18", "orange": "#e87818", "purple": "#7a22a0",
    "pink": "#ee86ac", "brown": "#6e4424", "beige": "#d8c8a4", "cream": "#f0e6c8", "tan": "#c8a478",
    "turquoise": "#30c0b8", "cyan": "#20c0d8", "magenta": "#cc20a0", "violet": "#7a38c8", "lime": "#98d820",
    "olive": "#6c6c20", "navy": "#14204c", "maroon": "#601818", "teal": "#107878", "lavender": "#b8a4dc",
    "salmon": "#f08a74", "coral": "#f4745c", "mint": "#9ce0b8", "khaki": "#b4a878", "mustard": "#d0a020",
    "charcoal": "#36383c", "scarlet": "#cc2010", "burgundy": "#5c1024", "indigo": "#342080", "lilac": "#c4a0d0",
    "peach": "#f8c4a0", "rose": "#e05478", "azure": "#3c98ec", "aqua": "#50d8d0", "emerald green": "#109050",
    "forest green": "#1c5020", "sky blue": "#80bce8", "royal blue": "#2848c0", "hot pink": "#f0409c",
    "neon green": "#50f030", "off white": "#e8e4da", "rust colored": "#a04820", "blue-green": "#14807c",
    "plum": "#6c2858", "fuchsia": "#d82890", "ochre": "#c08428", "sepia": "#6c4c34", "sand colored": "#d4bc90",
    "wine red": "#641828", "brick red": "#a43c2c", "cobalt blue": "#1440a4", "sea green": "#2c8c64",
    "apricot": "#f4b484", "cherry red": "#b01028", "blood red": "#7c0a0a", "lemon yellow": "#f0e430",
    "jet black": "#0e0e0e", "snow white": "#f4f4f4", "slate gray": "#5c6670", "steel blue": "#4c7ca8",
    "midnight blue": "#141c40", "chocolate brown": "#4c2c1a", "caramel": "#b07434", "copper colored": "#b46c44",
    "ginger": "#b86424", "periwinkle": "#9098dc", "orchid": "#c86cc4", "aquamarine": "#70d8b8",
}
"""The names that people use most."""

RARE = {
    "tea": "#65ab7c", "saffron": "#feb209", "cinnamon": "#ac4f06", "cocoa": "#875f42", "fern": "#63a950",
    "sapphire": "#2138ab", "straw": "#fcf679", "hazel": "#8e7618", "canary": "#fdff63", "carmine": "#9d0216",
    "lipstick": "#d5174e", "ruby": "#ca0147", "petrol": "#005f6a", "viridian": "#1e9167", "heather": "#a484ac",
    "mango": "#ffa62b", "shamrock": "#01b44c", "heliotrope": "#d94ff5", "iris": "#6258c4", "pear": "#cbf85f",
    "sandy": "#f1da7a", "banana": "#ffff7e", "tomato": "#ef4026", "buff": "#fef69e", "fawn": "#cfaf7b",
    "chestnut": "#742802", "cherry": "#cf0234", "midnight": "#03012d", "rouge": "#ab1239", "wheat": "#fbdd7e",
    "mulberry": "#920a4e", "celadon": "#a8c4ac", "strawberry": "#fb2943", "adobe": "#bd6c48", "camel": "#c69f59",
    "coffee": "#a6814c", "ecru": "#feffca", "amber": "#feb308", "russet": "#a13905", "pistachio": "#c0fa8b",
    "bordeaux": "#7b002c", "ocean": "#017b92", "blush": "#f29e8e", "lemon": "#fdff52", "cerise": "#de0c62",
    "umber": "#b26400", "aubergine": "#3d0734", "emerald": "#01a049", "tangerine": "#ff9408", "pumpkin": "#e17701",
    "chocolate": "#3d1c02", "sienna": "#a9561e", "cobalt": "#1e488f", "wine": "#80013f", "grape": "#6c3461",
    "brick": "#a03623", "sage": "#87ae73", "eggplant": "#380835", "puce": "#a57e52", "greyish": "#a8a495",
    "sand": "#e2ca76", "ivory": "#f2ecd8", "apple green": "#76cd26", "army green": "#4b5d16",
    "avocado green": "#87a922", "baby blue": "#a2cffe", "baby pink": "#ffb7ce", "banana yellow": "#fafe4b",
    "blue grey": "#607c8e", "bottle green": "#044a05", "bubblegum pink": "#fe83cc", "burnt orange": "#c04e01",
    "burnt sienna": "#b04e0f", "burnt umber": "#a0450e", "butter yellow": "#fffd74", "canary yellow": "#fffe40",
    "candy pink": "#ff63e9", "carnation pink": "#ff7fa7", "cool grey": "#95a3a6", "coral pink": "#ff6163",
    "light blue": "#8fc4ea", "pale blue": "#c4dff0",
    "cornflower blue": "#5170d7", "cranberry": "#9e003a", "denim blue": "#3b5b92", "dusty rose": "#c0737a",
    "dusky pink": "#cc7a8b", "duck egg blue": "#c3fbf4", "egg shell": "#fffcc4", "electric blue": "#0652ff",
    "electric green": "#21fc0d", "electric purple": "#aa23ff", "fire engine red": "#fe0002",
    "golden yellow": "#fec615", "grass green": "#3f9b0b", "hunter green": "#0b4008", "ice blue": "#d7fffe",
    "indigo blue": "#3a18b1", "jade green": "#2baf6a", "jungle green": "#048243", "kelly green": "#02ab2e",
    "lemon green": "#adf802", "lime green": "#89fe05", "moss green": "#658b38", "mustard yellow": "#d2bd0a",
    "navy blue": "#001146", "neon pink": "#fe019a", "neon blue": "#04d9ff", "neon yellow": "#cfff04",
    "ocean blue": "#03719c", "olive green": "#677a04", "pea green": "#8eab12", "peacock blue": "#016795",
    "pine green": "#0a481e", "powder blue": "#b1d1fc", "powder pink": "#ffb2d0", "prussian blue": "#004577",
    "racing green": "#014600", "raw umber": "#a75e09", "rose pink": "#f7879a", "rust orange": "#c45508",
    "rust red": "#aa2704", "sage green": "#88b378", "salmon pink": "#fe7b7c", "sandy brown": "#c4a661",
    "seafoam green": "#7af9ab", "shocking pink": "#fe02a2", "sunflower yellow": "#ffda03", "tomato red": "#ec2d01",
    "turquoise blue": "#06b1c4", "violet blue": "#510ac9", "warm grey": "#978a84", "watermelon": "#fd4659",
    "yellow green": "#c0fb2d", "yellow orange": "#fcb001", "blue violet": "#5d06e9", "red violet": "#9e0168",
    "red orange": "#fd3c06", "orange red": "#fd411e", "green yellow": "#c9ff27", "blue green": "#137e6d",
    "green blue": "#06b48b", "dusty blue": "#5a86ad", "dusty pink": "#d58a94", "dusty purple": "#825f87",
    "royal purple": "#4b006e", "steel grey": "#6f828a", "slate green": "#658d6d", "slate blue": "#5b7c99",
    "tea green": "#bdf8a3", "tan brown": "#ab7e4c", "teal blue": "#01889f", "teal green": "#25a36f",
    "spring green": "#a9f971", "stormy blue": "#507b9c", "burlywood": "#deb887", "cadet blue": "#5f9ea0",
    "firebrick": "#b22222", "gainsboro": "#dcdcdc", "goldenrod": "#daa520", "honeydew": "#f0fff0",
    "indian red": "#cd5c5c", "thistle": "#d8bfd8", "dodger blue": "#1e90ff", "medium purple": "#9370db",
}
"""Further names; most values are the means of the xkcd colour survey (Munroe 2010, CC0), some those of CSS."""

SHADES = {
    "pearl white": "#f2efe6",
    "oatmeal": "#d6c8ae", "biscuit": "#dcc49a", "mocha": "#6e4f3a", "latte": "#b99a76", "espresso": "#3c2a21",
    "cappuccino": "#a68868", "greige": "#b8ac9c", "putty": "#c2b6a0", "anthracite": "#33373b", "graphite": "#3d4043",
    "claret": "#6e1423", "merlot": "#561a24", "damson": "#4b2a40", 
    "stormy": "#4f6272", 
    "dove grey": "#9c9a98", "dove gray": "#9c9a98", "ash grey": "#b2b5ac", "eau de nil": "#c9d8b4",
    "robin egg blue": "#6fc7c8", "robin egg": "#6fc7c8", "wedgwood blue": "#5b7fae", "delft blue": "#2b4a8c",
    "petrol blue": "#1d4e5c", "laurel": "#5c6e4e", "paprika": "#b0391f", "cayenne": "#97301c",
    "chilli": "#b3201c", "chilli red": "#b3201c", "tobacco": "#6b4a2b", "cognac": "#9a5a2a", "whiskey": "#b06a2c",
    "whisky": "#b06a2c", "butterscotch": "#d49a4a", "toffee": "#8a5a34", "fudge": "#8c6246", "nutmeg": "#8a5c3c",
    "flaxen": "#dccb94", "champagne": "#e8d6b4", "vanilla": "#f2e6c4", "custard": "#f0dc96",
    "buttermilk": "#f6e8c0", "nude": "#ddb9a0", "flamingo": "#f48c8c", "raspberry": "#b01c4c", "blackberry": "#38223a",
    "blueberry": "#3f4a7c", "pomegranate": "#a4202c", "wisteria": "#a890d0", "inky": "#1a2238",
    "ink blue": "#1c2a4e", "acid green": "#a8c81c", "acid yellow": "#dce01c", "citron": "#cfc32a", 
    "blonde": "#dcbc80", "blond": "#dcbc80",
    "rosewood red": "#65000b",
    "sea foam": "#9fe2bf", "seafoam": "#9fe2bf", "arctic white": "#f4f8fa", "bone white": "#e8e2d2", 
    "crimson": "#c01430", "cerulean": "#2a7fc0", "vermilion": "#e03c28", "vermillion": "#e03c28", "ultramarine": "#2a24a4",
    "chartreuse": "#a4dc1c", "mauve": "#b090b8", "taupe": "#8a7c70", "auburn": "#7e3a20", "tawny": "#b06a30", "drab": "#8a7c5a",
    "dun": "#a08e74", "fuschia": "#d82890", "ocher": "#c08428", "maize": "#f0cc60", "creamy": "#f0e6c8", "rosy": "#e49a98",
    "field drab": "#6c541e", "earthy": "#7a5c40",
    "limed": "#d6ccb8", "cerused": "#d2c6b0", "pickled": "#dacfbc", "fumed": "#5c4330", "smoked": "#4a4038",
    "ebonised": "#26211d", "ebonized": "#26211d", "anodised black": "#202124", "gunmetal grey": "#53565a",
    "moss grey": "#8c9078", "blackened": "#2a2826", "bleached white": "#eae6da",
    "tea stained": "#c8a878", "sooty black": "#1c1a18",
    "carmine red": "#9d0216", "lapis blue": "#26518f", "marigold": "#eda42a", "buttercup": "#f6d34a", "primrose": "#eee08c",
    "mulled wine": "#5a2238", "beetroot": "#7a1c40", "hibiscus": "#c02860", "cyclamen": "#d05a96", "verdant": "#2f7a3a",
    "candyfloss pink": "#f4aecb", "candy floss pink": "#f4aecb",
    "golden brown": "#a5682a", "golden orange": "#e08a1c", "golden tan": "#c8964e", "golden blonde": "#d8b470",
    "fox red": "#b4561f", "mint green": "#a3d9b5",
    "grey green": "#7d8f7a", "green grey": "#7d8f7a", "grey brown": "#7d7166", "brown grey": "#7d7166",
    "glacier blue": "#a8cfe0", "arctic blue": "#b4d6e6", "gulf blue": "#5aa8d0", "delphinium": "#5068b0",
    "iron grey": "#5c5f61", "strong tea": "#7a3e1c", "candy red": "#c4102c", "weak tea": "#b07844", "milky tea": "#b48c68",
}
"""Names that training never draws: those of paint cards and cloth, of seas and skies, and what joiners do to wood."""

LIKENED = {
    "sea": "#3c8d94", "sky": "#82bce6", "storm": "#4f6272", "fog": "#c3c7c8", "mist": "#cdd5d4",
    "smoke": "#848884", "flame": "#e2582a", "sunset": "#f08050", "ember": "#c04a20", "raven": "#14161a",
    "ink": "#1a2238", "milk": "#f4f0e6", "bay": "#5c3a24", "fig": "#532d3b", "raisin": "#3f2a2c",
    "pebble": "#a49c90", "storm cloud": "#4f5a64", "thundercloud": "#454f5a", "thunder cloud": "#454f5a",
    "rain cloud": "#6b747c",
    "night sky": "#101a38", "midnight sky": "#0c1430", "summer sky": "#6fb4e8", "dawn": "#f4b8a0", "dusk": "#5a5078",
    "deep sea": "#0c3048", "stormy sea": "#3f5f6a", "lagoon": "#2cb0b0", "moonlight": "#cfd6e4", "sunshine": "#f8d840",
    "sunrise": "#f4a060", "old penny": "#7a4a30", "new penny": "#c8744c", "autumn leaves": "#b0622a", "wet sand": "#a08a66",
    "egg yolk": "#f0b020", "clotted cream": "#f2e4bc", "porridge": "#d8c8a8", "rain": "#8a98a4", "thunder": "#454f5a",
    "candlelight": "#f4c878", "firelight": "#e8843c", "bluebells": "#5a64c0", "cornflowers": "#5170d7", "daffodils": "#f4d02c",
    "desert sand": "#d8bd94", "military": "#4b5320", "flax": "#dccb94",
}
"""Things that lend their colour where words say that it is theirs, "the colour of a stormy sea", and not elsewhere."""

TREATMENTS = frozenset(["limed", "cerused", "pickled", "fumed", "smoked", "ebonised", "ebonized", "bleached white"])
"""Those of them that say what wood looks like, whatever its own colour."""

COLORS = LIKENED | SHADES | RARE | COMMON

COMMON_SHARE = 0.6
"""Share of the common names among all that are drawn."""

CHANGES = {
    # word: (factor of the saturation, of the lightness, share of white mixed in)
    "dark": (1.0, 0.5, 0.0), "deep": (1.15, 0.7, 0.0), "light": (1.0, 1.0, 0.45), "pale": (0.9, 1.0, 0.65),
    "pastel": (0.8, 1.0, 0.6), "bright": (1.25, 1.1, 0.05), "vivid": (1.4, 1.05, 0.0), "muted": (0.5, 0.95, 0.0),
}  # fmt: skip
"""Words that change any colour."""

LEANINGS = {"reddish": "red", "yellowish": "yellow", "greenish": "green", "bluish": "blue", "purplish": "purple",
            "pinkish": "pink", "brownish": "brown", "greyish": "grey", "whitish": "white"}  # fmt: skip
"""Words that let a colour lean towards another."""

LEAN = 0.35
CHANGED, LEANING, BOTH = 0.2, 0.08, 0.06
"""Shares of the drawn colours that such a word is put before, or one of either: "pale greyish violet", as dictionaries say."""

WORDS = (*COMMON, *RARE, *CHANGES, *LEANINGS)
"""All that a colour that training names may be made of."""


def draw_named(rng: Generator) -> tuple[str, NDArray]:
    """A colour's name and its sRGB (3,)."""
    names = list(COMMON if rng.random() < COMMON_SHARE else RARE)
    name = names[rng.integers(len(names))]
    kind = 1.0 if " " in name else rng.random()
    if CHANGED <= kind < CHANGED + LEANING + BOTH:
        name = f"{list(LEANINGS)[rng.integers(len(LEANINGS))]} {name}"
    if kind < CHANGED or CHANGED + LEANING <= kind < CHANGED + LEANING + BOTH:
        name = f"{list(CHANGES)[rng.integers(len(CHANGES))]} {name}"
    return name, named(name)


def named(name: str) -> NDArray[np.float64]:
    """sRGB (3,) of a name as `draw_named` makes them."""
    if name in COLORS:
        return rgb(COLORS[name])
    word, base = name.split(" ", 1)
    return changed(named(base), word)


def changed(color: NDArray[np.float64], word: str) -> NDArray[np.float64]:
    """sRGB (3,) of a colour under a word of `CHANGES` or `LEANINGS`."""
    if word in LEANINGS:
        return color + LEAN * (rgb(COLORS[LEANINGS[word]]) - color)
    saturation, lightness, white = CHANGES[word]
    color = (color.mean() + saturation * (color - color.mean())) * lightness
    return (color + white * (1 - color)).clip(0, 1)


def rgb(text: str) -> NDArray[np.float64]:
    """(3,) in [0, 1] of "#rrggbb"."""
    return np.array([int(text[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
