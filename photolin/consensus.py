"""Adaptive sample consensus: how many samples are enough, and rows fitted with them."""

from math import ceil, inf, isfinite, log1p

import numpy as np
from numpy.typing import NDArray

from .blocks import run_blocks
from .kernels import consensus_rows

BLOCK = 10_000
CONFIDENCE = 0.99
"""Wanted probability that at least one sample held D observations only."""


def samples_needed(inlier_share: float, confidence: float = CONFIDENCE) -> float:
    """Samples of three so that, with `confidence`, one of them holds inliers only.

    log(1 - confidence) / log(1 - w^3), rounded up; at least 1, infinite for w = 0.
    """
    clean = inlier_share**3
    if clean <= 0:
        return inf
    if clean >= confidence:
        return 1
    # log1p keeps small shares from rounding to log(1) = 0, which would ask for no samples at all
    wanted = log1p(-confidence) / log1p(-clean)
    return ceil(wanted) if isfinite(wanted) else inf


def stopping_table(limit: int, steps: int = 64) -> NDArray[np.int64]:
    """(steps+1,) samples needed at inlier shares 0..1, at most `limit`.

    A share between two steps takes the lower one's, hence never too few.
    """
    return np.array([min(limit, samples_needed(s / steps)) for s in range(steps + 1)], np.int64)


def fit_rows(
    X: NDArray[np.float32],
    columns: NDArray[np.int64],
    A: NDArray,
    T: float,
    Ts: float,
    *,
    limit: int,
    seed: int,
    guess: NDArray | None = None,
    threads: int | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Fit columns of X to factors A, see `photolin.kernels`.

    Args:
        X: (M,N) observations.
        columns: (R,) which columns of X to fit.
        A: (3,M) factors; NaN leaves an observation out.
        guess: (R,3) solutions to start from.

    Returns:
        (R,3) float32 solutions, NaN where fewer than three observations are lit, and (R,) int32
        scores, D minus U.
    """
    out = np.full((len(columns), 3), np.nan, np.float32)
    if guess is not None:
        out[:] = guess
    score, margin = np.empty(len(columns), np.int32), np.empty(len(columns), np.int32)
    white = np.full(len(X), np.inf, np.float32)
    factors = np.ascontiguousarray(A, np.float32)
    tries, key = stopping_table(limit), np.uint64(seed)
    tolerance, level = np.float32(T), np.float32(Ts)

    def work(start: int, stop: int) -> None:
        consensus_rows(
            X,
            columns,
            factors,
            white,
            tolerance,
            level,
            np.float32(0),
            tries,
            limit,
            key,
            out,
            score,
            margin,
            start,
            stop,
        )

    # about as much work in a block whether rows are pixels (short) or images (long)
    run_blocks(work, len(columns), max(1, BLOCK // len(X)), threads=threads)
    return out, score
