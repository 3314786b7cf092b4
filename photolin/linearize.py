"""Step 2: linearized bases of every pixel, (l1, l2, l3) by Eq. (6)."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel, Options, Progress
from .blocks import Talk, run_blocks
from .coefficients import KEEP, draw_samples
from .errors import DegenerateError
from .factors import Thresholds
from .kernels import centre_rows, support_rows
from .robust import Quality, linearize_robustly
from .stack import ImageStack

BLOCK = 4096

Work = Callable[[int, int, NDArray[np.float32]], None]


def linearize(
    stack: ImageStack,
    coefficients: NDArray[np.float64],
    base_images: tuple[int, int, int],
    thresholds: Thresholds,
    options: Options,
    quality: Quality | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.uint16]]:
    """Linearized bases of all mask pixels.

    `robust` samples among the images in which a pixel is lit until enough is known, then fits all
    its lit observations, weighted by how well they fit; the published methods draw
    `options.samples` triples among all images but the bases, the same for all pixels.

    Args:
        quality: what `robust` makes use of; nothing is known when left out.

    Returns:
        (3,H,W) signed, fraction of full scale; 0 outside the mask; NaN where `robust` finds a
        pixel lit in fewer than three images, which determines nothing. (P,) margin of each mask
        pixel: votes by which the winner beats the best different solution; 0 by the published
        methods.

    Raises:
        DegenerateError: no three images determine a candidate.
        Cancelled: `cancel` said so.
    """
    if options.method == "robust":
        known = quality or Quality(np.full(len(stack.images), np.inf, np.float32), 0.0)
        talk = Talk(threads, progress, cancel)
        bases, lead = linearize_robustly(
            stack.images, stack.mask, coefficients, thresholds, options, known, talk
        )
        return bases, np.minimum(lead, np.iinfo(np.uint16).max).astype(np.uint16)
    work = shared_samples_work(stack, coefficients, base_images, thresholds, options)
    bases = fit_pixels(stack, work, threads, progress, cancel)
    return bases, np.zeros(np.count_nonzero(stack.mask), np.uint16)


def fit_pixels(
    stack: ImageStack,
    work: Work,
    threads: int | None,
    progress: Progress | None,
    cancel: Cancel | None,
) -> NDArray[np.float32]:
    """Bases (3,H,W) of all mask pixels, a block at a time."""
    _, H, W = stack.shape
    bases = np.zeros((3, H * W), np.float32)
    pixels = stack.pixels

    def block(start: int, stop: int) -> None:
        out = np.full((stop - start, 3), np.nan, np.float32)
        work(start, stop, out)
        bases[:, pixels[start:stop]] = out.T

    run_blocks(
        block,
        len(pixels),
        BLOCK,
        threads=threads,
        stage="linearize",
        progress=progress,
        cancel=cancel,
    )
    return bases.reshape(3, H, W)


def shared_samples_work(
    stack: ImageStack,
    coefficients: NDArray[np.float64],
    base_images: tuple[int, int, int],
    thresholds: Thresholds,
    options: Options,
) -> Work:
    """Shared samples on one block of pixels, the winner by support or by centre of gravity."""
    X = stack.images.reshape(len(stack.images), -1)
    pixels, others = stack.pixels, np.setdiff1d(np.arange(len(X)), base_images)
    rng = np.random.default_rng([options.seed, 2])
    drawn, inverses = draw_samples(coefficients[others].T, options.samples, rng)
    if len(drawn) == 0:
        raise DegenerateError(
            "no three images determine the linearized bases: their coefficients lie in one plane, "
            f"as with too small a T (it is {thresholds.T:g}; try the suggested one), or because "
            "the lights do; then add images with lights outside it"
        )
    triples = others[drawn]
    A = np.ascontiguousarray(coefficients.T, np.float32)
    keep = int(np.ceil(KEEP * len(triples)))
    T, Ts = np.float32(thresholds.T), np.float32(thresholds.Ts)

    def work(start: int, stop: int, out: NDArray[np.float32]) -> None:
        rows = np.ascontiguousarray(X[:, pixels[start:stop]].T)
        if options.method == "statistical":
            centre_rows(rows, triples, inverses, keep, out, 0, len(rows))
        else:
            support = np.empty(len(rows), np.int32)
            support_rows(rows, A, triples, inverses, T, Ts, out, support, 0, len(rows))

    return work
