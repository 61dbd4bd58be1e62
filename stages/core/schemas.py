"""The artefacts by which stages meet. What a stage reads of another stage is stated here and nowhere else.

A *loop* is one corner of one face of the source, in the order of the file (Blender's word).
"""

from stages.core.artifact import Field, Schema

PREP = Schema(
    "dreammat.prep",
    4,
    {
        # the working mesh: normalised world frame, welded, outward, triangles
        "vertices": Field("f4", ("V", 3)),
        "triangles": Field("i4", ("F", 3), rows_of="V"),
        "normals": Field("f4", ("F", 3, 3)),  # unit shading normal per triangle corner
        "uv": Field("f4", ("F", 3, 2)),  # per triangle corner, v up; in any whole tile of the plane: textures repeat
        "charts": Field("i4", ("F",)),  # UV chart of each triangle, from 0; of those that share texels the lowest represents
        "triangle_loops": Field("i4", ("F", 3), rows_of="L"),  # the source loop of each triangle corner
        # the source, as it was
        "to_world": Field("f8", (4, 4)),  # source frame (node transforms applied) to world
        "source_vertices": Field("f8", ("SV", 3), finite=False),  # the file's numbers, node transforms not applied
        "source_uv": Field("f8", ("ST", 2), finite=False),  # the file's numbers; v as in the file's format
        "source_normals": Field("f4", ("SN", 3), finite=False),
        "source_tangents": Field("f4", ("SG", 4), finite=False),
        "source_images": Field("u1", ("B",)),  # bytes of the images of extra["passed_on"], one after the other
        "loop_start": Field("i4", ("P1",)),  # face p has loops loop_start[p] .. loop_start[p + 1] - 1
        "loop_vertex": Field("i4", ("L",), rows_of="SV"),
        "loop_source_uv": Field("i4", ("L",), rows_of="ST", least=-1),  # row of source_uv, or -1
        "loop_source_normal": Field("i4", ("L",), rows_of="SN", least=-1),  # row of source_normals, or -1
        "loop_source_tangent": Field("i4", ("L",), rows_of="SG", least=-1),  # row of source_tangents, or -1
        "face_part": Field("i4", ("P",)),  # entry of extra["parts"]
        "face_group": Field("i4", ("P",)),  # entry of extra["groups"], or -1
        "face_set": Field("i4", ("P",)),  # entry of extra["sets"], the texture set that the face shows
        "loop_uv": Field("f4", ("L", 2)),  # the UVs that textures are baked for, v up
        # other objects of the scene, world frame, which only cast shadows
        "caster_vertices": Field("f4", ("CV", 3)),
        "caster_triangles": Field("i4", ("CF", 3), rows_of="CV"),
    },
    # source_format: "obj" | "ply" | "stl" | "off" | "glb" | "fbx" | "usd"; uv_kept: bool; findings: what was found and mended;
    # parts: one per material slot and node: {"name", "material", "node", "transform" (16 numbers, row by row), "instance_of"
    # (the first part of the same mesh and slot, whose texels it shows, or -1)}
    # shared_texels: whether a texel may show more than one place, see `core.tiles`
    # sets: texture sets, at least one, as `core.texture_sets` has them
    # scene (only of an object of a scene): its nodes, see `prep.objects`, "source" (a hash) and "object" (a row of "objects")
    # groups: names of an OBJ's groups; passed_on: what materials of a glTF had besides, see `stages.asset.passed_on`
    extra=("source_format", "source_name", "uv_kept", "shared_texels", "parts", "sets", "groups", "passed_on", "findings"),
)

SCENE = Schema("dreammat.scene", 1, extra=("objects", "unusable"), manifest="scene.json")
"""A folder that `prep --split` wrote: scene.json and, for each object, <object>/prep.npz, whose extra["scene"] has the scene's
nodes. Further files are of later commands: <object>/prompt.txt, conditions/, material.npz, asset/.

objects: {"name", "title"} in the order of their first nodes; unusable: name -> why there is no prep.npz."""

CAMERAS = Schema(
    "dreammat.cameras",
    1,
    {
        "c2w": Field("f8", ("N", 4, 4)),
        "fov_y": Field("f8", ("N",)),  # radians
        "width": Field("i4", ()),
        "height": Field("i4", ()),
    },
)

CONDITIONS = Schema(
    "dreammat.conditions",
    4,
    # environments: names; views: count; knots: roughness of each A and B; clamped: name -> mended texels;
    # to_world: 16 numbers, the mesh source's frame to world, row by row; profile: "gltf", or "sd", which has files of its own
    # parts: {"number", "kind", "name", "share", "labels"} each, see `asset.parts`; shared_labels: [label, label that represents
    # it in a texel that both share, share of the first's area] each
    # bounces: of light between surfaces; 0 also where the object sees next to nothing of itself
    extra=("environments", "views", "knots", "clamped", "to_world", "parts", "shared_labels", "bounces"),
)
"""A folder: cameras.npz, survey.npz, environments/<name>.exr, view_NNN/geometry.exr, view_NNN/<environment>.exr; see
`core.views`. With bounces also bounces.npz and view_NNN/bounces.npz.
"""

ENDS = {
    "start": Field("i4", ("P1",)),  # where each point's blocked rays begin
    "followed": Field("u1", ("P",)),  # how many of them, the last ones, are followed from mirror to mirror
    "scale": Field("f2", ("P", "J")),  # of each lobe, what makes all rays' weights those of an open point
    "side": Field("u2", ("R",)),  # side of a cell on which a ray ends
    "lobe": Field("u1", ("M",)),  # by which glossy lobe a ray that is followed was drawn, 0 a mirror's
    "second": Field("u2", ("M",)),  # where a mirror looks on which such a ray ends; and one there
    "third": Field("u2", ("M",)),
    **{f"lobe_{name}": Field("u1", ("Q", 2)) for name in ("towards", "onward")},  # of the others, on the octahedral square
    **{f"far_{name}": Field("u2", ("M", 2)) for name in ("towards", "onward", "beyond")},
}
"""Where blocked rays end, see `light.ends`."""

BOUNCES = Schema(
    "dreammat.bounces",
    4,
    {
        **ENDS,  # of all rays of the sides; P1 is S + 1
        "weight": Field("f4", ("R",)),  # share in what a side receives
        "angle": Field("f4", ("R",)),  # solid angle, steradians
        "direct": Field("f4", ("S", "L", 3)),  # direct light of both sides of each cell, under each environment
        "cell_point": Field("f4", ("C", 3)),  # where the material of a cell is asked for, its normal, label and scale there
        "cell_normal": Field("f4", ("C", 3)),
        "cell_label": Field("i4", ("C",)),
        "cell_scale": Field("f4", ("C",)),
        "cell_width": Field("f4", ()),
        "lobe_rays": Field("i4", ("K",)),  # of each pixel, lobe by lobe
    },
)
"""Light between surfaces, whatever they are made of; see `light.exchange`."""

VIEW_BOUNCES = Schema("dreammat.view_bounces", 3, ENDS)
"""Where the blocked rays of a view's pixels end."""

SURVEY = Schema(
    "dreammat.survey",
    2,
    {
        "survey_point": Field("f4", ("Q", 3)),  # points of the surface, world
        "survey_normal": Field("f2", ("Q", 3)),
        "survey_convexity": Field("f2", ("Q",)),  # -1 in a crease to 1 on an edge
        "survey_occlusion": Field("f2", ("Q",)),  # share of the sky that the object hides
        "survey_piece": Field("i4", ("Q",)),  # row of the pieces; 0 is the whole object
        "survey_label": Field("i4", ("Q",)),  # of the parts, see `asset.parts.labels`
        "pieces_centre": Field("f4", ("PK", 3)),
        "pieces_turn": Field("f4", ("PK", 3, 3)),
        "pieces_radius": Field("f4", ("PK",)),
        "pieces_grain": Field("f4", ("PK", 3)),
    },
)
"""What a material must know of a mesh; see `material.survey`."""

MATERIAL = Schema(
    "dreammat.material",
    3,
    {
        **SURVEY.fields,
        "table": Field("f4", ("T", "C")),  # the residual's hash grid entries, all levels in one table
        "weights_0": Field("f4", ("H0", "I0")),  # MLP, (out, in) each
        "weights_1": Field("f4", ("H1", "H0")),
        "bias_0": Field("f4", ("H0",)),
        "bias_1": Field("f4", ("H1",)),
        "curve_step": Field("i4", ("S",)),
        "curve_loss": Field("f4", ("S",)),
        "c2w": Field("f8", ("N", 4, 4)),  # the views that distillation saw
        "fov_y": Field("f8", ("N",)),
        "size": Field("i4", (2,)),  # width, height of those views
    },
    # recipe: as `material.recipe` writes it; residual: ResidualConfig as a dict; prompt; guidance: name and what identifies its
    # model; environments: names used; extent: longest edge of the object in units of its source; parts: {"name", "prompt"} of
    # those that have prompts of their own; bounces: of light between surfaces, where there are any
    extra=("recipe", "residual", "prompt", "parts", "guidance", "environments"),
)

ASSET = Schema("dreammat.asset", 3, extra=("sets",), manifest="bake.json")
"""A folder: albedo, roughness, metallic and occlusion .exr; albedo.png, orm.png; model.glb; preview.png;
report.html; bake.json.

Where the material has them: normal .exr and .png, height.exr. Where there are several texture sets, each has these maps under
names of its own: bake.json's "sets", see `core.texture_sets`.
"""

EXPORT = Schema("dreammat.export", 1, manifest="export.json")
"""A folder that `export` wrote: files for one program, and export.json."""
