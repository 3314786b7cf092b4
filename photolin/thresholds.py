"""T and Ts from the data: the shadow level, and the noise that D observations show."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel, Options
from .bases import choose_bases
from .factorize import (
    Factorization,
    fit_bases,
    orthogonalize,
    refine_coefficients,
    search_coefficients,
)
from .factors import Thresholds
from .sample import Sample

MIN_T, MAX_T = 0.008, 0.12
FIRST_T = 0.05
LEVELS = 256
"""Histogram bins from black to the brightest grays when looking for the shadow level."""
FLOOR = 1
"""Bins that Ts spans where shadows are exactly dark: below, grazing light looks like them."""
CEILING = 24
"""Bins that Ts spans at most: what falls off more slowly is a dark surface, not a shadow level."""
GRAYS = slice(32, 96)
"""Bins whose level the dark mode has to rise from: beyond shadows, still dark."""
SMOOTHING = np.array([1, 4, 6, 4, 1]) / 16


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Suggested thresholds with the evidence."""

    thresholds: Thresholds
    histogram: NDArray[np.float64]
    """(LEVELS/2,) observations in bins of `bin_width` from 0, single images' own peaks left out."""
    bin_width: float
    """Fraction of full scale."""
    noise: float
    """Standard deviation of (i - l)/i below the fit, where no highlight can be."""
    starts: tuple[tuple[int, int, int], ...]
    """Choices of base images, best first."""
    coefficients: NDArray[np.float64] | None
    """(K,3) of the provisional linearization; None where none was needed."""


def suggest_thresholds(
    sample: Sample,
    options: Options,
    lights: NDArray[np.float64] | None = None,
    cancel: Cancel | None = None,
) -> Suggestion:
    """Thresholds for a stack; T or Ts given in `options` are kept.

    Ts is where the dark mode of the histogram has fallen to the level of the grays above it. T is
    three times the noise seen on the negative side (i < l) of D residuals, where highlights cannot
    be, after two provisional linearizations.

    Args:
        lights: (K,3) where known; coefficients are then not estimated.

    Raises:
        DegenerateError: the images do not determine coefficients.
    """
    histogram, bin_width = dark_histogram(sample.images)
    Ts = bin_width * shadow_bins(histogram) if options.Ts is None else options.Ts
    starts = find_starts(sample, Ts, options, lights)
    noise, T, found = 0.0, FIRST_T if options.T is None else options.T, None
    for _ in range(2 if options.T is None else 0):
        now = Thresholds(T, Ts)
        found = provisional(sample, starts, now, options, lights, found, cancel)
        noise = lower_noise(sample.images, found.coefficients, found.bases, now)
        T = float(np.clip(3 * noise, MIN_T, MAX_T))
    T = round(T, 4) if options.T is None else T
    Ts = round(Ts, 4) if options.Ts is None else Ts
    return Suggestion(
        Thresholds(T, Ts),
        histogram,
        bin_width,
        noise,
        tuple(starts),
        None if found is None else found.coefficients,
    )


def provisional(
    sample: Sample,
    starts: list[tuple[int, int, int]],
    thresholds: Thresholds,
    options: Options,
    lights: NDArray[np.float64] | None,
    last: Factorization | None,
    cancel: Cancel | None,
) -> Factorization:
    """A factorization good enough to read the noise off, from the last one where there is one."""
    seed, limit = options.seed, options.samples
    if lights is not None:
        c = orthogonalize(lights)
        bases, _ = fit_bases(sample, c, thresholds.T, thresholds.Ts, seed, limit)
        return Factorization(c, bases, 0)
    if last is None:
        rough = search_coefficients(sample, starts, thresholds, seed, limit, cancel)
    else:
        rough = last.coefficients
    return refine_coefficients(sample, rough, thresholds, seed, limit, cancel)


def find_starts(
    sample: Sample, Ts: float, options: Options, lights: NDArray[np.float64] | None
) -> list[tuple[int, int, int]]:
    """The base images given, or the best few choices."""
    if options.base_images is not None:
        return [options.base_images]
    return choose_bases(sample, Ts, options.seed, lights, count=6)


def dark_histogram(images: NDArray[np.float32]) -> tuple[NDArray[np.float64], float]:
    """Histogram of the darker half of the grays, one row of `images` an image, and its bin width.

    A shadow level is common to the images; a plane lit at a grazing angle makes a peak in one
    image. So the two fullest images of each bin do not count.
    """
    bin_width = float(np.quantile(images, 0.99)) / LEVELS
    bins = np.arange(LEVELS // 2 + 1) * bin_width
    # exact zeros are left out: noise clipped at zero piles up there and hides the mode's width
    rows = [np.histogram(image[image > 0], bins)[0] for image in images]
    return np.sort(rows, axis=0)[:-2].sum(axis=0).astype(np.float64), bin_width


def shadow_bins(histogram: NDArray[np.float64]) -> int:
    """How many bins of `dark_histogram` the shadows fill; FLOOR where they are exactly dark."""
    smooth = np.convolve(np.pad(histogram, 2, mode="edge"), SMOOTHING, mode="valid")
    grays = np.median(smooth[GRAYS])
    peak = int(np.argmax(smooth[:CEILING]))
    if smooth[peak] <= 2 * grays:
        return FLOOR
    above = np.flatnonzero(smooth[peak:CEILING] <= 1.25 * grays)
    return peak + int(above[0]) + 1 if above.size else CEILING


def lower_noise(
    images: NDArray[np.float32],
    coefficients: NDArray[np.float64],
    bases: NDArray[np.float32],
    thresholds: Thresholds,
) -> float:
    """Standard deviation of (i - l)/i among D observations with i < l."""
    l = coefficients.astype(np.float32) @ bases
    with np.errstate(invalid="ignore", divide="ignore"):
        short = (l - images) / images
    short = short[(images >= thresholds.Ts) & (short > 0) & (short <= thresholds.T)]
    if len(short) == 0:
        return 0.0
    # the median of a half-normal is 0.6745 standard deviations
    return float(np.median(short) / 0.6745)
