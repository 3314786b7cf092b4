"""Whether the lights are near: then each part of the picture has lights of its own."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .factorize import Factorization, orthogonalize
from .factors import Thresholds
from .refine import change_of_span, gauss_newton_step, weigh
from .sample import Sample

T = 0.03
"""Least tolerance of D here: near lights must not drop out before they are seen."""
STEPS = 2
WORTH = 1.2
"""Degrees by which the lights of a quarter differ from those of all when it is worth a word."""
LEAST_PIXELS = 100


@dataclass(frozen=True)
class Regions:
    """How much the coefficients depend on where they are estimated."""

    quarters: float
    """Median angle, degrees, between the coefficients of a quarter of the picture and of all."""
    control: float
    """The same for quarters of the pixels that are spread over the picture: what noise does. 0,
    not measured, where `quarters` is below WORTH."""


def compare_regions(
    sample: Sample, rows: NDArray, columns: NDArray, found: Factorization, thresholds: Thresholds
) -> Regions | None:
    """Estimate coefficients again from each quarter of the picture, up to the 3x3 ambiguity.

    Distant lights give the same everywhere. After Sato et al., who use the difference to find
    the positions of near lights.

    Args:
        rows, columns: (M,) of the sampled pixels.

    Returns:
        None where a quarter has too few pixels.
    """
    width = max(2 * found.noise.relative, T / 3)
    tolerance = max(thresholds.T, T)
    everywhere = np.full(found.bases.shape[1], np.iinfo(np.int32).max, np.int32)
    weights = weigh(
        sample, found.coefficients, found.bases, everywhere, tolerance, thresholds.Ts, width
    )
    X = sample.pixels
    place = (rows > np.median(rows)) * 2 + (columns > np.median(columns))
    telling = place[weights.any(axis=1)]
    if np.bincount(telling, minlength=4).min() < LEAST_PIXELS:
        return None

    def angle(chosen: NDArray) -> float:
        c = found.coefficients
        for _ in range(STEPS):
            c = orthogonalize(gauss_newton_step(X[chosen], weights[chosen], c))
        return float(np.degrees(change_of_span(found.coefficients, c)))

    quarters = float(np.median([angle(place == quarter) for quarter in range(4)]))
    if quarters < WORTH:
        return Regions(quarters, 0.0)
    spread = np.arange(len(rows)) % 4
    return Regions(quarters, float(np.median([angle(spread == part) for part in range(4)])))
