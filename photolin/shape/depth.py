"""From normals to depth."""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..analysis import Cancel, Progress
from ..errors import Cancelled, DegenerateError, InputError
from .multigrid import solve_laplace

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

GRAZING = 0.005
"""Least z of a unit normal: slopes end at 200, also of normals that face away from the camera."""
SHARPNESS = 2.0
"""k of Cao et al.: how fast a pixel lets go of the neighbour with the larger jump."""
LOOSE = 1e-4
"""Weight of a pair of neighbours that both let go of, relative to one held by both."""
REACH, BRIDGE = 4, 0.01
"""Pixels without a normal, up to REACH from one that has one, carry depth across with its normal
and the weight BRIDGE: shadowed grooves do not cut a surface in two."""
ROUNDS = 30
STILL = 0.01
"""Root mean square change of depth, pixels, at which rounds end."""
ROUGH, FINE = 1e-3, 1e-6
"""Tolerance of the linear equations in each round, and at the end."""
STEPS, LAST_STEPS = 4, 100
"""Most steps of solving them: the next round goes on from there."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Pairs of neighbours along the last axis, (H,W): each pixel and the next."""

    weight: Floats
    """Confidence in the pair, 0 to 1; 0 where there is none."""
    scale: Floats
    """Mean z of the two unit normals."""
    slope: Floats
    """Depth of the next minus that of the pixel, as the normals have it."""

    def times(self, hold: Floats) -> Floats:
        """Weights in the least squares of depth."""
        return self.weight * self.scale**2 * hold


def integrate_normals(
    normals: NDArray[np.floating],
    mask: Flags,
    weights: NDArray[np.floating] | None = None,
    *,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> NDArray[np.float32]:
    """Depth of the surface that has these normals, seen by an orthographic camera.

    Bilateral normal integration (Cao, Santo, Shi, Okura, Matsushita, ECCV 2022): least squares of
    nz (dz - slope) over pairs of neighbours, weighted again and again such that of its two
    neighbours in a row or column, each pixel holds on to the one with the smaller jump nz dz; so
    depth may jump at outlines. Other than there, both pixels of a pair share one slope, that of the
    chord perpendicular to the sum of their unit normals: it is exact on planes and spheres, up to
    the outline.

    What normals cannot tell: the depth of a part that is not connected to others, nor how far an
    object stands before another one where its outline is a jump all around. A jump that opens
    slowly along a tear is bent into a slope.

    Args:
        normals: (H,W,3) of any length, x right, y up, z to the camera. NaN or 0 where undetermined.
            Those with z below 0.005, or facing away, are taken as grazing.
        mask: (H,W) bool, the pixels of the object.
        weights: (H,W) confidence in each normal, any scale; 0 is undetermined. Even if left out.

    Returns:
        (H,W) z to the camera in pixels: times mm per pixel it is in mm. The mean over each part is
        0; a part is connected by neighbours in rows and columns, also across up to 8 undetermined
        mask pixels. NaN outside the mask and where undetermined.

    Raises:
        InputError: shapes, types or weights other than these.
        DegenerateError: no normal in the mask.
        Cancelled: `cancel` said so.
    """
    _check(normals, mask, weights)
    confidence = np.ones(mask.shape) if weights is None else weights.astype(np.float64)
    unit, known = _normalize(normals, mask & (confidence > 0))
    if not known.any():
        raise DegenerateError(
            "no pixel of the mask has a normal; at least one finite normal is needed"
        )
    rows, columns = (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0))
    box = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    unit, confidence = _bridge(unit[box], known[box], mask[box], confidence[box])
    z = _integrate(unit, confidence, progress, cancel)
    out = np.full(mask.shape, np.nan, np.float32)
    out[box][known[box]] = _centre(z, known[box], confidence > 0)
    return out


def _check(normals: NDArray, mask: NDArray, weights: NDArray | None) -> None:
    if mask.ndim != 2 or mask.dtype != np.bool_ or normals.shape != (*mask.shape, 3):
        raise InputError(
            f"normals are of shape {normals.shape}, the mask is {mask.dtype} of shape "
            f"{mask.shape}; normals (rows, columns, 3) and a bool mask (rows, columns) are accepted"
        )
    if weights is not None and weights.shape != mask.shape:
        raise InputError(
            f"weights are of shape {weights.shape}; that of the mask, {mask.shape}, is accepted"
        )
    if weights is not None and not ((weights >= 0) & np.isfinite(weights)).all():
        raise InputError("weights hold NaN, infinity or less than 0; numbers from 0 are accepted")


def _normalize(normals: NDArray[np.floating], allowed: Flags) -> tuple[Floats, Flags]:
    """Unit normals, those without a direction 0, and which of `allowed` have one."""
    n = np.where(np.isfinite(normals).all(axis=2, keepdims=True), normals, 0).astype(np.float64)
    n /= np.maximum(np.abs(n).max(axis=2, keepdims=True), np.finfo(np.float64).tiny)
    length = np.linalg.norm(n, axis=2, keepdims=True)
    return n / np.where(length > 0, length, 1), allowed & (length[:, :, 0] > 0)


def _bridge(unit: Floats, known: Flags, mask: Flags, confidence: Floats) -> tuple[Floats, Floats]:
    """Normals with those of small gaps filled in from the nearest, and confidence up to 1."""
    from scipy.ndimage import distance_transform_edt

    confidence = np.where(known, confidence / confidence[known].max(), 0)
    if not (mask & ~known).any():
        return unit, confidence
    found = distance_transform_edt(~known, return_indices=True)
    distance, (row, column) = cast(tuple[Floats, NDArray[np.int32]], found)
    gap = mask & ~known & (distance <= REACH)
    confidence[gap] = BRIDGE * confidence[row, column][gap]
    return unit[row, column], confidence


def _steps(unit: Floats, confidence: Floats, along: int) -> Steps:
    """Pairs along the last axis; depth rises by -n[along] / nz from a pixel to the next."""
    up = np.maximum(unit[:, :, 2], GRAZING)
    weight, scale, slope = (np.zeros(confidence.shape) for _ in range(3))
    weight[:, :-1] = np.sqrt(confidence[:, 1:] * confidence[:, :-1])
    scale[:, :-1] = (up[:, 1:] + up[:, :-1]) / 2
    slope[:, :-1] = -(unit[:, 1:, along] + unit[:, :-1, along]) / (up[:, 1:] + up[:, :-1])
    return Steps(weight, scale, slope)


def _integrate(
    unit: Floats, confidence: Floats, progress: Progress | None, cancel: Cancel | None
) -> Floats:
    """Depth on the whole picture, each part with some constant; 0 where confidence is 0."""

    def check() -> None:
        if cancel is not None and cancel():
            raise Cancelled("depth was cancelled")

    across = _steps(unit, confidence, 0)
    # rows count downwards, y upwards
    downwards = _steps((unit * (1, -1, 1)).swapaxes(0, 1), confidence.T, 1)
    hold_across, hold_downwards = np.ones_like(across.weight), np.ones_like(downwards.weight)
    z, tolerance = np.zeros(confidence.shape), ROUGH
    for turn in range(ROUNDS + 1):
        right, down = across.times(hold_across), downwards.times(hold_downwards)
        given = _pull(right * across.slope) + _pull(down * downwards.slope).T
        most = LAST_STEPS if tolerance == FINE else STEPS
        before, z = z, solve_laplace(right, down.T, given, z, tolerance, most, check)
        if progress is not None:
            progress("depth", 1.0 if tolerance == FINE else (turn + 1) / (ROUNDS + 2))
        if tolerance == FINE:
            break
        moved = np.sqrt(np.square(z - before).sum() / (confidence > 0).sum())
        if moved < STILL or turn == ROUNDS - 1:
            tolerance = FINE
        hold_across, hold_downwards = _hold(z, across), _hold(z.T, downwards)
    return z


def _pull(flow: Floats) -> Floats:
    """What flows into each pixel from the one before, less what flows on to the next."""
    out = -flow
    out[:, 1:] += flow[:, :-1]
    return out


def _hold(z: Floats, steps: Steps) -> Floats:
    """How far the two pixels of each pair hold on to each other: 1 where nothing jumps."""
    jump, before = np.zeros_like(z), np.zeros_like(z)
    jump[:, :-1] = np.square(steps.scale * (np.roll(z, -1, axis=1) - z))[:, :-1]
    jump *= steps.weight > 0
    before[:, 1:] = jump[:, :-1]
    # the logistic function without overflow
    onwards = (1 + np.tanh(SHARPNESS / 2 * (before - jump))) / 2
    hold = onwards.copy()
    hold[:, :-1] += 1 - onwards[:, 1:]
    return np.maximum(hold, LOOSE)


def _centre(z: Floats, known: Flags, joined: Flags) -> Floats:
    """Depth of the known pixels, in raster order, less its mean over each joined part."""
    from scipy.ndimage import label

    parts = np.zeros(joined.shape, np.int32)
    label(joined, output=parts)
    part = parts[known]
    values = z[known]
    count = np.maximum(np.bincount(part), 1)
    return values - (np.bincount(part, values) / count)[part]
