"""Options of `prep`. Nothing heavy is imported here, so that the command line can take its defaults from it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PrepOptions:
    """How a mesh is made ready.

    up: the source's up axis, "y" (front +z) or "z" (front -y, as Blender).
    texture_size: edge of the square texture that UVs are laid out for, texels.
    padding: texels around each chart that `bake` fills, twice this between charts; None: the widest of 16, 8, 4 and 2 (of a
        texture of 2048) that is worth what it takes from the charts.
    crease_angle: a sharper edge between two faces stays sharp where the file has no usable normals, degrees.
    weld_tolerance: vertices closer than this are one, in diagonals of the bounding box.
    uv: "auto" keeps the source's UVs where they give texels to the surface, "keep" insists on them, "mend" also gives the faces
        without texels charts in free space, "new" always makes new ones.
    own_instances: a mesh that stands in several places gets texels for each of them, in new UVs.
    textures: "auto" keeps the texture sets that the UVs are laid out for, "one" is one atlas, "slots" a set for each material
        slot, "udim" one for each UDIM tile.
    unwrap_seconds: after this, xatlas is stopped and the charts are made by direction of the normal instead.
    unwrap_triangles: a larger mesh does not try xatlas, which there takes minutes and packs no denser.
    """

    up: str = "y"
    texture_size: int = 2048
    padding: int | None = None
    crease_angle: float = 40.0
    weld_tolerance: float = 1e-6
    uv: str = "auto"
    own_instances: bool = False
    textures: str = "auto"
    unwrap_seconds: float = 60.0
    unwrap_triangles: int = 50_000
