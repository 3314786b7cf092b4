"""Bases that deviations from Lambert's law disturb least: from the lights that graze a surface.

Lambert's law holds best where n·s is small. Broad highlights lie around the mirror direction, that
is, among the bright observations; rough surfaces are flatter than Lambert says where they are
bright. So each pixel is fitted to the darker half of its lit observations, without the darkest,
which light from other surfaces fills. Shi et al. (CVPR 2012, PAMI 2014) choose dim observations for
the same reason. Where a surface is Lambertian that only adds noise: noise differs from pixel to
pixel and the materials' own deviations do not, which tells one from the other.
"""

import numpy as np
from numpy.typing import NDArray

from ..analysis import Analysis, Cancel, Progress
from ..blocks import run_blocks
from ..errors import InputError
from ..kernels import grazing_rows
from ..saturation import find_white
from ..stack import ImageStack

BLOCK = 1024
LOW, HIGH = 0.1, 0.5
"""Part of a pixel's lit observations that counts, from the darkest by the fit."""
LEAST, ENOUGH = 12, 24
"""Observations that count at least, and those that a pixel must have to be fitted: of fewer, those
that are left would hold highlights or follow the noise."""
DARK = 0.5
"""Share of the fit below which an observation is a shadow that other surfaces lighten."""
CUT, FLOOR = 4.0, 0.01
"""Residual without weight, in robust standard deviations of those that count, and the least such
deviation, as a share of the pixel's brightness."""
ROUNDS = 4
LEAST_CHANGE, NOISE_SHARE = 0.003, 0.5
"""Median change of the bases, as a share of their length, from which it matters, and the share of
its square that may be noise."""


def fit_grazing(
    stack: ImageStack,
    analysis: Analysis,
    powers: NDArray[np.floating] | None = None,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> NDArray[np.float32]:
    """Linearized bases from the observations in which lights graze the surface.

    For normals and albedo; labels stay those of `analysis.linearized_bases`, from which the
    choice starts. A stack whose bases change little by it, or by nothing but noise, keeps them:
    its surfaces are Lambertian, and more observations say more.

    Args:
        stack: what was analyzed.
        analysis: its coefficients and linearized bases, lights known or not.
        powers: (K,) of the lights, above 0, in any unit; as if equal when left out.
        threads: processors to use; the result does not depend on it.

    Returns:
        (3,H,W) signed, fraction of full scale, in the frame of `analysis.base_images`; those of
        `analysis` where a pixel is lit in fewer than ENOUGH images, or the lights that are left lie
        near a plane. NaN where those are, 0 outside the mask.

    Raises:
        InputError: stack, analysis and powers do not belong together.
        Cancelled: `cancel` said so.
    """
    weights = check_match(stack, analysis, powers)
    q, r = np.linalg.qr(analysis.coefficients)
    scale = np.sqrt(len(q) / 3)
    factors, to_frame = np.ascontiguousarray((q * scale).T), r / scale
    # einsum: the last digits of a product by BLAS depend on its threads
    old = np.einsum("ij,jhw->ihw", to_frame, analysis.linearized_bases.astype(np.float64))
    new = old.copy()
    flat, X = new.reshape(3, -1), stack.images.reshape(len(stack.images), -1)
    pixels = np.flatnonzero(analysis.determined())
    known = (factors, find_white(stack), weights, np.float32(analysis.thresholds.Ts))
    rules = (DARK, LOW, HIGH, LEAST, ENOUGH, CUT, FLOOR, ROUNDS)

    def work(start: int, stop: int) -> None:
        some = pixels[start:stop]
        out = np.ascontiguousarray(flat[:, some].T)
        grazing_rows(X, some, *known, *rules, out, 0, len(some))
        flat[:, some] = out.T

    run_blocks(
        work,
        len(pixels),
        BLOCK,
        threads=threads,
        stage="normals",
        progress=progress,
        cancel=cancel,
    )
    if not is_systematic(old, new):
        return analysis.linearized_bases
    changed = (new != old).any(axis=0)
    fitted = np.einsum("ij,jhw->ihw", np.linalg.inv(to_frame), new).astype(np.float32)
    return np.where(changed, fitted, analysis.linearized_bases)


def is_systematic(old: NDArray[np.float64], new: NDArray[np.float64]) -> bool:
    """Whether bases (3,H,W) in an orthogonal frame changed by something larger than noise.

    Noise is what differs between neighbours in a row; half the square of that, for both have it.
    """
    length = np.linalg.norm(old, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.where(length > 0, (new - old) / length, np.nan)
    squares = np.square(change).sum(axis=0)
    steps = np.square(np.diff(change, axis=2)).sum(axis=0) / 2
    squares, steps = squares[np.isfinite(squares)], steps[np.isfinite(steps)]
    if not squares.size or not steps.size:
        return False
    total = np.median(squares)
    return bool(total > LEAST_CHANGE**2 and np.median(steps) < NOISE_SHARE * total)


def check_match(
    stack: ImageStack, analysis: Analysis, powers: NDArray[np.floating] | None
) -> NDArray[np.float64]:
    """The powers (K,), 1 when left out; raises InputError where the three do not fit together."""
    if analysis.labels.shape != stack.shape or (analysis.mask != stack.mask).any():
        K, H, W = stack.shape
        raise InputError(
            f"the analysis is of {len(analysis.labels)} images of "
            f"{' x '.join(map(str, analysis.mask.shape))} pixels or has another mask, the stack "
            f"has {K} of {H} x {W}; the analysis of this stack is accepted"
        )
    if powers is None:
        return np.ones(len(stack.images))
    given = np.asarray(powers, np.float64)
    if given.shape != (len(stack.images),) or not (np.isfinite(given) & (given > 0)).all():
        raise InputError(
            f"powers have shape {given.shape} and may not be above 0; "
            f"{len(stack.images)} numbers above 0 are accepted"
        )
    return given
