"""Differences of two frames: signs and scales of values, classes where labels differ."""

from dataclasses import replace

import numpy as np
import pytest

from photolin import Options, analyze, render_scene
from photolin.factors import OUTSIDE, PALETTE, Factor
from webapp.compare import other_frame
from webapp.difference import DIM, differing, layer_values, render_difference
from webapp.frame import Frame, compose
from webapp.render import choose_scale, render_input, render_residual
from webapp.runs import Runs
from webapp.state import ViewState

SCENE = render_scene("sphere_cone", size=(24, 30), images=8)
STACK = SCENE.stack
RESULTS = {
    "robust": analyze(STACK, Options(T=0.05, Ts=0.02)),
    "statistical": analyze(STACK, Options(method="statistical", T=0.05, Ts=0.02, samples=50)),
}
RUNS = Runs(STACK, Options(), truth=SCENE.truth.labels)


def pair(**state: object) -> tuple[Frame, Frame]:
    frame = compose(RUNS, RESULTS, replace(ViewState(image=2), **state))  # type: ignore[arg-type]
    other = other_frame(frame)
    assert other is not None
    return frame, other


def test_values_of_a_layer_are_those_of_the_result() -> None:
    frame, _ = pair(against="input")
    k = 2
    linearized = RESULTS["robust"].linearized(k)
    for layer, values in (
        ("input", STACK.images[k]),
        ("linearized", linearized),
        ("residual", STACK.images[k] - linearized),
    ):
        shown = replace(frame, state=replace(frame.state, layer=layer))
        np.testing.assert_array_equal(layer_values(shown), values)


def test_equal_layers_differ_nowhere() -> None:
    for layer in ("input", "linearized", "residual"):
        picture, _ = render_difference(*pair(layer=layer, against=layer)) or (None, "")
        assert picture is not None
        assert (picture == 255).all()


def test_left_minus_right_has_its_sign_and_its_range_is_told() -> None:
    gap = RESULTS["robust"].linearized(2) - RESULTS["statistical"].linearized(2)
    scale = choose_scale(gap, STACK.mask)
    frames = pair(layer="linearized", against="linearized", beside="statistical")
    picture, legend = render_difference(*frames) or (None, "")
    assert picture is not None
    np.testing.assert_array_equal(picture, render_residual(gap, scale))
    assert f"blue -{scale:.3f} to red +{scale:.3f}" in legend
    place = np.unravel_index(np.nanargmax(np.abs(gap)), gap.shape)
    red, _, blue = picture[place].astype(int)
    assert np.sign(red - blue) == np.sign(gap[place]) != 0


@pytest.mark.parametrize("layer", ["input", "labels", "residual"])
def test_labels_are_coloured_only_where_they_differ(layer: str) -> None:
    frame, other = pair(layer=layer, against="truth")
    picture, legend = render_difference(frame, other) or (None, "")
    assert picture is not None
    assert frame.labels is not None
    where = frame.labels != SCENE.truth.labels[2]
    assert 0 < where.sum() < where.size
    dim = render_input(STACK.images[2], DIM)
    np.testing.assert_array_equal(picture[~where], np.repeat(dim[~where][:, None], 3, axis=1))
    for factor in Factor:
        assert (picture[where & (frame.labels == factor)] == PALETTE[factor]).all()
    assert "colour of the left one" in legend


def test_outside_the_mask_nothing_differs() -> None:
    one, other = np.array([1, 1, OUTSIDE, OUTSIDE, 2], np.uint8), np.array([1, 2, 1, OUTSIDE, 0])
    assert differing(one, other.astype(np.uint8)).tolist() == [False, True, False, False, True]


def test_without_labels_or_values_there_is_no_difference_of_them() -> None:
    frame = compose(RUNS, {}, ViewState(against="truth"))
    other = other_frame(frame)
    assert other is not None
    assert render_difference(frame, other) is None
    frame, other = pair(layer="input", against="labels")
    coloured = replace(other, state=replace(other.state, layer="normals"), labels=None)
    assert render_difference(frame, coloured) is None
