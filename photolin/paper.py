"""The figures Mukaigawa et al. (2007) print, beside our own."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .analysis import Method
from .evaluate import COLUMNS, ROWS, Evaluation
from .factors import LETTERS
from .shape.compare_methods import SIMPLE, MethodErrors

COUNTS = (2393, 845, 15007, 955)
"""Table 1: pixels of one 160x120 image in each true class, in the order of ROWS."""

PUBLISHED: Mapping[Method, tuple[tuple[float, ...], ...]] = {
    "statistical": (
        (99.04, 0.96, 0.00, 0.00),
        (0.00, 100.00, 0.00, 0.00),
        (0.00, 0.00, 99.01, 0.99),
        (0.00, 0.00, 43.56, 56.44),
    ),
    "classification": (
        (99.96, 0.04, 0.00, 0.00),
        (1.78, 98.22, 0.00, 0.00),
        (0.00, 0.00, 99.99, 0.01),
        (0.00, 0.00, 17.49, 82.51),
    ),
}
"""Table 2, percent: (a) the previous method, (b) the proposed one; rows and columns C A D S."""

TABLE_3: Mapping[str, tuple[float, float]] = {
    SIMPLE: (5.11, 14.41),
    "statistical": (4.04, 23.49),
    "classification": (3.84, 9.85),
}
"""Table 3: root mean square and largest error of depth, mm, of a sphere behind obstacles."""
ORDER = (*TABLE_3, "robust")
"""Of the methods in that table."""


def compare_with_paper(evaluations: Mapping[Method, Evaluation]) -> str:
    """Tables 1 and 2 of the paper and of these evaluations side by side, as aligned text."""
    first = next(iter(evaluations.values()))
    rows = [LETTERS[factor] for factor in ROWS]
    lines = [
        "Table 1: percent of all observations in each true class",
        f"{'':16}{''.join(f'{letter:>8}' for letter in rows)}",
        f"{'paper':16}{_cells(100 * np.array(COUNTS) / sum(COUNTS))}",
        f"{'this stack':16}{_cells(100 * first.counts / first.counts.sum())}",
        "",
        "Table 2: percent of a true class (row) given a label (column)",
    ]
    for method, evaluation in evaluations.items():
        published = PUBLISHED.get(method)
        heads = "".join(f"{LETTERS[factor]:>8}" for factor in COLUMNS)
        beside = f"   | {heads[:32]}  in the paper" if published else ""
        lines.append(f"{method:16}{heads}{beside}")
        for k, letter in enumerate(rows):
            beside = f"   | {_cells(np.array(published[k]))}" if published else ""
            lines.append(f"{letter:>16}{_cells(evaluation.confusion[k])}{beside}")
    lines += ["", f"{'':16}   macro %         rms         p99  rms/oracle  light error (degrees)"]
    lines += [
        f"{method:16}{e.macro:10.2f}  {e.rms:10.6f}  {e.p99:10.6f}  {e.oracle_ratio:10.3f}  "
        f"{e.light_error:11.3f}"
        for method, e in evaluations.items()
    ]
    return "\n".join(lines)


def compare_surfaces_with_paper(found: MethodErrors) -> str:
    """Table 3 of the paper beside the errors of each method, as aligned text.

    Relative figures are those of `simple`; the paper's are of its own sphere with obstacles.
    """
    first = found.errors[SIMPLE].depth
    lines = [
        f"Table 3: surfaces on {found.pixels} pixels, {found.note}",
        f"{'':16} normals (degrees)     without      depth (mm)     relative to simple",
        f"{'':16}    mean    median      normal     rms   largest       rms   largest"
        "   | the paper's sphere",
    ]
    for method, e in sorted(found.errors.items(), key=lambda item: ORDER.index(item[0])):
        depth = f"{'-':>8}{'-':>10}{'-':>10}{'-':>10}"
        if e.depth is not None:
            depth = f"{e.depth.rms:8.3f}{e.depth.largest:10.3f}"
            shares = ("-", "-")
            if first is not None and first.rms > 0:
                shares = (
                    f"{e.depth.rms / first.rms:.4f}",
                    f"{e.depth.largest / first.largest:.4f}",
                )
            depth += f"{shares[0]:>10}{shares[1]:>10}"
        printed = TABLE_3.get(method)
        beside = "" if printed is None else f"   | {printed[0]:8.2f}{printed[1]:8.2f}"
        lines.append(f"{method:16}{e.mean:8.3f}{e.median:10.3f}{e.undetermined:12}{depth}{beside}")
    return "\n".join(lines)


def _cells(values: NDArray[np.floating]) -> str:
    """Percentages in columns of eight; a dash where a class does not occur."""
    return "".join("       -" if np.isnan(v) else f"{v:8.2f}" for v in values)
