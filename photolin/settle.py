"""Ties among pixels that few observations decide: neighbours have nearly the same normal."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel
from .blocks import run_blocks
from .kernels import settle_rows, trust_rows
from .kernels.neighbours import TURN
from .observations import Observations

BLOCK = 1 << 14
FEW = 256
SWEEPS = 4
"""Most steps of two pixels by which a solution spreads."""
CERTAIN = 0.03
"""Uncertainty of a pixel's direction, radians, that halves what its neighbours make of it."""
PAIRS, FEWEST_PAIRS = 4000, 50
"""Neighbours that are compared to see whether the surface is smooth, about, and at least."""
DOUBTFUL = 0.5
"""Trust below which a pixel listens to its neighbours."""


def settle_ties(
    seen: Observations,
    bases: NDArray[np.float32],
    lead: NDArray[np.int32],
    threads: int | None = None,
    cancel: Cancel | None = None,
    among: NDArray[np.intp] | None = None,
    sweeps: int = SWEEPS,
) -> NDArray[np.float32]:
    """Let doubtful pixels take a neighbour's direction, in place.

    Where a pixel is lit in few images, wrong solutions explain as many observations as the right
    one. Of its own solution and those of its neighbours, rescaled and fitted again, the one wins
    that costs least: squared residuals, cut off, plus the difference from the neighbours'
    directions, each weighed by how well its own observations determine it. Doubtful are pixels
    whose direction is uncertain or that won by one vote or none; all others stay as they are.

    Args:
        bases: (3,H,W) in the frame of `seen.factors`, NaN where unknown; contiguous, changed.
        lead: (P,) votes by which the solution of each mask pixel, or of `among`, won.
        among: flat indices of the pixels that may be doubtful; all of the mask when left out.
        sweeps: how many at most.

    Returns:
        `bases`; what they become does not depend on threads.

    Raises:
        Cancelled: `cancel` said so.
    """
    K, H, W = seen.images.shape
    X, flat = seen.images.reshape(K, -1), bases.reshape(3, -1)
    pixels = np.flatnonzero(seen.mask) if among is None else among
    known = (seen.factors, seen.white, np.float32(seen.Ts), np.float32(seen.noise))
    trust = (seen.mask & np.isfinite(bases[0])).reshape(-1).astype(np.float32)

    def weigh(start: int, stop: int) -> None:
        trust_rows(X, pixels, *known, np.float32(CERTAIN), flat, lead, trust, start, stop)

    run_blocks(weigh, len(pixels), BLOCK, threads=threads, stage="linearize", cancel=cancel)
    if is_rough(flat, trust, (H, W)):
        return bases
    listening = doubtful = pixels[(trust[pixels] < DOUBTFUL) & (trust[pixels] > 0)]
    for _ in range(sweeps):
        out = np.empty((len(doubtful), 3), np.float32)
        gained = np.empty(len(doubtful), np.float32)
        work = partial(settle_rows, X, W, doubtful, *known, flat, trust, out, gained)
        run_blocks(work, len(doubtful), FEW, threads=threads, stage="linearize", cancel=cancel)
        changed = gained >= 0
        if not changed.any():
            break
        moved = doubtful[changed]
        flat[:, moved] = out[changed].T
        trust[moved] = np.maximum(trust[moved], gained[changed])
        doubtful = listening[reached_by(moved, listening, (H, W))]
    return bases


def is_rough(flat: NDArray[np.float32], trust: NDArray[np.float32], shape: tuple[int, int]) -> bool:
    """Whether neighbours that are sure of themselves differ so much that none tells of another.

    Args:
        flat: (3,N) bases.
        trust: (N,)
    """
    sure = np.pad((trust > DOUBTFUL).reshape(shape), ((0, 1), (0, 1)))
    turns = []
    for step in (1, shape[1]):
        beside = sure[:-1, 1:] if step == 1 else sure[1:, :-1]
        pairs = (sure[:-1, :-1] & beside).reshape(-1)
        every = max(1, int(np.count_nonzero(pairs)) // PAIRS)
        at = np.flatnonzero(pairs[::every]) * every
        here, there = (
            v / (np.linalg.norm(v, axis=0) + 1e-12) for v in (flat[:, at], flat[:, at + step])
        )
        turns.append(np.linalg.norm(here - there, axis=0))
    turned = np.concatenate(turns)
    return len(turned) >= FEWEST_PAIRS and bool(np.median(turned) > TURN)


def reached_by(
    moved: NDArray[np.intp], doubtful: NDArray[np.intp], shape: tuple[int, int]
) -> NDArray[np.bool_]:
    """Which doubtful pixels have a moved one in their window of 5 x 5; flat indices."""
    near = np.zeros((shape[0] + 4, shape[1] + 4), bool)
    rows, columns = np.divmod(moved, shape[1])
    for i in range(5):
        for j in range(5):
            near[rows + i, columns + j] = True
    return near[2:-2, 2:-2].reshape(-1)[doubtful]
