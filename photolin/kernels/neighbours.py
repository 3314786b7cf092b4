"""Ties settled by neighbours: of the solutions that explain a pixel, the one that theirs make
likely."""

import numpy as np
from numba import njit

from .consensus import SINGULAR, _solve

MOST = 24
"""Neighbours of a pixel: a window of 5 x 5 without its centre."""
STEPS = 4
TRIES = 6
"""Neighbours whose solution is tried, at most: the surest, and none like one before."""
ALIKE = np.float32(0.1)
"""Difference of directions, radians, below which both end in the same solution."""
TURN = np.float32(0.3)
"""How much the direction of a solution differs between neighbours, radians; wide, because all it
has to tell apart are solutions that have nothing to do with each other."""
SAY = np.float32(3.0)
"""What all neighbours together weigh, in units of the squared noise of one observation, halved."""
FAR = np.float32(2.0)
"""Disagreement from which a neighbour may be another surface, and weighs no more."""
SUITS = np.float32(0.5)
"""Disagreement with all neighbours, out of SAY times FAR, below which nothing else is tried."""
PASSED_ON = np.float32(0.3)
"""Trust in a solution taken from neighbours, as a share of theirs."""
BRIGHTER, DARKER = np.float32(3.0), np.float32(8.0)
"""Most that one observation above or below the fit speaks against it: a highlight explains the
first, nothing the second."""


@njit(nogil=True, cache=True)
def _against(x, a0, a1, a2, n, v, noise):  # pragma: no cover
    """What n lit observations have against v, in units of the squared noise, halved."""
    total = np.float32(0)
    for m in range(n):
        u = (x[m] - (a0[m] * v[0] + a1[m] * v[1] + a2[m] * v[2])) / noise
        total += min(np.float32(0.5) * u * u, BRIGHTER if u > 0 else DARKER)
    return total


@njit(nogil=True, cache=True)
def _stranger(units, say, count, v):  # pragma: no cover
    """What the neighbours have against the direction of v, in the same units."""
    size = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + np.float32(1e-12)
    total = np.float32(0)
    for q in range(count):
        d = np.float32(0)
        for c in range(3):
            d += (units[q, c] - v[c] / size) ** 2
        total += say[q] * min(d / (2 * TURN * TURN), FAR)
    return total


@njit(nogil=True, cache=True)
def _scale(x, a0, a1, a2, n, unit, ratios):  # pragma: no cover
    """Length along `unit` that explains n lit observations; 0 where none faces the light.

    The lower third of what each of them says: highlights only add.
    """
    count = 0
    for m in range(n):
        g = a0[m] * unit[0] + a1[m] * unit[1] + a2[m] * unit[2]
        if g > 1e-3:
            ratios[count] = x[m] / g
            count += 1
    if count == 0:
        return np.float32(0)
    kept = ratios[:count]
    kept.sort()
    return kept[count // 3]


@njit(nogil=True, cache=True)
def _lean(x, a0, a1, a2, n, units, say, count, noise, v, w):  # pragma: no cover
    """Weighted least squares on n lit observations from v into v, leaning on the neighbours.

    Across the neighbours' mean direction v is held with the strength of a turn by TURN; where the
    observations say anything, that is nothing. `w` is scratch, (3,) float64. False where nothing
    is determined.
    """
    size = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + np.float32(1e-12)
    m0 = m1 = m2 = trust = 0.0
    for q in range(count):
        d = np.float32(0)
        for c in range(3):
            d += (units[q, c] - v[c] / size) ** 2
        near = say[q] * np.exp(-d / (2 * TURN * TURN))
        trust += near
        m0 += near * units[q, 0]
        m1 += near * units[q, 1]
        m2 += near * units[q, 2]
    length = np.sqrt(m0 * m0 + m1 * m1 + m2 * m2) + 1e-12
    m0, m1, m2 = m0 / length, m1 / length, m2 / length
    hold = (noise / (size * TURN)) ** 2 * max(trust, 0.2) + 1e-9
    g00, g11, g22 = hold * (1 - m0 * m0), hold * (1 - m1 * m1), hold * (1 - m2 * m2)
    g01, g02, g12 = -hold * m0 * m1, -hold * m0 * m2, -hold * m1 * m2
    h0 = h1 = h2 = 0.0
    for m in range(n):
        u = (x[m] - (a0[m] * v[0] + a1[m] * v[1] + a2[m] * v[2])) / noise
        # what is darker than the fit never loses its say: nothing explains it
        reach, least = (np.float32(4), np.float32(0)) if u > 0 else (np.float32(6), np.float32(0.1))
        p = max(least, np.float32(1) - (u / reach) ** 2)
        p *= p
        b0, b1, b2, y = p * a0[m], p * a1[m], p * a2[m], np.float64(x[m])
        g00 += b0 * a0[m]
        g01 += b0 * a1[m]
        g02 += b0 * a2[m]
        g11 += b1 * a1[m]
        g12 += b1 * a2[m]
        g22 += b2 * a2[m]
        h0 += b0 * y
        h1 += b1 * y
        h2 += b2 * y
    if not _solve(g00, g01, g02, g11, g12, g22, h0, h1, h2, SINGULAR, w):
        return False
    v[0], v[1], v[2] = w[0], w[1], w[2]
    return True


@njit(nogil=True, cache=True)
def _meet(p, width, bases, trust, units, say):  # pragma: no cover
    """Directions of pixel p's trusted neighbours and their trust: how many, and trust in all."""
    height = bases.shape[1] // width
    row, column = p // width, p % width
    count, total = 0, np.float32(0)
    for i in range(max(row - 2, 0), min(row + 3, height)):
        for j in range(max(column - 2, 0), min(column + 3, width)):
            q = i * width + j
            size = np.sqrt(bases[0, q] ** 2 + bases[1, q] ** 2 + bases[2, q] ** 2)
            if q == p or not (trust[q] > 0 and size > 0):
                continue
            for c in range(3):
                units[count, c] = bases[c, q] / size
            say[count] = trust[q]
            total += trust[q]
            count += 1
    return count, total


@njit(nogil=True, cache=True)
def _is_new(units, tried, many, q):  # pragma: no cover
    """Whether no direction like that of neighbour q is among the `many` that were tried."""
    for t in range(many):
        p = tried[t]
        d = np.float32(0)
        for c in range(3):
            d += (units[q, c] - units[p, c]) ** 2
        if d < ALIKE * ALIKE:
            return False
    return True


@njit(nogil=True, cache=True)
def _choose(
    x, a0, a1, a2, n, units, say, count, noise, strange, v, w, ratios, best
):  # pragma: no cover
    """Put the least costly solution into `best`, from its own on; whether it changed.

    strange: what the neighbours have against its own; v, w, ratios: scratch.
    """
    cost = strange + _against(x, a0, a1, a2, n, best, noise)
    changed = False
    tried, many = np.empty(TRIES, np.int64), 0
    for q in np.argsort(-say[:count]):
        if not _is_new(units, tried, many, q):
            continue
        if many == TRIES:
            break
        tried[many] = q
        many += 1
        size = _scale(x, a0, a1, a2, n, units[q], ratios)
        if size <= 0:
            continue
        for c in range(3):
            v[c] = size * units[q, c]
        for _ in range(STEPS):
            if not _lean(x, a0, a1, a2, n, units, say, count, noise, v, w):
                break
        other = _against(x, a0, a1, a2, n, v, noise) + _stranger(units, say, count, v)
        if other < cost - np.float32(1e-3):
            cost = other
            best[:] = v
            changed = True
    return changed


@njit(nogil=True, cache=True)
def settle_rows(
    X, width, doubtful, A, white, Ts, noise, bases, trust, out, gained, start, stop
):  # pragma: no cover
    """Choose between a pixel's own solution and those of its neighbours, rescaled.

    Args:
        X: (K,N) float32 observations, pictures of `width` columns.
        doubtful: (R,) int64 the pixels to look at; all have a solution.
        A: (3,K) float32 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        Ts: float32 shadow level.
        noise: float32 standard deviation of an observation.
        bases: (3,N) float32 solutions of all pixels, NaN where unknown.
        trust: (N,) float32, 0 to 1; 0 outside the mask and where unknown.
        out: (R,3) float32, written: the solution chosen.
        gained: (R,) float32, written: trust of a new solution, -1 where the old one stays.
    """
    K = len(X)
    x, ratios = np.empty(K, np.float32), np.empty(K, np.float32)
    a0, a1, a2 = np.empty(K, np.float32), np.empty(K, np.float32), np.empty(K, np.float32)
    units, say = np.empty((MOST, 3), np.float32), np.empty(MOST, np.float32)
    v, w = np.empty(3, np.float32), np.empty(3, np.float64)
    for r in range(start, stop):
        p = doubtful[r]
        gained[r] = -1
        for c in range(3):
            out[r, c] = bases[c, p]
        count, total = _meet(p, width, bases, trust, units, say)
        for q in range(count):
            say[q] *= SAY / max(total, np.float32(1))
        strange = _stranger(units, say, count, out[r])
        if strange < SUITS:
            continue
        n = 0
        for k in range(K):
            if X[k, p] >= Ts and 0 < X[k, p] < white[k]:
                x[n], a0[n], a1[n], a2[n] = X[k, p], A[0, k], A[1, k], A[2, k]
                n += 1
        if _choose(x, a0, a1, a2, n, units, say, count, noise, strange, v, w, ratios, out[r]):
            gained[r] = PASSED_ON * min(total, np.float32(1))
