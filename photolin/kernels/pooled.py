"""Highlights seen by many pixels together, and the fit without them."""

import numpy as np
from numba import njit

from .consensus import MIN_WEIGHT, _solve

HALF = 2
"""A window is 2 HALF + 1 = 5 pixels wide."""
SINGULAR = 1e-5
"""Determinant of sums in single precision, relative to their diagonal, that may be rounding."""
TINY = np.float32(1e-30)
WINDOW = (2 * HALF + 1) ** 2

# Inner loops run over whole rows with indices from 0: only those become vector instructions.


@njit(nogil=True, cache=True)
def _residuals(x, usable, white, Ts, c, b0, b1, b2, cap, near, lit):  # pragma: no cover
    """Residuals i - l of the lit observations of a row, within -cap..cap; 0 for all others."""
    c0, c1, c2 = c[0], c[1], c[2]
    some = False
    for j in range(len(x)):
        r = x[j] - (c0 * b0[j] + c1 * b1[j] + c2 * b2[j])
        seen = usable[j] & (x[j] >= Ts) & (x[j] < white)
        near[j] = min(max(r, -cap), cap) if seen else np.float32(0)
        lit[j] = np.float32(1) if seen else np.float32(0)
        some |= seen
    return some


@njit(nogil=True, cache=True)
def _add_five(row, sums):  # pragma: no cover
    """sums[j] = row[j] + ... + row[j + 4], always in this order."""
    a, b, c, d, e = row[0:], row[1:], row[2:], row[3:], row[4:]
    for j in range(len(sums)):
        sums[j] = (a[j] + b[j]) + (c[j] + d[j]) + e[j]


@njit(nogil=True, cache=True)
def _add_rows(a, b, c, d, e, sums):  # pragma: no cover
    """Sums of five rows, always in this order."""
    for j in range(len(sums)):
        sums[j] = (a[j] + b[j]) + (c[j] + d[j]) + e[j]


@njit(nogil=True, cache=True)
def _weigh(near, lit, sums, counts, cap, reach, u):  # pragma: no cover
    """Weights of a row of observations, from their own residuals and the sums around them."""
    one, zero = np.float32(1), np.float32(0)
    # a mean of n residuals varies by 5 / sqrt(n) as much as one of 25
    square = max(np.float32(WINDOW) * reach * reach, TINY)
    for j in range(len(u)):
        bright = max(sums[j], zero)
        over = bright * bright / (square * max(counts[j], one))
        own = near[j] / cap
        w = max(one - over, zero) * max(one - own * own, zero)
        u[j] = w * w * lit[j]


@njit(nogil=True, cache=True)
def _add(total, u, a):  # pragma: no cover
    """total += a u"""
    for j in range(len(u)):
        total[j] += a * u[j]


@njit(nogil=True, cache=True)
def _sum_up(total, u, y, c):  # pragma: no cover
    """Add one image to the normal equations (10, n) of a row: G, h and the sum of weights."""
    n = 0
    for a in range(3):
        for b in range(a, 3):
            _add(total[n], u, c[a] * c[b])
            n += 1
    for a in range(3):
        _add(total[6 + a], y, c[a])
    _add(total[9], u, np.float32(1))


@njit(nogil=True, cache=True)
def _solve_sums(g, w):  # pragma: no cover
    """Solution w (3,) of the sums g (10,) of `_sum_up`; false where they do not determine one."""
    return g[9] >= MIN_WEIGHT and _solve(
        np.float64(g[0]),
        np.float64(g[1]),
        np.float64(g[2]),
        np.float64(g[3]),
        np.float64(g[4]),
        np.float64(g[5]),
        np.float64(g[6]),
        np.float64(g[7]),
        np.float64(g[8]),
        SINGULAR,
        w,
    )


@njit(nogil=True, cache=True)
def _look_around(
    images, usable, A, white, Ts, bases, cap, top, left, k, near, lit, across, among
):  # pragma: no cover
    """Residuals of image k in a tile and two pixels around it, and their sums over five columns;
    whether anything is lit. All arrays are 0 beyond the picture."""
    _, height, width = images.shape
    high, wide = near.shape
    above, below = max(0, HALF - top), min(high, height + HALF - top)
    before, after = max(0, HALF - left), min(wide, width + HALF - left)
    span = slice(left - HALF + before, left - HALF + after)
    c = A[:, k].copy()
    some = False
    for i in range(above, below):
        z = top - HALF + i
        some |= _residuals(
            images[k, z, span],
            usable[z, span],
            white[k],
            Ts,
            c,
            bases[0, z, span],
            bases[1, z, span],
            bases[2, z, span],
            cap,
            near[i, before:after],
            lit[i, before:after],
        )
        _add_five(near[i], across[i])
        _add_five(lit[i], among[i])
    return some


@njit(nogil=True, cache=True)
def pooled_tile(
    images, usable, A, white, Ts, bases, cap, reach, top, left, rows, columns, out
):  # pragma: no cover
    """Fit a tile's pixels to the observations around which no highlight is seen.

    Args:
        images: (K,H,W) float32 observations.
        usable: (H,W) bool, pixels that have a solution.
        A: (3,K) float32 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        Ts: float32 shadow level.
        bases: (3,H,W) float32 solutions so far, finite where usable.
        cap: float32 residual from which an observation has no say, whatever is around it.
        reach: float32 mean residual of a full window from which there is a highlight.
        top, left, rows, columns: the tile.
        out: (3,H,W) float32, written in the tile.

    Returns:
        Largest change of a solution, relative to the length of what it was.
    """
    K = len(images)
    wide, high = columns + 2 * HALF, rows + 2 * HALF
    # 0 beyond the picture
    near, lit = np.zeros((high, wide), np.float32), np.zeros((high, wide), np.float32)
    across, among = np.zeros((high, columns), np.float32), np.zeros((high, columns), np.float32)
    sums, counts = np.empty(columns, np.float32), np.empty(columns, np.float32)
    u, y = np.empty(columns, np.float32), np.empty(columns, np.float32)
    total = np.zeros((rows, 10, columns), np.float32)
    for k in range(K):
        c = A[:, k].copy()
        if not _look_around(
            images, usable, A, white, Ts, bases, cap, top, left, k, near, lit, across, among
        ):
            continue
        for i in range(rows):
            _add_rows(*_five(across, i), sums)
            _add_rows(*_five(among, i), counts)
            own, there = near[i + HALF, HALF : HALF + columns], lit[i + HALF, HALF : HALF + columns]
            _weigh(own, there, sums, counts, cap, reach, u)
            x = images[k, top + i, left : left + columns]
            for j in range(columns):
                y[j] = u[j] * x[j]
            _sum_up(total[i], u, y, c)
    return _solve_tile(total, usable, bases, top, left, out)


@njit(nogil=True, cache=True, inline="always")
def _five(rows, i):  # pragma: no cover
    return rows[i], rows[i + 1], rows[i + 2], rows[i + 3], rows[i + 4]


@njit(nogil=True, cache=True)
def _solve_tile(total, usable, bases, top, left, out):  # pragma: no cover
    """Solutions of the tile's normal equations into `out`, old ones where these are too few."""
    rows, _, columns = total.shape
    w = np.empty(3, np.float64)
    change = 0.0
    for i in range(rows):
        for j in range(columns):
            y, z = top + i, left + j
            for c in range(3):
                out[c, y, z] = bases[c, y, z]
            g = total[i, :, j]
            if usable[y, z] and _solve_sums(g, w):
                moved = size = 0.0
                for c in range(3):
                    moved += (w[c] - out[c, y, z]) ** 2
                    size += out[c, y, z] ** 2
                    out[c, y, z] = w[c]
                change = max(change, moved / (size + 1e-12))
    return np.sqrt(change)


@njit(nogil=True, cache=True)
def _clear(near, sums, counts, cap, reach, u):  # pragma: no cover
    """How free of highlights the surroundings of some pixels are, 0 to 1; 1 without lit ones."""
    one, zero = np.float32(1), np.float32(0)
    square = max(np.float32(WINDOW) * reach * reach, TINY)
    for j in range(len(u)):
        bright = max(sums[j], zero)
        w = max(one - bright * bright / (square * max(counts[j], one)), zero)
        u[j] = w * w if near[j] < cap else zero


@njit(nogil=True, cache=True)
def clear_tile(
    images, usable, A, white, Ts, bases, cap, reach, top, left, rows, columns, clear
):  # pragma: no cover
    """How free of highlights the surroundings of a tile's pixels are in each image.

    Args:
        clear: (K,H,W) float32, written in the tile, 0 to 1; the others as in `pooled_tile`.
    """
    wide, high = columns + 2 * HALF, rows + 2 * HALF
    near, lit = np.zeros((high, wide), np.float32), np.zeros((high, wide), np.float32)
    across, among = np.zeros((high, columns), np.float32), np.zeros((high, columns), np.float32)
    sums, counts = np.empty(columns, np.float32), np.empty(columns, np.float32)
    for k in range(len(images)):
        _look_around(
            images, usable, A, white, Ts, bases, cap, top, left, k, near, lit, across, among
        )
        for i in range(rows):
            _add_rows(*_five(across, i), sums)
            _add_rows(*_five(among, i), counts)
            u = clear[k, top + i, left : left + columns]
            _clear(near[i + HALF, HALF : HALF + columns], sums, counts, cap, reach, u)
