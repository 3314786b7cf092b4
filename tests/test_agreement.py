"""Agreement of labels: counts that add up, and words that do not hide what is small."""

from dataclasses import replace

import numpy as np

from photolin import Options, analyze, render_scene
from photolin.evaluate import COLUMNS, ROWS, tabulate
from photolin.factors import OUTSIDE, Factor
from webapp.agreement import (
    ORDER,
    Agreement,
    accuracies,
    agreement_html,
    measure_agreement,
    tabulate_labels,
)
from webapp.compare import other_frame
from webapp.frame import Frame, compose
from webapp.runs import Runs
from webapp.state import ViewState

SCENE = render_scene("sphere_cone", size=(24, 30), images=8)
STACK, TRUTH = SCENE.stack, SCENE.truth.labels
RESULTS = {
    "robust": analyze(STACK, Options(T=0.05, Ts=0.02)),
    "statistical": analyze(STACK, Options(method="statistical", T=0.05, Ts=0.02, samples=50)),
}
RUNS = Runs(STACK, Options(), truth=TRUTH)


def measure(**state: object) -> Agreement | None:
    frame = compose(RUNS, RESULTS, replace(ViewState(image=2), **state))  # type: ignore[arg-type]
    return measure_agreement(frame, seen(frame))


def seen(frame: Frame) -> Frame:
    other = other_frame(frame)
    assert other is not None
    return other


def test_counts_are_those_of_the_tables_of_the_paper() -> None:
    found = measure(against="truth")
    assert found is not None
    assert found.truth
    for mine, left, right in (
        (found.one, RESULTS["robust"].labels[2], TRUTH[2]),
        (found.all, RESULTS["robust"].labels, TRUTH),
    ):
        assert mine is not None
        counts, confusion = tabulate(left, right)
        rows, columns = ([ORDER.index(f) for f in order] for order in (ROWS, COLUMNS))
        np.testing.assert_array_equal(mine[rows].sum(axis=1), counts)
        assert mine.sum() == right.size
        present = counts > 0
        np.testing.assert_allclose(
            100 * mine[np.ix_(rows, columns)][present] / counts[present, None], confusion[present]
        )
        np.testing.assert_allclose(accuracies(mine)[rows][present], confusion.diagonal()[present])


def test_a_map_agrees_with_itself_and_exchanging_maps_turns_the_table() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.choice([0, 1, 2, 3, 4, OUTSIDE], (2, 40, 50)).astype(np.uint8)
    own = tabulate_labels(a, a)
    assert (own == np.diag(own.diagonal())).all()
    assert own.sum() == (a != OUTSIDE).sum()
    np.testing.assert_array_equal(tabulate_labels(a, b), tabulate_labels(b, a).T)
    row, column = ORDER.index(Factor.CAST), ORDER.index(Factor.DIFFUSE)
    expected = ((b == Factor.CAST) & (a == Factor.DIFFUSE)).sum()
    assert tabulate_labels(a, b)[row, column] == expected


def test_methods_are_counted_by_the_thresholds_of_the_view() -> None:
    found = measure(against="labels", beside="statistical", T=0.2)
    assert found is not None
    assert not found.truth
    other = measure(against="labels", beside="statistical")
    assert other is not None
    assert found.all is not None
    assert other.all is not None
    assert not np.array_equal(found.all, other.all)


def test_one_result_against_itself_is_not_counted() -> None:
    assert measure(against="residual") is None
    assert "choose another method" in agreement_html(None)


def test_few_that_differ_are_never_told_as_none() -> None:
    counts = np.zeros((5, 5), np.int64)
    counts[0, 0], counts[0, 1] = 999_999, 1
    page = agreement_html(Agreement(counts, counts, truth=True))
    assert "&lt;0.01 % of 1000000 labels differ. Macro accuracy 99.99 %" in page
    assert ">99.99<" in page
    assert page.count("photolin-agreement") == 2
    assert "–" in page  # classes that the truth does not have


def test_what_is_awaited_is_said() -> None:
    page = agreement_html(Agreement(np.eye(5, dtype=np.int64), None, truth=False))
    assert "<b>All images</b>: the final result is awaited." in page
    assert "0.00 % of 5 labels differ" in page
    assert "accuracy" not in page
