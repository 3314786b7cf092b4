"""The last fit of every pixel, without the highlights that only neighbours together can see.

Faint and wide highlights hide in the noise of one observation and pull every fit upwards. Within a
few pixels, though, the residuals of one image have the same sign: their mean shows a highlight
five times fainter. Images without scene structure in common (noise) average out.
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from .analysis import Cancel, Progress
from .blocks import run_blocks
from .kernels import clear_tile, pooled_tile
from .observations import Observations

TILE = 32
ROUNDS = 10
ANNEAL = (4.0, 2.0)
"""Reach of the first rounds, in units of the last: a first fit holds highlights itself."""
REACH = 2.5
"""Mean residual of a window, in units of its noise, from which it is a highlight."""
CAP = 0.06
"""Residual, as a share of the brightest grays, beyond which one observation is out by itself."""
LEAST = 5e-4
"""The least noise of means, as a share of the brightest grays."""
BELOW = 4.0
"""Residual below the fit, in units of the noise, beyond which an observation is out."""
SLACK = 0.02
"""... and as a share of the brightest grays: a fit that still holds highlights is too high."""
STILL = 0.1
"""Change of a pixel, in units of the noise, from which its surroundings are fitted once more."""
PATCHES, PATCH = 40, 12
"""Squares of pixels in which the noise of means is measured."""


Tile = tuple[slice, slice]
"""Rows and columns."""


class Limits(NamedTuple):
    """Residuals that cost an observation its say, fractions of full scale."""

    cap: float
    """Of its own, on either side."""
    reach: float
    """Above the fit, of the mean of a full window."""
    slack: float
    """Of its own, below the fit."""


def refit_bases(
    seen: Observations,
    bases: NDArray[np.float32],
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> NDArray[np.float32]:
    """Fit all pixels again to the observations whose surroundings show no highlight.

    The weight of an observation falls with the mean residual of its image in a window of 5 x 5
    pixels, in units of the noise that such means show below zero, where no highlight is. Repeated
    until still, where it is not; a pixel with too few such observations keeps its solution.

    Args:
        bases: (3,H,W) in the frame of `seen.factors`, NaN where unknown.

    Returns:
        (3,H,W); does not depend on threads.

    Raises:
        Cancelled: `cancel` said so.
    """
    usable = seen.mask & np.isfinite(bases[0])
    old = np.where(usable, bases, np.float32(0))
    new = old.copy()
    tiles = {at: t for at, t in split(seen.mask.shape).items() if usable[t].any()}
    least = STILL * seen.noise / seen.bright
    cap = widest(seen)
    slack, reach = BELOW * seen.noise + SLACK * seen.bright, 0.0
    for round_ in range(ROUNDS):
        if round_ <= len(ANNEAL):
            means = measure_means(seen, usable, cap, old) + LEAST * seen.bright
            reach = REACH * means * (*ANNEAL, 1.0)[round_]
        limits = Limits(cap, reach, slack)
        change = fit_tiles(seen, usable, limits, list(tiles.values()), old, new, threads, cancel)
        if progress is not None:
            progress("linearize", (round_ + 1) / ROUNDS)
        old, new = new, old
        if round_ >= len(ANNEAL):
            # what is not worked on again has to be the same in both
            for rows, columns in tiles.values():
                new[:, rows, columns] = old[:, rows, columns]
            moved = surround({at for at, c in zip(tiles, change, strict=True) if c > least})
            tiles = {at: tile for at, tile in tiles.items() if at in moved}
    return np.where(usable, old, bases)


def find_clear(
    seen: Observations,
    bases: NDArray[np.float32],
    threads: int | None = None,
    cancel: Cancel | None = None,
) -> NDArray[np.float32]:
    """(K,H,W) how free of highlights the surroundings of each pixel are in each image, 0 to 1.

    Args:
        bases: (3,H,W) of `refit_bases`.

    Raises:
        Cancelled: `cancel` said so.
    """
    usable = seen.mask & np.isfinite(bases[0])
    flat = np.where(usable, bases, np.float32(0))
    cap = widest(seen)
    reach = REACH * (measure_means(seen, usable, cap, flat) + LEAST * seen.bright)
    clear = np.ones(seen.images.shape, np.float32)
    tiles = list(split(seen.mask.shape).values())
    known = (seen.images, usable, seen.factors, seen.white, np.float32(seen.Ts), flat)

    def work(start: int, stop: int) -> None:
        for rows, columns in tiles[start:stop]:
            size = (rows.stop - rows.start, columns.stop - columns.start)
            place = (rows.start, columns.start)
            clear_tile(*known, np.float32(cap), np.float32(reach), *place, *size, clear)

    run_blocks(work, len(tiles), 4, threads=threads, cancel=cancel)
    return clear


def widest(seen: Observations) -> float:
    """Residual beyond which one observation is out by itself, fraction of full scale."""
    return max(CAP * seen.bright, BELOW * seen.noise)


def fit_tiles(
    seen: Observations,
    usable: NDArray[np.bool_],
    limits: Limits,
    tiles: list[Tile],
    old: NDArray[np.float32],
    new: NDArray[np.float32],
    threads: int | None,
    cancel: Cancel | None,
) -> NDArray[np.float64]:
    """Fit the pixels of some tiles from the bases `old` into `new`; largest change in each."""
    change = np.zeros(len(tiles))
    known = (seen.images, usable, seen.factors, seen.white, np.float32(seen.Ts), old)
    cuts = (np.float32(limits.cap), np.float32(limits.reach), np.float32(limits.slack))

    def work(start: int, stop: int) -> None:
        for job in range(start, stop):
            rows, columns = tiles[job]
            size = (rows.stop - rows.start, columns.stop - columns.start)
            change[job] = pooled_tile(*known, *cuts, rows.start, columns.start, *size, new)

    run_blocks(work, len(tiles), 4, threads=threads, cancel=cancel)
    return change


def split(shape: tuple[int, int]) -> dict[tuple[int, int], Tile]:
    """The tiles of a picture, by their place in the grid."""
    rows, columns = (
        [slice(at, min(at + TILE, size)) for at in range(0, size, TILE)] for size in shape
    )
    return {(i, j): (r, c) for i, r in enumerate(rows) for j, c in enumerate(columns)}


def surround(places: set[tuple[int, int]]) -> set[tuple[int, int]]:
    """These places of the grid and all that touch them."""
    near = (-1, 0, 1)
    return {(i + a, j + b) for i, j in places for a in near for b in near}


def measure_means(
    seen: Observations, usable: NDArray[np.bool_], cap: float, bases: NDArray[np.float32]
) -> float:
    """Standard deviation of the mean residual of a full 5 x 5 window, fraction of full scale.

    From the negative ones, in squares spread over the object; 0 where there are none.
    """
    H, W = usable.shape
    pixels = np.flatnonzero(usable)
    if not pixels.size:
        return 0.0
    centres = pixels[np.linspace(0, len(pixels) - 1, PATCHES).astype(int)]
    rows, columns = (
        np.clip(at[:, None] + np.arange(PATCH) - PATCH // 2, 0, size - 1)
        for at, size in zip(np.divmod(centres, W), (H, W), strict=True)
    )
    place = (rows[:, :, None], columns[:, None, :])
    x = seen.images[:, *place]
    l = np.tensordot(seen.factors.T, bases[:, *place], 1)
    lit = (x >= seen.Ts) & (x < seen.white[:, None, None, None]) & usable[place]
    near = np.where(lit, np.clip(x - l, -cap, cap), 0)
    sums, counts = (
        sliding_window_view(a, (5, 5), axis=(2, 3)).sum((-1, -2), dtype=np.float32)
        for a in (near, lit)
    )
    inner = (counts > 12) & lit[:, :, 2:-2, 2:-2]
    means = sums[inner] / np.sqrt(25 * counts[inner])
    below = means[means < 0]
    return float(np.median(-below) / 0.6745) if below.size else 0.0
