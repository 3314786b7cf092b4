"""Coefficients to the last digit: weighted factorization of the observations that are diffuse.

Alternation (`factorize`) zigzags towards the best coefficients and stops far from them, because
bases fitted to noisy coefficients pull the coefficients back. Eliminating the bases instead (each
pixel's own are a linear least-squares problem) leaves one problem in the coefficients of all images
together, solved by Gauss-Newton steps: Wiberg, "Computation of principal components when data are
missing", COMPSTAT 1976; Okatani and Deguchi, IJCV 72(3), 2007.
"""

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel
from .errors import Cancelled, DegenerateError
from .factorize import (
    MIN_SCORE,
    NO_NOISE,
    NO_START,
    ROUGH_PIXELS,
    Factorization,
    Noise,
    fit_bases,
    orthogonalize,
)
from .sample import Sample

WITHIN = 0.84
"""Share of the noise that the suggested T lets pass (1.4 standard deviations of a normal one). It
trades diffuse pixels lost to noise against highlights lost to T, for the best mean of both."""
MIN_T, MAX_T = 0.016, 0.12
FIRST_T = 0.1
CUT = 3.0
"""Residual, in units of the noise, beyond which an observation is no longer diffuse in the fit."""
FIRST_WIDTH = 0.03
LAST_WIDTH = 5e-4
"""Below this, residuals of noise-free 16-bit images are rounding."""
ROUNDS = 12
EARLY = 4
"""Rounds on the smallest part of the sample: far from the noise, more pixels tell no more."""
MORE_PIXELS = 2000
"""Pixels from then on, until the coefficients are still."""
LATE = 2
"""Rounds on the whole sample, if they are not still before."""
STILL = 2e-5
"""Change of the coefficients in one round, relative to their length, that ends the rounds."""
DIM = 0.1
"""Brightness, as a share of what pixels usually reach, below which being dimmer counts no more."""
DAMPING = 1e-6
NOISE_OBSERVATIONS = 120_000
"""Observations from which noise is read, at least."""
HESSIAN_OBSERVATIONS, HESSIAN_PIXELS = 20_000, 300
"""Observations that say how the coefficients depend on each other, and pixels, at least."""


def refine_coefficients(
    sample: Sample,
    coefficients: NDArray[np.float64],
    Ts: float,
    seed: int,
    limit: int,
    cancel: Cancel | None = None,
    rounds: int = ROUNDS,
) -> Factorization:
    """The factorization that best explains the diffuse observations, from rough coefficients.

    Each round fits bases by consensus within a tolerance that follows the noise, weighs D
    observations by their residual (a Gaussian whose width is annealed down to the noise, so that
    highlight tails lose their say), and takes a Gauss-Newton step in all coefficients.

    Args:
        coefficients: (K,3)
        rounds: how many at most; with a few, only the last ones of the annealing, for coefficients
            that are nearly right.

    Raises:
        DegenerateError: the observations do not determine coefficients.
        Cancelled: `cancel` said so.
    """
    before = c = orthogonalize(coefficients)
    noise = Noise(FIRST_T / CUT, 0.0, FIRST_T)
    bases, score = np.empty((3, 0), np.float32), np.empty(0, np.int32)
    some = few = sample.thin(ROUGH_PIXELS)
    more = sample.thin(MORE_PIXELS)
    for round_ in range(ROUNDS - rounds, ROUNDS):
        if round_ >= EARLY and some is few:
            some = more
        if round_ >= ROUNDS - LATE:
            some = sample
        if cancel is not None and cancel():
            raise Cancelled("coefficients was cancelled")
        wanted = max(CUT * noise.relative, MIN_T)
        tolerance = max(min(wanted, FIRST_T), FIRST_T * 0.5**round_)
        bases, score = fit_bases(some, c, tolerance, Ts, seed, limit)
        noise = measure_noise(some.images, c, bases, tolerance, Ts)
        width = max(2 * noise.relative, FIRST_WIDTH * 0.5**round_, LAST_WIDTH)
        weights = weigh(some, c, bases, score, tolerance, Ts, width)
        if not weights.any():
            raise DegenerateError(NO_START)
        before, c = c, gauss_newton_step(some.pixels, weights, c)
        if not np.isfinite(c).all() or np.linalg.cond(c) > 1e4:
            raise DegenerateError(NO_START)
        c = orthogonalize(c)
        # annealing goes on while it still changes the width, however little the coefficients move
        still = round_ >= EARLY and change_of_span(before, c) < STILL
        if still and width <= max(2 * noise.relative, LAST_WIDTH):
            if some is sample:
                break
            some = sample
    # the last step has turned the frame that the bases are in, the more the less is determined
    bases = (np.linalg.lstsq(c, before)[0] @ bases).astype(np.float32)
    return Factorization(c, bases, int(score[score > 0].sum()), noise)


def follow_noise(noise: Noise) -> float:
    """T that lets all but the tail of the noise pass."""
    return float(np.clip(noise.tail, MIN_T, MAX_T))


def measure_noise(
    images: NDArray[np.float32],
    coefficients: NDArray[np.float64],
    bases: NDArray[np.float32],
    T: float,
    Ts: float,
) -> Noise:
    """Noise of the D observations with i < l.

    Args:
        images: (K,M)
        coefficients: (K,3)
        bases: (3,M), NaN where unknown.
    """
    step = max(1, images.size // NOISE_OBSERVATIONS)
    images, bases = images[:, ::step], bases[:, ::step]
    l = coefficients.astype(np.float32) @ bases
    with np.errstate(invalid="ignore"):
        short = l - images
        near = (images >= Ts) & (np.abs(short) <= FIRST_T * images)
    # three unknowns take their share of the noise away, nearly all of it where few are lit
    count = near.sum(axis=0)
    short *= np.sqrt(count / np.maximum(count - 3, 0.5)).astype(np.float32)
    below = near & (count > 3) & (short > 0)
    short, i, level = short[below], images[below], l[below]
    counted = short <= T * i
    if not counted.any():
        return NO_NOISE
    tail = float(np.quantile(short / i, WITHIN))
    # FIRST_T i cuts off the noise of dim observations, but not that of bright ones; bright by the
    # fit: among equally lit pixels the brighter observations are those with less noise below it
    bright = level >= np.median(level)
    return Noise(half_normal((short / i)[counted]), half_normal(short[bright]), tail)


def half_normal(deviations: NDArray[np.float32]) -> float:
    """Standard deviation of the normal distribution of whose one side these are."""
    return float(np.median(deviations) / 0.6745)


def weigh(
    sample: Sample,
    coefficients: NDArray[np.float64],
    bases: NDArray[np.float32],
    score: NDArray[np.int32],
    T: float,
    Ts: float,
    width: float,
) -> NDArray[np.float64]:
    """(M,K) weights of the observations: Gaussian in (i - l)/i for D, 0 for all others.

    Times 1/i, down to DIM: the dimmer of two D observations departs less from Lambert's law, in
    absolute terms, and from the fit.
    """
    i = sample.pixels
    l = (coefficients.astype(np.float32) @ bases).T
    with np.errstate(invalid="ignore", divide="ignore"):
        residual = (i - l) / i
        diffuse = (i >= Ts) & (np.abs(residual) <= T) & (score >= MIN_SCORE)[:, None]
    bright = np.median(np.quantile(i, 0.95, axis=1))
    surer = bright / np.maximum(i, DIM * bright)
    fitting = np.exp(-0.5 * (np.where(diffuse, residual, 0) / width) ** 2)
    return np.where(diffuse, surer * fitting, 0.0)


def gauss_newton_step(
    X: NDArray[np.float32], W: NDArray[np.float64], c: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Coefficients after one step towards the least sum of W (X - b c)^2 with the best b.

    Args:
        X: (M,K) observations, a row for each pixel.
        W: (M,K) weights, 0 leaves an observation out.
        c: (K,3) coefficients.
    """
    K = len(c)
    gram = (W @ (c[:, :, None] * c[:, None, :]).reshape(K, 9)).reshape(-1, 3, 3)
    size = np.prod(np.diagonal(gram, axis1=1, axis2=2), axis=1)
    known = np.linalg.det(gram) > 1e-6 * size
    inverse = np.linalg.inv(gram[known])
    x, w = X[known].astype(np.float64), W[known]
    b = (inverse @ ((w * x) @ c)[:, :, None])[:, :, 0]
    gradient = (w * (x - b @ c.T)).T @ b
    # b follows c: what a change of c moves within the span of c does not count
    # the Hessian only says which way to step: float32 and some of the pixels are enough
    step = max(1, len(b) // max(HESSIAN_OBSERVATIONS // K, HESSIAN_PIXELS))
    b, w, inverse = b[::step], w[::step] * step, inverse[::step] / step
    spanned = np.linalg.cholesky(inverse).transpose(0, 2, 1) @ c.T * w[:, None, :]
    spanned = spanned.astype(np.float32).reshape(-1, K)
    hessian = np.empty((K, 3, K, 3))
    for i in range(3):
        for j in range(i, 3):
            both = b[:, i] * b[:, j]
            repeated = np.repeat(both.astype(np.float32), 3)[:, None]
            block = np.diag(both @ w) - spanned.T @ (repeated * spanned)
            hessian[:, i, :, j] = block
            hessian[:, j, :, i] = block.T
    hessian = hessian.reshape(3 * K, 3 * K)
    # any 3x3 map of c fits as well: damping keeps those nine directions still
    # where no pixel is known, nothing moves
    hessian[np.diag_indices(3 * K)] += DAMPING * np.trace(hessian) / (3 * K) or 1.0
    return c + np.linalg.solve(hessian, gradient.ravel()).reshape(K, 3)


def change_of_span(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Distance of two column spaces, given by orthogonal columns of one length; 0 to 1."""
    length = np.linalg.norm(a[:, 0])
    outside = b / length - a @ (a.T @ b) / length**3
    return float(np.linalg.norm(outside) / np.sqrt(3))
