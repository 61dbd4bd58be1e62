"""A scanned tile as a look, laid without seams and without being seen to repeat.

Source: Heitz and Neyret 2018, "High-performance by-example noise using a histogram-preserving blending operator": three
patches of the tile are mixed at each point, in a space where its values are normally distributed, so that mixing keeps their
deviation; what comes back has the tile's own histogram. Deliot and Heitz 2019: coarser levels of detail are averaged in that
space, and what a level lost is averaged on the way back. What repeats of itself, such as bricks, is laid as it is. """

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stages.core.color import srgb_decode
from stages.core.errors import InputError
from stages.core.images import read_image
from stages.material.look import Look
from stages.material.noise_kernels import corner, fast, unit
from stages.material.place import Place

Array = NDArray[np.float32]

CHANNELS = 6
"""Three of colour along its principal axes, roughness, metallic, height in tiles."""

LARGEST = 2048
"""Texels along the edge of a tile that is kept; larger ones are averaged."""

PATCH = 0.45
"""Distance of the patches that are mixed, tiles."""

REPEATS = 0.4
"""A tile whose luminance agrees with itself this well elsewhere, as a correlation, repeats of itself."""

NEAR = 0.08
"""Distance, tiles, within which all things agree with themselves."""

WIDE = 3
"""Waves a tile of what is too wide to count as repeating."""

DEEP = 0.02
"""Metres from black to white of a height map that no normal map measures, per metre of the tile."""

STEPS, SPAN = 512, 4.5
"""Of the way back from normally distributed values."""


@dataclass(frozen=True)
class Scan:
    """tile: metres of its edge. texels: levels of detail, from (N, N, CHANNELS) down to (1, 1, CHANNELS), normally distributed
    unless it repeats. back: (levels, CHANNELS, STEPS) values of what each level holds, or None where it repeats and is laid as
    it is. axes: (3, 3) of colour; mean: (3,) linear. known: which maps there are. """

    tile: float
    texels: list[Array]
    back: Array | None
    axes: Array
    mean: Array
    known: frozenset[str]

    @staticmethod
    def read(maps: dict[str, Path], tile: float) -> "Scan":
        """Of files by what they are. Raises: InputError."""
        values, known = _channels(maps)
        color = values[..., :3].reshape(-1, 3)
        mean = color.mean(0)
        axes = np.linalg.eigh(np.cov((color - mean).T.astype(np.float64)) + 1e-12 * np.eye(3))[1].T.astype(np.float32)
        values[..., :3] = ((color - mean) @ axes.T).reshape(values[..., :3].shape)
        if repeats(values[..., 2]):
            return Scan(tile, _levels(values), None, axes, mean, known)
        normal, quantiles = _normally(values)
        levels = _levels(normal)
        hidden = [np.sqrt(np.clip(1 - level.reshape(-1, CHANNELS).var(0), 0, 1)) for level in levels]
        back = np.stack([np.stack([_way_back(q, s) for q, s in zip(quantiles, row, strict=True)]) for row in hidden])
        return Scan(tile, levels, back.astype(np.float32), axes, mean, known)

    def __call__(self, at: Place) -> Look:
        """The scan at some points."""
        covered = np.maximum(at.footprint * (len(self.texels[0]) / self.tile), 1)  # texels
        level = np.minimum(np.log2(covered), len(self.texels) - 1.001)
        values = self._laid(at, level.astype(np.float32))
        color = np.clip(self.mean[:, None] + self.axes.T @ values[:3], 0, 1)
        roughness = np.clip(values[3], 0, 1) if "roughness" in self.known else 0.6
        metallic = np.clip(values[4], 0, 1) if "metallic" in self.known else 0.0
        height = values[5] * np.float32(self.tile) if "height" in self.known else 0.0
        return Look(color.astype(np.float32), roughness, metallic, height)

    def _laid(self, at: Place, level: Array) -> Array:
        """(CHANNELS, P) values at points of known levels of detail."""
        sizes = np.array([len(texels) for texels in self.texels], np.int64)
        starts = np.concatenate([[0], np.cumsum(sizes**2)[:-1]])
        flat = np.concatenate([texels.reshape(-1, CHANNELS) for texels in self.texels])
        spread = self.back is not None
        step = PATCH if spread else 1.0
        counts = np.array([_whole(period / self.tile / step) for period in at.period[:2]], np.int64)
        scale = [n / period if n else 1 / (self.tile * step) for n, period in zip(counts, at.period[:2], strict=True)]
        x, y = (np.ascontiguousarray(a * np.float32(s)) for a, s in zip(at.uv, scale, strict=True))
        out = np.empty((CHANNELS, len(at)), np.float32)
        seed = np.uint32(at.seed & 0xFFFFFFFF)
        face = np.ascontiguousarray(at.face, np.int32)
        _lay(x, y, face, level, flat, sizes, starts, counts, np.float32(step), seed, spread, out)
        return self._back(out, level) if self.back is not None else out

    def _back(self, normal: Array, level: Array) -> Array:
        """Values of normally distributed ones, (CHANNELS, P) each."""
        assert self.back is not None
        x = np.clip((normal / SPAN + 1) * ((STEPS - 1) / 2), 0, STEPS - 1.001)
        column, row = x.astype(np.int32), level.astype(np.int32)
        fx, fy = x - column, level - row
        out = np.empty_like(normal)
        for c in range(CHANNELS):
            table, k = self.back[:, c], column[c]
            near = table[row, k] * (1 - fx[c]) + table[row, k + 1] * fx[c]
            far = table[row + 1, k] * (1 - fx[c]) + table[row + 1, k + 1] * fx[c]
            out[c] = near + (far - near) * fy
        return out


def _whole(count: float) -> int:
    """Patches on a way around, at least one; 0 where there is none."""
    return max(1, round(count)) if count else 0


@fast
def _lay(x, y, face, level, flat, sizes, starts, counts, step, seed, spread, out):  # type: ignore[no-untyped-def]
    """Mix the patches around each point. x, y in patches; step: tiles a patch; counts: patches on the way around, or 0."""
    for p in range(len(x)):
        i, j = np.floor(x[p]), np.floor(y[p])
        fx, fy = x[p] - i, y[p] - j
        upper = fx + fy > 1
        total = np.float32(0)
        low = int(level[p])
        part = level[p] - np.float32(low)
        for c in range(out.shape[0]):
            out[c, p] = 0
        for k in range(3 if spread else 1):
            dx = np.float32(1 if (k == 1) or (k == 0 and upper) else 0)
            dy = np.float32(1 if (k == 2) or (k == 0 and upper) else 0)
            if k == 0:
                w = abs(np.float32(1) - fx - fy)
            elif upper:
                w = np.float32(1) - (fy if k == 1 else fx)
            else:
                w = fx if k == 1 else fy
            u, v = x[p] * step, -y[p] * step
            if spread:
                a, b = i + dx, j + dy
                if counts[0]:
                    a -= counts[0] * np.floor(a / counts[0])
                if counts[1]:
                    b -= counts[1] * np.floor(b / counts[1])
                h = corner(a, b, np.float32(face[p]), seed)
                u = (fx - dx) * step + unit(h)
                v = (dy - fy) * step + unit(np.uint32(h * np.uint32(0x9E3779B1)))
            else:
                w = np.float32(1)
            total += w * w
            for near in range(2):
                size = sizes[low + near]
                share = w * (part if near else np.float32(1) - part)
                px, py = (u - np.floor(u)) * size - np.float32(0.5), (v - np.floor(v)) * size - np.float32(0.5)
                cx, cy = np.floor(px), np.floor(py)
                gx, gy = px - cx, py - cy
                left, top = int(cx) % size, int(cy) % size
                right, bottom = (left + 1) % size, (top + 1) % size
                base = starts[low + near]
                for c in range(out.shape[0]):
                    one = flat[base + top * size + left, c] * (1 - gx) + flat[base + top * size + right, c] * gx
                    two = flat[base + bottom * size + left, c] * (1 - gx) + flat[base + bottom * size + right, c] * gx
                    out[c, p] += share * (one * (1 - gy) + two * gy)
        for c in range(out.shape[0]):
            out[c, p] /= np.sqrt(total)


def _channels(maps: dict[str, Path]) -> tuple[Array, frozenset[str]]:
    """(N, N, CHANNELS) of a set's files, and which of them are known."""
    color = srgb_decode(_square(maps["color"])[..., :3])
    size = len(color)
    values = np.zeros((size, size, CHANNELS), np.float32)
    values[..., :3] = color
    known = set()
    if "packed" in maps:
        packed = _fitted(maps["packed"], size)
        values[..., 3], values[..., 4] = packed[..., 1], packed[..., 2]
        known |= {"roughness", "metallic"}
    for channel, role in ((3, "roughness"), (4, "metallic")):
        if role in maps:
            values[..., channel] = _fitted(maps[role], size)[..., 0]
            known.add(role)
    for role, sign in (("normal", 1.0), ("normal_dx", -1.0)):
        if role in maps and "height" not in known:
            values[..., 5] = integrated(_fitted(maps[role], size)[..., :3], sign)
            known.add("height")
    if "height" in maps and "height" not in known:
        values[..., 5] = DEEP * _fitted(maps["height"], size)[..., 0]
        known.add("height")
    values[..., 5] -= values[..., 5].mean()
    return values, frozenset(known)


def _square(path: Path) -> Array:
    """A map as a square of at most `LARGEST` texels, grey ones with three channels."""
    pixels = read_image(path)
    side = min(pixels.shape[0], pixels.shape[1])
    if side < 16:
        raise InputError(f"{path}: {pixels.shape[1]} x {pixels.shape[0]} pixels; expected a map of at least 16 x 16")
    step = max(1, -(-side // LARGEST))
    side -= side % step
    blocks = pixels[:side, :side].reshape(side // step, step, side // step, step, -1).mean((1, 3))
    return np.repeat(blocks, 3, 2) if blocks.shape[2] < 3 else blocks


def _fitted(path: Path, size: int) -> Array:
    """A map as a square of `size` texels, averaged or in between its own, as a tile that goes on at its borders."""
    pixels = _square(path)
    if len(pixels) > size:
        step = -(-len(pixels) // size)
        whole = len(pixels) // step * step
        pixels = pixels[:whole, :whole].reshape(whole // step, step, whole // step, step, -1).mean((1, 3))
    if len(pixels) == size:
        return pixels
    at = (np.arange(size, dtype=np.float32) + np.float32(0.5)) * np.float32(len(pixels) / size) - np.float32(0.5)
    low = np.floor(at).astype(int)
    part, near, far = (at - low)[:, None, None], low % len(pixels), (low + 1) % len(pixels)
    rows = pixels[near] + (pixels[far] - pixels[near]) * part
    return rows[:, near] + (rows[:, far] - rows[:, near]) * part[:, 0]


def integrated(normal: Array, sign: float = 1.0) -> Array:
    """The height, in tiles, that a tile's normal map is of. Source: Frankot and Chellappa 1988.

    Args: (N, N, 3) as stored, [0, 1], rows down. sign: 1 where green is up the picture, −1 where it is down. Returns: (N, N).
    """
    n = 2 * normal.astype(np.float64) - 1
    z = np.maximum(n[..., 2], 0.1)
    right, down = -n[..., 0] / z, sign * n[..., 1] / z  # slopes along columns and rows
    wave = 2j * np.pi * np.fft.fftfreq(len(n), 1 / len(n))
    kx, ky = wave[None, :], wave[:, None]
    power = np.abs(kx) ** 2 + np.abs(ky) ** 2
    power[0, 0] = 1
    height = (np.conj(kx) * np.fft.fft2(right) + np.conj(ky) * np.fft.fft2(down)) / power
    height[0, 0] = 0
    return np.fft.ifft2(height).real.astype(np.float32)


def repeats(values: Array) -> bool:
    """Whether a tile agrees with itself somewhere else. Args: (N, N)."""
    step = max(1, len(values) // 256)
    size = len(values) // step
    small = values[: size * step, : size * step].reshape(size, step, size, step).mean((1, 3))
    wave = np.abs(np.fft.fftfreq(size, 1 / size))
    wide = np.maximum(wave[:, None], wave[None]) < WIDE
    spectrum = np.where(wide, 0, np.abs(np.fft.fft2(small)) ** 2)
    agrees = np.fft.ifft2(spectrum).real
    away = np.minimum(np.arange(size), size - np.arange(size)) / size
    far = np.hypot(away[:, None], away[None]) > NEAR
    return bool(agrees[0, 0] > 0 and agrees[far].max() / agrees[0, 0] > REPEATS)


def _normally(values: Array) -> tuple[Array, Array]:
    """Each channel by rank as a normally distributed one, and its sorted values (CHANNELS, M)."""
    from scipy.special import ndtri  # takes a second with all that it loads, which who has no scans need not spend

    flat = values.reshape(-1, CHANNELS)
    count = len(flat)
    normal = np.empty_like(flat)
    scores = ndtri((np.arange(count) + 0.5) / count).astype(np.float32)
    for c in range(CHANNELS):
        normal[np.argsort(flat[:, c], kind="stable"), c] = scores
    return normal.reshape(values.shape), np.sort(flat, 0).T[:, :: max(1, count // 4096)]


def _way_back(quantiles: Array, hidden: float) -> NDArray:
    """(STEPS,) mean value of what is seen as each normal score, where a level lost a part of deviation `hidden`."""
    from scipy.special import ndtr

    at = np.linspace(-SPAN, SPAN, STEPS)
    nodes, weights = np.polynomial.hermite_e.hermegauss(15)
    share = ndtr(at[:, None] + hidden * nodes[None])
    values = np.interp(share, (np.arange(len(quantiles)) + 0.5) / len(quantiles), quantiles)
    result: NDArray = values @ (weights / weights.sum())
    return result


def _levels(values: Array) -> list[Array]:
    """A tile and its averages over ever larger squares."""
    levels = [np.ascontiguousarray(values, np.float32)]
    while len(levels[-1]) > 1:
        last = levels[-1]
        size = len(last) // 2
        levels.append(last[: 2 * size, : 2 * size].reshape(size, 2, size, 2, -1).mean((1, 3)))
    return levels
