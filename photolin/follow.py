"""Linearize again for other thresholds, from a result nearby: quick enough to follow a slider."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from .analysis import Analysis, Cancel
from .blocks import Talk
from .coefficients import relate_to_bases
from .errors import OptionError
from .factors import Thresholds
from .label import label_images
from .refine import refine_coefficients
from .robust import Effort, Quality, linearize_robustly
from .sample import Sample, draw_sample
from .saturation import find_white
from .stack import ImageStack

PIXELS, FEWEST = 2000, 1000
"""Sampled pixels on which the coefficients are estimated again: with up to 24 images, and with
many."""
ROUNDS = 2
"""Rounds of their refinement: they start nearly right."""
SAMPLES = 30
"""Most random samples of a pixel: a T far too small would ask for hundreds."""
QUICK = Effort(rounds=3, sweeps=1, fewest=5000)


@dataclass(frozen=True, eq=False)
class Ground:
    """What does not depend on thresholds, taken once from a stack."""

    sample: Sample
    """Pixels that decide the coefficients."""
    white: NDArray[np.float32]
    """(K,) value from which observations of an image are saturated."""
    lights: NDArray[np.float64] | None
    """(K,3) where known; coefficients are then not estimated."""


def prepare_ground(stack: ImageStack, seed: int = 0) -> Ground:
    """Draw the sample of a whole stack, of which parts may then be followed."""
    white = find_white(stack)
    count = max(PIXELS * 24 // max(24, len(stack.images)), FEWEST)
    return Ground(draw_sample(stack, seed, white, count), white, stack.lights)


def follow_thresholds(
    images: NDArray[np.float32],
    mask: NDArray[np.bool_],
    ground: Ground,
    near: Analysis,
    thresholds: Thresholds,
    *,
    threads: int | None = None,
    cancel: Cancel | None = None,
) -> Analysis:
    """A linearization and labels by the method `robust` for other T and Ts.

    Coefficients are refined from those of `near`, the bases of all pixels and all labels are new.
    What `pipeline.analyze` finds for the same thresholds differs from it by less than noise does,
    but is not the same to the last bit: this is what to show until that is there.

    Args:
        images, mask: (K,H,W) and (H,W) of the stack of `ground`, or of a thinned-out part of it.
        near: a result of the whole stack for thresholds not far away.

    Returns:
        An analysis of these pixels, without confidence; its only stage is `follow`.

    Raises:
        OptionError: `near` is of another method or number of images.
        DegenerateError: with these thresholds, the images do not determine a solution.
        Cancelled: `cancel` returned true.
    """
    if near.options.method != "robust" or len(near.coefficients) != len(images):
        raise OptionError(
            f"a result by {near.options.method} of {len(near.coefficients)} images cannot be "
            f"followed for {len(images)}; one by robust of the same images is accepted"
        )
    start = perf_counter()
    options = replace(near.options, T=thresholds.T, Ts=thresholds.Ts)
    quick = replace(options, samples=min(options.samples, SAMPLES))
    with threadpool_limits(1, "blas"):
        found = refine_coefficients(
            ground.sample,
            near.coefficients,
            thresholds.Ts,
            options.seed,
            quick.samples,
            cancel,
            ROUNDS,
        )
        c = (
            near.coefficients
            if ground.lights is not None
            else relate_to_bases(found.coefficients, near.base_images)
        )
        quality = Quality(ground.white, found.noise.absolute)
        talk = Talk(threads, None, cancel)
        bases, _ = linearize_robustly(images, mask, c, thresholds, quick, quality, talk, QUICK)
    labels = label_images(images, bases, c, mask, thresholds, threads=threads)
    seconds = perf_counter() - start
    return Analysis(
        options=options,
        thresholds=thresholds,
        base_images=near.base_images,
        coefficients=c,
        linearized_bases=bases,
        labels=labels,
        mask=mask,
        names=near.names,
        seconds={"follow": seconds, "total": seconds},
        title=near.title,
        lights=ground.lights,
        files=near.files,
    )
