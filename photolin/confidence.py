"""How far a result can be trusted: pixel by pixel, image by image, and as a whole."""

import numpy as np
from numpy.typing import NDArray

from .analysis import Cancel, Confidence
from .blocks import run_blocks
from .dimensions import Plane
from .factorize import orthogonalize
from .factors import Thresholds
from .kernels import evidence_rows
from .linearize import Quality
from .near_light import WORTH, Regions
from .stack import ImageStack

BLOCK = 1 << 13
JUDGES = 4000
"""Pixels that judge an image, about."""
FEW = 4
"""Lit images below which three observations fit whatever they are."""
MISFIT = 0.08
"""Share of lit pixels by which an image may fit worse than the median image."""
GAIN = 0.1
"""Change of exposure, against known light powers, that is worth a word."""
SATURATED = 0.05
DIFFUSE = 0.5
"""Share of the lit observations that are D below which images and lights do not go together."""
NEAR_RATIO = 6.0
"""Times that the lights of a quarter of the picture differ more than noise makes them."""
FLAT = 0.85
"""Share of the D observations from which two dimensions explain too many of them..."""
FLAT_RESIDUAL = 2.0
"""... unless what they leave is this many times the noise."""


def measure_confidence(
    stack: ImageStack,
    coefficients: NDArray[np.float64],
    bases: NDArray[np.float32],
    labels: NDArray[np.uint8],
    margin: NDArray[np.uint16],
    thresholds: Thresholds,
    quality: Quality,
    threads: int | None = None,
    cancel: Cancel | None = None,
) -> Confidence:
    """What each pixel and each image rests on.

    Args:
        coefficients: (K,3)
        bases: (3,H,W)
        labels: (K,H,W)
        margin: (P,) of `linearize`.

    Raises:
        Cancelled: `cancel` said so.
    """
    K, H, W = stack.shape
    X, flat = stack.images.reshape(K, -1), labels.reshape(K, -1)
    A = np.ascontiguousarray(orthogonalize(coefficients).T, np.float32)
    lit, diffuse = np.empty(H * W, np.uint16), np.empty(H * W, np.uint16)
    spread, Ts = np.empty(H * W, np.float32), np.float32(thresholds.Ts)

    def work(start: int, stop: int) -> None:
        evidence_rows(X, flat, A, quality.white, Ts, lit, diffuse, spread, start, stop)

    run_blocks(work, H * W, BLOCK, threads=threads, stage="confidence", cancel=cancel)
    lit[~stack.mask.reshape(-1)] = 0
    lead = np.zeros((H, W), np.uint16)
    lead[stack.mask] = margin
    some = stack.pick(np.arange(0, len(margin), max(1, len(margin) // JUDGES)))
    seen = X[:, some]
    saturated = seen >= quality.white[:, None]
    # what is saturated is darker than it should be; as 0 it is not lit
    support, residual, gain = judge_images(
        np.where(saturated, np.float32(0), seen),
        coefficients @ bases.reshape(3, -1)[:, some],
        thresholds,
        quality.noise,
    )
    return Confidence(
        lit=lit.reshape(H, W),
        diffuse=diffuse.reshape(H, W),
        margin=lead,
        spread=spread.reshape(H, W),
        support=support,
        residual=residual,
        gain=gain,
        saturated=saturated.mean(axis=1),
    )


def judge_images(
    i: NDArray[np.float32],
    l: NDArray[np.float64],
    thresholds: Thresholds,
    noise: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Support, residual and gain of each image, from some pixels.

    Args:
        i: (K,M) input.
        l: (K,M) linearized, NaN where unknown.
        noise: standard deviation of an observation, fraction of full scale.

    Returns:
        (K,) share of the lit pixels that are possible: not below the fit, which nothing can cause,
        by more than T i and three times the noise; (K,) median of |i - l|/i and (K,) median of i/l
        where both are lit. 1, 0 and 1 for an image without such pixels.
    """
    support, residual, gain = np.ones(len(i)), np.zeros(len(i)), np.ones(len(i))
    for k in range(len(i)):
        lit = (i[k] >= max(thresholds.Ts, 1e-9)) & np.isfinite(l[k])
        if not lit.any():
            continue
        a, b = i[k, lit], l[k, lit]
        slack = thresholds.T * a + 3 * noise
        support[k] = ((b - a <= slack) & (b >= -slack)).mean()
        facing = b >= max(thresholds.Ts, 1e-9)
        if facing.any():
            residual[k] = np.median(np.abs(a - b)[facing] / a[facing])
            gain[k] = np.median(a[facing] / b[facing])
    return support, residual, gain


def find_doubts(stack: ImageStack, confidence: Confidence, thresholds: Thresholds) -> list[str]:
    """Sentences on what is wrong or cannot be told, each with the number that says so."""
    lit = confidence.lit[stack.mask]
    few, unlit = lit < FEW, lit < 3
    del lit
    doubts = []
    if unlit.any():
        doubts.append(
            f"{unlit.sum()} of {unlit.size} pixels are lit in fewer than three images (i >= Ts = "
            f"{thresholds.Ts:g}), too few to determine them"
        )
    if few.mean() > 0.2:
        doubts.append(
            f"{100 * few.mean():.0f} % of the pixels are lit in fewer than {FEW} images, so that "
            "nothing checks their linearized values; more images would"
        )
    share = confidence.saturated.mean()
    if share > SATURATED:
        doubts.append(
            f"{100 * share:.0f} % of the observations are saturated and have no say; shorten the "
            "exposure"
        )
    return doubts + (doubt_model(stack, confidence) or doubt_images(stack, confidence))


def doubt_model(stack: ImageStack, confidence: Confidence) -> list[str]:
    """Whether the images follow the lights at all."""
    diffuse, lit = confidence.diffuse[stack.mask].sum(), confidence.lit[stack.mask].sum()
    if diffuse >= DIFFUSE * lit:
        return []
    cause = (
        "the surface may be too glossy"
        if stack.lights is None
        else "the lights given may not belong to these images, not be in their order, or have "
        "other powers"
    )
    return [
        f"only {100 * diffuse / lit:.0f} % of the lit observations agree with the result within "
        f"T: {cause}"
    ]


def doubt_images(stack: ImageStack, confidence: Confidence) -> list[str]:
    """Images that do not fit the others."""
    doubts = []
    support, gain = confidence.support, confidence.gain
    usual = np.median(support)
    # the last: shares of few pixels say little
    slack = max(MISFIT, 5 * np.median(np.abs(support - usual)), 2 / np.sqrt(stack.mask.sum()))
    for k in np.flatnonzero(support < usual - slack):
        doubts.append(
            f"image {k} ({stack.names[k]}) does not fit the others: {100 * (1 - support[k]):.0f} % "
            f"of its lit pixels are darker than possible, {100 * (1 - usual):.0f} % of the median "
            "image's; a moved camera, a wrong light or a wrong order are possible"
        )
    if stack.lights is not None:
        slack = max(GAIN, 5 * float(np.median(np.abs(gain - np.median(gain)))))
        for k in np.flatnonzero(np.abs(gain / np.median(gain) - 1) > slack):
            doubts.append(
                f"image {k} ({stack.names[k]}) is {gain[k] / np.median(gain):.2f} times as bright "
                "as its light power says; another exposure or a flickering light are possible"
            )
    return doubts


def doubt_distance(regions: Regions | None) -> list[str]:
    """Whether the lights are too near for one direction each."""
    if regions is None or regions.quarters < WORTH:
        return []
    if regions.quarters < NEAR_RATIO * regions.control:
        return []
    return [
        f"the lights differ between the quarters of the picture by {regions.quarters:.1f} degrees "
        f"({regions.control:.1f} from noise): they may be near the object; move them away, or "
        "analyze a smaller region"
    ]


def doubt_dimensions(plane: Plane | None) -> list[str]:
    """Whether the stack really has three dimensions."""
    if plane is None or plane.explained < FLAT or plane.residual > FLAT_RESIDUAL:
        return []
    return [
        f"the stack hardly has three dimensions: two explain {100 * plane.explained:.0f} % of its "
        f"diffuse observations, and leave {plane.residual:.1f} times the noise; the lights may lie "
        "in one plane or the scene may be flat: vary the lights, or give them"
    ]
