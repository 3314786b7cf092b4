"""Normals, albedo and depth as files: floats to measure with, 16-bit PNG to look at and to bake.

What 16-bit PNG cannot hold, NaN and outside of the mask, is 0 in it, as in other tools: black,
which no unit normal is.
"""

import io
import zlib
from typing import Literal, get_args

import numpy as np
import tifffile
from numpy.typing import NDArray

from ..errors import InputError, OptionError

Convention = Literal["opengl", "directx"]
CONVENTIONS: tuple[Convention, ...] = get_args(Convention)
"""Where green points: up as in OpenGL, down as in DirectX."""
Unit = Literal["mm", "pixels"]

AXES = "x right, y up, z to the camera"
FULL = 65535
LINEAR = 100_000
"""The PNG chunk gAMA of values that are proportional to light."""


def normals_tiff(normals: NDArray[np.floating]) -> bytes:
    """Encode (H,W,3) unit normals as float32 TIFF; red, green, blue are x, y, z.

    NaN, where undetermined, and 0, outside the mask, stay.

    Raises:
        InputError: another shape.
    """
    _check_normals(normals)
    return _tiff(normals, f"unit normals; red, green, blue: {AXES}; NaN where undetermined")


def normals_npz(normals: NDArray[np.floating], mask: NDArray[np.bool_]) -> bytes:
    """Encode (H,W,3) unit normals and the (H,W) mask as NPZ: `normals` float32, `mask`, `axes`.

    Raises:
        InputError: other shapes.
    """
    _check_normals(normals)
    if mask.shape != normals.shape[:2]:
        raise InputError(
            f"the mask is of shape {mask.shape}; that of the normals, {normals.shape[:2]}, is "
            "accepted"
        )
    buffer = io.BytesIO()
    # zip entries of savez are dated 1980: equal normals give equal bytes
    np.savez_compressed(
        buffer, normals=normals.astype(np.float32), mask=mask.astype(bool), axes=np.array(AXES)
    )
    return buffer.getvalue()


def normals_png(normals: NDArray[np.floating], convention: Convention = "opengl") -> bytes:
    """Encode (H,W,3) unit normals as 16-bit RGB PNG: n = 2 value / 65535 - 1.

    NaN and 0 become (0, 0, 0). The text chunk Description names the convention.

    Args:
        convention: `opengl`, green is y up; `directx`, green is y down.

    Raises:
        InputError: another shape.
        OptionError: another convention.
    """
    _check_normals(normals)
    if convention not in CONVENTIONS:
        raise OptionError(f"convention is {convention!r}; accepted are {', '.join(CONVENTIONS)}")
    there = (np.isfinite(normals) & (normals != 0).any(axis=2, keepdims=True)).all(axis=2)
    up = 1 if convention == "opengl" else -1
    n = np.where(there[:, :, None], normals * (1.0, up, 1.0), -1)
    green = "y up (OpenGL)" if up == 1 else "y down (DirectX)"
    text = (
        f"unit normals, n = 2 value / {FULL} - 1; red x right, green {green}, blue z to the "
        "camera; 0 0 0 outside the mask and where undetermined"
    )
    return _png((n + 1) / 2, text)


def albedo_tiff(albedo: NDArray[np.floating]) -> bytes:
    """Encode albedo, (H,W) gray or (H,W,3) red, green, blue, as float32 TIFF, unscaled.

    Raises:
        InputError: another shape.
    """
    _check_albedo(albedo)
    return _tiff(albedo, "albedo, linear; NaN where undetermined, 0 outside the mask")


def albedo_png(albedo: NDArray[np.floating], white: float | None = None) -> bytes:
    """Encode albedo, (H,W) or (H,W,3), as linear 16-bit PNG: albedo = white value / 65535.

    NaN becomes 0. The text chunk Description tells `white`, gAMA that values are linear.

    Args:
        white: albedo of value 65535; what is above is clipped. The largest one when left out, so
            that none is.

    Raises:
        InputError: another shape.
        OptionError: white is not above 0.
    """
    _check_albedo(albedo)
    values = np.where(np.isfinite(albedo), albedo, 0).astype(np.float64)
    if white is None:
        white = float(values.max(initial=0)) or 1.0
    if not 0 < white < np.inf:
        raise OptionError(f"white is {white}; accepted is an albedo above 0")
    text = (
        f"albedo, linear: albedo = {white!r} * value / {FULL}; 0 outside the mask and where "
        "undetermined"
    )
    return _png(values / white, text, LINEAR)


def depth_tiff(depth: NDArray[np.floating], unit: Unit) -> bytes:
    """Encode (H,W) depth as float32 TIFF; ImageDescription names the unit and the axes.

    Raises:
        InputError: another shape.
        OptionError: another unit.
    """
    if depth.ndim != 2:
        raise InputError(f"depth is of shape {depth.shape}; (rows, columns) is accepted")
    if unit not in get_args(Unit):
        raise OptionError(f"unit is {unit!r}; accepted are {', '.join(get_args(Unit))}")
    return _tiff(
        depth,
        f"depth, unit: {unit}; z of {AXES}; mean 0 over each connected part; "
        "NaN outside the mask and where undetermined",
    )


def _check_normals(normals: NDArray) -> None:
    if normals.ndim != 3 or normals.shape[2] != 3:
        raise InputError(f"normals are of shape {normals.shape}; (rows, columns, 3) is accepted")


def _check_albedo(albedo: NDArray) -> None:
    if albedo.ndim not in (2, 3) or albedo.shape[2:] not in ((), (3,)):
        raise InputError(
            f"albedo is of shape {albedo.shape}; (rows, columns) and (rows, columns, 3) are "
            "accepted"
        )


def _tiff(values: NDArray[np.floating], description: str) -> bytes:
    buffer = io.BytesIO()
    with tifffile.TiffWriter(buffer, bigtiff=values.size * 4 > 4e9) as tiff:
        tiff.write(
            values.astype(np.float32),
            photometric="rgb" if values.ndim == 3 else "minisblack",
            description=description,
            metadata=None,
            software=False,
        )
    return buffer.getvalue()


def _png(values: NDArray[np.float64], text: str, gamma: int | None = None) -> bytes:
    """Values from 0 to 1 as 16-bit PNG; others are clipped."""
    from imagecodecs import png_encode

    whole = np.round(values.clip(0, 1) * FULL)
    png = bytes(png_encode(np.ascontiguousarray(whole, np.uint16)))
    chunks = _chunk(b"tEXt", b"Description\0" + text.encode("latin-1"))
    if gamma is not None:
        chunks = _chunk(b"gAMA", gamma.to_bytes(4, "big")) + chunks
    header = 8 + 25  # signature and IHDR, which must come first
    return png[:header] + chunks + png[header:]


def _chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG file, which imagecodecs writes none of."""
    body = kind + data
    return len(data).to_bytes(4, "big") + body + zlib.crc32(body).to_bytes(4, "big")
