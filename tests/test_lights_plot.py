"""All lights as found: places, rings and names read back from the drawing."""

from xml.etree import ElementTree

import numpy as np
import pytest

from webapp.box_plot import View
from webapp.lights_plot import CIRCLE, format_vector, plot_coefficients, plot_lights

SVG = "{http://www.w3.org/2000/svg}"
LIGHTS = np.array([[0, 0, 2.0], [1, 0, 1], [0, 3, 3], [-1, -1, 0], [0.5, 0, -0.5]])
NAMES = ("a.png", "b.png", "c.png", "<d>&", "e.png")
C = np.random.default_rng(0).normal(size=(5, 3))


def marks(drawing: str) -> dict[str, list[ElementTree.Element]]:
    """Circles of each light by its tooltip's first word, in the order drawn."""
    svg = ElementTree.fromstring(drawing)
    return {
        (title.text or "").split(":")[0]: list(group.iter(f"{SVG}circle"))
        for group in svg.iter(f"{SVG}g")
        for title in group.findall(f"{SVG}title")
    }


def place(circle: ElementTree.Element) -> list[float]:
    return [float(circle.get("cx", "")), float(circle.get("cy", ""))]


def test_lights_are_where_the_camera_sees_them_x_right_and_y_up() -> None:
    found = marks(plot_lights(LIGHTS, 0, NAMES))
    half = CIRCLE * np.sqrt(0.5)
    expected = [(0, 0), (half, 0), (0, -half), (-half, half), (half, 0)]
    for name, at in zip(NAMES, expected, strict=True):
        np.testing.assert_allclose(place(found[name][-1]), at, atol=0.06)


def test_the_power_of_a_light_does_not_move_it() -> None:
    assert plot_lights(LIGHTS * [[1], [9], [0.1], [2], [5]], 1, NAMES) == plot_lights(
        LIGHTS, 1, NAMES
    )


def test_a_light_from_behind_is_hollow() -> None:
    found = marks(plot_lights(LIGHTS, 0, NAMES))
    hollow = {name for name, circles in found.items() if circles[-1].get("fill") == "none"}
    assert hollow == {"e.png"}


@pytest.mark.parametrize("current", range(5))
@pytest.mark.parametrize("kind", ["lights", "coefficients"])
def test_the_current_one_alone_is_ringed_and_on_top(current: int, kind: str) -> None:
    drawn = (
        plot_lights(LIGHTS, current, NAMES)
        if kind == "lights"
        else plot_coefficients(C, current, NAMES, View(35, 25))
    )
    found = marks(drawn)
    assert len(found) == 5
    assert [len(circles) for circles in found.values()] == [1, 1, 1, 1, 2]
    assert list(found)[-1] == NAMES[current]


def test_names_are_escaped() -> None:
    for drawn in (plot_lights(LIGHTS, 0, NAMES), plot_coefficients(C, 0, NAMES, View(0, 0))):
        assert "<d>" not in drawn
        assert "<d>&" in marks(drawn)


def test_coefficients_turn_with_the_view() -> None:
    one, other = (marks(plot_coefficients(C, 0, NAMES, View(a, 0))) for a in (0, 180))
    for name in NAMES:
        (x, y), (u, v) = place(one[name][-1]), place(other[name][-1])
        assert y == pytest.approx(v, abs=0.11)
        assert x + u == pytest.approx(300, abs=0.11)


def test_a_vector_has_three_decimals_and_no_negative_zero() -> None:
    assert format_vector([1, -0.00001, -2.5]) == "(1.000, 0.000, -2.500)"
