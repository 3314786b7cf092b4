"""Step 2 of the method `robust`: each pixel by itself, with its neighbours, and large pictures from
thinned-out ones."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .analysis import Options
from .blocks import Talk, run_blocks
from .consensus import stopping_table
from .factors import Thresholds
from .fine import FEWEST_PIXELS, choose_step, fit_fine, thin_out
from .kernels import consensus_rows
from .observations import Observations
from .refit import ROUNDS, find_clear, refit_bases
from .settle import SWEEPS, settle_ties

BLOCK = 4096
TURNED = 1 << 16
"""Pixels whose bases are brought into the frame of the base images at once."""
BRIGHTEST = 1000
"""Pixels that show how bright the brightest grays are, at least."""
REACH = 4.0
"""Residual, in units of the noise, from which an observation has no weight in the last fit."""
LEAST_REACH = 0.003
"""The least such residual, as a share of the brightest grays."""
CROPPED = 0.5
"""Share of the picture that the object's rectangle has at most to be worked on by itself."""
LEAST_NOISE = 6e-4
"""The least noise, as a share of the brightest grays: rounding and faint light from elsewhere."""


@dataclass(frozen=True, eq=False)
class Quality:
    """What is known of a stack's observations."""

    white: NDArray[np.float32]
    """(K,) value from which observations of an image are saturated; infinity for none."""
    noise: float
    """Standard deviation of an observation, fraction of full scale."""


@dataclass(frozen=True)
class Effort:
    """How much is done; less is quicker, and less exact."""

    rounds: int = ROUNDS
    """Rounds of `refit_bases`."""
    sweeps: int = SWEEPS
    """Sweeps of `settle_ties`."""
    fewest: int = FEWEST_PIXELS
    """Pixels on which highlights of large pictures of many images are searched for."""


THOROUGH = Effort()


def linearize_robustly(
    images: NDArray[np.float32],
    mask: NDArray[np.bool_],
    coefficients: NDArray[np.float64],
    thresholds: Thresholds,
    options: Options,
    quality: Quality,
    talk: Talk,
    effort: Effort = THOROUGH,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Linearized bases (3,H,W), NaN where not determined, and margins (P,); see `linearize`.

    Args:
        images: (K,H,W)
        mask: (H,W)
    """
    rules = Rules(thresholds.T, thresholds.Ts, options.samples, options.seed, effort)
    box = bound(mask)
    if mask[box].size > CROPPED * mask.size:
        return fit_picture(images, mask, coefficients, quality, rules, talk)
    inside = np.ascontiguousarray(images[:, *box]), np.ascontiguousarray(mask[box])
    bases = np.zeros((3, *mask.shape), np.float32)
    bases[:, *box], lead = fit_picture(*inside, coefficients, quality, rules, talk)
    return bases, lead


def bound(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Rows and columns of the smallest rectangle that holds all of a mask."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return slice(0), slice(0)
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


@dataclass(frozen=True)
class Rules:
    """What decides a consensus."""

    T: float
    """Relative tolerance."""
    Ts: float
    """Shadow level, fraction of full scale."""
    limit: int
    """The most samples."""
    seed: int
    """Of all samples."""
    effort: Effort = THOROUGH


def fit_picture(
    images: NDArray[np.float32],
    mask: NDArray[np.bool_],
    coefficients: NDArray[np.float64],
    quality: Quality,
    rules: Rules,
    talk: Talk,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The same for a picture that the object nearly fills."""
    # solved in an orthogonal frame (see `factorize.orthogonalize`), returned in that of the bases
    q, r = np.linalg.qr(coefficients)
    scale = np.sqrt(len(q) / 3)
    factors = np.ascontiguousarray((q * scale).T, np.float32)
    count = int(np.count_nonzero(mask))
    thin = slice(None, None, max(1, count // BRIGHTEST))
    some = images.reshape(len(images), -1)[:, thin][:, mask.reshape(-1)[thin]]
    bright = float(np.quantile(some[some > 0], 0.99)) if (some > 0).any() else 1.0
    noise = quality.noise + LEAST_NOISE * bright
    seen = Observations(images, mask, factors, quality.white, rules.Ts, noise, bright)
    step = choose_step(count, len(images), rules.effort.fewest)
    if step == 1:
        bases, lead = fit_together(seen, rules, talk)
    else:
        bases, lead = fit_from_thinned(seen, step, rules, talk)
    back, flat = (np.linalg.inv(r) * scale).astype(np.float32), bases.reshape(3, -1)
    for start in range(0, flat.shape[1], TURNED):
        flat[:, start : start + TURNED] = back @ flat[:, start : start + TURNED]
    return bases, lead


def fit_together(
    seen: Observations, rules: Rules, talk: Talk
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Bases (3,H,W) and lead (P,) by consensus, ties settled, shared highlights left out."""
    pixels = np.flatnonzero(seen.mask)
    bases = np.zeros(seen.images.shape[1:], np.float32)[None].repeat(3, axis=0)
    lead = fit_alone(seen, pixels, rules, bases, talk.part(0, 0.4))
    settled = settle_ties(seen, bases, lead, talk.threads, talk.cancel, sweeps=rules.effort.sweeps)
    rest, rounds = talk.part(0.4, 1), rules.effort.rounds
    return refit_bases(seen, settled, rest.threads, rest.progress, rest.cancel, rounds), lead


def fit_from_thinned(
    seen: Observations, step: int, rules: Rules, talk: Talk
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The same for a picture too large to look at every pixel's surroundings."""
    coarse = thin_out(seen, step)
    first, _ = fit_together(coarse, rules, talk.part(0, 0.5))
    clear = find_clear(coarse, first, talk.threads, talk.cancel)
    rest = talk.part(0.5, 0.8)
    bases, lead, doubtful = fit_fine(
        seen, clear, step, rules.T, rest.threads, rest.progress, rest.cancel
    )
    alone = fit_alone(seen, doubtful, rules, bases, talk.part(0.8, 1))
    lead.reshape(-1)[doubtful] = alone
    sweeps = rules.effort.sweeps
    settled = settle_ties(seen, bases, alone, talk.threads, talk.cancel, doubtful, sweeps)
    return settled, lead[seen.mask]


def fit_alone(
    seen: Observations,
    pixels: NDArray[np.intp],
    rules: Rules,
    bases: NDArray[np.float32],
    talk: Talk,
) -> NDArray[np.int32]:
    """Consensus of each pixel by itself, into `bases` (3,H,W); NaN where nothing determines it.

    Returns:
        (P,) votes by which each won.
    """
    X = seen.images.reshape(len(seen.images), -1)
    flat = bases.reshape(3, -1)
    lead = np.zeros(len(pixels), np.int32)
    tries, seed = stopping_table(rules.limit), np.uint64(rules.seed)
    reach = max(REACH * (seen.noise - LEAST_NOISE * seen.bright), LEAST_REACH * seen.bright)
    levels = (np.float32(rules.T), np.float32(rules.Ts), np.float32(reach))

    def work(start: int, stop: int) -> None:
        some = pixels[start:stop]
        out, score = np.full((len(some), 3), np.nan, np.float32), np.empty(len(some), np.int32)
        consensus_rows(
            *(X, some, seen.factors, seen.white, *levels, tries, rules.limit, seed),
            *(out, score, lead[start:stop], 0, len(some)),
        )
        flat[:, some] = out.T

    run_blocks(
        work,
        len(pixels),
        BLOCK,
        threads=talk.threads,
        stage="linearize",
        progress=talk.progress,
        cancel=talk.cancel,
    )
    return lead
