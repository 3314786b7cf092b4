"""Large pictures: highlights are found on every few pixels, and all pixels fitted without them.

Highlights are parts of the scene, not of the pixel grid: in a picture of twice the size they are
twice as many pixels wide. So they are searched for where pixels are thinned out to a fixed number,
and every pixel is then fitted once to the observations that are free of them, and checked. Where
the check fails (edges, small highlights, another surface) nothing of the fit is kept.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel, Progress
from .blocks import run_blocks
from .kernels import fine_band
from .observations import Observations

COARSE_PIXELS, FEWEST_PIXELS = 20_000, 10_000
"""Mask pixels that a thinned-out picture has, about, with up to 24 images and with many."""
COLUMNS = 512
"""Columns that are worked on at once, about; what is summed up for them stays in the cache."""
WIDE = 4.0
"""Residual, in units of the noise, that noise may have."""


def choose_step(pixels: int, images: int = 24, fewest: int = FEWEST_PIXELS) -> int:
    """Side of the blocks of pixels that one stands for; 1: all are looked at.

    Args:
        fewest: pixels that are left with any number of images, about.
    """
    coarse = np.clip(COARSE_PIXELS * 24 / images, min(fewest, COARSE_PIXELS), COARSE_PIXELS)
    return max(1, round(np.sqrt(pixels / coarse)))


def thin_out(seen: Observations, step: int) -> Observations:
    """One pixel of each block of `step` x `step`: its centre, or another one in the mask.

    Returns:
        Observations of (ceil(H / step), ceil(W / step)) pixels; a block without any of the
        object's pixels is not in the mask.
    """
    K, H, W = seen.images.shape
    h, w = -(-H // step), -(-W // step)
    inside = np.zeros((h * step, w * step), bool)
    inside[:H, :W] = seen.mask
    blocks = inside.reshape(h, step, w, step).transpose(0, 2, 1, 3).reshape(h, w, -1)
    centre = step // 2 * step + step // 2
    at = np.where(blocks[:, :, centre], centre, blocks.argmax(axis=2))
    rows = np.minimum(np.arange(h)[:, None] * step + at // step, H - 1)
    columns = np.minimum(np.arange(w)[None, :] * step + at % step, W - 1)
    images = np.ascontiguousarray(seen.images.reshape(K, -1)[:, rows * W + columns])
    return replace(seen, images=images, mask=blocks.any(axis=2))


def fit_fine(
    seen: Observations,
    clear: NDArray[np.float32],
    step: int,
    T: float,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.intp]]:
    """Least squares of all pixels with the weights of their blocks.

    Args:
        clear: (K,h,w) weights of blocks, from `refit.find_clear` on `thin_out`.
        T: relative tolerance.

    Returns:
        (3,H,W) bases in the frame of `seen.factors`, 0 outside the mask; (H,W) votes ahead of
        none; flat indices of mask pixels that these do not explain, which are to be fitted anew.

    Raises:
        Cancelled: `cancel` said so.
    """
    _, H, W = seen.images.shape
    bases = np.empty((3, H, W), np.float32)
    lead, doubt = np.empty((H, W), np.int32), np.empty((H, W), bool)
    width = max(1, COLUMNS // step) * step
    known = (seen.images, seen.factors, seen.white, np.float32(seen.Ts), clear)
    room = (np.float32(T), np.float32(WIDE * seen.noise))

    def work(start: int, stop: int) -> None:
        for band in range(start, stop):
            top = band * step
            rows = min(step, H - top)
            for left in range(0, W, width):
                size = (rows, min(width, W - left))
                fine_band(*known, step, *room, top, left, *size, bases, lead, doubt)

    run_blocks(
        work,
        -(-H // step),
        max(1, 16 // step),
        threads=threads,
        stage="linearize",
        progress=progress,
        cancel=cancel,
    )
    if not seen.mask.all():
        bases[:, ~seen.mask] = 0
    return bases, lead, np.flatnonzero(doubt & seen.mask)
