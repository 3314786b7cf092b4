"""Ts from gray levels alone: the shadows of a histogram, or pixels that someone points out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import OptionError

LEVELS = 256
"""Histogram bins from black to the brightest grays when looking for the shadow level."""
FLOOR = 1.0
"""Bins that Ts spans where no shadow level is seen: below, grazing light looks like shadows."""
BLACK, BLACK_FLOOR = 0.01, 0.3
"""Share of observations that are exactly 0 from which shadows are black, and the bins then."""
CEILING = 24
"""Bins that Ts spans at most: what falls off more slowly is a dark surface, not a shadow level."""
SPREAD = 3.8
"""Ts above the shadows' level, in standard deviations of the noise there."""
GRAYS = slice(32, 96)
"""Bins whose level the dark mode has to rise from: beyond shadows, still dark."""
SMOOTHING = np.array([1, 4, 6, 4, 1]) / 16


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


def offset_bins(histogram: NDArray[np.float64], blacks: int) -> float:
    """Bins of `dark_histogram` below the shadows' own level: light that all images share.

    Shadows around a level that is not zero leave the bins below it empty, and no observation is
    exactly black; noise clipped at zero makes nearly half of them so.

    Args:
        blacks: observations that are exactly 0.
    """
    smooth = np.convolve(np.pad(histogram, 2), SMOOTHING, mode="valid")
    grays = np.median(smooth[GRAYS])
    peak = int(np.argmax(smooth[:CEILING]))
    below = smooth[: max(peak - 1, 0)]
    if smooth[peak] <= 2 * grays or not below.size or below.min() > 0.5 * smooth[peak]:
        return 0.0
    return 0.0 if blacks > 0.2 * histogram[: 2 * peak + 1].sum() else peak + 0.5


def shadow_bins(histogram: NDArray[np.float64], black: float = 0.0) -> float:
    """How many bins of `dark_histogram` the shadows fill; FLOOR or BLACK_FLOOR where none is seen.

    At least SPREAD standard deviations of the dark mode: where shadows are few, the tail of their
    noise is lost among the grays.

    Args:
        black: share of the observations that are exactly 0, which the histogram leaves out.
    """
    smooth = np.convolve(np.pad(histogram, 2, mode="edge"), SMOOTHING, mode="valid")
    grays = np.median(smooth[GRAYS])
    peak = int(np.argmax(smooth[:CEILING]))
    if smooth[peak] <= 2 * grays:
        return BLACK_FLOOR if black > BLACK else FLOOR
    above = np.flatnonzero(smooth[peak:CEILING] <= 1.25 * grays)
    if not above.size:
        return CEILING
    rise = smooth[peak:CEILING] - grays
    ends = np.flatnonzero(rise <= 0)
    # the area of half a normal distribution is 1.2533 deviations high; SMOOTHING adds one bin
    area = rise[: ends[0] if ends.size else None].sum() / rise[0] - 0.5
    deviation = np.sqrt(max((area / 1.2533) ** 2 - 1, 0.0))
    # shadows with a level of their own stand out on both sides
    spread = SPREAD * deviation if peak <= 2 else 0.0
    return float(min(peak + max(above[0] + 1, spread), CEILING))


@dataclass(frozen=True)
class ShadowLevel:
    """Ts between sampled shadows and sampled lit pixels."""

    Ts: float
    """Fraction of full scale."""
    error: float
    """Share of the samples on the wrong side, each kind counted alike; 0 to 1."""


def sample_shadow_level(
    shadows: NDArray[np.floating], lit: NDArray[np.floating] | None = None
) -> ShadowLevel:
    """Ts the paper's way: from pixels that someone points out as shadow, and as lit.

    With both, the level that puts the smallest share on the wrong side, in the middle of the
    levels that do so equally; with shadows alone, three of their standard deviations above their
    mean, at least their maximum.

    Args:
        shadows: sampled intensities in shadow, fraction of full scale; at least one.
        lit: sampled intensities in light.

    Raises:
        OptionError: no shadow is sampled.
    """
    dark = np.sort(np.asarray(shadows, np.float64).ravel())
    if dark.size == 0:
        raise OptionError("no shadow pixel is sampled; at least one is needed for Ts")
    bright = np.sort(np.asarray([] if lit is None else lit, np.float64).ravel())
    if bright.size == 0:
        return ShadowLevel(float(max(dark.mean() + 3 * dark.std(), np.nextafter(dark[-1], 1))), 0.0)
    # an observation is shadow when i < Ts: the candidates lie between neighbouring samples
    values = np.unique(np.concatenate([dark, bright]))
    levels = np.concatenate(
        [[values[0]], (values[1:] + values[:-1]) / 2, [np.nextafter(values[-1], 2)]]
    )
    wrong_dark = 1 - np.searchsorted(dark, levels, side="left") / dark.size
    wrong_lit = np.searchsorted(bright, levels, side="left") / bright.size
    error = (wrong_dark + wrong_lit) / 2
    best = np.flatnonzero(error == error.min())
    return ShadowLevel(float(levels[best[len(best) // 2]]), float(error.min()))
