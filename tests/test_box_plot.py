"""A cube from any side: a projection that keeps lengths, axes beside it, numbers apart."""

from itertools import product
from xml.etree import ElementTree

import numpy as np
import pytest

from webapp.box_plot import HALF, HEIGHT, MIDST, WIDTH, Box, View, choose_box, draw_box

SVG = "{http://www.w3.org/2000/svg}"
NAMES = ("a", "b", "c")
VIEWS = [View(a, e) for a in (-180, -135, -30, 0, 35, 90) for e in (-90, -40, 0, 25, 90)]
CENTRE = np.array([0.3, -0.2, 1.0])


def box(view: View) -> Box:
    return Box(CENTRE, 0.5, view)


def texts(one: Box) -> list[tuple[str, float, float, str]]:
    svg = ElementTree.fromstring(draw_box(one, NAMES, "", "title"))
    return [
        (t.text or "", float(t.get("x", "")), float(t.get("y", "")), t.get("text-anchor", ""))
        for t in svg.iter(f"{SVG}text")
    ]


@pytest.mark.parametrize("view", VIEWS)
def test_the_rotation_is_one_and_the_third_axis_stays_upright(view: View) -> None:
    R = view.rotation
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    assert R[0, 2] == 0
    assert R[1, 2] >= -1e-12


@pytest.mark.parametrize(
    ("view", "right", "up"),
    [(View(0, 0), 1, 2), (View(-90, 0), 0, 2), (View(-90, 90), 0, 1)],
)
def test_axes_point_where_they_do_in_a_plot_of_two_of_them(view: View, right: int, up: int) -> None:
    one = box(view)
    x, y = (one.place(CENTRE + 0.5 * np.eye(3)[axis]) - MIDST for axis in (right, up))
    np.testing.assert_allclose(x, [HALF, 0], atol=1e-9)
    np.testing.assert_allclose(y, [0, -HALF], atol=1e-9)


def test_what_is_right_of_the_middle_moves_left_when_the_viewer_goes_around_to_the_right() -> None:
    near = CENTRE + 0.5 * View(30, 0).rotation[2]
    assert box(View(40, 0)).place(near)[0] < box(View(30, 0)).place(near)[0]


@pytest.mark.parametrize("view", VIEWS)
def test_everything_stays_inside_the_drawing(view: View) -> None:
    one = box(view)
    corners = CENTRE + 0.5 * np.array(list(product((-1, 1), repeat=3)))
    assert one.holds(corners).all()
    assert ((one.place(corners) > 0) & (one.place(corners) < (WIDTH, HEIGHT))).all()
    for text, x, y, anchor in texts(one):
        wide = 6.5 * len(text)
        left = x - {"start": 0, "middle": wide / 2, "end": wide}[anchor]
        assert left >= 0
        assert left + wide <= WIDTH
        assert 5 <= y <= HEIGHT - 5


@pytest.mark.parametrize("view", VIEWS)
def test_each_axis_has_its_name_once_beside_the_cube(view: View) -> None:
    one = box(view)
    found = {text: np.array([x, y]) for text, x, y, _ in texts(one) if text in NAMES}
    assert set(found) == set(NAMES)
    corners = one.place(CENTRE + 0.5 * np.array(list(product((-1, 1), repeat=3))))
    for name in found.values():
        # some line through the name has all corners on its other side
        angles = np.linspace(0, 2 * np.pi, 360)
        out = np.stack([np.cos(angles), np.sin(angles)])
        assert ((name - corners) @ out).min(axis=0).max() > 5


@pytest.mark.parametrize("view", VIEWS)
def test_numbers_do_not_lie_over_each_other_along_an_axis(view: View) -> None:
    numbers = [(float(t), x, y) for t, x, y, _ in texts(box(view)) if t not in NAMES]
    assert numbers
    axes = np.array([[n, x, y] for n, x, y in numbers])
    steps = np.diff(axes, axis=0)
    same = np.abs(steps[:, 1:]).max(axis=1) > 1e-6
    for (n, x, y), there in zip(steps, same, strict=True):
        if there and n > 0 and abs(n) <= 0.5:  # two of one axis, not of two
            assert abs(x) >= 24 or abs(y) >= 10.9


def test_numbers_stand_where_their_values_are() -> None:
    one = box(View(0, 0))
    beside = {text: y for text, x, y, anchor in texts(one) if anchor == "end"}
    assert beside
    for text, y in beside.items():
        assert one.place([0, 0, float(text)])[1] == pytest.approx(y, abs=0.1)


@pytest.mark.parametrize("view", [View(35, 25), View(-120, -40), View(170, 10)])
def test_walls_are_behind(view: View) -> None:
    one = box(view)
    svg = ElementTree.fromstring(draw_box(one, NAMES, "", "title"))
    walls = next(svg.iter(f"{SVG}path")).get("d", "")
    ends = np.array([end.split() for end in walls.replace("L", "M").split("M")[1:]], float)
    corners = CENTRE + 0.5 * np.array(list(product((-1, 1), repeat=3)))
    depth = corners @ view.rotation[2]
    near, far = (one.place(corners[n(depth)]) for n in (np.argmax, np.argmin))
    assert np.abs(ends - far).max(axis=1).min() < 0.1
    assert np.abs(ends - near).max(axis=1).min() > 1


def test_text_from_outside_is_escaped() -> None:
    drawn = draw_box(box(View(35, 25)), ("<b>", "&", '"'), "", '"><script>')
    assert "<script" not in drawn
    names = [text for text, *_ in texts(box(View(35, 25)))]
    assert names
    root = ElementTree.fromstring(drawn)
    assert root.get("aria-label") == '"><script>'


# --- the choice of a cube ---


def test_a_few_points_far_away_change_nothing() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(1000, 3))
    wild = points.copy()
    wild[:20] *= 1e6
    mid, far = (choose_box(p, points[50:51], (0, 0, 0), View(0, 0)) for p in (points, wild))
    assert far.half == pytest.approx(mid.half, rel=0.1)
    assert 1 < mid.half < 3


def test_what_is_important_lies_inside_and_zoom_goes_to_the_focus() -> None:
    points = np.random.default_rng(0).normal(size=(200, 3))
    important = np.array([[9.0, 0, 0], [0, -7, 2]])
    wide = choose_box(points, important, important[0], View(0, 0))
    assert wide.holds(important).all()
    near = choose_box(points, important, important[0], View(0, 0), 50)
    assert near.half == pytest.approx(wide.half / 50)
    assert near.holds(important).tolist() == [True, False]


def test_points_that_coincide_have_a_cube_around_them() -> None:
    one = choose_box(np.ones((5, 3)), np.ones((1, 3)), (1, 1, 1), View(35, 25))
    assert one.half > 0.01
    np.testing.assert_allclose(one.place([1, 1, 1]), MIDST)
    assert len(texts(one)) > 3


def test_points_at_zero_have_a_cube_too() -> None:
    assert choose_box(np.zeros((5, 3)), np.zeros((1, 3)), (0, 0, 0), View(0, 0)).half > 0
