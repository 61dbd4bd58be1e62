"""Things by name: how large they are, and what they are made of where everybody knows."""

from typing import NamedTuple


class Thing(NamedTuple):
    """metres: its longest edge. made: words for what it is made of when nobody says, or ""."""

    metres: float
    made: str = ""


def _things(metres: float, text: str) -> dict[str, Thing]:
    """Things of a size: "name" or "name: what it is made of", separated by semicolons."""
    entries = (entry.split(":", 1) for entry in text.split(";") if entry.strip())
    return {name.strip(): Thing(metres, rest[0].strip() if rest else "") for name, *rest in entries}


OBJECTS: dict[str, Thing] = {
    **_things(0.03, "ring; coin; bolt; nut; die: white plastic; thimble: steel; bead; screw: steel; nail: iron; earring; pebble: stone"),
    **_things(0.1, "cup; apple: glossy red wax; mushroom: cream leather; egg: eggshell; tennis ball: yellow green felt; golf ball: white plastic; "
                   "lemon: lemon peel; tomato: tomato; avocado: dark green leather; mug: white ceramic; camera: black plastic; phone: black glass; key: brass; lock: brass; "
                   "chess piece; pocket watch: gold; light bulb: glass; candle: wax; figurine; toy; mouse; orange: orange peel; "
                   "cookie: cookie; doughnut: brown candy; strawberry: strawberry; cactus: cactus; pine cone: brown wood; seashell: seashell"),
    **_things(0.25, "vase; teapot; bowl; bottle; plate; jar; pot; clock; shoe; boot: brown leather; hat; helmet; mask; head; skull: bone; duck; rubber duck: yellow rubber; "
                    "hammer; knife; book; bust; brick; lantern: iron; crown: gold; trophy: gold; football: brown leather; basketball: orange rubber; "
                    "soccer ball: white leather; baseball: white leather; bowling ball: glossy black plastic; gear; gun: gunmetal; pistol: gunmetal; "
                    "teddy bear: brown plush; lamp; pumpkin: orange pumpkin; cabbage: leaves; bread: bread; loaf: bread; kettle: steel; pan: iron; horseshoe: iron; rabbit; cat; pineapple: ochre scales; "
                    "piggy bank: pink ceramic; snow globe: glass; flower pot: terracotta; urn; amphora: terracotta; bell: brass"),
    **_things(0.6, "bag; box; machine part; tool; ornament; ball; sphere; cube; bracket; torus; shield; guitar: varnished wood; violin: varnished wood; robot: painted metal; monster; bird; fish; "
                   "backpack: fabric; suitcase: leather; toolbox: red painted metal; bucket: galvanized steel; watering can: galvanized steel; mailbox: blue painted metal; "
                   "basket: wicker; globe: paper; anvil: iron; sword: steel; axe: steel; pillow: cotton; cushion: fabric; radio: walnut; typewriter: black painted metal; "
                   "fire extinguisher: red painted metal; traffic cone: orange rubber; skateboard: maple; drum: wood; sink: porcelain; toilet: porcelain; monitor: black plastic; television: black plastic"),
    **_things(1.0, "chair; table; crate: wood; barrel: oak; bench: wood; chest: wood; stool: wood; shelf: wood; statue: marble; sculpture; armor: steel; armour: steel; wheel; tire: black rubber; tyre: black rubber; fire hydrant: red painted metal; "
                   "bicycle: painted metal; armchair: leather; blackboard: slate; chalkboard: slate; snowman: snow; gravestone: granite; tombstone: granite; birdbath: stone; "
                   "trash can: green plastic; dustbin: green plastic; cart: wood; engine: iron; pipe: iron; dog; cow; horse; animal; bear; surfboard: white plastic; cello: varnished wood; "
                   "washing machine: white painted metal; stove: black iron; cupboard: wood; wardrobe: wood; desk: wood; bookshelf: wood; bookcase: wood; cabinet: wood; door: wood; rug: carpet; mattress: cotton"),
    **_things(2.0, "sofa: fabric; couch: fabric; bed: wood; piano: glossy black lacquer; dragon; fountain: stone; column: marble; pillar: stone; motorcycle: painted metal; motorbike: painted metal; "
                   "phone booth: red painted metal; telephone box: red painted metal; post box: red painted metal; bathtub: porcelain; refrigerator: white painted metal; fridge: white painted metal; canoe: wood; cannon: iron; scarecrow: straw; fireplace: brick; "
                   "log: bark; tree stump: bark; stump: bark; totem pole: wood; boulder: rock; rock; barrier: concrete"),
    **_things(4.5, "car: car paint; truck: painted metal; van: white car paint; tractor: green painted metal; boat: wood; tree: bark; gazebo: wood; shed: wood; well: stone; hut: mud; tent: canvas; wagon: wood; hot tub: cedar; school bus: yellow painted metal; taxi: yellow car paint; fire truck: red painted metal; arch: stone; wall: brick; fence: wood"),
    **_things(12.0, "house: brick; ship: painted metal; airplane: painted metal; plane: painted metal; tower: stone; bridge: concrete; castle: stone; church: stone; temple: stone; lighthouse: white plaster; windmill: white plaster; barn: red painted wood; cottage: stone; cabin: wood; bus: painted metal; train: painted metal; tank: green painted metal; submarine: painted metal; terracotta roof: roof tiles; tiled roof: roof tiles; thatched roof: straw; pyramid: sandstone; silo: galvanized steel"),
}  # fmt: skip
