"""All pixels of a large picture, with what a thinned-out one has shown of its highlights."""

import numpy as np
from numba import njit

from .consensus import MIN_WEIGHT, _solve
from .pooled import _add

# Inner loops run over whole rows with indices from 0: only those become vector instructions.


@njit(nogil=True, cache=True)
def _spread(weights, step, out):  # pragma: no cover
    """Each weight `step` times."""
    for b in range(len(weights)):
        part = out[b * step : (b + 1) * step]
        for j in range(len(part)):
            part[j] = weights[b]


@njit(nogil=True, cache=True)
def _take(x, usable, white, Ts, weights, u, y):  # pragma: no cover
    """u = weights of the lit observations of a row, y = u x."""
    zero = np.float32(0)
    for j in range(len(x)):
        u[j] = weights[j] if usable[j] & (x[j] >= Ts) & (x[j] < white) else zero
        y[j] = u[j] * x[j]


@njit(nogil=True, cache=True)
def _judge(
    x, usable, white, Ts, c, b0, b1, b2, weights, T, wide, lit, diffuse, against
):  # pragma: no cover
    """Count, for a row of one image, what is lit, what is D, and what contradicts the fit.

    That is what is darker than possible, or far from the fit though no highlight was seen there.
    """
    c0, c1, c2 = c[0], c[1], c[2]
    half = np.float32(0.5)
    for j in range(len(x)):
        l = c0 * b0[j] + c1 * b1[j] + c2 * b2[j]
        r = x[j] - l
        seen = usable[j] & (x[j] >= Ts) & (x[j] < white)
        room = max(T * x[j], wide)
        wrong = (r < -room) | (l < -wide) | ((r > room) & (weights[j] >= half))
        lit[j] += np.int32(seen)
        diffuse[j] += np.int32(seen & (abs(r) <= T * x[j]))
        against[j] += np.int32(seen & wrong)


@njit(nogil=True, cache=True)
def _solve_row(total, b0, b1, b2, doubt):  # pragma: no cover
    """Solutions of a row of normal equations; doubt where they are none."""
    w = np.empty(3, np.float64)
    for j in range(len(b0)):
        g = total[:, j]
        good = g[9] >= MIN_WEIGHT and _solve(
            np.float64(g[0]),
            np.float64(g[1]),
            np.float64(g[2]),
            np.float64(g[3]),
            np.float64(g[4]),
            np.float64(g[5]),
            np.float64(g[6]),
            np.float64(g[7]),
            np.float64(g[8]),
            w,
        )
        doubt[j] = not good
        if good:
            b0[j], b1[j], b2[j] = w[0], w[1], w[2]


@njit(nogil=True, cache=True)
def fine_band(
    images, usable, A, white, Ts, weights, step, T, wide, top, left, rows, columns, out, lead, doubt
):  # pragma: no cover
    """Fit some pixels with the weights of the blocks they lie in, and check the fit.

    Args:
        images: (K,H,W) float32 observations.
        usable: (H,W) bool, pixels of the object.
        A: (3,K) float32 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        Ts, T: float32 thresholds.
        weights: (K,h,w) float32 weights of blocks of `step` x `step` pixels.
        wide: float32 residual that noise may have.
        top, left: multiples of step; `rows` is at most `step`.
        out: (3,H,W) float32, written.
        lead: (H,W) int32, written: 2 D + S, the votes ahead of none at all.
        doubt: (H,W) bool, written: the fit fails, or observations contradict it.
    """
    K = len(images)
    block = slice(left // step, -(-(left + columns) // step))
    wide_row = np.empty((block.stop - block.start) * step, np.float32)
    w = wide_row[:columns]
    u, y = np.empty(columns, np.float32), np.empty(columns, np.float32)
    total = np.zeros((rows, 10, columns), np.float32)
    one = np.float32(1)
    for k in range(K):
        _spread(weights[k, top // step, block], step, wide_row)
        c = A[:, k].copy()
        for i in range(rows):
            z = top + i
            x, inside = images[k, z, left : left + columns], usable[z, left : left + columns]
            _take(x, inside, white[k], Ts, w, u, y)
            n = 0
            for a in range(3):
                for b in range(a, 3):
                    _add(total[i, n], u, c[a] * c[b])
                    n += 1
            for a in range(3):
                _add(total[i, 6 + a], y, c[a])
            _add(total[i, 9], u, one)
    span = slice(left, left + columns)
    for i in range(rows):
        z = top + i
        _solve_row(total[i], out[0, z, span], out[1, z, span], out[2, z, span], doubt[z, span])
    lit, diffuse = np.zeros((rows, columns), np.int32), np.zeros((rows, columns), np.int32)
    against = np.zeros((rows, columns), np.int32)
    for k in range(K):
        _spread(weights[k, top // step, block], step, wide_row)
        c = A[:, k].copy()
        for i in range(rows):
            z = top + i
            _judge(
                images[k, z, span],
                usable[z, span],
                white[k],
                Ts,
                c,
                out[0, z, span],
                out[1, z, span],
                out[2, z, span],
                w,
                T,
                wide,
                lit[i],
                diffuse[i],
                against[i],
            )
    for i in range(rows):
        for j in range(columns):
            lead[top + i, left + j] = lit[i, j] + diffuse[i, j]
            doubt[top + i, left + j] |= against[i, j] > 0
