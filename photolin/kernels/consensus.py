"""Adaptive sample consensus with refinement: the compiled heart of `robust`."""

import numpy as np
from numba import njit

MIN_WEIGHT = 3.5
"""Sum of weights below which a weighted fit would follow single observations."""
SINGULAR = 1e-9
"""Determinant of sums in double precision, relative to their diagonal, that may be rounding."""
SUMS = {"reassoc", "nsz"}
"""Lets sums be taken in vectors; nothing else of IEEE arithmetic is given up."""
UNFIT = -(2**30)
"""Score of no candidate at all."""


@njit(nogil=True, cache=True, inline="always")
def _next(state):  # pragma: no cover
    """Splitmix64: the next state and 32 random bits of it."""
    state = state + np.uint64(0x9E3779B97F4A7C15)
    z = state
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return state, (z ^ (z >> np.uint64(31))) >> np.uint64(32)


@njit(nogil=True, cache=True)
def _score(x, a0, a1, a2, n, v, T):  # pragma: no cover
    """D minus U over n lit observations, and D alone.

    Light can only be added to a lit pixel: one that is darker than the fit, or lit though the fit
    says it faces away, contradicts physics and votes against.
    """
    v0, v1, v2 = v[0], v[1], v[2]
    diffuse = np.int32(0)
    against = np.int32(0)
    for m in range(n):
        l = a0[m] * v0 + a1[m] * v1 + a2[m] * v2
        excess = x[m] - l
        slack = T * x[m]
        d = abs(excess) <= slack
        diffuse += np.int32(d)
        against += np.int32((not d) & ((excess < 0) | (l < 0)))
    return diffuse - against, diffuse


@njit(nogil=True, cache=True)
def _explained(x, a0, a1, a2, n, v, T, reach):  # pragma: no cover
    """Whether all n lit observations are D, or as near to the fit as noise may bring them."""
    v0, v1, v2 = v[0], v[1], v[2]
    far = np.int32(0)
    for m in range(n):
        excess = x[m] - (a0[m] * v0 + a1[m] * v1 + a2[m] * v2)
        far += np.int32(abs(excess) > max(T * x[m], reach))
    return far == 0


@njit(nogil=True, cache=True, fastmath=SUMS)
def _misfit(x, a0, a1, a2, n, v, T):  # pragma: no cover
    """Sum over D of ((i - l) / (T i))^2: settles equal scores."""
    v0, v1, v2 = v[0], v[1], v[2]
    total = np.float32(0)
    for m in range(n):
        excess = x[m] - (a0[m] * v0 + a1[m] * v1 + a2[m] * v2)
        share = excess / (T * x[m])
        total += share * share if abs(share) <= 1 else np.float32(0)
    return total


@njit(nogil=True, cache=True)
def _solve(g00, g01, g02, g11, g12, g22, h0, h1, h2, least, out):  # pragma: no cover
    """out = inverse(G) h for symmetric 3x3 G; false where its determinant is at most `least` of its
    diagonal's."""
    c00 = g11 * g22 - g12 * g12
    c01 = g02 * g12 - g01 * g22
    c02 = g01 * g12 - g02 * g11
    det = g00 * c00 + g01 * c01 + g02 * c02
    if not det > least * g00 * g11 * g22:
        return False
    c11 = g00 * g22 - g02 * g02
    c12 = g01 * g02 - g00 * g12
    c22 = g00 * g11 - g01 * g01
    out[0] = (c00 * h0 + c01 * h1 + c02 * h2) / det
    out[1] = (c01 * h0 + c11 * h1 + c12 * h2) / det
    out[2] = (c02 * h0 + c12 * h1 + c22 * h2) / det
    return True


@njit(nogil=True, cache=True, fastmath=SUMS)
def _refit(x, a0, a1, a2, n, v, T, out):  # pragma: no cover
    """Least squares on the D observations of v; false where they do not determine one."""
    v0, v1, v2 = v[0], v[1], v[2]
    g00 = g01 = g02 = g11 = g12 = g22 = h0 = h1 = h2 = count = 0.0
    for m in range(n):
        excess = x[m] - (a0[m] * v0 + a1[m] * v1 + a2[m] * v2)
        w = 1.0 if abs(excess) <= T * x[m] else 0.0
        b0, b1, b2, y = w * a0[m], w * a1[m], w * a2[m], np.float64(x[m])
        count += w
        g00 += b0 * a0[m]
        g01 += b0 * a1[m]
        g02 += b0 * a2[m]
        g11 += b1 * a1[m]
        g12 += b1 * a2[m]
        g22 += b2 * a2[m]
        h0 += b0 * y
        h1 += b1 * y
        h2 += b2 * y
    return count >= 3 and _solve(g00, g01, g02, g11, g12, g22, h0, h1, h2, SINGULAR, out)


@njit(nogil=True, cache=True, fastmath=SUMS)
def _polish(x, a0, a1, a2, n, reach, w, v):  # pragma: no cover
    """Weighted least squares on all lit observations, from v, into v.

    `w` is scratch, (3,) float64. Weights are Tukey's biweight of the residual, zero from `reach`
    on: T i would drop dim observations that noise has moved, and keep the tails of highlights.
    """
    for _ in range(2):
        v0, v1, v2 = v[0], v[1], v[2]
        g00 = g01 = g02 = g11 = g12 = g22 = h0 = h1 = h2 = weight = 0.0
        for m in range(n):
            excess = (x[m] - (a0[m] * v0 + a1[m] * v1 + a2[m] * v2)) / reach
            u = np.float64(max(np.float32(0), np.float32(1) - excess * excess))
            u *= u
            b0, b1, b2, y = u * a0[m], u * a1[m], u * a2[m], np.float64(x[m])
            weight += u
            g00 += b0 * a0[m]
            g01 += b0 * a1[m]
            g02 += b0 * a2[m]
            g11 += b1 * a1[m]
            g12 += b1 * a2[m]
            g22 += b2 * a2[m]
            h0 += b0 * y
            h1 += b1 * y
            h2 += b2 * y
        if weight < MIN_WEIGHT or not _solve(g00, g01, g02, g11, g12, g22, h0, h1, h2, SINGULAR, w):
            return
        v[0], v[1], v[2] = w[0], w[1], w[2]


@njit(nogil=True, cache=True)
def _sample(x, a0, a1, a2, n, state, out):  # pragma: no cover
    """Exact fit to three random observations; false where their factors lie near a plane."""
    state, r0 = _next(state)
    state, r1 = _next(state)
    state, r2 = _next(state)
    i, j, k = int(r0 % np.uint64(n)), int(r1 % np.uint64(n - 1)), int(r2 % np.uint64(n - 2))
    j += j >= i
    low, high = min(i, j), max(i, j)
    k += k >= low
    k += k >= high
    # columns of the adjugate are cross products of the rows of A
    u0, u1, u2 = (
        a1[j] * a2[k] - a2[j] * a1[k],
        a2[j] * a0[k] - a0[j] * a2[k],
        a0[j] * a1[k] - a1[j] * a0[k],
    )
    det = a0[i] * u0 + a1[i] * u1 + a2[i] * u2
    norms = (
        (a0[i] ** 2 + a1[i] ** 2 + a2[i] ** 2)
        * (a0[j] ** 2 + a1[j] ** 2 + a2[j] ** 2)
        * (a0[k] ** 2 + a1[k] ** 2 + a2[k] ** 2)
    )
    if not det * det > 1e-4 * norms:
        return state, False
    f = x[i] / det
    g = x[j] / det
    h = x[k] / det
    out[0] = f * u0 + g * (a1[k] * a2[i] - a2[k] * a1[i]) + h * (a1[i] * a2[j] - a2[i] * a1[j])
    out[1] = f * u1 + g * (a2[k] * a0[i] - a0[k] * a2[i]) + h * (a2[i] * a0[j] - a0[i] * a2[j])
    out[2] = f * u2 + g * (a0[k] * a1[i] - a1[k] * a0[i]) + h * (a0[i] * a1[j] - a1[i] * a0[j])
    return state, True


@njit(nogil=True, cache=True)
def _differ(v, w):  # pragma: no cover
    """Whether two solutions are farther apart than a tenth of the larger one."""
    apart = (v[0] - w[0]) ** 2 + (v[1] - w[1]) ** 2 + (v[2] - w[2]) ** 2
    size = max(v[0] ** 2 + v[1] ** 2 + v[2] ** 2, w[0] ** 2 + w[1] ** 2 + w[2] ** 2)
    return apart > 0.01 * size


@njit(nogil=True, cache=True)
def _fit(x, a0, a1, a2, n, T, reach, tries, limit, state, v, w, best):  # pragma: no cover
    """Best v of n lit observations into `best`; returns its score, or UNFIT, and the runner-up's.

    `best` holds a first guess, or NaN; v (float32) and w (float64) are scratch, (3,); `tries` as
    in `consensus_rows`. The runner-up is the best
    scored solution that differs from the winner.
    """
    score, diffuse, misfit, second = UNFIT, 0, 0.0, UNFIT
    if not np.isfinite(best[0]):
        # most pixels show no highlight: then all that is lit is D, and nothing need be drawn
        v[:] = 0
        if _refit(x, a0, a1, a2, n, v, np.float32(np.inf), w):
            best[0], best[1], best[2] = w[0], w[1], w[2]
    if np.isfinite(best[0]):
        score, diffuse = _score(x, a0, a1, a2, n, best, T)
        misfit = _misfit(x, a0, a1, a2, n, best, T)
        # no other candidate could explain more than all
        if n > 3 and _explained(x, a0, a1, a2, n, best, T, reach):
            return score, second
    drawn = 0
    while drawn < min(limit, tries[diffuse * (len(tries) - 1) // n]):
        drawn += 1
        state, ok = _sample(x, a0, a1, a2, n, state, v)
        if not ok:
            continue
        for step in range(3):
            s, d = _score(x, a0, a1, a2, n, v, T)
            # whichever wins, the other one is a rival
            if min(s, score) > second and _differ(v, best):
                second = min(s, score)
            if s < score:
                break
            e = _misfit(x, a0, a1, a2, n, v, T)
            if s > score or e < misfit:
                score, diffuse, misfit = s, d, e
                best[:] = v
            elif step > 0:
                break
            if not _refit(x, a0, a1, a2, n, v, T, w):
                break
            v[0], v[1], v[2] = w[0], w[1], w[2]
    return score, second


@njit(nogil=True, cache=True)
def consensus_rows(
    X, columns, A, white, T, Ts, reach, tries, limit, seed, out, score, margin, start, stop
):  # pragma: no cover
    """Fit rows start..stop by adaptive sample consensus.

    Args:
        X: (M,N) float32 observations; row r of the problem is column `columns[r]` of X.
        columns: (R,) int64.
        A: (3,M) float32 factors; an observation whose factors are NaN is left out.
        white: (M,) float32; an observation from there on is saturated and left out.
        T, Ts: float32 thresholds.
        reach: float32, residual that noise may have, from which an observation has no weight in
            the last fit; 0: no noise, and no last fit.
        tries: (n,) int64 samples needed against the share of D among the lit, 0 to 1.
        limit: the most samples to draw.
        seed: uint64; each row draws its own sequence from it and its column number.
        out: (R,3) float32; first guess (or NaN) in, winner out; NaN where fewer than 3 are lit.
        score: (R,) int32, written: D - U among the lit.
        margin: (R,) int32, written: score above that of the best different solution seen, 0 where
            nothing was fitted.
    """
    M = X.shape[0]
    x = np.empty(M, np.float32)
    a0 = np.empty(M, np.float32)
    a1 = np.empty(M, np.float32)
    a2 = np.empty(M, np.float32)
    v = np.empty(3, np.float32)
    w = np.empty(3, np.float64)
    for r in range(start, stop):
        column = columns[r]
        n = 0
        for m in range(M):
            value = X[m, column]
            if value >= Ts and 0 < value < white[m] and np.isfinite(A[0, m]):
                x[n], a0[n], a1[n], a2[n] = value, A[0, m], A[1, m], A[2, m]
                n += 1
        if n < 3:
            out[r] = np.nan
            score[r] = UNFIT
            margin[r] = 0
            continue
        state = np.uint64(seed) ^ (np.uint64(column) * np.uint64(0xD1342543DE82EF95))
        score[r], second = _fit(x, a0, a1, a2, n, T, reach, tries, limit, state, v, w, out[r])
        margin[r] = max(0, score[r] - max(second, -n))
        if score[r] == UNFIT:
            out[r] = np.nan
        elif reach > 0:
            _polish(x, a0, a1, a2, n, reach, w, out[r])


@njit(nogil=True, cache=True)
def score_candidates(x, A, v, T, diffuse, score, start, stop):  # pragma: no cover
    """D and D - U over lit observations of one row, for each of its candidates start..stop.

    Args:
        x: (M,) float32 lit observations.
        A: (3,M) float32 factors.
        v: (n,3) float32 candidates.
        T: float32 threshold.
        diffuse, score: (n,) int32, written: D, and D minus U.
    """
    for s in range(start, stop):
        score[s], diffuse[s] = _score(x, A[0], A[1], A[2], len(x), v[s], T)
