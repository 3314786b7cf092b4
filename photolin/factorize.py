"""Rough coefficients of all images at once, by alternation: step 1 of `robust`.

Base images with wide highlights or a dominant plane give poor coefficients, whatever is done with
them. So they only give a start: bases are linearized with those coefficients, coefficients are
estimated again from the linearized bases, and so on while T is annealed down. The support over
all sampled pixels and images decides between starts from different base images. `refine` goes on
from there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel
from .consensus import fit_rows
from .errors import Cancelled, DegenerateError
from .factors import Thresholds
from .sample import Sample

COARSE = (6.0, 4.0, 3.0)
"""T during alternation, in units of T."""
MAX_T = 0.3
FLAT = 0.002
"""Root mean square of what the directions of (i1, i2, i3) have out of one plane; as little as this
noise alone could make."""
ROUGH_PIXELS = 1000
FINALISTS = 2
"""Starts, of all tried, that are followed beyond the first alternation."""
MIN_SCORE = 4
"""D - U a pixel needs to have a say in the coefficients: three D observations fit anything."""


NO_START = (
    "no base images explain the others: the lights may lie in one plane, the scene may be flat, "
    "or Ts may lie above most lit pixels; vary the lights or lower Ts"
)


@dataclass(frozen=True)
class Noise:
    """Spread of D observations below the fit, where no highlight can be."""

    relative: float
    """Standard deviation of (i - l)/i."""
    absolute: float
    """Standard deviation of i - l in the brighter half, fraction of full scale."""
    tail: float
    """(l - i)/i that few exceed, see `refine.WITHIN`; noise need not be normal."""


NO_NOISE = Noise(0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Factorization:
    """Coefficients and linearized bases of a sample that explain each other."""

    coefficients: NDArray[np.float64]
    """(K,3); columns orthogonal, of length sqrt(K/3)."""
    bases: NDArray[np.float32]
    """(3,M) of the sampled pixels; NaN where lit in fewer than three images."""
    score: int
    """D - U over all sampled pixels and images."""
    noise: Noise = NO_NOISE
    """What is left below the fit, where it was measured."""

    def thin(self, count: int) -> "Factorization":
        """With the bases of the pixels that `Sample.thin` keeps."""
        step = max(1, self.bases.shape[1] // count)
        return replace(self, bases=np.ascontiguousarray(self.bases[:, ::step]))


def search_coefficients(
    sample: Sample,
    starts: Sequence[tuple[int, int, int]],
    thresholds: Thresholds,
    seed: int,
    limit: int,
    cancel: Cancel | None = None,
) -> NDArray[np.float64]:
    """Rough coefficients: the best-supported ones from several choices of base images.

    Args:
        starts: triples of base images to start from.
        limit: the most random samples for one fit.

    Returns:
        (K,3)

    Raises:
        DegenerateError: no start led anywhere.
        Cancelled: `cancel` said so.
    """
    lit = (sample.images >= thresholds.Ts) & (sample.images > 0)
    dark = np.flatnonzero(lit.sum(axis=1) < 3)
    if dark.size:
        raise DegenerateError(
            f"image {dark[0]} is lit in fewer than three of the object's pixels (i >= Ts = "
            f"{thresholds.Ts:g}), which tells nothing of its light; take it out or lower Ts"
        )
    few = sample.thin(ROUGH_PIXELS)
    first = [start_coefficients(few, triple, thresholds, seed, limit) for triple in starts]
    found = [
        alternate(few, c, thresholds, COARSE[:1], seed, limit, cancel)
        for c in first
        if c is not None
    ]
    best = sorted((f for f in found if f is not None), key=lambda f: -f.score)[:FINALISTS]
    found = [
        alternate(few, f.coefficients, thresholds, COARSE[1:], seed, limit, cancel) for f in best
    ]
    found = [f for f in found if f is not None]
    if not found:
        raise DegenerateError(NO_START)
    return max(found, key=lambda f: f.score).coefficients


def start_coefficients(
    sample: Sample,
    triple: tuple[int, int, int],
    thresholds: Thresholds,
    seed: int,
    limit: int,
) -> NDArray[np.float64] | None:
    """(K,3) coefficients of Eq. (2) with raw base images, from pixels lit in all three.

    None where they are not determined: no image fits, or the base images hardly differ in three
    ways (see FLAT).
    """
    bases = sample.images[list(triple)].copy()
    lit = ((bases >= thresholds.Ts) & (bases > 0)).all(axis=0)
    unit = bases[:, lit].astype(np.float64)
    unit /= np.linalg.norm(unit, axis=0)
    spread = np.linalg.svd(unit, compute_uv=False)[-1] if lit.sum() >= 3 else 0
    T = min(max(3 * thresholds.T, 0.1), MAX_T)
    if spread <= FLAT * np.sqrt(lit.sum()):
        return None
    bases[:, ~lit] = np.nan
    return fit_coefficients(sample, bases, T, thresholds.Ts, seed, limit)


def fit_coefficients(
    sample: Sample,
    bases: NDArray[np.float32],
    T: float,
    Ts: float,
    seed: int,
    limit: int,
    guess: NDArray[np.float64] | None = None,
) -> NDArray[np.float64] | None:
    """(K,3) coefficients from bases (3,M), NaN in pixels without a say; None if not determined."""
    K = len(sample.images)
    voters = balance_directions(bases, np.random.default_rng(seed))
    frame = np.linalg.qr(voters[:, np.isfinite(voters[0])].T.astype(np.float64))[1]
    if len(frame) < 3 or np.linalg.cond(frame) > 1e4:
        return None
    # where lights or surface directions differ little, only an orthogonal frame tells them apart
    white = np.linalg.solve(frame.T, voters)
    start = None if guess is None else guess @ frame.T
    c, _ = fit_rows(sample.pixels, np.arange(K), white, T, Ts, limit=limit, seed=seed, guess=start)
    c = (c @ np.linalg.inv(frame).T).astype(np.float64)
    if not np.isfinite(c).all() or np.linalg.cond(c) > 1e4:
        return None
    return c


def alternate(
    sample: Sample,
    coefficients: NDArray[np.float64],
    thresholds: Thresholds,
    schedule: tuple[float, ...],
    seed: int,
    limit: int,
    cancel: Cancel | None = None,
) -> Factorization | None:
    """Bases from coefficients and coefficients from bases, once for each T of the schedule."""
    for factor in schedule:
        if cancel is not None and cancel():
            raise Cancelled("coefficients was cancelled")
        T = min(factor * thresholds.T, MAX_T)
        coefficients = orthogonalize(coefficients)
        bases, score = fit_bases(sample, coefficients, T, thresholds.Ts, seed, limit)
        bases[:, score < MIN_SCORE] = np.nan
        found = fit_coefficients(sample, bases, T, thresholds.Ts, seed, limit, coefficients)
        if found is None:
            return None
        coefficients = found
    coefficients = orthogonalize(coefficients)
    bases, score = fit_bases(sample, coefficients, thresholds.T, thresholds.Ts, seed, limit)
    return Factorization(coefficients, bases, int(score[score > 0].sum()))


def fit_bases(
    sample: Sample, coefficients: NDArray, T: float, Ts: float, seed: int, limit: int
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """(3,M) linearized bases of the sampled pixels and their (M,) scores."""
    columns = np.arange(sample.images.shape[1])
    b, score = fit_rows(sample.images, columns, coefficients.T, T, Ts, limit=limit, seed=seed)
    return np.ascontiguousarray(b.T), score


def orthogonalize(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same column space with orthogonal columns of length sqrt(K/3).

    Only in such a frame does a small determinant mean lights near a plane, and a direction of the
    bases a direction of the surface.
    """
    return np.linalg.qr(coefficients)[0] * np.sqrt(len(coefficients) / 3)


def balance_directions(
    bases: NDArray[np.float32], rng: np.random.Generator, cells: int = 6
) -> NDArray[np.float32]:
    """Bases with pixels of over-represented directions set to NaN.

    A plane that fills most of the picture is one direction; without this, a candidate that maps
    it right wins almost all votes whatever it does elsewhere.
    """
    length = np.linalg.norm(bases, axis=0)
    voters = np.flatnonzero(length > 0)
    if voters.size == 0:
        return bases
    rng.shuffle(voters)
    unit = bases[:, voters] / length[voters]
    side = 2 * cells + 1
    cell = np.ravel_multi_index(tuple(np.rint(unit * cells).astype(int) + cells), (side,) * 3)
    order = np.argsort(cell, kind="stable")
    counts = np.unique_counts(cell).counts
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size) - np.repeat(np.cumsum(counts) - counts, counts)
    keep = voters[rank < max(16, 2 * int(np.median(counts)))]
    balanced = np.full_like(bases, np.nan)
    balanced[:, keep] = bases[:, keep]
    return balanced
