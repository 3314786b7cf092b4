"""Weighted Laplace equations on a picture: one weight for each pair of neighbouring pixels."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..blocks import run_blocks
from ..kernels.laplace import residual_rows, smooth_rows

Floats = NDArray[np.floating]

COARSEST = 4
"""Rows and columns that are solved outright."""
SMOOTH = (0.35, 2.0)
"""Eigenvalues of the scaled matrix, at most 2, that smoothing damps; coarser grids do the rest."""
DEGREE = 3
"""Steps of smoothing before and after the coarser grids."""
BLOCK = 2**17
"""Pixels in one piece of work for a thread."""


@dataclass(frozen=True, eq=False)
class Grid:
    """The matrix A: (A z)_a = sum over neighbours b of weight_ab (z_a - z_b)."""

    right: Floats
    """(H,W) weights of each pixel and the next in its row; 0 in the last column."""
    down: Floats
    """(H,W) weights of each pixel and the one below; 0 in the last row."""
    inverse: Floats
    """(H,W) 1 / diagonal; 0 where a pixel has no neighbour."""

    def residual(self, given: Floats, z: Floats) -> Floats:
        """given - A z, (H,W)."""
        out = np.empty_like(z)
        self._work(lambda *rows: residual_rows(self.right, self.down, given, z, out, *rows))
        return out

    def smooth(self, given: Floats, z: Floats) -> Floats:
        """z nearer to A^-1 given, by Chebyshev iteration.

        Saad, Iterative methods for sparse linear systems, 2003, algorithm 12.1.
        """
        low, high = SMOOTH
        middle, half = np.float32(high + low) / 2, np.float32(high - low) / 2
        keep, take, ratio = np.float32(0), 1 / middle, half / middle
        step = np.zeros_like(z)
        for _ in range(DEGREE):
            out = np.empty_like(z)
            args = self.right, self.down, self.inverse, given, z, keep, take, step, out
            self._work(lambda *rows, args=args: smooth_rows(*args, *rows))
            new = 1 / (2 * middle / half - ratio)
            keep, take, ratio, z = new * ratio, 2 * new / half, new, out
        return z

    def _work(self, work: Callable[[int, int], None]) -> None:
        H, W = self.right.shape
        run_blocks(work, H, max(BLOCK // W, 1))


def solve_laplace(
    right: Floats,
    down: Floats,
    given: Floats,
    start: Floats,
    tolerance: float,
    most: int = 200,
    check: Callable[[], None] = lambda: None,
) -> NDArray[np.float64]:
    """Find z with sum over neighbours b of weight_ab (z_a - z_b) = given_a at each pixel a.

    Conjugate gradients, preconditioned by one multigrid cycle on blocks of 2x2 pixels. On each
    connected part z is determined up to a constant, which comes from `start`.

    Args:
        right, down: (H,W) weights >= 0 of each pixel and the next to the right, or below; 0 in the
            last column, or row.
        given: (H,W) float64; its sum over each connected part is 0.
        start: (H,W) float64, a guess.
        tolerance: largest norm of what is left of `given`, relative to its own.
        most: steps of conjugate gradients at most.
        check: called before each step; may raise.

    Returns:
        (H,W); what is found after `most` steps where the tolerance is not reached.
    """
    grid = _grid(right.astype(np.float64), down.astype(np.float64))
    grids, last = _coarsen(right.astype(np.float32), down.astype(np.float32))
    z = start.astype(np.float64)
    rest = grid.residual(given, z)
    enough = tolerance**2 * (given * given).sum()
    nothing, step, before = np.zeros_like(z), np.zeros_like(z), np.inf
    for _ in range(most):
        check()
        if (rest * rest).sum() <= enough:
            break
        guess = _cycle(grids, last, rest.astype(np.float32)).astype(np.float64)
        now = (rest * guess).sum()
        if now == 0:  # what is left is below single precision
            break
        step = guess + now / before * step
        change = grid.residual(nothing, step)
        length = -now / (step * change).sum()
        z += length * step
        rest += length * change
        before = now
    return z


def _grid(right: Floats, down: Floats) -> Grid:
    diagonal = right + down
    diagonal[:, 1:] += right[:, :-1]
    diagonal[1:] += down[:-1]
    inverse = np.divide(1, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)
    return Grid(np.ascontiguousarray(right), np.ascontiguousarray(down), inverse)


def _coarsen(right: Floats, down: Floats) -> tuple[list[Grid], Floats]:
    """Grids of blocks of 2x2 pixels, finest first, and the inverse matrix of the last.

    The weight of two blocks is the mean of the two weights across their border, half of what the
    Galerkin product of piecewise constant functions has: those are too stiff by that factor.
    """
    grids = [_grid(right, down)]
    while max(right.shape) > COARSEST:
        r, d = _pad(right), _pad(down)
        right, down = (r[::2, 1::2] + r[1::2, 1::2]) / 2, (d[1::2, ::2] + d[1::2, 1::2]) / 2
        grids.append(_grid(right, down))
    units = np.eye(right.size, dtype=np.float32).reshape(-1, *right.shape)
    matrix = -np.stack([grids[-1].residual(0 * unit, unit).ravel() for unit in units])
    # constants, which have the eigenvalue 0, are left out
    inverse = np.linalg.pinv(matrix.astype(np.float64), rcond=1e-6, hermitian=True)
    return grids, inverse.astype(np.float32)


def _cycle(grids: list[Grid], last: Floats, rest: Floats) -> Floats:
    """About A^-1 `rest`: smoothed here, corrected on coarser grids, smoothed again."""
    if len(grids) == 1:
        return (last @ rest.ravel()).reshape(rest.shape)
    grid = grids[0]
    z = grid.smooth(rest, np.zeros_like(rest))
    left = _pad(grid.residual(rest, z))
    blocks = left[::2, ::2] + left[1::2, ::2] + left[::2, 1::2] + left[1::2, 1::2]
    coarse = _cycle(grids[1:], last, blocks)
    H, W = rest.shape
    z += coarse.repeat(2, axis=0).repeat(2, axis=1)[:H, :W]
    return grid.smooth(rest, z)


def _pad(values: Floats) -> Floats:
    """With even numbers of rows and columns; what is added is 0."""
    H, W = values.shape
    return np.pad(values, ((0, H % 2), (0, W % 2)))
