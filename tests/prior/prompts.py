"""Prompts, and what must be understood of them: a line each, "prompt | where family colour | where family colour …".

where: a kind of mask, or several that would do ("up/patches"); "all" is the base. family: of the look ("*": any; "metal" alone
is metallic). colour: sRGB. What a prompt calls for beyond this, such as grime, is not asked. FORMS were written as a user
writes, before the tables were looked at for them; WORDS are single things, stuffs, finishes and wear. corpus.txt has
prompts as artists, makers of games and researchers write them, of every form: its rows are what the reader gave, read through,
and those left out that were wrong. They hold what is right today; they do not measure how often new prompts are.
"""

from pathlib import Path

CORPUS = (Path(__file__).parent / "corpus.txt").read_text(encoding="utf-8")

FORMS = """
a boot, brown leather with a black rubber sole | all leather #5e3a22 | below plastic #222222
wooden chest with metal bands | all wood #8a5a34 | bands metal #b8b8b8
snow covered rock | all stone #8c8880 | up ice #f0f2f4
moss-covered stone | all stone #8c8880 | crevices/up/patches organic #4a5a22
white with cobalt stripes | all * #eeeeee | stripes * #1e488f
leopard spots on tan | all * #c8a478 | spots * #2a1a10
gold veins in black marble | all stone #242426 | veins metal #ffe29b
blue paint peeling off wood | all wood #92633b | chips paint #1f45b8
copper roof, brick walls | all stone #94503c | above metal #fad1c2
half oak half gold | all wood #b48a56 | left/right/above/below metal #ffe29b
concrete fading into grass | all stone #98968f | fade organic #4a6a28
a teapot of white porcelain with a gold rim and wooden handle | all ceramic #f0eee8 | above metal #ffe29b | below wood #92633b
red velvet armchair with dark wooden legs | all fabric #c01818 | below wood #4a3020
green glass bottle with a cork top | all plastic #1f8a2c | above wood #b98a5a
rusty iron gate with peeling white paint | all rust #7a3b1d | chips paint #eeeeee
steel knife with an ebony handle | all metal #c6c6c4 | below wood #2a211c
terracotta pot with a white glazed rim | all ceramic #b8623f | above ceramic #eeeeee
cast iron pan with a wooden handle | all metal #4e4d4c | below wood #92633b
gray granite with copper inlay | all stone #8a8684 | veins/bands metal #fad1c2
black and white checkered marble floor | all stone #1a1a1a | checks stone #eeeeee
red and white striped canvas tent | all fabric #c01818 | stripes fabric #eeeeee
blue ceramic vase with white polka dots | all ceramic #1f45b8 | dots ceramic #eeeeee
old leather suitcase with brass corners | all leather #5e3a22 | edges metal #f4e2ae
stone statue covered in ivy | all stone #8c8880 | patches/crevices organic #3c5a20
bronze bust with verdigris in the crevices | all metal #d9a877 | crevices rust #5fa08c
concrete wall with rust streaks | all stone #98968f | streaks rust #7a3b1d
dusty black piano | all * #1a1a1a | up ground/stone #a39a8c
scratched green painted metal | all paint #1f8a2c | scratches metal #c6c6c4
white marble column with a gold base | all stone #e8e4de | below metal #ffe29b
lower half brick, upper half white plaster | all stone #94503c | above stone #eeeeee
wood on the bottom and steel on top | all wood #92633b | above metal #c6c6c4
tiger stripes on orange fur | all organic #e87818 | stripes * #1a120c
navy wool with red trim | all fabric #14204c | edges fabric #c01818
matte black plastic with glossy red edges | all plastic #1a1a1a | edges plastic #c01818
car with red paint and black rubber tires | all paint #c01818 | below plastic #222222
a lantern made of blackened iron with brass trim | all metal #5d6066 | edges metal #f4e2ae
copper above, walnut below | all metal #fad1c2 | below wood #5a3d28
sandstone temple with moss on the roof | all stone #c8a878 | above organic #4a5a22
white sneaker with a red sole | all * #eeeeee | below * #c01818
the top is oak, the legs are black steel | all wood #b48a56 | below metal #1a1a1a
mahogany desk with a green leather top | all wood #6e2c1c | above/up leather #1f8a2c
gold leaf flaking off dark wood | all wood #4a3020 | chips metal #ffe29b
pink icing on a chocolate cake | all organic #4c2e1e | up/patches/above organic #ee86ac
a dog house of red painted wood with a blue roof | all paint #c01818 | above paint #1f45b8
brushed steel with a black rubber grip | all metal #c6c6c4 | below plastic #222222
a wooden shield with an iron rim | all wood #92633b | edges/above metal #b0b0b0
marble statue with moss in the cracks and snow on top | all stone #e8e4de | crevices organic #4a5a22 | up/above ice #f0f2f4
yellow taxi with black checks | all paint #e8cc18 | checks paint #1a1a1a
denim jacket with brown leather patches | all fabric #38507a | patches leather #5e3a22
worn red paint revealing steel | all paint #c01818 | chips/edges metal #c6c6c4
chrome with blue racing stripes | all metal #c4c5c5 | stripes * #1f45b8
bamboo handle, ceramic body, cork lid | all ceramic #c8c0b0 | above wood #b98a5a | below wood #cdb06a
mud splattered white van | all paint #eeeeee | patches/below ground/stone #5a4430
gold-trimmed white porcelain cup | all ceramic #eeeeee | edges metal #ffe29b
silver with patches of tarnish | all metal #fcfaf5 | patches * #3a342c
oak with ebony inlay | all wood #b48a56 | veins/bands wood #2a211c
ice turning into rock | all ice #b4d0dc | fade stone #8c8880
black rubber speckled with yellow | all plastic #222222 | spots plastic #e8cc18
lichen growing on granite | all stone #8a8684 | patches organic #8a9a6a
red brick with white mortar lines and a slate roof | all stone #94503c | above stone #4a5056
a ceramic jar, glossy blue, with a matte white lid | all ceramic #1f45b8 | above ceramic #eeeeee
brass tap with green verdigris stains | all metal #f4e2ae | patches rust #5fa08c
emerald velvet cushion with gold tassels | all fabric #01a049 | */edges metal #ffe29b
helmet in polished steel with gilded edges | all metal #c6c6c4 | edges metal #ffe29b
zebra striped fabric | all fabric #ece8e0 | stripes fabric #161514
grey stone below, white snow above | all stone #808080 | above ice #eeeeee
old bronze cannon on a wooden carriage | all metal #c89969 | patches/below wood #92633b
carved jade dragon on a wooden stand | all gem #4a8a5e | below wood #92633b
polished steel blade, leather-wrapped grip, brass pommel | all metal #c6c6c4 | below leather #5e3a22 | below metal #f4e2ae
concrete with a band of blue tiles | all stone #98968f | bands ceramic #1f45b8
green paint over wood, peeling | all wood #92633b | chips paint #1f8a2c
rusty iron under peeling green paint | all rust #7a3b1d | chips paint #1f8a2c
turquoise and gold striped vase | all ceramic #30c0b8 | stripes metal #ffe29b
paint: teal; trim: copper | all paint #107878 | edges metal #fad1c2
split in half: one side gold, the other side silver | all metal #ffe29b | right metal #fcfaf5
white with red and blue stripes | all * #eeeeee | stripes * #c01818 | stripes * #1f45b8
wooden table with a marble top | all wood #92633b | above stone #e8e4de
gold plated steel with scratches revealing the steel | all metal #ffe29b | scratches metal #c6c6c4
sandstone that turns into marble | all stone #c8a878 | fade stone #e8e4de
grey concrete, lower third painted yellow | all stone #98968f | below paint #e8cc18
"""

WORDS = """
a rubber duck | all plastic #e8cc18
a blackboard | all * #2e3432
fire hydrant | all paint #c01818
tennis ball | all fabric #c8e03c
terracotta roof | all ceramic #b05c3c
school bus | all paint #e8b020
stop sign | all * #c01818
snowman | all ice #f0f2f4
a banana | all organic #e8d040
a carrot | all organic #e87818
an eggplant | all organic #380835
traffic cone | all plastic #e86820
billiard table | all fabric #1f7a3c
wine bottle | all * #1c3020
lemon | all organic #e8d83c
gold bar | all metal #ffe29b
pool table felt | all fabric #1f7a3c
cricket ball | all leather #901c1c
rusty iron | all rust #7a3b1d
rusty bucket | all metal #c8cccf | chips rust #7a3b1d
polished brass | all metal #f4e2ae
hammered copper | all metal #fad1c2
weathered oak planks | all wood #a8895f
mahogany | all wood #6e2c1c
matte white ceramic | all ceramic #eeeeee
mauve fabric | all fabric #c0a0cc
dark reddish brown leather | all leather #4b2018
pale pink silk | all fabric #f8d4de
charred wood | all wood #26211e
wet slate | all stone #4a5056
mossy cobblestone | all stone #807c76 | crevices organic #4a5a22
snowy pine | all wood #d3ab74 | up ice #f0f2f4
dusty old leather | all leather #5e3a22 | up ground/stone #a39a8c
chipped yellow paint | all paint #e8cc18 | chips metal #c6c6c4
verdigris | all rust #5fa08c
corrugated cardboard | all paper #b8946a
tree bark | all wood #5a4a3c
crocodile leather | all organic/leather #5a6238
obsidian | all * #16161a
beige carpet | all fabric #d8c8a4
"""


def parsed(lines: str) -> list[tuple[str, list[tuple[tuple[str, ...], tuple[str, ...], str]]]]:
    """Each prompt with the (wheres, families, colour) of every coat that must be there."""
    result = []
    for line in lines.strip().splitlines():
        prompt, *wanted = (part.strip() for part in line.split("|"))
        coats = [(tuple(a.split("/")), tuple(b.split("/")), c) for a, b, c in (text.split() for text in wanted)]
        result.append((prompt, coats))
    return result
