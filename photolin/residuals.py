"""T from what a result leaves below the fit, where no highlight can be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .analysis import Analysis
from .refine import follow_noise, measure_noise
from .sample import choose_pixels
from .stack import ImageStack

OBSERVATIONS = 200_000
"""Observations, about, that are looked at."""


@dataclass(frozen=True, eq=False)
class Residuals:
    """Lit observations darker than the fit, and the T that they stand for."""

    values: NDArray[np.float32]
    """(N,) (l - i)/i, above 0; read-only."""
    T: float
    """By the rule of `suggest_thresholds`, for these pixels and this result."""

    def passed(self, T: float) -> float:
        """Share of them that a T takes for diffuse, 0 to 1; NaN without any."""
        return float((self.values <= T).mean()) if self.values.size else float("nan")


def measure_residuals(
    stack: ImageStack, analysis: Analysis, Ts: float, most: int = OBSERVATIONS
) -> Residuals:
    """Residuals of lit observations below the fit: light can only be added, so they are noise.

    Args:
        Ts: shadow level, fraction of full scale.
        most: about as many observations are looked at, at least one pixel in all images.
    """
    pixels = choose_pixels(stack, analysis.options.seed, max(1, most // len(stack.images)))
    pixels = pixels[analysis.determined().ravel()[pixels]]
    i = stack.images.reshape(len(stack.images), -1)[:, pixels]
    bases = analysis.linearized_bases.reshape(3, -1)[:, pixels]
    l = analysis.coefficients.astype(np.float32) @ bases
    below = (i >= max(Ts, 1e-9)) & (l > i)
    values = (l[below] - i[below]) / i[below]
    values.setflags(write=False)
    noise = measure_noise(i, analysis.coefficients, bases, analysis.thresholds.T, max(Ts, 1e-9))
    return Residuals(values, round(follow_noise(noise), 4))
