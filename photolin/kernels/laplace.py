"""Differences of a picture with a weight for each pair of neighbouring pixels.

`right` (H,W) weighs each pixel and the next in its row, `down` (H,W) each and the one below; 0 in
the last column, or row. (A z)_a is the sum over the neighbours b of weight_ab (z_a - z_b).
"""

from numba import njit


@njit(nogil=True, cache=True, inline="always")
def _rest(right, down, given, z, r, c, above, below):  # pragma: no cover
    """given - A z at the pixel (r, c), whose rows above and below are given."""
    # at a border the pixel is its own neighbour: cheaper than to ask
    before, after, here = max(c - 1, 0), min(c + 1, z.shape[1] - 1), z[r, c]
    rest = given[r, c]
    rest += right[r, before] * (z[r, before] - here) + right[r, c] * (z[r, after] - here)
    rest += down[above, c] * (z[above, c] - here) + down[r, c] * (z[below, c] - here)
    return rest


@njit(nogil=True, cache=True)
def residual_rows(right, down, given, z, out, start, stop):  # pragma: no cover
    """out = given - A z in the rows from `start` to before `stop`; all arrays (H,W)."""
    H, W = z.shape
    for r in range(start, stop):
        above, below = max(r - 1, 0), min(r + 1, H - 1)
        for c in range(W):
            out[r, c] = _rest(right, down, given, z, r, c, above, below)


@njit(nogil=True, cache=True)
def smooth_rows(
    right, down, inverse, given, z, keep, take, step, out, start, stop
):  # pragma: no cover
    """A step of Chebyshev iteration: step = keep step + take inverse (given - A z), out = z + step.

    `inverse` (H,W) is 1 over the diagonal of A. Rows from `start` to before `stop`.
    """
    H, W = z.shape
    for r in range(start, stop):
        above, below = max(r - 1, 0), min(r + 1, H - 1)
        for c in range(W):
            rest = _rest(right, down, given, z, r, c, above, below)
            step[r, c] = keep * step[r, c] + take * inverse[r, c] * rest
            out[r, c] = z[r, c] + step[r, c]
