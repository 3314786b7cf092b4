"""Whether a stack really has three dimensions, or lights in a plane or a flat scene give two."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .factorize import Factorization
from .factors import Thresholds
from .sample import Sample

ROUNDS = 20
LEAST_NOISE = 1e-6
"""Rounding, as a share of the brightest observation."""


@dataclass(frozen=True)
class Plane:
    """How well two dimensions do what three do."""

    explained: float
    """Share of the D observations that stay within T of the fit without the third dimension."""
    residual: float
    """Median over pixels of the rms residual of D observations then, in units of the noise."""


def fit_plane(sample: Sample, found: Factorization, thresholds: Thresholds) -> Plane | None:
    """Fit the D observations of each sampled pixel again, with two of the three dimensions.

    Where noise or a few highlights make up the third dimension, most pixels do not need it.

    Returns:
        None where no pixel has four D observations.
    """
    b, X = found.bases.T.astype(np.float64), sample.pixels.astype(np.float64)
    with np.errstate(invalid="ignore"):
        near = np.abs(X - b @ found.coefficients.T) <= thresholds.T * X
    diffuse = near & (thresholds.Ts <= X) & (X > 0)
    some = diffuse.sum(axis=1) >= 4
    if not some.any():
        return None
    b, X, diffuse = b[some], X[some], diffuse[some]
    noise = max(found.noise.absolute, LEAST_NOISE * float(X.max()))
    c = found.coefficients @ span_plane(b, noise)
    gram = (diffuse @ (c[:, :, None] * c[:, None, :]).reshape(-1, 4)).reshape(-1, 2, 2)
    # lights along a line leave one of the two open; what is added moves no residual by its noise
    gram += 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    v = np.linalg.solve(gram, ((diffuse * X) @ c)[..., None])[..., 0]
    excess = np.where(diffuse, X - v @ c.T, 0)
    rms = np.sqrt((excess**2).sum(axis=1) / (diffuse.sum(axis=1) - 2))
    explained = (np.abs(excess) <= thresholds.T * X) & diffuse
    return Plane(float(explained.sum() / diffuse.sum()), float(np.median(rms)) / noise)


def span_plane(b: NDArray[np.float64], noise: float) -> NDArray[np.float64]:
    """(3,2) orthonormal directions of the plane through 0 nearest to points b (M,3).

    By least absolute distance, which a few wild points do not turn: weights are one over the
    distance, and followed by iteration.
    """
    weight = 1 / np.maximum(np.linalg.norm(b, axis=1), noise)
    axes = np.eye(3)
    for _ in range(ROUNDS):
        axes = np.linalg.eigh((b * weight[:, None]).T @ b)[1]
        weight = 1 / np.maximum(np.abs(b @ axes[:, 0]), noise / 3)
    return axes[:, 1:]
