"""Where observations change their label as T and Ts grow, counted."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def _below(steps, level):  # pragma: no cover
    """How many of the ascending `steps` are at most `level`; 0 for NaN."""
    low, high = 0, len(steps)
    while low < high:
        middle = (low + high) >> 1
        if steps[middle] <= level:
            low = middle + 1
        else:
            high = middle
    return low


@njit(nogil=True, cache=True)
def _diffuse_from(T, i, distance):  # pragma: no cover
    """First of the ascending T with `distance` <= T i, as the label loop compares; len(T): none.

    T i rounded to float32 still ascends, so that a search finds it.
    """
    low, high = 0, len(T)
    while low < high:
        middle = (low + high) >> 1
        if distance <= T[middle] * i:
            high = middle
        else:
            low = middle + 1
    return low


@njit(nogil=True, cache=True)
def landscape_rows(X, bases, c, truth, rows, picks, T, Ts, counts, start, stop):  # pragma: no cover
    """Count the observations of pixels picks[start..stop] by where they change.

    One is lit for the first `a` of Ts and dark for the others, and diffuse from T number `b` on:
    this and what it is before `b` and when dark says its label for all pairs.

    Args:
        X: (K,N) float32 observations.
        bases: (3,N) float32 linearized bases.
        c: (K,3) float32 coefficients.
        truth: (K,N) uint8 true labels, or (0,0) for none.
        rows: (256,) row of `counts` of a true label; without truth row 0 takes all.
        picks: (M,) flat indices of pixels.
        T: (n,) float32 ascending.
        Ts: (m,) float32 ascending.
        counts: (rows,5,m+1,n+1) int64, added to: true class, kind, a, b. Kinds: 0 the linearized
            value is unknown; before `b` U and when dark A (1) or C (2); S and A (3) or C (4).
    """
    for q in range(start, stop):
        p = picks[q]
        b0, b1, b2 = bases[0, p], bases[1, p], bases[2, p]
        for k in range(len(X)):
            i = X[k, p]
            # in the order and precision of the label loop
            l = c[k, 0] * b0 + c[k, 1] * b1 + c[k, 2] * b2
            row = rows[truth[k, p]] if len(truth) else 0
            a = _below(Ts, i)
            if np.isnan(l):
                counts[row, 0, a, len(T)] += 1
                continue
            excess = i - l
            kind = (3 if excess > 0 and l >= 0 else 1) + (1 if l > 0 else 0)
            counts[row, kind, a, _diffuse_from(T, i, abs(excess))] += 1
