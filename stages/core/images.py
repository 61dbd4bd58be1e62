"""Eight-bit and HDR pictures through OpenImageIO: PNG out and in, Radiance HDR in, and names written into them."""

import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from stages.core.artifact import written_atomically
from stages.core.errors import InputError

TEXT_HEIGHT = 14
"""Of names in pictures, pixels."""

AVERAGE, PAETH = 0x40, 0x80
"""libpng's filters of all rows: each pixel less the mean of its left and upper neighbours, or less the neighbour that the
others foretell. To try all filters on every row takes twice the time, and saves 0 to 2 % of the bytes of textures."""

RUNS, MATCHES = "rle", "default"
"""What zlib looks for: the byte before, again and again, or strings of bytes that were there before. Grain repeats nothing: six
sets of textures are 6 % smaller by runs, and written in half of the time; pictures with a background are up to 17 % larger."""


def write_png(path: Path, pixels: NDArray, strategy: str = MATCHES) -> None:
    """Write a PNG atomically, of 8 bits, or of 16 where the pixels have them.

    Args:
        pixels: (H, W), (H, W, 3) or (H, W, 4); uint8, uint16, or float in [0, 1] already encoded as the file wants it
        (rounded to nearest, clamped). A fourth channel is stored as it is, and the others are not scaled by it.
        strategy: MATCHES, or RUNS for textures.
    """
    if pixels.dtype not in (np.uint8, np.uint16):
        pixels = (np.clip(pixels, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    pixels = np.ascontiguousarray(pixels if pixels.ndim == 3 else pixels[..., None])
    height, width, count = pixels.shape
    with written_atomically(path) as temporary:
        output = oiio.ImageOutput.create(str(temporary))
        assert output is not None, "OpenImageIO was built without PNG"
        spec = oiio.ImageSpec(width, height, count, pixels.dtype.name)
        spec["oiio:UnassociatedAlpha"] = 1
        spec["compression"] = strategy
        spec["png:filter"] = PAETH if strategy == RUNS else AVERAGE
        written = output.open(str(temporary), spec)
        written = written and output.write_image(pixels) and output.close()
        if not written:
            raise OSError(output.geterror() or "the PNG writer failed")


def decode_image(data: bytes) -> NDArray[np.float32]:
    """The pixels of a PNG or JPEG file's bytes, as stored: (H, W, C) float32, integers scaled to [0, 1].

    Raises: InputError.
    """
    with tempfile.NamedTemporaryFile(suffix=".png" if data.startswith(b"\x89PNG") else ".jpg") as file:
        file.write(data)
        file.flush()
        return read_image(Path(file.name))


def read_image(path: Path) -> NDArray[np.float32]:
    """Read any picture OpenImageIO knows, integers scaled to [0, 1].

    Returns:
        (H, W, C) float32, values as stored (no transfer curve applied).
    Raises: InputError.
    """
    as_stored = oiio.ImageSpec()
    as_stored["oiio:UnassociatedAlpha"] = 1  # else colours come multiplied by alpha
    source = oiio.ImageInput.open(str(path), as_stored)
    if source is None:
        raise InputError(f"{path}: not a readable picture ({oiio.geterror().strip().splitlines()[0]}); save it again")
    pixels = source.read_image("float")
    problem = source.geterror()
    source.close()
    if pixels is None:
        raise InputError(f"{path}: not a readable picture ({problem.strip()}); save it again")
    return pixels


def labelled(picture: NDArray[np.float32], text: str) -> NDArray[np.float32]:
    """A picture (H, W, 3), encoded, with its name in a corner; without, where OpenImageIO finds no font."""
    image = oiio.ImageBuf(np.ascontiguousarray(picture, np.float32))
    left, base = TEXT_HEIGHT // 2, 3 * TEXT_HEIGHT // 2
    oiio.ImageBufAlgo.render_text(image, left, base, text, TEXT_HEIGHT, "", (0.95, 0.95, 0.95), shadow=2)
    return np.asarray(image.get_pixels(oiio.FLOAT), np.float32).reshape(picture.shape)
