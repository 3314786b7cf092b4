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
DEVIATIONS = 3.0
"""Ts above the middle of sampled shadows, in standard deviations."""
COVERED = 0.95
"""Share of sampled shadows that lie below Ts in any case; what is brighter may be lit pixels among
them, and does not widen their spread."""
MEAN_ABOVE = 0.6573
"""Mean of a normal distribution between its middle and COVERED of it, in standard deviations."""
HALF_STEP = 2.0**-17
"""Half a gray level of 16 bits: Ts above the brightest shadow where nothing says how far."""
BELOW_FULL = 1 - 2.0**-24
"""The highest Ts."""
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
    """Ts above sampled shadows, and below sampled lit pixels."""

    Ts: float
    """Fraction of full scale, in [0, 1)."""
    error: float
    """Share of the samples on the wrong side, each kind counted alike; 0 to 1."""


def sample_shadow_level(
    shadows: NDArray[np.floating], lit: NDArray[np.floating] | None = None
) -> ShadowLevel:
    """Ts the paper's way: from pixels that someone points out as shadow, and as lit.

    The paper: "The threshold Ts [...] can be determined by manually sampling some pixels in shadow
    regions" (below Eq. 3); how is left open. Here the level that shadows give alone is DEVIATIONS
    above their middle, and above COVERED of them. With lit pixels it is the level nearest to that
    among those with the smallest share of samples on the wrong side, within one standard error, as
    the samples tell no better. Where the kinds leave a gap that is close above the shadows: pixels
    dimmer than those pointed out as lit stay lit.

    Args:
        shadows: sampled intensities in shadow, fraction of full scale; at least one.
        lit: sampled intensities in light.

    Raises:
        OptionError: no shadow is sampled, or something that is no intensity.
    """
    dark = np.asarray(shadows, np.float64).ravel()
    bright = np.asarray([] if lit is None else lit, np.float64).ravel()
    if dark.size == 0:
        raise OptionError("no shadow pixel is sampled; at least one is needed for Ts")
    if not all(((kind >= 0) & (kind <= 1)).all() for kind in (dark, bright)):
        raise OptionError(
            "a sampled intensity lies outside 0 to 1 or is not a number; "
            "fractions of full scale, 0 to 1, are accepted"
        )
    aim = _aim(dark)
    if bright.size == 0:
        level = min(aim, BELOW_FULL)
        return ShadowLevel(float(level), float((dark >= level).mean()))
    return _part(dark, bright, aim)


def _aim(dark: NDArray[np.float64]) -> float:
    """The level that shadows give alone.

    Their spread is read above their middle alone, where noise is not clipped at black.
    """
    middle, covering = np.quantile(dark, 0.5), np.quantile(dark, COVERED, method="higher")
    above = dark[(dark > middle) & (dark <= covering)]
    deviation = (above.mean() - middle) / MEAN_ABOVE if above.size else 0.0
    return float(max(middle + DEVIATIONS * deviation, covering + HALF_STEP))


def _part(dark: NDArray[np.float64], bright: NDArray[np.float64], aim: float) -> ShadowLevel:
    """Of the levels with nearly the smallest error the one nearest to `aim`."""
    # an observation is shadow when i < Ts: the levels in (low, high] part the samples alike
    values = np.unique(np.concatenate([dark, bright]))
    low = np.concatenate([[-np.inf], values])
    high = np.concatenate([values, [np.inf]])
    missed = 1 - np.searchsorted(np.sort(dark), high, side="left") / dark.size
    lost = np.searchsorted(np.sort(bright), high, side="left") / bright.size
    error = (missed + lost) / 2
    spread = np.sqrt(missed * (1 - missed) / dark.size + lost * (1 - lost) / bright.size) / 2
    least = np.argmin(error)
    near = error <= error[least] + spread[least] + 1e-12
    low, high, error = low[near], high[near], error[near]
    levels = np.clip(aim, low + np.minimum(HALF_STEP, (high - low) / 2), high)
    nearest = np.argmin(np.abs(levels - aim))
    return ShadowLevel(float(min(levels[nearest], BELOW_FULL)), float(error[nearest]))
