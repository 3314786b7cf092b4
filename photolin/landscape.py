"""What every pair of thresholds makes of a result: the T-Ts landscape.

Pairs relabel by Eq. (3) of Mukaigawa et al. 2007 with the linearized bases that are there; they do
not linearize again. The bases of the method robust hardly depend on T, those of the others do.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label

from .analysis import Analysis, Cancel, Progress
from .blocks import run_blocks
from .errors import InputError, OptionError
from .factors import Factor
from .kernels.landscape import landscape_rows
from .stack import ImageStack

SAMPLE = 1 << 18
"""Mask pixels that are looked at: all of 512 x 512; of more, each share has a standard deviation
of at most 0.5 / sqrt(SAMPLE) = 0.1 %."""
BLOCK = 1 << 14
USUAL_T, USUAL_TS = (0.003, 0.3), (0.001, 0.2)
WIDER = 3.0
"""Factor by which the usual ranges reach beyond the present thresholds at least."""
ACCURATE = (Factor.CAST, Factor.ATTACHED, Factor.DIFFUSE, Factor.SPECULAR)
"""True classes of the macro accuracy, as in Table 2 of the paper."""
STABLE = 0.3
"""Share of the cells that count as stable, of those where U does not forbid it."""
POSSIBLE = 0.1
"""How far U, which nothing can cause, may be from its least share on the map to its greatest."""

Range = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Landscape:
    """Labels of one result at n x n pairs of thresholds, counted; read-only.

    Rows of the arrays go with Ts, columns with T, both ascending.
    """

    T: NDArray[np.float64]
    """(n,) relative tolerance of each column, unitless, evenly spaced on a log scale."""
    Ts: NDArray[np.float64]
    """(n,) shadow level of each row, fraction of full scale, evenly spaced on a log scale."""
    shares: NDArray[np.float64]
    """(5,n,n) share of each Factor code among the observations, 0 to 1."""
    change: NDArray[np.float64]
    """(n,n) share of the observations whose label differs in the next cell, 0 to 1: mean of the
    neighbours with greater T and with greater Ts; small is stable."""
    accuracy: NDArray[np.float64] | None
    """(n,n) percent of a true class given its label, mean over C, A, D and S as far as there are
    any; None without truth, NaN where it has none of them."""
    undetermined: float
    """Share of observations that are U at all thresholds, for want of a linearized value."""
    pixels: int
    """Mask pixels that were looked at, each in all images."""

    def __post_init__(self) -> None:
        for array in (self.T, self.Ts, self.shares, self.change, self.accuracy):
            if array is not None:
                array.setflags(write=False)

    def cell(self, T: float, Ts: float) -> tuple[int, int]:
        """(row, column) of the cell nearest to T and Ts; those outside count as at the border."""
        return _nearest(self.Ts, Ts), _nearest(self.T, T)


def map_landscape(
    stack: ImageStack,
    analysis: Analysis,
    T: Range | None = None,
    Ts: Range | None = None,
    cells: int = 24,
    truth: NDArray[np.uint8] | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Landscape:
    """Label a stack at `cells` x `cells` pairs of thresholds.

    Cells are shifted by less than half a cell so that one lies exactly at the thresholds of
    `analysis`, where they are in range: its shares are those of `analysis.labels`, as long as all
    pixels are looked at (SAMPLE).

    Args:
        T: (low, high), 0 < low < high <= 1; usual values around those of `analysis` if left out.
        Ts: (low, high), fraction of full scale, 0 < low < high < 1; the same.
        cells: on each axis, 2 to 64.
        truth: (K,H,W) true Factor codes; others, as OUTSIDE, have no say.

    Raises:
        OptionError: a range or `cells` is not as above.
        InputError: stack, result and truth differ in shape.
        Cancelled: `cancel` returned true.
    """
    _check(stack, analysis, cells, truth)
    used = analysis.thresholds
    T = _check_range("T", T or _around(USUAL_T, used.T, 1.0))
    Ts = _check_range("Ts", Ts or _around(USUAL_TS, used.Ts, math.nextafter(1, 0)))
    levels = [_axis(T, cells, used.T), _axis(Ts, cells, used.Ts)]
    picks = stack.pick(_ranks(int(stack.mask.sum())))
    rows = np.zeros(256, np.int64)
    told = np.empty((0, 0), np.uint8)
    if truth is not None:
        told = truth.reshape(len(truth), -1)
        rows[:] = len(ACCURATE)
        rows[list(ACCURATE)] = np.arange(len(ACCURATE))
    images, c = (
        stack.images.reshape(len(stack.images), -1),
        analysis.coefficients.astype(np.float32),
    )
    bases = np.ascontiguousarray(analysis.linearized_bases).reshape(3, -1)
    tolerances, shadows = (level.astype(np.float32) for level in levels)
    size = (rows.max() + 1, 5, cells + 2, cells + 2)
    parts = np.zeros((-(-len(picks) // BLOCK), *size), np.int64)

    def work(start: int, stop: int) -> None:
        part = parts[start // BLOCK]
        landscape_rows(images, bases, c, told, rows, picks, tolerances, shadows, part, start, stop)

    run_blocks(work, len(picks), BLOCK, stage="landscape", progress=progress, cancel=cancel)
    return _summarize(parts.sum(axis=0), levels, len(picks), truth is not None)


def plateau(landscape: Landscape) -> tuple[int, int]:
    """(row, column) in the middle of the largest area of stable labels: a suggestion.

    A cell is stable where less of each class is exchanged with the cells around it, in the mean of
    D, S, A and C, than in all but STABLE of the cells where U is within POSSIBLE of its least
    share. Classes count alike, else the many D would hide that the few S are eaten as T grows; and
    where T is below the noise nothing changes either, but half of the noise is U. Stable cells that
    share a side make an area; the middle of the largest is its cell farthest from others and from
    the border of the map, of equals the one with the least exchange. Stable thresholds need not be
    the best: in noise they are at a T that takes all noise for D, and faint highlights with it.
    """
    impossible = landscape.shares[Factor.UNDEFINED]
    low, high = impossible.min(), impossible.max()
    possible = impossible <= low + POSSIBLE * (high - low)
    exchange = _exchange(landscape.shares[1:])
    areas = np.empty(exchange.shape, np.int32)
    label(possible & (exchange <= np.quantile(exchange[possible], STABLE)), output=areas)
    largest = areas == 1 + int(np.argmax(np.bincount(areas.ravel())[1:]))
    depth = np.asarray(distance_transform_edt(np.pad(largest, 1)))[1:-1, 1:-1]
    deepest = np.flatnonzero(depth == depth.max())
    best = deepest[np.argmin(exchange.ravel()[deepest])]
    row, column = divmod(int(best), exchange.shape[1])
    return row, column


def _exchange(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,n) share of a class (C,n,n) that a cell and its neighbours do not have in common, mean
    over classes and directions; along T and along Ts each class only grows or only shrinks."""
    total = np.zeros(shares.shape[1:])
    for axis in (1, 2):
        a, b = np.delete(shares, -1, axis), np.delete(shares, 0, axis)
        larger = np.maximum(a, b)
        gone = np.divide(np.abs(a - b), larger, out=np.zeros_like(a), where=larger > 0).mean(axis=0)
        padded = np.pad(gone, [(1, 1) if d == axis - 1 else (0, 0) for d in (0, 1)], mode="edge")
        total += np.delete(padded, -1, axis - 1) + np.delete(padded, 0, axis - 1)
    return total / 4


def _summarize(
    counts: NDArray[np.int64], levels: list[NDArray[np.float64]], pixels: int, with_truth: bool
) -> Landscape:
    """From (rows,5,cells+2,cells+2) of `landscape_rows`; its last level only tells changes."""
    n = len(levels[0]) - 1
    lit = counts[:, :, ::-1].cumsum(axis=2)[:, :, ::-1][:, :, 1:]  # a > m
    dark = counts.sum(axis=3).cumsum(axis=2)[:, :, :n, None].repeat(n, axis=3)  # a <= m
    later = lit.cumsum(axis=3)  # b <= j
    diffuse = later[:, 1:, :n, :n].sum(axis=1)
    unfit = (later[..., -1:] - later)[:, :, :n, :n]  # b > j
    labelled = np.stack(
        [diffuse, unfit[:, 3] + unfit[:, 4], dark[:, 1] + dark[:, 3], dark[:, 2] + dark[:, 4]]
    )
    total = counts.sum()
    shares = np.concatenate([np.zeros((1, n, n)), labelled.sum(axis=1) / total])
    shares[Factor.UNDEFINED] = (dark[:, 0] + unfit[:, :3].sum(axis=1)).sum(axis=0) / total
    along_T = lit[:, 1:, :n, 1 : n + 1].sum(axis=(0, 1))
    along_Ts = counts[:, 1:, 1 : n + 1].sum(axis=(0, 1, 3))[:, None]
    accuracy = None
    if with_truth:
        true = counts.sum(axis=(1, 2, 3))[: len(ACCURATE)]
        rates = [labelled[f - 1, row] / true[row] for row, f in enumerate(ACCURATE) if true[row]]
        accuracy = 100 * np.mean(rates, axis=0) if rates else np.full((n, n), np.nan)
    return Landscape(
        T=levels[0][:-1],
        Ts=levels[1][:-1],
        shares=shares,
        change=(along_T + along_Ts) / (2 * total),
        accuracy=accuracy,
        undetermined=float(counts[:, 0].sum() / total),
        pixels=pixels,
    )


def _check(
    stack: ImageStack, analysis: Analysis, cells: int, truth: NDArray[np.uint8] | None
) -> None:
    if not 2 <= cells <= 64:
        raise OptionError(f"cells is {cells}; accepted is 2 to 64")
    for what, labels in (("result's", analysis.labels), ("true", truth)):
        if labels is not None and labels.shape != stack.shape:
            raise InputError(
                f"the {what} labels have shape {labels.shape}, the stack {stack.shape}; "
                "labels of the same images are accepted"
            )


def _check_range(name: str, pair: Range) -> Range:
    low, high = pair
    if not (0 < low < high and (high <= 1 if name == "T" else high < 1)):
        raise OptionError(
            f"the range of {name} is {low:g} to {high:g}; "
            f"accepted is from above 0 to a greater number {'up to' if name == 'T' else 'below'} 1"
        )
    return pair


def _around(usual: Range, present: float, most: float) -> Range:
    """The usual range, widened to hold the present value."""
    low = min(usual[0], present / WIDER) if present > 0 else usual[0]
    return low, min(max(usual[1], present * WIDER), most)


def _axis(ends: Range, cells: int, present: float) -> NDArray[np.float64]:
    """(cells+1,) middles of cells, and of one beyond; one is `present`, where in range."""
    low, step = math.log(ends[0]), math.log(ends[1] / ends[0]) / cells
    middles = low + (np.arange(cells + 1) + 0.5) * step
    if not ends[0] <= present <= ends[1]:
        return np.exp(middles)
    at = min(int((math.log(present) - low) / step), cells - 1)
    axis = np.exp(middles + math.log(present) - middles[at])
    axis[at] = present
    return axis


def _nearest(axis: NDArray[np.float64], value: float) -> int:
    return int(np.argmin(np.abs(np.log(axis / value)))) if value > 0 else 0


def _ranks(count: int) -> NDArray[np.intp]:
    """Which of `count` mask pixels are looked at: all, or one at random of each of SAMPLE runs."""
    if count <= SAMPLE:
        return np.arange(count)
    places = np.arange(SAMPLE) + np.random.default_rng(0).random(SAMPLE)
    return (places * (count / SAMPLE)).astype(np.intp)
