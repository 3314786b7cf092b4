"""Whether a stack really has three dimensions, or lights in a plane or a flat scene give two."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .factorize import Factorization
from .factors import Thresholds
from .sample import Sample

PAIRS = 60
FEW = 150
"""Pixels on which planes are compared."""
ROUNDS = 20
LEAST_NOISE = 1e-4
"""As a share of the brightest observation: no camera is better."""


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
    T, c, X = thresholds.T, found.coefficients, sample.pixels.astype(np.float64)
    b = found.bases.T.astype(np.float64)
    with np.errstate(invalid="ignore"):
        near = np.abs(X - b @ c.T) <= T * X
    diffuse = near & (thresholds.Ts <= X) & (X > 0)
    some = diffuse.sum(axis=1) >= 4
    if not some.any():
        return None
    b, X, diffuse = b[some], X[some], diffuse[some]
    noise = max(found.noise.absolute, LEAST_NOISE * float(X.max()))
    step = max(1, len(b) // FEW)
    few = X[::step], diffuse[::step]
    # bases themselves may lie anywhere along a dimension that is not there: what counts is the fit
    first = max(pair_planes(b), key=lambda axes: drop_third(*few, c @ axes, T)[0])
    planes = first, settle_plane(b, first, noise)
    explained, residual = max(drop_third(X, diffuse, c @ axes, T) for axes in planes)
    return Plane(explained, residual / noise)


def drop_third(
    X: NDArray[np.float64], diffuse: NDArray[np.bool_], c: NDArray[np.float64], T: float
) -> tuple[float, float]:
    """Share of D observations X (M,K) within T of a fit by c (K,2), and the pixels' median rms."""
    gram = (diffuse @ (c[:, :, None] * c[:, None, :]).reshape(-1, 4)).reshape(-1, 2, 2)
    # lights along a line leave one of the two open; what is added moves no residual by its noise
    gram += 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    v = np.linalg.solve(gram, ((diffuse * X) @ c)[..., None])[..., 0]
    excess = np.where(diffuse, X - v @ c.T, 0)
    rms = np.sqrt((excess**2).sum(axis=1) / (diffuse.sum(axis=1) - 2))
    explained = (np.abs(excess) <= T * X) & diffuse
    return float(explained.sum() / diffuse.sum()), float(np.median(rms))


def pair_planes(b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,3,2) orthonormal directions of planes through 0 and two of the points b (M,3)."""
    pairs = np.random.default_rng(0).integers(len(b), size=(PAIRS, 2))
    return np.linalg.svd(b[pairs].transpose(0, 2, 1), full_matrices=False)[0]


def settle_plane(
    b: NDArray[np.float64], axes: NDArray[np.float64], noise: float
) -> NDArray[np.float64]:
    """(3,2) the plane of least absolute distance from points b, from that of `axes` (3,2)."""
    normal = np.cross(*axes.T)
    whole = np.empty((3, 3))
    for _ in range(ROUNDS):
        weight = 1 / np.maximum(np.abs(b @ normal), noise / 3)
        whole = np.linalg.eigh((b * weight[:, None]).T @ b)[1]
        normal = whole[:, 0]
    return whole[:, 1:]
