"""T and Ts from the data: the shadow level, and the noise that D observations show."""

from dataclasses import dataclass
from math import floor, log10

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
from .refine import follow_noise, measure_noise, refine_coefficients
from .sample import Sample, draw_sample
from .saturation import find_white
from .shadow_level import BELOW_FULL, dark_histogram, offset_bins, shadow_bins
from .stack import ImageStack

FIRST_T = 0.05
CLEAR = 2.5
"""Ts above clipped noise, in its standard deviations: the best trade for dim diffuse pixels."""
DEEP, FEWEST_DEEP = 0.05, 100
"""How far below 0 an attached shadow is, as a share of the brightest grays, to be one for sure,
and how many of these show the noise."""
DEEP_SHARE = 0.001
"""Share of the observations that have to be so for their level to be told."""
COVERED = 0.95
"""Share of them that lie below it; and of the diffuse observations, above it."""
LOUD = 0.1
"""Such noise, as a share of the brightest grays, from which it is the fit that is wrong."""
ONE_SIDED = 0.1
"""Median of noise that is clipped at 0, in standard deviations; light from elsewhere has more."""


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Suggested thresholds with the evidence."""

    thresholds: Thresholds
    histogram: NDArray[np.float64]
    """(LEVELS/2,) observations in bins of `bin_width` from 0, single images' own peaks left out."""
    bin_width: float
    """Fraction of full scale."""
    offset: float
    """Gray level of the darkest shadows, fraction of full scale; 0 where they are black."""
    starts: tuple[tuple[int, int, int], ...]
    """Choices of base images, best first."""
    found: Factorization | None
    """The linearization of the sample that shows the noise; None where nothing asked for it."""


def suggest_thresholds(
    stack: ImageStack, options: Options | None = None, cancel: Cancel | None = None
) -> Suggestion:
    """Thresholds for a stack, with the evidence; T or Ts given in `options` are kept.

    Raises:
        DegenerateError: the images do not determine coefficients.
        Cancelled: `cancel` returned true.
    """
    options = options or Options()
    sample = draw_sample(stack, options.seed, find_white(stack))
    return suggest_from_sample(sample, options, stack.lights, cancel)


def suggest_from_sample(
    sample: Sample,
    options: Options,
    lights: NDArray[np.float64] | None = None,
    cancel: Cancel | None = None,
) -> Suggestion:
    """Thresholds for the stack of a sample; T or Ts given in `options` are kept.

    Ts is where the dark mode of the histogram has fallen to the level of the grays above it, and
    above the noise and the light from elsewhere that attached shadows show after linearizing the
    sample. T lets pass all but the
    tail of the residuals seen below the fit (i < l), where highlights cannot be.

    Args:
        lights: (K,3) where known; coefficients are then not estimated.

    Raises:
        DegenerateError: the images do not determine coefficients.
    """
    histogram, bin_width = dark_histogram(sample.images)
    blacks = int((sample.images <= 0).sum())
    bins = shadow_bins(histogram, blacks / sample.images.size)
    Ts = options.Ts if options.Ts is not None else shorten(bin_width * bins)
    starts = find_starts(sample, Ts, options, lights)
    T, found = options.T, None
    if T is None or options.method == "robust":
        found = linearize_sample(sample, starts, Ts, options, lights, cancel)
        dark = max(
            CLEAR * clipped_noise(sample.images, found), scattered_light(sample.images, found)
        )
        if options.Ts is None and dark > Ts:
            Ts = shorten_above(dark)
            starts = find_starts(sample, Ts, options, lights)
            found = linearize_sample(sample, starts, Ts, options, lights, cancel)
    if T is None:
        assert found is not None
        T = round(follow_noise(found.noise), 4)
    offset = bin_width * offset_bins(histogram, blacks)
    return Suggestion(Thresholds(T, Ts), histogram, bin_width, offset, tuple(starts), found)


def linearize_sample(
    sample: Sample,
    starts: list[tuple[int, int, int]],
    Ts: float,
    options: Options,
    lights: NDArray[np.float64] | None,
    cancel: Cancel | None,
) -> Factorization:
    """Coefficients (those of the lights, where known) and bases of the sample, and the noise.

    The tolerance follows the noise, whatever `options.T` is: a T that calls noise undefined would
    only hide what the observations say of the coefficients.
    """
    seed, limit = options.seed, options.samples
    if lights is None:
        first = Thresholds(FIRST_T, Ts)
        rough = search_coefficients(sample, starts, first, seed, limit, cancel)
        return refine_coefficients(sample, rough, Ts, seed, limit, cancel)
    c = orthogonalize(lights)

    def at(tolerance: float) -> Factorization:
        bases, score = fit_bases(sample, c, tolerance, Ts, seed, limit)
        noise = measure_noise(sample.images, c, bases, tolerance, Ts)
        return Factorization(c, bases, int(score[score > 0].sum()), noise)

    return at(follow_noise(at(FIRST_T).noise))


def clipped_noise(images: NDArray[np.float32], found: Factorization) -> float:
    """Standard deviation of noise in deep attached shadows, where it is clipped at black; else 0.

    Half of it is then black. Broad noise has no mode in the histogram of all grays; these show it.

    Args:
        images: (K,M)
    """
    _, deep, bright = split_deep(images, found)
    if deep.size < FEWEST_DEEP:
        return 0.0
    middle, upper = np.quantile(deep, (0.5, 0.8413))
    return float(upper) if middle <= ONE_SIDED * upper and upper < LOUD * bright else 0.0


def scattered_light(images: NDArray[np.float32], found: Factorization) -> float:
    """The level below which deep attached shadows lie, however bright light from elsewhere makes
    them; 0 where they are too few, or as bright as what is lit: then it is the fit that is wrong.

    A surface turned away from the light gets light from other surfaces and from the room, which
    the fit takes for none: by it alone, such pixels are undefined wherever they are above Ts.

    Args:
        images: (K,M)
    """
    l, deep, _ = split_deep(images, found)
    if deep.size < max(FEWEST_DEEP, DEEP_SHARE * images.size):
        return 0.0
    lit = images[(l > 0) & (np.abs(images - l) <= FIRST_T * images)]
    level = float(np.quantile(deep, COVERED))
    return level if lit.size and level <= np.quantile(lit, 1 - COVERED) else 0.0


def split_deep(
    images: NDArray[np.float32], found: Factorization
) -> tuple[NDArray[np.float32], NDArray[np.float32], float]:
    """Linearized values (K,M), the observations in deep attached shadows, the brightest grays."""
    l = found.coefficients.astype(np.float32) @ found.bases
    bright = float(np.quantile(images, 0.99))
    return l, images[l < -DEEP * bright], bright


def find_starts(
    sample: Sample, Ts: float, options: Options, lights: NDArray[np.float64] | None
) -> list[tuple[int, int, int]]:
    """The base images given, or the best few choices."""
    if options.base_images is not None:
        return [options.base_images]
    return choose_bases(sample, Ts, options.seed, lights, count=6)


def shorten(level: float) -> float:
    """Rounded to four decimals, or to two digits where that is finer, as on very dark stacks."""
    return float(round(level, _decimals(level))) if level > 0 else 0.0


def shorten_above(level: float) -> float:
    """The same, upwards and never the level itself: grays that have it are below the result.

    Less than 1, as Ts is.
    """
    decimals = _decimals(level)
    # a tenth of a step apart at least, which single precision tells
    steps = floor(level * 10**decimals + 0.1) + 1
    return min(float(round(steps / 10**decimals, decimals)), BELOW_FULL)


def _decimals(level: float) -> int:
    return max(4, 1 - floor(log10(level)))
