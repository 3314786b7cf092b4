"""The view of one tab."""

from dataclasses import FrozenInstanceError, asdict, replace

import pytest

from photolin.errors import OptionError
from photolin.factors import Factor, Thresholds
from webapp.state import LAYERS, ViewState


def test_equal_scalars_make_equal_and_hashable_states():
    a = ViewState(image=3, T=0.05, pixel=(4, 5), shown=frozenset({Factor.CAST}))
    b = ViewState(image=3, T=0.05, pixel=(4, 5), shown=frozenset({Factor.CAST}))
    assert a == b
    assert hash(a) == hash(b)
    assert replace(a, image=4) != a


def test_every_field_changes_the_state():
    changed = {
        "image": 1, "layer": "residual", "method": "statistical", "T": 0.1, "Ts": 0.1,
        "opacity": 0.3, "shown": frozenset(), "outlines": True, "patterns": True, "theme": "light",
        "pixel": (0, 0), "gain": 2.0,
        "live": False, "encoding": "exact (PNG)", "beside": "statistical",
        "against": "truth", "divider": 0.2, "arrangement": "left", "pins": ((1, 2),),
        "relief": True, "arrows": False, "light": (0.1, 0.2), "often": "lit",
    }  # fmt: skip
    assert set(changed) == set(asdict(ViewState()))
    for name, value in changed.items():
        assert replace(ViewState(), **{name: value}) != ViewState()


def test_a_state_cannot_be_changed_in_place():
    with pytest.raises(FrozenInstanceError):
        ViewState().image = 2  # pyright: ignore[reportAttributeAccessIssue]


def test_every_class_is_shown_at_first_and_thresholds_are_those_of_the_backend():
    assert ViewState().shown == set(Factor)
    assert ViewState(T=0.1, Ts=0.3).thresholds == Thresholds(0.1, 0.3)


@pytest.mark.parametrize("layer", LAYERS)
def test_each_layer_is_accepted(layer):
    assert ViewState(layer=layer).layer == layer


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"T": 0.0}, "T is 0; accepted is a number above 0 and up to 1"),
        ({"T": float("nan")}, "T is nan; accepted is a number above 0 and up to 1"),
        ({"Ts": 1.0}, "Ts is 1; accepted is a number from 0 to below 1"),
        ({"image": -1}, "image is -1; accepted is a number from 0"),
        (
            {"layer": "bases"},
            "layer is 'bases'; accepted are input, linearized, residual, labels, how often, "
            "albedo, normals, depth, relit",
        ),
        (
            {"method": "best"},
            "method is 'best'; accepted are robust, classification, statistical",
        ),
        (
            {"against": "bases"},
            "against is 'bases'; accepted are input, linearized, residual, labels, how often, "
            "albedo, normals, depth, relit, truth",
        ),
        (
            {"often": "never"},
            "often is 'never'; accepted are specular, lit, attached shadow, cast shadow, "
            "any shadow, undefined",
        ),
        (
            {"arrangement": "over"},
            "arrangement is 'over'; accepted are split, side by side, difference, left, right",
        ),
        ({"divider": 1.1}, "divider is 1.1; accepted is 0 to 1"),
        (
            {"pins": ((0, 0), (0, 0))},
            "pins are ((0, 0), (0, 0)); accepted are 4 different pixels",
        ),
        (
            {"light": (0.8, 0.8)},
            "light is (0.8, 0.8); accepted are x and y of a direction towards the camera's side, "
            "of length below 1",
        ),
        ({"opacity": 1.5}, "opacity is 1.5; accepted is 0 to 1"),
        ({"opacity": float("nan")}, "opacity is nan; accepted is 0 to 1"),
        ({"gain": 0.0}, "gain is 0; accepted is a number above 0"),
        ({"gain": float("inf")}, "gain is inf; accepted is a number above 0"),
    ],
)
def test_a_value_out_of_range_is_refused_with_its_name_and_range(change, words):
    with pytest.raises(OptionError) as error:
        ViewState(**change)
    assert str(error.value) == words
