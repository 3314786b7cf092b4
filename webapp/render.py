"""Arrays to pictures and bytes. Pure: what is stored is never changed, only shown."""

import struct
import zlib
from collections.abc import Collection, Mapping

import imagecodecs
import numpy as np
from numpy.typing import NDArray

from photolin.factors import OUTSIDE, PALETTE, Factor

from .patterns import MARK, MARKS, STRENGTH, add_marks

RGB = tuple[int, int, int]
ZERO = 128
"""Grey value of zero in a signed picture."""
OPACITY = 0.55
DIFFUSE_OPACITY = 0.15
"""Opacity of diffuse at the default: it is everywhere, and the eye should go to the rest."""
SPECULAR_OPACITY = 0.75
"""Of specular at the default: on dark pixels it would else look as undefined does, both being a
brown; brighter, it is told apart by all eyes."""


def choose_gain(images: NDArray[np.float32], mask: NDArray[np.bool_]) -> float:
    """Factor that brings the 99.5th percentile inside the mask to white, at least 1.

    Args:
        images: (K,H,W) or (H,W), fraction of full scale.
        mask: (H,W), true where the object is.

    Returns:
        One gain for all images, so that they can be compared; to be stated on screen.
    """
    high = _percentile(images, mask)
    return max(1.0, 1.0 / high) if high > 0 else 1.0


def choose_scale(signed: NDArray[np.float32], mask: NDArray[np.bool_]) -> float:
    """Symmetric range of a signed picture: the 99.5th percentile of |values|, above 0."""
    return max(_percentile(np.abs(signed), mask), 1e-6)


def render_input(image: NDArray[np.float32], gain: float) -> NDArray[np.uint8]:
    """Grey picture (H,W) of an input image: linear, `gain` times brighter, white above 1 / gain."""
    picture = image * np.float32(255 * gain)
    picture += np.float32(0.5)
    return np.minimum(picture, 255, out=picture).astype(np.uint8)


def render_linearized(linearized: NDArray[np.float32], scale: float) -> NDArray[np.uint8]:
    """Grey picture (H,W) of a signed image.

    Zero (and NaN) is exactly 128; `scale` and more is 255; -`scale` and less is 1.
    """
    picture = linearized * np.float32(127 / scale)
    np.clip(picture, -127, 127, out=picture)
    picture += np.float32(ZERO + 0.5)
    np.copyto(picture, ZERO, where=np.isnan(picture))
    return picture.astype(np.uint8)


def render_residual(residual: NDArray[np.float32], scale: float) -> NDArray[np.uint8]:
    """Colour picture (H,W,3) of i - l: zero white, +`scale` red (light added), -`scale` blue."""
    return np.take(_DIVERGING, render_linearized(residual, scale), axis=0)


def encode_jpeg(picture: NDArray[np.uint8], quality: int = 90) -> bytes:
    """JPEG of a grey (H,W) or colour (H,W,3) picture: quick (2 ms a megapixel), not exact."""
    return bytes(imagecodecs.jpeg8_encode(picture, level=quality, subsampling="444"))


def encode_png(picture: NDArray[np.uint8]) -> bytes:
    """PNG of a grey (H,W) or colour (H,W,3) picture: exact, 12 ms for a grey megapixel."""
    return bytes(
        imagecodecs.png_encode(
            picture,
            level=1,
            strategy=imagecodecs.PNG.STRATEGY.HUFFMAN_ONLY,
            filter=imagecodecs.PNG.FILTER.SUB,
        )
    )


def encode_labels(
    labels: NDArray[np.uint8],
    shown: Collection[Factor] = frozenset(Factor),
    opacity: float = OPACITY,
    *,
    outlines: bool = False,
    solid: bool = False,
    patterns: bool = False,
    palette: Mapping[Factor, RGB] = PALETTE,
) -> bytes:
    """Overlay of a label map, as an 8-bit palette PNG whose indices are the labels themselves.

    Marks of patterns have indices of their own. Only the palette's alpha depends on `shown` and
    `opacity`. Run-length matching suits label maps: half the bytes of zlib's level 1, as fast.

    Args:
        labels: (H,W) Factor codes; OUTSIDE and every other code is transparent.
        shown: classes drawn; the others are transparent.
        opacity: 0 to 1; diffuse is fainter and specular stronger, except at 0 and 1.
        outlines: draw the one-pixel borders of the classes, opaque, diffuse left out.
        solid: draw every shown class opaque (the label map alone).
        patterns: mark the classes by patterns, unless outlines are drawn.
        palette: sRGB of each class.
    """
    if outlines:
        from skimage.segmentation import find_boundaries

        borders = find_boundaries(labels, connectivity=1)
        labels = np.where(borders, labels, np.uint8(OUTSIDE))
        shown = set(shown) - {Factor.DIFFUSE}
    elif patterns:
        labels = add_marks(labels)
    colours, alphas = tabulate_colours(shown, opacity, solid=solid or outlines, palette=palette)
    H, W = labels.shape
    rows = np.zeros((H, W + 1), np.uint8)
    rows[:, 1:] = labels
    deflate = zlib.compressobj(1, strategy=zlib.Z_RLE)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        (
            _chunk(b"IHDR", struct.pack(">IIBBBBB", W, H, 8, 3, 0, 0, 0)),
            _chunk(b"PLTE", colours.tobytes()),
            _chunk(b"tRNS", np.rint(255 * alphas).astype(np.uint8).tobytes()),
            _chunk(b"IDAT", deflate.compress(rows.data) + deflate.flush()),
            _chunk(b"IEND", b""),
        )
    )


def tabulate_colours(
    shown: Collection[Factor],
    opacity: float,
    *,
    solid: bool = False,
    palette: Mapping[Factor, RGB] = PALETTE,
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """(256,3) sRGB and (256,) alpha, 0 to 1, of each code and of the marks of its pattern."""
    colours, alphas = np.zeros((256, 3), np.uint8), np.zeros(256, np.float32)
    for factor in shown:
        colours[factor] = palette[factor]
        alphas[factor] = 1 if solid else alpha_of(Factor(factor), opacity)
        if factor in MARKS:
            colours[factor + MARK] = MARKS[factor]
            alphas[factor + MARK] = min(1, STRENGTH * alphas[factor])
    return colours, alphas


def _percentile(values: NDArray[np.float32], mask: NDArray[np.bool_]) -> float:
    """99.5th percentile inside the mask, of about 200 000 values when there are more."""
    pixels = np.flatnonzero(mask)
    planes = values.reshape(-1, mask.size)
    sample = planes[:, pixels[:: max(1, len(planes) * pixels.size // 200_000)]]
    sample = sample[np.isfinite(sample)]
    return float(np.percentile(sample, 99.5)) if sample.size else 0.0


def alpha_of(factor: Factor, opacity: float) -> float:
    """Of a class; some follow a power of the opacity: 0 and 1 stay, 55 % becomes theirs."""
    own = {Factor.DIFFUSE: DIFFUSE_OPACITY, Factor.SPECULAR: SPECULAR_OPACITY}
    return float(opacity ** (np.log(own.get(factor, OPACITY)) / np.log(OPACITY)))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _diverging() -> NDArray[np.uint8]:
    """(256,3): blue at 1, white at ZERO, red at 255 (the ends of ColorBrewer's RdBu)."""
    blue, white, red = (33, 102, 172), (255, 255, 255), (178, 24, 43)
    stops = zip(blue, white, red, strict=True)
    channels = [np.interp(np.arange(256), (1, ZERO, 255), stop) for stop in stops]
    return np.stack(channels, axis=1).round().astype(np.uint8)


_DIVERGING = _diverging()
