"""The stack at a glance: what each image is like among the others, and which stand out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.ndimage import shift as move

from .analysis import Analysis, Cancel, Confidence, Progress
from .confidence import GAIN, JUDGES, SATURATED, doubt_images
from .errors import Cancelled, InputError, OptionError
from .factors import Factor
from .stack import ImageStack

NEAR_COPY = 0.01
"""Difference of two images after the best factor, as a share of their rms, up to which they show
the same light, nearly: without shadows, lights about 2 degrees apart make as much."""
RESIDUAL = 0.05
"""How much farther an image may be from its linearization than the median image, of i."""
MOVED = 0.7
"""Pixels from which a shift is worth a word."""
BETTER = 0.8
"""What is left of the difference at edges, at most, for a shift to be believed."""
WINDOW, TAPER, FINE, COARSE = 512, 12, 1.0, 6.0
"""Pixels: the part of the picture that is compared, its fading border, what is too
fine to be compared, and what is too coarse to be an edge."""
FEWEST, FARTHEST = 400, 8
"""Pixels that it takes to tell a shift, and the part of the picture that it may be."""


@dataclass(frozen=True)
class Shift:
    """Where an image lies against its linearization."""

    rows: float
    """Pixels down, to a tenth."""
    columns: float
    """Pixels to the right."""
    left: float
    """What is left of the difference at edges when it is moved back: below 1 it fits better."""

    @property
    def sure(self) -> bool:
        """Whether it is large enough, and fits enough better, to be told."""
        return bool(np.hypot(self.rows, self.columns) > MOVED and self.left < BETTER)


@dataclass(frozen=True, eq=False)
class ImageReview:
    """One image among the others; NaN and None where the result or the image do not tell."""

    name: str
    shares: NDArray[np.float64]
    """(5,) share of each Factor code among the mask pixels, 0 to 1; read-only."""
    saturated: float
    """Share of saturated pixels, 0 to 1."""
    support: float
    """Share of the lit pixels that are possible, see `Confidence`, 0 to 1."""
    residual: float
    """Median of |i - l|/i among the lit pixels."""
    gain: float
    """Median of i/l there."""
    copy_of: int | None
    """Number of an earlier image that shows the same light; None for most."""
    shift: Shift | None
    findings: tuple[str, ...]
    """Sentences on what stands out, each with the number that says so."""


def review_images(
    stack: ImageStack,
    analysis: Analysis,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> tuple[ImageReview, ...]:
    """Look at each image of a stack beside the others and beside its linearization.

    Raises:
        InputError: stack and result differ in shape.
        Cancelled: `cancel` returned true.
    """
    if analysis.labels.shape != stack.shape:
        raise InputError(
            f"the result's labels have shape {analysis.labels.shape}, the stack {stack.shape}; "
            "a result of the stack itself is accepted"
        )
    known, copies = analysis.confidence, find_copies(stack)
    doubts = [] if known is None else doubt_images(stack, known)
    reviews = []
    for k, name in enumerate(stack.names):
        if cancel is not None and cancel():
            raise Cancelled("the overview was cancelled")
        shift = measure_shift(stack.images[k], analysis.linearized(k), stack.mask)
        here = f"image {k} ({name})"
        told = [doubt for doubt in doubts if doubt.startswith(f"{here} ")]
        if k in copies:
            told.append(_tell_copy(here, copies[k], stack.names))
        if shift is not None and shift.sure:
            told.append(
                f"{here} lies {abs(shift.rows):.1f} px {'below' if shift.rows > 0 else 'above'} "
                f"and {abs(shift.columns):.1f} px {'right' if shift.columns > 0 else 'left'} of "
                "the others; the camera or the object has moved"
            )
        if known is not None:
            told.extend(_tell_values(here, k, known, lights=stack.lights is not None))
        shares = np.bincount(analysis.labels[k][stack.mask], minlength=256) / stack.mask.sum()
        shares = shares[: len(Factor)]
        shares.setflags(write=False)
        copy = copies[k][0] if k in copies else None
        saturated, support, residual, gain = (
            (float("nan") if known is None else float(getattr(known, field)[k]))
            for field in ("saturated", "support", "residual", "gain")
        )
        reviews.append(
            ImageReview(name, shares, saturated, support, residual, gain, copy, shift, tuple(told))
        )
        if progress is not None:
            progress("overview", (k + 1) / len(stack.names))
    return tuple(reviews)


def count_classes(labels: NDArray[np.uint8], *factors: Factor) -> NDArray[np.uint16]:
    """In how many images each pixel has one of `factors`; D and S make how often it is lit.

    Args:
        labels: (K,H,W) Factor codes.

    Returns:
        (H,W), 0 to K; 0 outside the mask.

    Raises:
        OptionError: no factor, or one that is no class.
    """
    if not factors or not set(factors) <= set(Factor):
        raise OptionError(
            f"factors are {tuple(map(int, factors))}; accepted are one or more of "
            f"{', '.join(str(int(factor)) for factor in sorted(Factor))}"
        )
    count = np.zeros(labels.shape[1:], np.uint16)
    for one in labels:
        hit = one == np.uint8(factors[0])
        for factor in factors[1:]:
            hit |= one == np.uint8(factor)
        count += hit
    return count


def find_copies(stack: ImageStack) -> dict[int, tuple[int, float | None]]:
    """Images that show the same light as an earlier one, by some JUDGES pixels.

    Returns:
        {image: (earlier image, how many times as bright)}; None as the factor where all mask pixels
        are exactly the same. Noise above NEAR_COPY / sqrt(2) of the images' rms hides copies.
    """
    count = int(stack.mask.sum())
    ranks = np.arange(0, count, max(1, count // JUDGES))
    x = stack.images.reshape(len(stack.images), -1)[:, stack.pick(ranks)].astype(np.float64)
    products = x @ x.T
    power = np.maximum(products.diagonal(), 1e-30)
    left = 1 - products**2 / np.outer(power, power)
    found: dict[int, tuple[int, float | None]] = {}
    if len(ranks) <= 3:
        return found  # any three pixels may be alike under different lights
    for k in range(1, len(x)):
        j = int(np.argmin(left[:k, k]))
        if left[j, k] < NEAR_COPY**2:
            same = np.array_equal(stack.images[j][stack.mask], stack.images[k][stack.mask])
            found[k] = j, None if same else float(products[j, k] / power[j])
    return found


def measure_shift(
    image: NDArray[np.float32], linearized: NDArray[np.float32], mask: NDArray[np.bool_]
) -> Shift | None:
    """How far an image lies from its linearization, by phase correlation of their edges.

    Args:
        image: (H,W)
        linearized: (H,W) signed; NaN where unknown.
        mask: (H,W)

    Returns:
        None where too few pixels are known, nothing varies, or the best shift is no small one.
    """
    from skimage.registration import phase_cross_correlation

    known = mask & np.isfinite(linearized)
    if known.sum() < FEWEST:
        return None
    box = _middle(np.flatnonzero(known.any(axis=1))), _middle(np.flatnonzero(known.any(axis=0)))
    inside = known[box]
    fade = np.asarray(distance_transform_edt(np.pad(inside, 1)))[1:-1, 1:-1] / TAPER
    lit = np.maximum(np.where(inside, linearized[box], 0), 0)
    weight = inside.astype(np.float32)
    around = np.maximum(gaussian_filter(weight, COARSE), 1e-3)
    a, b = (
        (x - gaussian_filter(x * weight, COARSE) / around) * np.minimum(fade, 1)
        for x in (image[box], lit)
    )
    if not (a.any() and b.any()):
        return None
    back = phase_cross_correlation(b, a, upsample_factor=10)[0]
    # smooth alike, for moving by parts of pixels smooths too
    a, b = (gaussian_filter(x, FINE) for x in (a, b))
    # where edges are and both pictures reach, so that dots of noise and borders do not decide
    whole = (fade >= 1) & (move(np.minimum(fade, 1), back, order=1) > 0.99)
    if np.abs(back).max() > min(inside.shape) / FARTHEST or whole.sum() < FEWEST:
        return None
    slope = np.hypot(np.gradient(b, axis=0), np.gradient(b, axis=1))
    edges = whole & (slope >= np.quantile(slope[whole], 0.8))
    before, after = (np.median(np.abs(x - b)[edges]) for x in (a, move(a, back, order=1)))
    left = float(after / before) if before > 0 else 1.0
    return Shift(float(-back[0]), float(-back[1]), left)


def _middle(places: NDArray[np.intp]) -> slice:
    """From the first to the last place; of more than WINDOW, the middle ones."""
    first, last = places[[0, -1]]
    cut = max(0, (last + 1 - first - WINDOW + 1) // 2)
    return slice(int(first + cut), int(last + 1 - cut))


def _tell_copy(here: str, copy: tuple[int, float | None], names: tuple[str, ...]) -> str:
    j, factor = copy
    there = f"image {j} ({names[j]})"
    if factor is None:
        return f"{here} is the same as {there}; take one of them out"
    return f"{here} shows nearly the light of {there}, {factor:.2f} times as bright; it adds little"


def _tell_values(here: str, k: int, known: Confidence, *, lights: bool) -> list[str]:
    """What `doubt_images` leaves out: saturation, distance, and exposure where no lights say it."""
    told = []
    if known.saturated[k] > SATURATED:
        told.append(f"{100 * known.saturated[k]:.0f} % of {here} is saturated")
    usual = float(np.median(known.residual))
    slack = max(RESIDUAL, 5 * float(np.median(np.abs(known.residual - usual))))
    if known.residual[k] > usual + slack:
        told.append(
            f"{here} is {100 * known.residual[k]:.0f} % of i from its linearization, the median "
            f"image {100 * usual:.0f} %"
        )
    gain = known.gain / np.median(known.gain)
    slack = max(GAIN, 5 * float(np.median(np.abs(gain - 1))))
    if not lights and abs(gain[k] - 1) > slack:
        told.append(f"{here} is {gain[k]:.2f} times as bright as its linearization")
    return told
