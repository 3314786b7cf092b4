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
    search_coefficients,
)
from .factors import Thresholds
from .refine import follow_noise, lower_noise, refine_coefficients
from .sample import Sample

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
    """(K,3) of the provisional linearization; None where T was given."""


def suggest_thresholds(
    sample: Sample,
    options: Options,
    lights: NDArray[np.float64] | None = None,
    cancel: Cancel | None = None,
) -> Suggestion:
    """Thresholds for a stack; T or Ts given in `options` are kept.

    Ts is where the dark mode of the histogram has fallen to the level of the grays above it. T is
    a multiple of the noise seen on the negative side (i < l) of D residuals, where highlights
    cannot be, after a provisional linearization.

    Args:
        lights: (K,3) where known; coefficients are then not estimated.

    Raises:
        DegenerateError: the images do not determine coefficients.
    """
    histogram, bin_width = dark_histogram(sample.images)
    Ts = options.Ts if options.Ts is not None else round(bin_width * shadow_bins(histogram), 4)
    starts = find_starts(sample, Ts, options, lights)
    T, found = options.T, None
    if T is None:
        found = provisional(sample, starts, Ts, options, lights, cancel)
        T = round(follow_noise(found.noise), 4)
    return Suggestion(
        Thresholds(T, Ts),
        histogram,
        bin_width,
        0.0 if found is None else found.noise,
        tuple(starts),
        None if found is None else found.coefficients,
    )


def provisional(
    sample: Sample,
    starts: list[tuple[int, int, int]],
    Ts: float,
    options: Options,
    lights: NDArray[np.float64] | None,
    cancel: Cancel | None,
) -> Factorization:
    """A factorization with the noise that shows in it."""
    seed, limit = options.seed, options.samples
    if lights is None:
        first = Thresholds(FIRST_T, Ts)
        rough = search_coefficients(sample, starts, first, seed, limit, cancel)
        return refine_coefficients(sample, rough, None, Ts, seed, limit, cancel)
    c = orthogonalize(lights)

    def at(T: float) -> Factorization:
        bases, score = fit_bases(sample, c, T, Ts, seed, limit)
        noise = lower_noise(sample.images, c, bases, T, Ts)
        return Factorization(c, bases, int(score[score > 0].sum()), noise)

    return at(follow_noise(at(FIRST_T).noise))


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
