"""The two published ways to pick a winner among samples that all rows share."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def support_rows(X, A, triples, inverses, T, Ts, out, support, start, stop):  # pragma: no cover
    """Maximum support among shared samples, Eq. (5) or (6), for rows start..stop.

    Args:
        X: (N,M) float32 observations.
        A: (3,M) float32 factors.
        triples: (n,3) observation numbers of each sample.
        inverses: (n,3,3) float32 inverse of A at those.
        T, Ts: float32 thresholds.
        out: (N,3) float32, written: the winner; the first one of equals.
        support: (N,) int32, written: D + A + C of the winner.
    """
    M = X.shape[1]
    for row in range(start, stop):
        x = X[row]
        dark = 0
        for m in range(M):
            dark += x[m] < Ts
        best = -1
        for s in range(len(triples)):
            x0, x1, x2 = x[triples[s, 0]], x[triples[s, 1]], x[triples[s, 2]]
            g = inverses[s]
            v0 = g[0, 0] * x0 + g[0, 1] * x1 + g[0, 2] * x2
            v1 = g[1, 0] * x0 + g[1, 1] * x1 + g[1, 2] * x2
            v2 = g[2, 0] * x0 + g[2, 1] * x1 + g[2, 2] * x2
            count = 0
            for m in range(M):
                i = x[m]
                l = A[0, m] * v0 + A[1, m] * v1 + A[2, m] * v2
                count += (i >= Ts) & (abs(i - l) <= T * i)
            if count > best:
                best = count
                out[row, 0], out[row, 1], out[row, 2] = v0, v1, v2
        support[row] = dark + best


@njit(nogil=True, cache=True)
def _drop(v, distance, left, keep, centre):  # pragma: no cover
    """Write the centre of v[:left], move those not beyond the mean distance from it to the front.

    Returns how many those are; `left` where the centre is the last one.
    """
    m0 = m1 = m2 = 0.0
    for s in range(left):
        m0 += v[s, 0]
        m1 += v[s, 1]
        m2 += v[s, 2]
    m0, m1, m2 = m0 / left, m1 / left, m2 / left
    centre[0], centre[1], centre[2] = m0, m1, m2
    mean = 0.0
    for s in range(left):
        distance[s] = np.sqrt((v[s, 0] - m0) ** 2 + (v[s, 1] - m1) ** 2 + (v[s, 2] - m2) ** 2)
        mean += distance[s] / left
    if mean <= 1e-6 * (abs(m0) + abs(m1) + abs(m2)):
        return left
    kept = 0
    for s in range(left):
        if distance[s] <= mean:
            v[kept] = v[s]
            kept += 1
    return left if kept < keep else kept


@njit(nogil=True, cache=True)
def centre_path(v, keep, path, counts):  # pragma: no cover
    """All centres of gravity that `centre_rows` goes through with the candidates v.

    Args:
        v: (n,3) float64 candidates; their order and all but those left at the end is lost.
        keep: how many candidates may be left at the least.
        path: (n,3) float64, written: the centres.
        counts: (n,) int64, written: of how many candidates each is the centre.

    Returns:
        How many centres there are, at least 1.
    """
    left = len(v)
    distance = np.empty(left, np.float64)
    steps = 0
    while True:
        kept = _drop(v, distance, left, keep, path[steps])
        counts[steps] = left
        steps += 1
        if kept == left:
            return steps
        left = kept


@njit(nogil=True, cache=True)
def centre_rows(X, triples, inverses, keep, out, start, stop):  # pragma: no cover
    """Centre of gravity and outlier elimination among shared samples, for rows start..stop.

    The authors' earlier method: the centre of all candidates, drop those farthest from it, again
    from the rest, until `keep` of them are left or all that are left coincide.

    Args:
        X: (N,M) float32 observations.
        triples: (n,3) observation numbers of each sample.
        inverses: (n,3,3) float32 inverse of A at those.
        keep: how many candidates may be left at the least.
        out: (N,3) float32, written: the last centre.
    """
    n = len(triples)
    v = np.empty((n, 3), np.float64)
    distance, centre = np.empty(n, np.float64), np.empty(3, np.float64)
    for row in range(start, stop):
        x = X[row]
        for s in range(n):
            x0, x1, x2 = x[triples[s, 0]], x[triples[s, 1]], x[triples[s, 2]]
            g = inverses[s]
            v[s, 0] = g[0, 0] * x0 + g[0, 1] * x1 + g[0, 2] * x2
            v[s, 1] = g[1, 0] * x0 + g[1, 1] * x1 + g[1, 2] * x2
            v[s, 2] = g[2, 0] * x0 + g[2, 1] * x1 + g[2, 2] * x2
        left = n
        while True:
            kept = _drop(v, distance, left, keep, centre)
            if kept == left:
                break
            left = kept
        out[row] = centre
