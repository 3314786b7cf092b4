"""Step 1 as published: coefficients from random samples of three pixels (Eq. 2 and 5)."""

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel, Options, Progress
from .blocks import run_blocks
from .errors import DegenerateError
from .factors import Thresholds
from .kernels import centre_rows, support_rows
from .stack import ImageStack

KEEP = 0.05
"""Share of the candidates the statistical method ends with at the least."""
DRAWS = 20
SINGULAR = 1e-6
"""Normalized determinant below which three observations do not determine a candidate."""


def estimate_coefficients(
    stack: ImageStack,
    base_images: tuple[int, int, int],
    thresholds: Thresholds,
    options: Options,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> NDArray[np.float64]:
    """Coefficients by random samples over all mask pixels.

    Args:
        options: method (classification: maximum SupportC, Eq. 5; statistical: centre of gravity
            and outlier elimination, the earlier method), samples for each image, seed.

    Returns:
        (K,3); rows of the base images are unit vectors.

    Raises:
        DegenerateError: no sample determines a candidate.
        Cancelled: `cancel` said so.
    """
    K = len(stack.images)
    X = np.ascontiguousarray(stack.images.reshape(K, -1)[:, stack.pixels])
    A = X[list(base_images)]
    triples, inverses = draw_pixels(A, base_images, options.samples, options.seed)
    out, support = np.empty((K, 3), np.float32), np.empty(K, np.int32)
    keep = int(np.ceil(KEEP * len(triples)))
    T, Ts = np.float32(thresholds.T), np.float32(thresholds.Ts)

    def work(start: int, stop: int) -> None:
        if options.method == "statistical":
            centre_rows(X, triples, inverses, keep, out, start, stop)
        else:
            support_rows(X, A, triples, inverses, T, Ts, out, support, start, stop)

    run_blocks(work, K, 1, threads=threads, stage="coefficients", progress=progress, cancel=cancel)
    coefficients = out.astype(np.float64)
    coefficients[list(base_images)] = np.eye(3)
    return coefficients


def draw_pixels(
    A: NDArray[np.floating], base_images: tuple[int, int, int], count: int, seed: int
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """`draw_samples` of pixels, whose bases are A (3,M); each seed gives the same ones.

    Raises:
        DegenerateError: no sample determines a candidate.
    """
    triples, inverses = draw_samples(A, count, np.random.default_rng([seed, 1]))
    if len(triples) == 0:
        raise DegenerateError(
            f"base images {base_images}: no three pixels tell them apart; "
            "their lights may lie in one plane, or they share too few lit pixels"
        )
    return triples, inverses


def draw_samples(
    A: NDArray[np.floating], count: int, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Random triples of the M factors and the inverses that solve them.

    Args:
        A: (3,M) factors.
        count: how many; those that are singular are drawn again, up to DRAWS times.

    Returns:
        (n,3) observation numbers, (n,3,3) inverses: v = inverse @ x[triple].
    """
    triples, inverses = np.empty((0, 3), np.int64), np.empty((0, 3, 3), np.float32)
    for _ in range(DRAWS):
        drawn = rng.integers(0, A.shape[1], (count, 3))
        regular, inverse = invert_regular(A, drawn)
        triples = np.concatenate([triples, regular])[:count]
        inverses = np.concatenate([inverses, inverse])[:count]
        if len(triples) == count:
            break
    return triples, inverses


def invert_regular(
    A: NDArray[np.floating], triples: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """The triples of factors that determine a candidate, and the inverses of those."""
    rows = A[:, triples].transpose(1, 2, 0).astype(np.float64)
    norms = np.prod(np.linalg.norm(rows, axis=2), axis=1)
    regular = np.abs(np.linalg.det(rows)) > SINGULAR * norms
    inverses = np.linalg.inv(rows[regular])
    # factors of 1e-38 and less have an inverse beyond single precision
    usable = np.abs(inverses).max(axis=(1, 2), initial=0) < np.finfo(np.float32).max
    return triples[regular][usable], inverses[usable].astype(np.float32)


def relate_to_bases(
    coefficients: NDArray[np.float64], base_images: tuple[int, int, int]
) -> NDArray[np.float64]:
    """The same coefficients with unit vectors in the rows of the base images.

    Raises:
        DegenerateError: the lights of the base images lie in one plane.
    """
    rows = coefficients[list(base_images)]
    if not np.linalg.cond(rows) < 1e6:
        raise DegenerateError(
            f"the lights of base images {base_images} lie in one plane; choose other base images"
        )
    related = coefficients @ np.linalg.inv(rows)
    related[list(base_images)] = np.eye(3)
    return related
