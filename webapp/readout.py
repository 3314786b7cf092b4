"""The sentences of the inspector. Pure; plain text, to be passed through `escape` into markup.

Intensities are fractions of full scale, with three decimals; thresholds and what is compared with
them have four, and more where four would hide why a comparison came out as it did.
"""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis
from photolin.factors import LETTERS, OUTSIDE, TITLES, Factor, Thresholds, classify
from photolin.shape.recover import Shape
from photolin.shape.resolved import Kind

MISFITS: dict[Kind, tuple[float, str]] = {
    "sphere": (1.5, "the outline may be wrong, or not that of a matte sphere"),
    "points": (3.0, "the outline or a point may be wrong, or the surface too glossy"),
    "some lights": (3.0, "a light may be that of another image, or have another power"),
}
"""Residuals in degrees above which a shape is doubted, and what may be wrong then."""


@dataclass(frozen=True)
class LegendRow:
    """One class of one label map."""

    factor: Factor
    letter: str
    title: str
    count: int
    """Pixels of this class."""
    percent: float
    """Of the pixels inside the mask, 0 to 100."""


def escape(text: str) -> str:
    """`text` for HTML or Markdown: all but letters, digits and spaces as character codes."""
    return re.sub(r"[^\w ]|_", lambda match: f"&#{ord(match[0])};", text)


def explain(i: float, l: float, thresholds: Thresholds, name: str) -> str:
    """The rule of Eq. (3) that decided one observation, with its numbers.

    Args:
        i: input intensity, fraction of full scale.
        l: linearized intensity (signed), fraction of full scale; NaN where it is unknown.
        thresholds: T and Ts.
        name: what the image is called, as "Image 07".
    """
    factor = Factor(int(classify(i, l, thresholds)))
    if not np.isfinite(l):
        return f"{name}: i {_number(i)} of full scale; l could not be determined: undefined."
    i, l, T, Ts = (float(np.float32(v)) for v in (i, l, thresholds.T, thresholds.Ts))
    observed = f"{name}: i {_number(i)}, l {_number(l)} of full scale."
    lit, level = _apart(i, Ts)
    if i < Ts:
        facing, reason = (
            ("l ≤ 0", "the surface faces away from the light")
            if factor is Factor.ATTACHED
            else ("l > 0", "the surface faces the light; something blocks it")
        )
        return f"{observed} i = {lit} < Ts = {level} and {facing}: {TITLES[factor]} ({reason})."
    return f"{observed} i = {lit} ≥ Ts = {level} and {_lit_rule(factor, i, l, T)}."


def rule_of(i: float, l: float, thresholds: Thresholds) -> str:
    """The rule of Eq. (3) that decided one observation, in a few words."""
    factor = Factor(int(classify(i, l, thresholds)))
    if not np.isfinite(l):
        return "l unknown"
    if i < thresholds.Ts:
        return "dark, faces away" if factor is Factor.ATTACHED else "dark, yet faces the light"
    if factor is Factor.DIFFUSE:
        return "i is l within T"
    if factor is Factor.SPECULAR:
        return "brighter than l"
    return "darker than l" if l > i else "lit, yet faces away"


def _lit_rule(factor: Factor, i: float, l: float, T: float) -> str:
    distance, slack = _apart(abs(i - l), T * i)
    if factor is Factor.DIFFUSE:
        return f"|i - l| = {distance} ≤ T·i = {slack}: diffuse"
    if factor is Factor.SPECULAR:
        return (
            f"i - l = {distance} > T·i = {slack} with l ≥ 0: "
            "specular (light is added to what the surface scatters)"
        )
    if l > i:
        return (
            f"l - i = {distance} > T·i = {slack}: undefined (lit, but below the fit; light can be "
            "added to a lit pixel, not taken from it, so l or T is wrong here)"
        )
    return (
        f"l = {_number(l)} < 0: undefined (lit, although the fit says the surface faces away "
        "from the light, so l or Ts is wrong here)"
    )


def describe_pixel(
    row: int, column: int, i: NDArray[np.float32], thresholds: Thresholds, *, inside: bool = True
) -> str:
    """In how many of the K images (`i` is (K,)) a pixel is lit, and what follows from it."""
    where = f"Pixel (row {row}, column {column})"
    if not inside:
        return f"{where} lies outside the mask: nothing was computed there."
    lit = int(np.count_nonzero(np.asarray(i, np.float32) >= np.float32(thresholds.Ts)))
    level = tell_threshold(thresholds.Ts)
    sentence = f"{where} is lit (i ≥ Ts = {level}) in {lit} of {len(i)} images"
    if lit < 3:
        return f"{sentence}: its linearized value cannot be determined."
    return f"{sentence}."


def status_line(row: int, column: int, i: float, l: float, label: int) -> str:
    """Values under the pointer, in one line; fractions of full scale."""
    if label == OUTSIDE:
        return f"row {row}  column {column}  i {i:.3f}  outside the mask"
    return (
        f"row {row}  column {column}  i {i:.3f}  l {l:z.3f}  residual {i - l:+z.3f}  "
        f"{LETTERS[Factor(label)]}"
    )


def legend(labels: NDArray[np.uint8]) -> tuple[LegendRow, ...]:
    """Count and share of each class of a label map (H,W) or (K,H,W), in the legend's order."""
    inside = int(np.count_nonzero(labels != OUTSIDE))
    counts = {factor: int(np.count_nonzero(labels == np.uint8(factor))) for factor in LETTERS}
    return tuple(
        LegendRow(
            factor, letter, TITLES[factor], counts[factor], 100 * counts[factor] / max(inside, 1)
        )
        for factor, letter in LETTERS.items()
    )


def preview_status(thresholds: Thresholds, step: int, whole: bool, seconds: float) -> str:
    """That a linearization has followed the thresholds, how much of it, and how long it took."""
    T, Ts = tell_threshold(thresholds.T), tell_threshold(thresholds.Ts)
    nth = {1: "st", 2: "nd", 3: "rd"}.get(step % 10 if step % 100 not in (11, 12, 13) else 0, "th")
    each = "the part on screen" if step == 1 else f"every {step}{nth} pixel"
    part = "" if whole else f" ({each})"
    return f"T {T}, Ts {Ts}: preview{part}, {1000 * seconds:.0f} ms."


def threshold_status(
    shown: Thresholds, used: Thresholds | None, seconds: float | None = None
) -> str:
    """Whether the linearized bases (computed with `used`) belong to the thresholds shown.

    Args:
        seconds: that the linearization took.
    """
    if used is None:
        return "Nothing is linearized yet."
    T, T_used = _apart(shown.T, used.T)
    Ts, Ts_used = _apart(shown.Ts, used.Ts)
    if shown == used:
        took = "" if seconds is None else f", linearized in {1000 * seconds:.0f} ms"
        return f"T {T}, Ts {Ts}: final{took}."
    return (
        f"Labels: T {T}, Ts {Ts}. Linearized bases: T {T_used}, Ts {Ts_used}; "
        "linearize again to match."
    )


def describe_shape(shape: Shape) -> str:
    """How the ambiguity of unknown lights was resolved, and what is left open."""
    found = shape.resolved
    unknown = int(np.count_nonzero(np.isnan(shape.albedo)))
    sentences = [f"Normals {found.note}."]
    if unknown:
        sentences.append(f"{unknown} pixels have too few observations for a normal.")
    if shape.depth is not None:
        z = shape.lengths(shape.depth)
        z = z[np.isfinite(z)]
        sentences.append(f"Depth spans {np.ptp(z):.4g} {shape.unit}.")
    if not found.scaled:
        sentences.append("Albedo has no absolute scale.")
    return " ".join(sentences)


def doubt_shape(shape: Shape) -> tuple[str, ...]:
    """What looks wrong in what was known of the scene, or that it fits badly; mostly nothing.

    A wrong outline of a sphere shows in the residual of all its pixels by a third of what it does
    to normals, or less; in that of few points hardly at all.
    """
    found = shape.resolved
    limit, cause = MISFITS.get(found.kind, (math.inf, ""))
    if found.doubts:
        return tuple(f"{doubt[:1].upper()}{doubt[1:]}." for doubt in found.doubts)
    if found.residual <= limit:
        return ()
    return (f"Off by {found.residual:.1f} degrees: {cause}.",)


def shape_status(used: Analysis, wanted: Analysis | None, thresholds: Thresholds) -> str:
    """That a shape is not of what is on screen, or nothing.

    Args:
        used: what the shape was recovered from.
        wanted: the result of the method on screen, if there is one.
        thresholds: those that recovering again would use.
    """
    method = used.options.method
    same = wanted is None or wanted.options.method == method
    if same and used.thresholds == thresholds:
        return ""
    T, _ = _apart(used.thresholds.T, thresholds.T)
    Ts, _ = _apart(used.thresholds.Ts, thresholds.Ts)
    by = "" if same else f" by the method {method}"
    return f"This shape is of T {T}, Ts {Ts}{by}; recover again to match what is on screen."


def summarize(analysis: Analysis) -> str:
    """One run in one sentence: method, size, bases, thresholds, time."""
    K, H, W = analysis.labels.shape
    bases = ", ".join(analysis.names[k] for k in analysis.base_images)
    count = int(np.count_nonzero(analysis.mask))
    return (
        f"{analysis.options.method}: {K} images of {H} rows × {W} columns, {count} pixels in the "
        f"mask, base images {bases}, T {tell_threshold(analysis.thresholds.T)}, "
        f"Ts {tell_threshold(analysis.thresholds.Ts)}, {analysis.seconds['total']:.2f} s."
    )


def _number(value: float) -> str:
    """Three decimals; a value that would read as zero and is not, in scientific notation."""
    return f"{value:.1e}" if 0 < abs(value) < 0.0005 else f"{value:z.3f}"


def tell_threshold(value: float) -> str:
    """Four decimals, the sliders' step being 0.0005; scientific where that would read as zero."""
    return f"{value:.1e}" if 0 < value < 0.00005 else f"{value:.4f}"


def _apart(a: float, b: float) -> tuple[str, str]:
    """Both numbers with as many decimals, 4 to 8, as it takes to tell them apart, and from zero."""
    decimals = 4
    while decimals < 8 and (
        (a != b and f"{a:z.{decimals}f}" == f"{b:z.{decimals}f}")
        or any(v and not float(f"{v:.{decimals}f}") for v in (a, b))  # would read as zero
    ):
        decimals += 1
    return f"{a:z.{decimals}f}", f"{b:z.{decimals}f}"
