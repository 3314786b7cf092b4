"""How far a result is from the truth: Tables 1 and 2 of Mukaigawa et al. 2007, and errors.

Table 3, of surfaces, is in shape.compare_methods.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .factors import LETTERS, Factor
from .oracle import fit_oracle
from .shape.compare_surface import SurfaceErrors, compare_surface, describe_errors
from .shape.recover import Shape
from .shape.true_surface import TrueSurface, surface_of
from .synthetic import Truth

ROWS = (Factor.CAST, Factor.ATTACHED, Factor.DIFFUSE, Factor.SPECULAR)
"""The true classes in the order of the paper's tables."""
COLUMNS = (*ROWS, Factor.UNDEFINED)
"""The classes of a result in the order of the paper's tables."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A result measured against its truth."""

    counts: NDArray[np.int64]
    """(4,) observations (pixel and image) of each true class, in ROWS order: Table 1."""
    images: int
    """Number of images K."""
    confusion: NDArray[np.float64]
    """(4,5) percent of the true class (ROWS) given each label (COLUMNS): Table 2. NaN in the row of
    a class the truth does not have."""
    macro: float
    """Mean of the confusion's diagonal, percent, over the classes the truth has."""
    rms: float
    """Root mean square of linearized - ideal, fraction of full scale, over the determined mask
    pixels that are lit in at least three images; NaN where there are none."""
    p99: float
    """99th percentile of |linearized - ideal| over the same, fraction of full scale."""
    worst_image: int
    """Number, from 0, of the image with the greatest rms; -1 where there are no such pixels."""
    undetermined: int
    """Mask pixels lit in at least three images whose bases the result leaves open (NaN)."""
    light_error: float
    """Mean angle between true and estimated lights after the best 3x3 map, degrees."""
    oracle_ratio: float = float("nan")
    """rms divided by that of least squares with the true labels and lights, over the pixels where
    both are known; NaN where the images were not given. Below 1 is possible: the oracle's D
    observations hold tails of highlights."""
    surface: SurfaceErrors | None = None
    """Normals, depth and lights of the result's shape; None where it has none."""


def evaluate(
    labels: NDArray[np.uint8],
    coefficients: NDArray[np.float64],
    linearized_bases: NDArray[np.float32],
    truth: Truth,
    images: NDArray[np.float32] | None = None,
    shape: Shape | None = None,
) -> Evaluation:
    """Compare a result with the truth of its stack.

    Args:
        labels: (K,H,W) Factor codes.
        coefficients: (K,3)
        linearized_bases: (3,H,W) signed, fraction of full scale.
        images: (K,H,W) the stack, for the oracle ratio.
        truth: of the same K images of H x W pixels.
        shape: the surface that came of it.

    Raises:
        InputError: result and truth differ in shape.
    """
    K, H, W = truth.labels.shape
    found = (labels.shape, coefficients.shape, linearized_bases.shape)
    if found != ((K, H, W), (K, 3), (3, H, W)):
        raise InputError(
            f"the result's labels, coefficients and bases have shapes {found[0]}, {found[1]} and "
            f"{found[2]}, the truth has {K} images of {H} x {W} pixels; "
            "a result of the truth's own stack is accepted"
        )
    mask = truth.mask
    true = truth.labels[:, mask]
    counts, confusion = tabulate(labels[:, mask], true)
    lit = np.isin(true, (Factor.DIFFUSE, Factor.SPECULAR)).sum(0) >= 3
    bases = linearized_bases[:, mask].astype(np.float64)
    known = lit & np.isfinite(bases).all(0)
    rms, p99, worst = float("nan"), float("nan"), -1
    if known.any():
        error = coefficients @ bases[:, known] - truth.ideal[:, mask][:, known]
        each = np.square(error).mean(1)
        rms, worst = float(np.sqrt(each.mean())), int(each.argmax())
        p99 = float(np.quantile(np.abs(error), 0.99))
    ratio = float("nan")
    if images is not None and known.any():
        linearized, determined = fit_oracle(images, truth)
        both = known & determined
        ideal = truth.ideal[:, mask][:, both]
        own = np.square(coefficients @ bases[:, both] - ideal).mean()
        best = np.square(linearized[:, both] - ideal).mean()
        ratio = float(np.sqrt(own / max(best, 1e-18)))
    return Evaluation(
        counts=counts,
        images=K,
        confusion=confusion,
        macro=float(np.nanmean(confusion.diagonal())) if counts.any() else float("nan"),
        rms=rms,
        p99=p99,
        worst_image=worst,
        undetermined=int((lit & ~known).sum()),
        light_error=light_error(coefficients, truth.lights),
        oracle_ratio=ratio,
        surface=None if shape is None else measure_surface(shape, surface_of(truth)),
    )


def measure_surface(shape: Shape, true: TrueSurface) -> SurfaceErrors:
    """Errors of a shape over the mask of the truth; depth in mm by the scale of the truth."""
    return compare_surface(shape.normals, true, depth=shape.depth, lights=shape.lights)


def tabulate(
    labels: NDArray[np.uint8], true: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Counts (4,) of the true classes and the confusion (4,5) in percent; see Evaluation."""
    given = np.array([[((true == r) & (labels == c)).sum() for c in COLUMNS] for r in ROWS])
    counts = np.array([(true == r).sum() for r in ROWS])
    with np.errstate(invalid="ignore"):
        return counts, 100 * given / counts[:, None]


def light_error(coefficients: NDArray[np.float64], lights: NDArray[np.floating]) -> float:
    """Mean angle, degrees, between `lights` and `coefficients` (K,3) after the best 3x3 map.

    Light powers are free: the map A makes s_k x (c_k A) = 0 for all k in the least-squares sense,
    the last right singular vector of that linear system.
    """
    s = lights.astype(np.float64)
    s = s / np.linalg.norm(s, axis=1, keepdims=True)
    cross = np.cross(np.eye(3), s[:, None, :])  # (K,3,3)
    system = np.einsum("ki,kja->kaij", coefficients, cross).reshape(-1, 9)
    mapped = coefficients @ np.linalg.svd(system)[2][-1].reshape(3, 3)
    cosine = (mapped * s).sum(1) / np.maximum(np.linalg.norm(mapped, axis=1), 1e-12)
    return float(np.degrees(np.arccos(np.clip(np.sign(cosine.sum()) * cosine, -1, 1))).mean())


def format_evaluation(evaluation: Evaluation, title: str = "result") -> str:
    """Tables 1 and 2 of the paper, and the errors, as lines of aligned text."""
    e = evaluation
    total = max(int(e.counts.sum()), 1)
    heads = "".join(f"{LETTERS[c]:>8}" for c in COLUMNS)
    rows = [
        f"{LETTERS[factor]:<6}{count:>12}{100 * count / total:>7.2f} %"
        + "".join("       -" if np.isnan(x) else f"{x:>8.2f}" for x in row)
        for factor, count, row in zip(ROWS, e.counts, e.confusion, strict=True)
    ]
    return "\n".join(
        [
            f"{title}: {e.images} images; percent of a true class (row) given a label (column)",
            f"{'true':<6}{'count':>12}{'share':>9}{heads}",
            *rows,
            f"macro accuracy      {e.macro:.2f} %",
            f"linearized - ideal  rms {e.rms:.6f}, p99 {e.p99:.6f} of full scale, "
            f"worst in image {e.worst_image}; {e.undetermined} pixels undetermined",
            f"light error         {e.light_error:.3f} degrees",
            *([] if np.isnan(e.oracle_ratio) else [f"oracle ratio        {e.oracle_ratio:.3f}"]),
            *([] if e.surface is None else describe_errors(e.surface)),
        ]
    )
