"""Two pictures in one: every pixel is from one of them, or their difference."""

from dataclasses import replace

import numpy as np
import pytest

from photolin import Options, analyze, render_scene
from photolin.factors import PALETTE, Factor
from webapp.compare import LINE, differ, lay_over, lay_together, mixture, other_frame, split
from webapp.frame import Frame, compose
from webapp.runs import Runs
from webapp.state import ViewState

SCENE = render_scene("sphere_cone", size=(24, 30), images=8)
STACK = SCENE.stack
RESULTS = {
    "robust": analyze(STACK),
    "classification": analyze(STACK, Options(method="classification", samples=50)),
}
RUNS = Runs(STACK, Options(), truth=SCENE.truth.labels)


def frame(**state: object) -> Frame:
    return compose(RUNS, RESULTS, replace(ViewState(), **state))  # type: ignore[arg-type]


def pictures() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    one, two = rng.integers(0, 256, (2, 10, 20, 3)).astype(np.uint8)
    return one, two


@pytest.mark.parametrize("divider", [0.0, 0.1, 0.5, 0.98, 1.0])
def test_left_of_the_line_is_one_picture_and_right_of_it_the_other(divider: float) -> None:
    one, two = pictures()
    both = split(one, two, divider)
    at = round(divider * 20)
    np.testing.assert_array_equal(both[:, : max(at - 1, 0)], one[:, : max(at - 1, 0)])
    np.testing.assert_array_equal(both[:, at:], two[:, at:])
    if 0 < at < 20:
        assert (both[:, at - 1] == LINE).all()
    else:
        np.testing.assert_array_equal(both, one if at else two)


def test_the_difference_is_symmetric_and_black_where_pictures_are_equal() -> None:
    one, two = pictures()
    np.testing.assert_array_equal(differ(one, two), differ(two, one))
    assert (differ(one, one) == 0).all()
    np.testing.assert_array_equal(differ(one, two), np.abs(one.astype(int) - two))


def test_labels_lie_over_a_grey_picture_as_in_the_overlay() -> None:
    f = frame(opacity=1.0)
    assert f.labels is not None
    over = lay_over(np.full((24, 30), 77, np.uint8), f, hidden=False)
    for factor in Factor:
        assert (over[f.labels == factor] == PALETTE[factor]).all()
    few = lay_over(np.full((24, 30), 77, np.uint8), frame(shown=frozenset({Factor.CAST})), False)
    assert (few[f.labels == Factor.DIFFUSE] == 77).all()
    assert (few[f.labels == Factor.CAST] != 77).any()
    assert (lay_over(np.full((24, 30), 77, np.uint8), f, hidden=True) == 77).all()


def test_half_opaque_labels_mix_with_the_picture() -> None:
    f = frame(opacity=0.5)
    assert f.labels is not None
    over = lay_over(np.full((24, 30), 100, np.uint8), f, hidden=False)
    cast = f.labels == Factor.CAST
    expected = np.array(PALETTE[Factor.CAST]) * 0.5 + 50
    assert np.abs(over[cast].astype(float) - expected).max() <= 1


def other_of(**state: object) -> Frame:
    found = other_frame(frame(**state))
    assert found is not None
    return found


def test_compared_is_the_method_beside_where_there_is_one() -> None:
    f = frame(beside="classification", against="labels")
    other = other_of(beside="classification", against="labels")
    assert other.analysis is RESULTS["classification"]
    np.testing.assert_array_equal(other.labels, f.beside_labels)
    alone = other_of(against="residual")
    assert alone.analysis is RESULTS["robust"]
    assert alone.state.layer == "residual"
    assert other_frame(frame()) is None


def test_the_truth_is_the_map_of_the_image_shown_and_nothing_where_it_is_not_known() -> None:
    other = other_of(against="truth", image=5, beside="classification")
    np.testing.assert_array_equal(other.labels, SCENE.truth.labels[5])
    assert other.state.layer == "labels"
    assert other.analysis is None
    unknown = compose(Runs(STACK, Options()), RESULTS, ViewState(against="truth"))
    assert other_frame(unknown) is None


@pytest.mark.parametrize("arrangement", ["split", "left", "right"])
def test_both_are_laid_into_one_picture_as_they_are_arranged(arrangement: str) -> None:
    state = {"against": "truth", "arrangement": arrangement, "divider": 0.4, "opacity": 1.0}
    picture, legend = lay_together(frame(**state), other_of(**state))
    first, second = frame(**state).labels, SCENE.truth.labels[0]
    assert first is not None
    at = {"split": 12, "left": 30, "right": 0}[arrangement]
    shown = np.concatenate([first[:, :at], second[:, at:]], axis=1)
    beside_line = np.arange(30) != (at - 1 if arrangement == "split" else -1)
    for factor in Factor:
        assert (picture[(shown == factor) & beside_line] == PALETTE[factor]).all()
    assert legend.startswith("left: input")


def test_layers_that_cannot_be_subtracted_show_how_far_their_pictures_are_apart() -> None:
    state = {"layer": "input", "against": "input", "arrangement": "difference"}
    alone = compose(RUNS, {}, replace(ViewState(), **state))  # type: ignore[arg-type]
    other = other_frame(alone)
    assert other is not None
    picture, legend = lay_together(alone, other)
    assert (picture == 0).all()
    assert "black is equal" in legend


def test_what_decides_a_joined_picture_is_in_its_key() -> None:
    base = {"against": "truth", "arrangement": "split"}
    keys = [
        mixture(frame(**state), other_of(**state))
        for state in (
            base,
            {**base, "divider": 0.25},
            {**base, "arrangement": "difference"},
            {**base, "against": "labels"},
            {**base, "opacity": 0.1},
            {**base, "against": "labels", "beside": "classification"},
        )
    ]
    assert len(set(keys)) == len(keys)
    still = {**base, "arrangement": "difference"}
    moved = {**still, "divider": 0.9}
    assert mixture(frame(**still), other_of(**still)) == mixture(frame(**moved), other_of(**moved))


def test_there_is_nothing_to_compare_with_before_there_is_a_shape() -> None:
    assert other_frame(frame(against="normals")) is None
    assert other_frame(frame(against="labels")) is not None
