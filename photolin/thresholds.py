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

MIN_TS = 0.003
"""Below this a Ts would tell nothing: 16-bit rounding and grazing light look alike."""
MIN_T, MAX_T = 0.008, 0.12
FIRST_T = 0.05
STEP = 0.0005
LEVELS = 512
"""Histogram bins over full scale when looking for the shadow level."""
SMOOTHING = np.array([1, 4, 6, 4, 1]) / 16


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Suggested thresholds with the evidence."""

    thresholds: Thresholds
    histogram: NDArray[np.float64]
    """(LEVELS//4,) observations in bins of 1/LEVELS of full scale from 0, single images' own peaks
    left out."""
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
    histogram = dark_histogram(sample.images)
    Ts = shadow_level(histogram) if options.Ts is None else options.Ts
    starts = find_starts(sample, Ts, options, lights)
    noise, T, found = 0.0, FIRST_T if options.T is None else options.T, None
    for _ in range(2 if options.T is None else 0):
        now = Thresholds(T, Ts)
        found = provisional(sample, starts, now, options, lights, found, cancel)
        noise = lower_noise(sample.images, found.coefficients, found.bases, now)
        T = float(np.clip(3 * noise, MIN_T, MAX_T))
    T = round_to_step(T) if options.T is None else T
    Ts = round_to_step(Ts) if options.Ts is None else Ts
    return Suggestion(
        Thresholds(T, Ts),
        histogram,
        noise,
        tuple(starts),
        None if found is None else found.coefficients,
    )


def round_to_step(threshold: float) -> float:
    """A threshold on the grid that sliders move on, so that what is suggested can be set by hand."""
    return round(round(threshold / STEP) * STEP, 4)


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


def dark_histogram(images: NDArray[np.float32]) -> NDArray[np.float64]:
    """Histogram of positive observations below a quarter of full scale, one row an image.

    A shadow level is common to the images; a plane lit at a grazing angle makes a peak in one
    image. So the two fullest images of each bin do not count.
    """
    bins = np.arange(LEVELS // 4 + 1) / LEVELS
    # exact zeros are left out: noise clipped at zero piles up there and hides the mode's width
    rows = [np.histogram(image[image > 0], bins)[0] for image in images]
    return np.sort(rows, axis=0)[:-2].sum(axis=0).astype(np.float64)


def shadow_level(histogram: NDArray[np.float64]) -> float:
    """Ts from `dark_histogram`; MIN_TS where shadows are exactly dark."""
    smooth = np.convolve(np.pad(histogram, 2, mode="edge"), SMOOTHING, mode="valid")
    grays = 1.5 * np.median(smooth[LEVELS // 10 :])
    peak = int(np.argmax(smooth[: LEVELS // 12]))
    if smooth[peak] <= 2 * grays:
        return MIN_TS
    above = np.flatnonzero(smooth[peak:] <= grays)
    return max(MIN_TS, (peak + int(above[0])) / LEVELS)


def lower_noise(
    images: NDArray[np.float32],
    coefficients: NDArray[np.float64],
    bases: NDArray[np.float32],
    thresholds: Thresholds,
) -> float:
    """Standard deviation of (i - l)/i among D observations with i < l."""
    l = coefficients.astype(np.float32) @ bases  # noqa: E741
    with np.errstate(invalid="ignore", divide="ignore"):
        short = (l - images) / images
    short = short[(images >= thresholds.Ts) & (short > 0) & (short <= thresholds.T)]
    if len(short) == 0:
        return 0.0
    # the median of a half-normal is 0.6745 standard deviations
    return float(np.median(short) / 0.6745)
