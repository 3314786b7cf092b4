"""The figures Mukaigawa et al. (2007) print for the sphere and cone, beside our own."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .analysis import Method
from .evaluate import COLUMNS, ROWS, Evaluation
from .factors import LETTERS

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


def _cells(values: NDArray[np.floating]) -> str:
    """Percentages in columns of eight; a dash where a class does not occur."""
    return "".join("       -" if np.isnan(v) else f"{v:8.2f}" for v in values)
