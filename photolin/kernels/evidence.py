"""How much each pixel's linearized bases rest on."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def _count(x, labels, Ts, white, c, n, d, g):  # pragma: no cover
    """Add one image's lit and D observations of some pixels to counts and sums."""
    c0, c1, c2 = c[0], c[1], c[2]
    zero, one = np.float32(0), np.float32(1)
    g00, g01, g02, g11, g12, g22 = g[0], g[1], g[2], g[3], g[4], g[5]
    for p in range(len(x)):
        n[p] += np.uint16((x[p] >= Ts) & (x[p] < white))
        d[p] += np.uint16(labels[p] == 1)
    a00, a01, a02, a11, a12, a22 = c0 * c0, c0 * c1, c0 * c2, c1 * c1, c1 * c2, c2 * c2
    for p in range(len(x)):
        u = one if labels[p] == 1 else zero
        g00[p] += u * a00
        g01[p] += u * a01
        g02[p] += u * a02
    for p in range(len(x)):
        u = one if labels[p] == 1 else zero
        g11[p] += u * a11
        g12[p] += u * a12
        g22[p] += u * a22


@njit(nogil=True, cache=True)
def evidence_rows(X, labels, A, white, Ts, lit, diffuse, spread, start, stop):  # pragma: no cover
    """Count lit and D observations of pixels start..stop, and how far apart their lights are.

    Args:
        X: (K,N) float32 observations.
        labels: (K,N) uint8 Factor codes.
        A: (3,K) float32 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        Ts: float32 shadow level.
        lit, diffuse: (N,) uint16, written.
        spread: (N,) float32, written: determinant of the D observations' mean c c^T over the cube
            of a third of its trace; 1 for lights evenly spread, 0 for lights in a plane.
    """
    # slices indexed from 0 become vector instructions, start + p does not
    n, d, out = lit[start:stop], diffuse[start:stop], spread[start:stop]
    n[:] = 0
    d[:] = 0
    g = np.zeros((6, stop - start), np.float32)
    for k in range(len(X)):
        _count(X[k, start:stop], labels[k, start:stop], Ts, white[k], A[:, k].copy(), n, d, g)
    for p in range(len(out)):
        g00, g01, g02, g11, g12, g22 = g[0, p], g[1, p], g[2, p], g[3, p], g[4, p], g[5, p]
        det = (
            g00 * (g11 * g22 - g12 * g12)
            - g01 * (g01 * g22 - g12 * g02)
            + g02 * (g01 * g12 - g11 * g02)
        )
        third = (g00 + g11 + g22) / 3
        out[p] = max(det, np.float32(0)) / third**3 if d[p] >= 3 else np.float32(0)
