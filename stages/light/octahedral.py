"""The sphere on a square: Clarberg's octahedral map, in which every texel covers the same solid angle."""

import math

import numpy as np

from stages.core.parallel import compiled
from stages.light.environment import bilinear_at

fast = compiled(fastmath={"contract", "reassoc", "nsz", "arcp"})


@compiled(inline="always")
def direction_to_square(x, y, z):  # type: ignore[no-untyped-def]
    """Unit direction to [0, 1]^2, area-preserving. Source: Clarberg 2008, "Fast Equal-Area Mapping", Eq. 8-10."""
    radius = math.sqrt(max(1 - abs(z), 0.0))
    a, b = abs(x), abs(y)
    phi = math.atan2(b, a) * (2 / math.pi)
    v = phi * radius
    u = radius - v
    if z < 0:
        u, v = 1 - v, 1 - u
    u = u if x >= 0 else -u
    v = v if y >= 0 else -v
    return (u + 1) * 0.5, (v + 1) * 0.5


@compiled(inline="always")
def square_to_direction(u, v):  # type: ignore[no-untyped-def]
    """[0, 1]^2 to a unit direction, the inverse of `direction_to_square`."""
    u, v = 2 * u - 1, 2 * v - 1
    a, b = abs(u), abs(v)
    distance = 1 - (a + b)
    radius = 1 - abs(distance)
    phi = ((b - a) / radius + 1) * (math.pi / 4) if radius > 0 else 0.0
    z = 1 - radius * radius
    z = z if distance >= 0 else -z
    scale = radius * math.sqrt(max(2 - radius * radius, 0.0))
    x, y = math.cos(phi) * scale, math.sin(phi) * scale
    return (x if u >= 0 else -x), (y if v >= 0 else -y), z


@compiled(inline="always")
def square_to_texel(u, v, height, width):  # type: ignore[no-untyped-def]
    """[0, 1]^2 to the column and row of a latitude-longitude light, and z: where `lookup` reads the light along
    `square_to_direction`, without sines to be undone again, to 2e-8 radians.

    Source: Abramowitz & Stegun 1964, 4.4.46 (arc cosine).
    """
    u, v = 2 * u - 1, 2 * v - 1
    a, b = abs(u), abs(v)
    distance = 1 - (a + b)
    radius = 1 - abs(distance)
    turn = ((b - a) / radius + 1) / 8 if radius > 0 else 0.0  # of the azimuth within its quarter, in whole turns
    turn = turn if u >= 0 else 0.5 - turn
    z = 1 - radius * radius
    p = (((-0.0012624911 * z + 0.0066700901) * z - 0.0170881256) * z + 0.0308918810) * z - 0.0501743046
    polar = radius * (((p * z + 0.0889789874) * z - 0.2145988016) * z + 1.5707963050) / math.pi
    column = (0.5 - (turn if v >= 0 else -turn)) * width
    return column, (polar if distance >= 0 else 1 - polar) * height, (z if distance >= 0 else -z)


@compiled
def texel_directions(size):  # type: ignore[no-untyped-def]
    """Direction of each texel centre of a size x size square: x, y, z, (size, size) each."""
    result = np.empty((3, size, size))
    for row in range(size):
        for column in range(size):
            x, y, z = square_to_direction((column + 0.5) / size, (row + 0.5) / size)
            result[0, row, column], result[1, row, column], result[2, row, column] = x, y, z
    return result


@fast
def octahedral(radiance, size, oversample):  # type: ignore[no-untyped-def]
    """The light on the octahedral square, each texel the mean of oversample^2 look-ups; black parts are passed over.

    Args: radiance (H, W, 3). Returns: (size, size, 3) float32.
    """
    height, width, _ = radiance.shape
    result = np.zeros((size, size, 3), np.float32)
    reach = 2 + 4 * height // size  # texels of the light that one of the square can touch, and more
    coarse = np.zeros((height // reach + 3, width // reach + 3), np.bool_)  # cells with light in them or near them
    for row in range(height):
        for column in range(width):
            if radiance[row, column].max() > 0:
                a, b = row // reach + 1, column // reach + 1
                coarse[a - 1 : a + 2, b - 1 : b + 2] = True
    coarse[:, :2] = coarse[:, -3:] = True  # the seam
    share = 1 / (oversample * oversample)
    for row in range(size):
        for column in range(size):
            u, v, z = square_to_texel((column + 0.5) / size, (row + 0.5) / size, height, width)
            polar = abs(z) > 1 - 8.0 / size  # here a texel spans many columns
            if not polar and not coarse[int(v) // reach + 1, int(u) // reach + 1]:
                continue
            red, green, blue = 0.0, 0.0, 0.0
            for a in range(oversample):
                for b in range(oversample):
                    x, y = (column + (b + 0.5) / oversample) / size, (row + (a + 0.5) / oversample) / size
                    u, v, _ = square_to_texel(x, y, height, width)
                    seen = bilinear_at(radiance, u, v)
                    red, green, blue = red + seen[0], green + seen[1], blue + seen[2]
            result[row, column, 0], result[row, column, 1], result[row, column, 2] = red * share, green * share, blue * share
    return result
