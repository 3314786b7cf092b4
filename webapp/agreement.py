"""How far the labels of two pictures agree: counts, and the table that shows them. Pure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Analysis
from photolin.factors import LETTERS, TITLES, Factor, Thresholds, css_colour
from photolin.label import label_images

from .frame import Frame

ORDER = tuple(LETTERS)
"""The classes of rows and columns."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """Two label maps pixel by pixel, of one image and of all."""

    one: NDArray[np.int64]
    """(5,5) pixels of the image shown, by the right picture's class (rows, ORDER) and the left
    one's (columns)."""
    all: NDArray[np.int64] | None
    """The same of all images; None while a preview is of a part only."""
    truth: bool
    """Whether the right picture is the truth."""


def measure_agreement(frame: Frame, other: Frame) -> Agreement | None:
    """Count the labels of both; None where they are not there, or are of one result."""
    if frame.labels is None or other.labels is None or frame.analysis is None:
        return None
    if other.analysis is frame.analysis:
        return None
    partial = frame.preview is not None and frame.analysis is frame.preview.near
    whole = None
    if not partial:
        thresholds = frame.state.thresholds
        left = _all_labels(frame, frame.analysis, thresholds)
        right = frame.truth
        if other.analysis is not None:
            right = _all_labels(frame, other.analysis, thresholds)
        whole = None if right is None else tabulate_labels(left, right)
    one = tabulate_labels(frame.labels, other.labels)
    return Agreement(one, whole, truth=other.analysis is None)


def tabulate_labels(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(5,5) counts by the class of `right` (rows, ORDER) and of `left` (columns), any equal shapes.

    Pixels that are in no class of both are not counted.
    """
    # codes are 0 to 4, and 255 outside, which 8 steps put beyond all others
    code = np.minimum(right, 7) * np.uint8(8) + np.minimum(left, 7)
    counts = np.bincount(code.ravel(), minlength=64).reshape(8, 8)
    return counts[np.ix_(ORDER, ORDER)].astype(np.int64)


def accuracies(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """(5,) percent of each row's class that the columns agree with; NaN where there is none."""
    rows = counts.sum(axis=1)
    return np.divide(100.0 * counts.diagonal(), rows, out=np.full(5, np.nan), where=rows > 0)


def agreement_html(found: Agreement | None) -> str:
    """A sentence and a table for the image shown and for all images."""
    if found is None:
        return (
            "<p>There are no two results to count labels of: choose another method, or the truth "
            "where it is known.</p>"
        )
    parts = [("This image", found.one), ("All images", found.all)]
    return "".join(
        f"<p><b>{title}</b>: the final result is awaited.</p>"
        if counts is None
        else _block(title, counts, truth=found.truth)
        for title, counts in parts
    )


def _block(title: str, counts: NDArray[np.int64], *, truth: bool) -> str:
    total = int(counts.sum())
    apart = total - int(counts.trace())
    share = 100 * apart / max(total, 1)
    text = f"<b>{title}</b>: {_percent(share, apart)} % of {total} labels differ."
    right = accuracies(counts)
    if truth and total:
        text += f" Macro accuracy {_percent(float(np.nanmean(right)), 1)} %."
    head = "".join(f'<th style="{CELL}">{_letter(factor)}</th>' for factor in ORDER)
    body = "".join(
        f'<tr title="{TITLES[factor]}: {row.sum()} labels of the right picture">'
        f"<th>{_letter(factor)}</th>{_cells(row, r)}"
        f'<td style="{CELL};opacity:0.7">{row.sum()}</td></tr>'
        for r, (factor, row) in enumerate(zip(ORDER, counts, strict=True))
    )
    rows = "truth" if truth else "right"
    return (
        f'<p style="margin:0.7em 0 0.2em">{text}</p>'
        '<table class="photolin-agreement" style="border-collapse:collapse;'
        'font-variant-numeric:tabular-nums">'
        f'<tr><th style="{CELL};font-weight:400">{rows}, %</th>{head}'
        f'<th style="{CELL};font-weight:400">pixels</th></tr>{body}</table>'
    )


CELL = "text-align:right;padding:0.05em 0.4em;white-space:nowrap"


def _cells(row: NDArray[np.int64], diagonal: int) -> str:
    return "".join(_cell(n, int(row.sum()), c == diagonal) for c, n in enumerate(row.tolist()))


def _cell(count: int, row: int, agrees: bool) -> str:
    if row == 0:
        return f'<td style="{CELL};opacity:0.4">–</td>'
    share = 100 * count / row
    look = "font-weight:700" if agrees else ("" if count else "opacity:0.4")
    return f'<td style="{CELL};{look}">{_percent(share, count)}</td>'


def _percent(share: float, count: int) -> str:
    """Two decimals, and never 0.00 or 100.00 for what is some but few, or all but few."""
    if count and share < 0.005:
        return "&lt;0.01"
    return f"{min(share, 99.99) if share < 100 else share:.2f}"


def _letter(factor: Factor) -> str:
    colour, letter = css_colour(factor), LETTERS[factor]
    return (
        f'<span style="display:inline-block;width:0.7em;height:0.7em;border-radius:2px;'
        f'background:{colour}"></span> {letter}'
    )


def _all_labels(frame: Frame, analysis: Analysis, thresholds: Thresholds) -> NDArray[np.uint8]:
    """(K,H,W) by one result and the thresholds of the view."""
    if analysis.thresholds == thresholds:
        return analysis.labels
    stack = frame.stack
    bases, coefficients = analysis.linearized_bases, analysis.coefficients
    return label_images(stack.images, bases, coefficients, stack.mask, thresholds)
