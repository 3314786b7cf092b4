"""The last fit of every pixel, without the highlights that only neighbours together can see.

Faint and wide highlights hide in the noise of one observation and pull every fit upwards. Within a
few pixels, though, the residuals of one image have the same sign: their mean shows a highlight
five times fainter. Images without scene structure in common (noise) average out.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel, Progress
from .blocks import run_blocks
from .kernels import clear_tile, pooled_tile
from .observations import Observations

TILE = (16, 128)
"""Rows and columns: long rows suit the loops, and what is summed up stays in the cache."""
ROUNDS = 10
ANNEAL = (4.0, 2.0)
"""Reach of the first rounds, in units of the last: a first fit holds highlights itself."""
REACH = 3.0
"""Mean residual of a window, in units of its noise, from which it is a highlight."""
CAP, CAP_NOISE = 0.02, 4.0
"""Residual from which one observation is out by itself: a share of the brightest grays (a fit that
still holds highlights is too high) and some noise."""
LEAST = 5e-4
"""The least noise of means, as a share of the brightest grays."""
STILL = 0.1
"""Change of a pixel, in units of the noise, from which its surroundings are fitted once more."""
GOLDEN_RATIO = (np.sqrt(5) - 1) / 2
LIT, ENOUGH = 12, 50
"""Lit pixels that a window has to have more of to be measured, and windows needed."""
PATCHES, PATCH = 40, 12
"""Squares of pixels in which the noise of means is measured."""


Tile = tuple[slice, slice]
"""Rows and columns."""


def refit_bases(
    seen: Observations,
    bases: NDArray[np.float32],
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    rounds: int = ROUNDS,
) -> NDArray[np.float32]:
    """Fit all pixels again to the observations whose surroundings show no highlight.

    The weight of an observation falls with the mean residual of its image in a window of 5 x 5
    pixels, in units of the noise that such means show below zero, where no highlight is. Repeated
    until still, where it is not; a pixel with too few such observations keeps its solution. The
    bases given have to be good: what is one percent too low would take everything for a highlight.

    Args:
        bases: (3,H,W) in the frame of `seen.factors`, NaN where unknown.
        rounds: how many at most.

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
    cap, reach = widest(seen), 0.0
    for round_ in range(rounds):
        if round_ <= len(ANNEAL):
            means = measure_means(seen, usable, cap, old) + LEAST * seen.bright
            reach = REACH * means * (*ANNEAL, 1.0)[round_]
        fit = partial(fit_tiles, seen, usable, cap, reach, list(tiles.values()))
        change = fit(old, new, threads, cancel)
        if progress is not None:
            progress("linearize", (round_ + 1) / rounds)
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

    run_blocks(work, len(tiles), 2, threads=threads, stage="linearize", cancel=cancel)
    return clear


def widest(seen: Observations) -> float:
    """Residual beyond which one observation is out by itself, fraction of full scale."""
    return max(CAP * seen.bright + CAP_NOISE * seen.noise, 1e-30)


def fit_tiles(
    seen: Observations,
    usable: NDArray[np.bool_],
    cap: float,
    reach: float,
    tiles: list[Tile],
    old: NDArray[np.float32],
    new: NDArray[np.float32],
    threads: int | None,
    cancel: Cancel | None,
) -> NDArray[np.float64]:
    """Fit the pixels of some tiles from the bases `old` into `new`; largest change in each."""
    change = np.zeros(len(tiles))
    known = (seen.images, usable, seen.factors, seen.white, np.float32(seen.Ts), old)
    cuts = (np.float32(cap), np.float32(reach))

    def work(start: int, stop: int) -> None:
        for job in range(start, stop):
            rows, columns = tiles[job]
            size = (rows.stop - rows.start, columns.stop - columns.start)
            change[job] = pooled_tile(*known, *cuts, rows.start, columns.start, *size, new)

    run_blocks(work, len(tiles), 2, threads=threads, stage="linearize", cancel=cancel)
    return change


def split(shape: tuple[int, int]) -> dict[tuple[int, int], Tile]:
    """The tiles of a picture, by their place in the grid."""
    rows, columns = (
        [slice(at, min(at + side, size)) for at in range(0, size, side)]
        for side, size in zip(TILE, shape, strict=True)
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

    From the negative ones, in squares spread over the object; that of independent observations
    where windows are too few.
    """
    H, W = usable.shape
    pixels = np.flatnonzero(usable)
    if not pixels.size:
        return seen.noise / 5
    # multiples of an irrational number: no step that rows of the picture could be in tune with
    spread = np.arange(PATCHES) * GOLDEN_RATIO % 1
    rows, columns = (
        at[:, None] + np.arange(PATCH) - PATCH // 2
        for at in np.divmod(pixels[(spread * len(pixels)).astype(int)], W)
    )
    inside = ((rows >= 0) & (rows < H))[:, :, None] & ((columns >= 0) & (columns < W))[:, None, :]
    place = (rows.clip(0, H - 1)[:, :, None], columns.clip(0, W - 1)[:, None, :])
    x = seen.images[:, *place]
    l = np.tensordot(seen.factors.T, bases[:, *place], 1)
    lit = (x >= seen.Ts) & (x < seen.white[:, None, None, None])
    lit &= usable[place] & inside
    near = np.where(lit, np.clip(x - l, -cap, cap), 0)
    sums, counts = window_sums(near), window_sums(lit.astype(np.float32))
    inner = (counts > LIT) & lit[:, :, 2:-2, 2:-2]
    means = sums[inner] / np.sqrt(25 * counts[inner])
    below = means[means < 0]
    if below.size < ENOUGH:  # an object one pixel wide has no full windows
        return seen.noise / 5
    return float(np.median(-below) / 0.6745)


def window_sums(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sums over 5 x 5 windows of the last two axes, which become 4 shorter."""
    size = values.shape[-1] - 4
    across = sum((values[..., i : i + size] for i in range(1, 5)), values[..., :size])
    return sum((across[..., i : i + size, :] for i in range(1, 5)), across[..., :size, :])
