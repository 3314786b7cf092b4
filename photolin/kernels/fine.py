"""All pixels of a large picture, with what a thinned-out one has shown of its highlights."""

import numpy as np
from numba import njit

from .pooled import _solve_sums, _sum_up

# Inner loops run over whole rows with indices from 0: only those become vector instructions.


@njit(nogil=True, cache=True)
def _spread(weights, step, out):  # pragma: no cover
    """Each weight `step` times."""
    for b in range(len(weights)):
        part = out[b * step : (b + 1) * step]
        for j in range(len(part)):
            part[j] = weights[b]


@njit(nogil=True, cache=True)
def _take(x, white, Ts, weights, u, y):  # pragma: no cover
    """u = weights of the lit observations of a row, y = u x."""
    zero = np.float32(0)
    for j in range(len(x)):
        u[j] = weights[j] if (x[j] >= Ts) & (x[j] < white) else zero
        y[j] = u[j] * x[j]


@njit(nogil=True, cache=True)
def _judge(x, white, Ts, c, b0, b1, b2, weights, T, wide, lead, against):  # pragma: no cover
    """Count, for a row of one image, what is lit and again what is D, and what contradicts the fit.

    That is what is darker than possible, or far from the fit though no highlight was seen there.
    """
    c0, c1, c2 = c[0], c[1], c[2]
    half = np.float32(0.5)
    for j in range(len(x)):
        l = c0 * b0[j] + c1 * b1[j] + c2 * b2[j]
        r = x[j] - l
        slack = T * x[j]
        room = max(slack, wide)
        seen = (x[j] >= Ts) & (x[j] < white)
        wrong = (r < -room) | (l < -wide) | ((r > room) & (weights[j] >= half))
        lead[j] += np.int32(seen) + np.int32(seen & (abs(r) <= slack))
        against[j] |= np.int32(seen & wrong)


@njit(nogil=True, cache=True)
def _solve_row(total, b0, b1, b2, doubt):  # pragma: no cover
    """Solutions of a row of normal equations; doubt where they are none."""
    w = np.empty(3, np.float64)
    for j in range(len(b0)):
        g = total[:, j]
        good = _solve_sums(g, w)
        doubt[j] = not good
        if not good:
            w[:] = 0
        b0[j], b1[j], b2[j] = w[0], w[1], w[2]


@njit(nogil=True, cache=True)
def fine_band(
    images, A, white, Ts, weights, step, T, wide, top, left, rows, columns, out, lead, doubt
):  # pragma: no cover
    """Fit some pixels with the weights of the blocks they lie in, and check the fit.

    Args:
        images: (K,H,W) float32 observations.
        A: (3,K) float32 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        Ts, T: float32 thresholds.
        weights: (K,h,w) float32 weights of blocks of `step` x `step` pixels.
        wide: float32 residual that noise may have.
        top, left: multiples of step; `rows` is at most `step`.
        out: (3,H,W) float32, written, 0 where the fit fails.
        lead: (H,W) int32, written: 2 D + S, the votes ahead of none at all.
        doubt: (H,W) bool, written: the fit fails, or observations contradict it.
    """
    K = len(images)
    block = slice(left // step, -(-(left + columns) // step))
    spread = np.empty((K, (block.stop - block.start) * step), np.float32)
    u, y = np.empty(columns, np.float32), np.empty(columns, np.float32)
    total = np.zeros((rows, 10, columns), np.float32)
    span = slice(left, left + columns)
    for k in range(K):
        _spread(weights[k, top // step, block], step, spread[k])
        c = A[:, k].copy()
        for i in range(rows):
            _take(images[k, top + i, span], white[k], Ts, spread[k, :columns], u, y)
            _sum_up(total[i], u, y, c)
    against = np.zeros(columns, np.int32)
    for i in range(rows):
        z = top + i
        b0, b1, b2 = out[0, z, span], out[1, z, span], out[2, z, span]
        _solve_row(total[i], b0, b1, b2, doubt[z, span])
        votes = lead[z, span]
        votes[:] = 0
        against[:] = 0
        for k in range(K):
            x, w, c = images[k, z, span], spread[k, :columns], A[:, k].copy()
            _judge(x, white[k], Ts, c, b0, b1, b2, w, T, wide, votes, against)
        for j in range(columns):
            doubt[z, left + j] |= against[j] != 0
