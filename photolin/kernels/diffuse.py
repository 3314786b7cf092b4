"""Least squares on the D observations of every pixel."""

import numpy as np
from numba import njit

from .consensus import _solve
from .pooled import _sum_up

PLANE = 1e-6
"""Determinant of the normal equations, relative to their diagonal, below which the lights of the
observations lie in a plane."""


@njit(nogil=True, cache=True)
def _take(x, labels, white, u, y):  # pragma: no cover
    """u = 1 for the D observations of some pixels in one image, y = u x."""
    for p in range(len(x)):
        u[p] = np.float64((labels[p] == 1) & (x[p] < white))
        y[p] = u[p] * x[p]


@njit(nogil=True, cache=True)
def diffuse_rows(X, labels, A, white, out, start, stop):  # pragma: no cover
    """Fit pixels start..stop to their D observations alone.

    Args:
        X: (K,N) float32 observations.
        labels: (K,N) uint8 Factor codes.
        A: (3,K) float64 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        out: (3,N) float64, written; NaN where D are fewer than three or their lights in a plane.
    """
    n = stop - start
    total, u, y = np.zeros((10, n)), np.empty(n), np.empty(n)
    for k in range(len(X)):
        _take(X[k, start:stop], labels[k, start:stop], white[k], u, y)
        _sum_up(total, u, y, A[:, k].copy())
    w = np.empty(3)
    for p in range(n):
        g = total[:, p]
        good = g[9] >= 3 and _solve(g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], g[8], PLANE, w)
        for c in range(3):
            out[c, start + p] = w[c] if good else np.nan
