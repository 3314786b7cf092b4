"""The fit of every pixel to the observations that its lights graze."""

import numpy as np
from numba import njit

from .consensus import MIN_WEIGHT, _solve

PLANE = 1e-3
"""Determinant of the normal equations, relative to their diagonal, below which the chosen lights
are too near a plane; in an orthogonal frame it is 1 for lights that spread evenly."""


@njit(nogil=True, cache=True)
def _choose(x, l, power, n, dark, low, high, least, enough, level, few, u):  # pragma: no cover
    """u = 1 for the observations whose light grazes, 0 for all others; how many are 1.

    `level` and `few` are scratch, (n,).
    """
    count = 0
    for m in range(n):
        # far below the fit is a shadow that other surfaces lighten
        facing = (l[m] > 0) & (x[m] >= dark * l[m])
        level[m] = l[m] / power[m] if facing else np.inf
        if facing:
            few[count] = level[m]
            count += 1
    if count < enough:
        return 0
    few[:count].sort()
    keep = max(int(np.ceil((high - low) * count)), least)
    drop = min(int(low * count), max(count - keep, 0))
    first, last = few[drop], few[min(drop + keep, count) - 1]
    chosen = 0
    for m in range(n):
        inside = (level[m] >= first) & (level[m] <= last)
        u[m] = 1.0 if inside else 0.0
        chosen += inside
    return chosen


@njit(nogil=True, cache=True)
def _weigh(x, l, n, chosen, cut, floor, few, u):  # pragma: no cover
    """Tukey's biweight of the chosen residuals, in units of their own median, into u."""
    count = 0
    for m in range(n):
        if u[m] > 0:
            few[count] = abs(x[m] - l[m])
            count += 1
    few[:chosen].sort()
    median = 0.5 * (few[chosen // 2] + few[(chosen - 1) // 2])
    reach = cut * max(1.4826 * median, floor)
    for m in range(n):
        share = (x[m] - l[m]) / reach
        w = max(0.0, 1.0 - share * share)
        u[m] *= w * w


@njit(nogil=True, cache=True)
def _solve_weighted(x, a0, a1, a2, u, n, w):  # pragma: no cover
    """Weighted least squares into w; false where the observations do not determine it."""
    g00 = g01 = g02 = g11 = g12 = g22 = h0 = h1 = h2 = weight = 0.0
    for m in range(n):
        b0, b1, b2 = u[m] * a0[m], u[m] * a1[m], u[m] * a2[m]
        weight += u[m]
        g00 += b0 * a0[m]
        g01 += b0 * a1[m]
        g02 += b0 * a2[m]
        g11 += b1 * a1[m]
        g12 += b1 * a2[m]
        g22 += b2 * a2[m]
        h0 += b0 * x[m]
        h1 += b1 * x[m]
        h2 += b2 * x[m]
    return weight >= MIN_WEIGHT and _solve(g00, g01, g02, g11, g12, g22, h0, h1, h2, PLANE, w)


@njit(nogil=True, cache=True)
def grazing_rows(
    X,
    pixels,
    A,
    white,
    powers,
    Ts,
    dark,
    low,
    high,
    least,
    enough,
    cut,
    floor,
    rounds,
    out,
    start,
    stop,
):  # pragma: no cover
    """Fit pixels start..stop to those observations whose lights graze them.

    Args:
        X: (K,N) float32 observations; row r of the problem is column `pixels[r]`.
        pixels: (R,) int64.
        A: (3,K) float64 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        powers: (K,) float64 of the lights; l / power orders the observations.
        Ts: float32 shadow level.
        dark: share of the fit below which an observation is a shadow.
        low, high: part of the order that counts, 0 to 1.
        least: how many count where there are as many.
        enough: a pixel with fewer that it faces, not in shadow, stays as it is; at least `least`.
        cut: residual without weight, in robust standard deviations.
        floor: the least such deviation, as a share of the length of the solution.
        rounds: how often observations are chosen anew.
        out: (R,3) float64; solutions so far in, new ones out; what is not determined stays.
    """
    K = len(X)
    x, l, level, power = np.empty(K), np.empty(K), np.empty(K), np.empty(K)
    a0, a1, a2, few, u = np.empty(K), np.empty(K), np.empty(K), np.empty(K), np.empty(K)
    w = np.empty(3)
    for r in range(start, stop):
        n = 0
        for k in range(K):
            value = X[k, pixels[r]]
            if (value >= Ts) & (value < white[k]):
                x[n], a0[n], a1[n], a2[n] = value, A[0, k], A[1, k], A[2, k]
                power[n] = powers[k]
                n += 1
        v = out[r]
        for round_ in range(rounds):
            for m in range(n):
                l[m] = a0[m] * v[0] + a1[m] * v[1] + a2[m] * v[2]
            chosen = _choose(x, l, power, n, dark, low, high, least, enough, level, few, u)
            if chosen == 0:
                break
            size = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
            # residuals of a fit to all observations say little of how these ones agree
            if round_ > 0:
                _weigh(x, l, n, chosen, cut, floor * size, few, u)
            if not _solve_weighted(x, a0, a1, a2, u, n, w):
                break
            v[0], v[1], v[2] = w[0], w[1], w[2]
