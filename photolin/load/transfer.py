"""Stored values to one linear channel."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .options import Channel
from .pictures import Picture

WEIGHTS: dict[Channel, tuple[float, float, float]] = {
    "mean": (1 / 3, 1 / 3, 1 / 3),
    "luminance": (0.2126, 0.7152, 0.0722),
    "max": (1, 1, 1),
    "r": (1, 0, 0),
    "g": (0, 1, 0),
    "b": (0, 0, 1),
}
"""What red, green and blue are multiplied with before they are joined: by their maximum for max, by
their sum for all others. Luminance is that of Rec. 709 and sRGB."""


STRIP = 64
"""Rows that are looked up at once."""


def decode_srgb(v: NDArray) -> NDArray:
    """The sRGB curve of IEC 61966-2-1, from stored to linear; 0 to 1 maps onto 0 to 1."""
    return np.where(v <= 0.04045, v / 12.92, ((np.maximum(v, 0.04045) + 0.055) / 1.055) ** 2.4)


def linear_plane(
    picture: Picture, channel: int, transfer: Literal["linear", "srgb"]
) -> NDArray[np.float32]:
    """Channel number `channel` of `picture`: (H,W), a new array, fraction of full scale, linear."""
    stored = picture.pixels[..., channel]
    decode = decode_srgb if transfer == "srgb" else np.asarray
    if stored.dtype.kind == "u" and stored.dtype.itemsize <= 2:
        # All values there can be, decoded once, in double precision.
        table = decode(np.arange(2 ** (8 * stored.dtype.itemsize)) / picture.full)
        table, plane = table.astype(np.float32), np.empty(stored.shape, np.float32)
        for row in range(0, len(stored), STRIP):  # numpy makes 8 bytes of every index
            strip = slice(row, row + STRIP)
            np.take(table, stored[strip], out=plane[strip], mode="clip")
        return plane
    with np.errstate(over="ignore"):  # what single precision cannot hold is refused as infinite
        return decode(stored.astype(np.float64) / picture.full).astype(np.float32)


def one_channel(
    picture: Picture,
    channel: Channel,
    transfer: Literal["linear", "srgb"],
    dark: Sequence[NDArray] | None = None,
    power: NDArray | None = None,
) -> NDArray[np.float32]:
    """Join the linear channels of `picture` into one.

    Args:
        picture: gray, which is taken as it is, or red, green and blue.
        channel: the rule.
        transfer: the relation of its values to light.
        dark: (H,W) for each channel, linear, subtracted.
        power: (3,) power of the light in red, green and blue, by which channels are divided.

    Returns:
        (H,W), fraction of full scale; dark frames, powers and floats may lead out of [0, 1].
    """
    gray = picture.pixels.shape[2] == 1
    if gray and power is not None:
        power = power.mean(keepdims=True)
    total = None
    for c, weight in enumerate((1.0,) if gray else WEIGHTS[channel]):
        if weight == 0:
            continue
        plane = linear_plane(picture, c, transfer)
        if dark is not None:
            with np.errstate(invalid="ignore"):
                plane -= dark[c]
        with np.errstate(over="ignore", invalid="ignore"):  # as in linear_plane
            plane *= np.float32(weight if power is None else weight / power[c])
        if total is None:
            total = plane
        elif channel == "max":
            np.maximum(total, plane, out=total)
        else:
            total += plane
    assert total is not None
    return total
