"""How sure a solution is, from the observations that bear it out."""

import numpy as np
from numba import njit

UNCHECKED = np.float32(1e-5)
"""Trust in a solution that fits three observations or fewer: any three fit exactly."""


@njit(nogil=True, cache=True)
def trust_rows(
    X, pixels, A, white, Ts, noise, certain, bases, lead, trust, start, stop
):  # pragma: no cover
    """How sure the solutions of pixels start..stop are, from what they explain.

    Args:
        X: (K,N) float32 observations.
        pixels: (P,) int64.
        A: (3,K) float32 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        Ts: float32 shadow level.
        noise: float32 standard deviation of an observation.
        certain: float32 uncertainty of a direction, radians, that halves the trust.
        bases: (3,N) float32, NaN where unknown.
        lead: (P,) int32 votes by which each solution won.
        trust: (N,) float32, written for these pixels; a tenth where the lead is one vote or less.
    """
    K = X.shape[0]
    for r in range(start, stop):
        p = pixels[r]
        b0, b1, b2 = bases[0, p], bases[1, p], bases[2, p]
        if not np.isfinite(b0):
            trust[p] = 0
            continue
        g00 = g01 = g02 = g11 = g12 = g22 = 0.0
        count = 0
        for k in range(K):
            x, c0, c1, c2 = X[k, p], A[0, k], A[1, k], A[2, k]
            excess = x - (c0 * b0 + c1 * b1 + c2 * b2)
            if x >= Ts and 0 < x < white[k] and abs(excess) <= 4 * noise:
                count += 1
                g00 += c0 * c0
                g01 += c0 * c1
                g02 += c0 * c2
                g11 += c1 * c1
                g12 += c1 * c2
                g22 += c2 * c2
        # 1 / trace of the inverse: between the least eigenvalue and a third of it
        minors = g00 * g11 - g01 * g01 + g00 * g22 - g02 * g02 + g11 * g22 - g12 * g12
        det = (
            g00 * (g11 * g22 - g12 * g12)
            - g01 * (g01 * g22 - g12 * g02)
            + g02 * (g01 * g12 - g11 * g02)
        )
        if count < 4 or not det > 0:
            trust[p] = UNCHECKED
            continue
        size = b0 * b0 + b1 * b1 + b2 * b2 + 1e-12
        open_ = noise * noise * minors / (det * size) / (certain * certain)
        trust[p] = (1.0 if lead[r] > 1 else 0.1) / (1 + open_)
