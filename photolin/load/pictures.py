"""One image file to an array of the depth it was stored in.

Pillow, and imageio through it, hands out 16-bit RGB PNG and PPM as 8 bits without a word, so PNG is
decoded by imagecodecs, TIFF by tifffile and PGM/PPM here; imageio reads JPEG, TGA and BMP, which
have 8 bits.
"""

import logging
import re
import stat
import struct
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Literal

import imagecodecs
import imageio.v3 as iio
import numpy as np
import tifffile
from numpy.typing import NDArray

from ..errors import InputError, PhotolinError

PIXEL_LIMIT = 200_000_000
"""Most pixels of one image; looked up in its header, before memory is taken for it."""
VALUE_LIMIT = 2_000_000_000
"""Most pixels of all images together, 8 GB of memory."""

# What tifffile logs about broken files reaches the user as an InputError; not twice, on stderr.
logging.getLogger("tifffile").addHandler(logging.NullHandler())


@dataclass(frozen=True, eq=False)
class Picture:
    """An image as stored; alpha left out."""

    pixels: NDArray
    """(H,W,1) gray or (H,W,3) red, green, blue; unsigned integers or floats."""
    full: float
    """The stored value that means full scale; 1 for floats."""
    transfer: Literal["linear", "srgb"]
    """How the file says its values relate to light."""
    why: str
    """What in the file says so."""


def read_picture(path: Path) -> Picture:
    """Decode an image file, all bits of it.

    Raises:
        InputError: `path` cannot be read, is truncated, no image, of a kind not accepted, or above
            PIXEL_LIMIT.
    """
    kind = path.suffix.lower()
    if kind not in READERS:
        raise InputError(f"{path}: is no image file; accepted are {', '.join(READERS)}")
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise InputError(f"{path}: is a folder or a device; an image file is accepted")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        return READERS[kind](data, str(path))
    except (PhotolinError, MemoryError):
        raise
    except Exception as error:  # decoders raise whatever the broken bytes lead them to
        raise InputError(
            f"{path}: is truncated or not a {kind[1:].upper()} image ({error}); "
            "a whole image file is accepted"
        ) from error


def as_picture(
    pixels: NDArray, where: str, full: float | None = None, srgb: bool = False, why: str = ""
) -> Picture:
    """Bring (H,W) or (H,W,C) numbers into the form of a Picture, C from 1 to 4.

    Raises:
        InputError: another shape, or not numbers.
    """
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 2, 3, 4) or pixels.dtype.kind not in "uif":
        raise InputError(
            f"{where}: is {pixels.dtype} of shape {pixels.shape}; gray, RGB and RGBA images of "
            "integers or floats are accepted"
        )
    if full is None:
        full = 1.0 if pixels.dtype.kind == "f" else float(np.iinfo(pixels.dtype).max)
    pixels = pixels[..., : 1 if pixels.shape[2] < 3 else 3]
    return Picture(pixels, full, "srgb" if srgb else "linear", why)


def check_size(rows: int, columns: int, where: str, count: int = 1) -> None:
    """Raise InputError for images without pixels, or above PIXEL_LIMIT or together VALUE_LIMIT."""
    if not 0 < rows * columns <= PIXEL_LIMIT:
        raise InputError(
            f"{where}: claims {rows} x {columns} pixels; 1 to {PIXEL_LIMIT // 10**6} million for "
            "an image are accepted"
        )
    if count * rows * columns > VALUE_LIMIT:
        raise InputError(
            f"{where}: {count} images of {rows} x {columns} pixels are too many; up to "
            f"{VALUE_LIMIT // 10**6} million pixels together are accepted, or a region (option roi)"
        )


def depth_of(pixels: NDArray) -> str:
    """The depth as users name it: "16-bit" or "float"."""
    return "float" if pixels.dtype.kind == "f" else f"{pixels.dtype.itemsize * 8}-bit"


def read_page(page: tifffile.TiffPage, where: str) -> Picture:
    """Decode one page of a TIFF file; raises what tifffile raises for broken data."""
    check_size(page.imagelength, page.imagewidth, where)
    pixels = page.asarray()
    full = None
    if pixels.dtype == np.bool_:
        pixels = pixels.view(np.uint8)
    if page.photometric == tifffile.PHOTOMETRIC.PALETTE and page.colormap is not None:
        pixels = np.moveaxis(page.colormap[:, pixels], 0, -1)
    elif pixels.dtype.kind == "u":
        full = float(2**page.bitspersample - 1)
    if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
        pixels = np.asarray(full or 1, pixels.dtype) - pixels
    if page.axes == "SYX":
        pixels = np.moveaxis(pixels, 0, -1)
    return as_picture(pixels, where, full, why=f"{depth_of(pixels)} TIFF")


def _read_tiff(data: bytes, where: str) -> Picture:
    with tifffile.TiffFile(BytesIO(data)) as tif:
        return read_page(tif.pages.first, where)


def _read_png(data: bytes, where: str) -> Picture:
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("no PNG signature")
    columns, rows = struct.unpack(">II", data[16:24])
    check_size(rows, columns, where)
    pixels = imagecodecs.png_decode(data)
    srgb, tag = _png_transfer(data)
    return as_picture(pixels, where, srgb=srgb, why=f"{depth_of(pixels)} PNG {tag}")


def _png_transfer(data: bytes) -> tuple[bool, str]:
    """Whether the chunks before the pixels say sRGB, and in which words; no chunk means linear."""
    chunks, at = {}, 8
    while at + 8 <= len(data) and data[at + 4 : at + 8] != b"IDAT":
        (size,) = struct.unpack(">I", data[at : at + 4])
        chunks[data[at + 4 : at + 8]] = data[at + 8 : at + 8 + size]
        at += 12 + size
    # The order of precedence is that of the PNG specification.
    if b"iCCP" in chunks:
        name = chunks[b"iCCP"].split(b"\0")[0].decode("latin-1")
        return "linear" not in name.lower(), f"with the colour profile {name!r}"
    if b"sRGB" in chunks:
        return True, "with an sRGB tag"
    if b"gAMA" in chunks:
        gamma = struct.unpack(">I", chunks[b"gAMA"])[0] / 100_000
        return gamma < 0.75, f"with a gamma tag of {gamma:g}"
    return False, "without an sRGB or gamma tag"


def _read_pnm(data: bytes, where: str) -> Picture:
    gap = rb"(?:\s+|#[^\n]*\n)+"
    header = re.match(rb"P([2356])" + (gap + rb"(\d+)") * 3 + rb"\s", data)
    if header is None:
        raise ValueError("no P2, P3, P5 or P6 header")
    kind, columns, rows, full = (int(number) for number in header.groups())
    check_size(rows, columns, where)
    if not 0 < full < 65536:
        raise ValueError(f"full scale of {full}; 1 to 65535 is the format's")
    shape = (rows, columns, 3 if kind in (3, 6) else 1)
    dtype = np.uint8 if full < 256 else np.uint16
    if kind in (2, 3):
        pixels = np.array(data[header.end() :].split(), dtype)
    else:
        stored = np.dtype(dtype).newbyteorder(">")
        pixels = np.frombuffer(data, stored, rows * columns * shape[2], header.end()).astype(dtype)
    name = "PGM" if shape[2] == 1 else "PPM"
    return as_picture(pixels.reshape(shape), where, full, why=f"{depth_of(pixels)} {name}")


def _read_with_imageio(srgb: bool, why: str) -> Callable[[bytes, str], Picture]:
    def read(data: bytes, where: str) -> Picture:
        # Rotation tags are left aside: the pixels of a fixed camera are registered as stored.
        try:
            rows, columns = iio.improps(BytesIO(data), plugin="pillow").shape[:2]
        except Exception as error:  # imageio speaks of its plugins and of "uris"
            raise ValueError("no readable header") from error
        check_size(rows, columns, where)
        plain = iio.immeta(BytesIO(data), plugin="pillow")["mode"] in ("L", "LA", "RGB", "RGBA")
        pixels = iio.imread(BytesIO(data), plugin="pillow", mode=None if plain else "RGB")
        return as_picture(pixels, where, srgb=srgb, why=why)

    return read


_read_jpeg = _read_with_imageio(True, "JPEG")

READERS: dict[str, Callable[[bytes, str], Picture]] = {
    ".png": _read_png,
    ".tif": _read_tiff,
    ".tiff": _read_tiff,
    ".jpg": _read_jpeg,
    ".jpeg": _read_jpeg,
    ".tga": _read_with_imageio(False, "8-bit TGA"),
    ".bmp": _read_with_imageio(False, "8-bit BMP"),
    ".pgm": _read_pnm,
    ".ppm": _read_pnm,
}
"""Reader of each accepted suffix."""
