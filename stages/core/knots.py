"""What is known of the light of a point: at which roughness, and of what materials."""

F0 = 0.04
"""Normal reflectance of every dielectric: glTF 2.0, index of refraction 1.5."""

KNOTS = (0.0, 0.08, 0.16, 0.25, 0.36, 0.5, 0.65, 0.82, 1.0)
"""Roughness at which A and B are stored; holds 0, 0.5 and 1."""

LIGHT_MAPS = tuple((m, r) for m in (0, 1) for r in (0.0, 0.5, 1.0))
"""Metallic and roughness of the six light maps, in the paper's order."""
