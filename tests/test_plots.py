"""The i-l plot of one pixel."""

import xml.etree.ElementTree as ET
from itertools import pairwise

import numpy as np
import pytest

from photolin.factors import PALETTE, Factor, Thresholds, classify
from webapp.plots import PixelPanel, plot_pixel

SVG = "{http://www.w3.org/2000/svg}"
THRESHOLDS = Thresholds(0.1, 0.05)
I = np.array([0.8, 0.6, 0.01, 0.01, 0.3], np.float32)
L = np.array([0.8, 0.3, -0.2, 0.4, 0.6], np.float32)
NAMES = [f"image {k}" for k in range(5)]


def panel(i=I, l=L, title="robust") -> PixelPanel:
    return PixelPanel(title, i, l, classify(i, l, THRESHOLDS))


def parse(html: str) -> ET.Element:
    return ET.fromstring(html)


def square(svg: ET.Element) -> ET.Element:
    inner = svg.find(f"{SVG}svg")
    assert inner is not None
    return inner


def dots(svg: ET.Element) -> dict[str, tuple[float, float, str, int]]:
    """Image name -> (x, y, colour, number of circles), in drawing order."""
    found = {}
    for group in square(svg).iter(f"{SVG}g"):
        title = group.find(f"{SVG}title")
        if title is not None and title.text is not None:
            circles = group.findall(f"{SVG}circle")
            c = circles[-1]
            place = float(c.get("cx", "")), float(c.get("cy", ""))
            found[title.text.split(":")[0]] = (*place, c.get("fill"), len(circles))
    return found


def colour(factor: int) -> str:
    return "#{:02X}{:02X}{:02X}".format(*PALETTE[Factor(factor)])


def panels_of(html: str) -> list[ET.Element]:
    return parse(html).findall(f"{SVG}svg")


def test_every_image_has_one_dot_in_the_colour_of_its_class():
    (svg,) = panels_of(plot_pixel([panel()], THRESHOLDS, 0, NAMES))
    found = dots(svg)
    assert sorted(found) == NAMES
    for name, label in zip(NAMES, classify(I, L, THRESHOLDS), strict=True):
        assert found[name][2] == colour(label)


def test_the_five_observations_cover_the_five_classes():
    assert set(classify(I, L, THRESHOLDS)) == set(Factor)


@pytest.mark.parametrize("current", range(5))
def test_only_the_current_image_is_ringed_and_it_is_drawn_last(current):
    (svg,) = panels_of(plot_pixel([panel()], THRESHOLDS, current, NAMES))
    found = dots(svg)
    assert [name for name, dot in found.items() if dot[3] == 2] == [NAMES[current]]
    assert list(found)[-1] == NAMES[current]


def test_both_axes_have_one_scale_right_is_brighter_and_up_is_higher():
    grid = np.array([0.1, 0.5, 0.9], np.float32)
    (svg,) = panels_of(plot_pixel([panel(grid, grid)], THRESHOLDS, 0, NAMES))
    points = [dot[:2] for _, dot in sorted(dots(svg).items())]
    x, y = np.array(points).T
    np.testing.assert_allclose(np.diff(x), -np.diff(y), atol=0.02)
    assert (np.diff(x) > 0).all()
    side = square(svg)
    assert side.get("width") == side.get("height")


def test_a_dark_side_far_below_zero_makes_the_plot_higher_and_not_wider():
    deep = panel(l=np.array([0.8, 0.3, -0.7, 0.4, 0.6], np.float32))
    for panels in ([deep], [deep, deep]):
        (svg, *_) = panels_of(plot_pixel(panels, THRESHOLDS, 0, NAMES))
        width, height = (float(square(svg).get(name, "")) for name in ("width", "height"))
        assert height > 1.5 * width
        (vertical,) = [e for e in square(svg).iter(f"{SVG}line") if e.get("stroke-dasharray")]
        assert float(vertical.get("x1", "")) < 0.2 * width  # Ts; zero is to the left of it
        for x, y, *_ in dots(svg).values():
            assert 0 <= x <= width
            assert 0 <= y <= height


def test_dots_lie_in_the_region_of_their_class():
    rng = np.random.default_rng(0)
    i = rng.uniform(0, 1, 300).astype(np.float32)
    i[:100] *= THRESHOLDS.Ts
    l = rng.uniform(-0.6, 1.2, 300).astype(np.float32)
    l[200:] = i[200:] * rng.uniform(0.85, 1.15, 100)
    names = [f"image {k}" for k in range(300)]
    (svg,) = panels_of(plot_pixel([panel(i, l)], THRESHOLDS, 0, names))
    regions = [
        (polygon.get("fill"), [tuple(map(float, p.split(","))) for p in points.split()])
        for polygon in square(svg).iter(f"{SVG}polygon")
        for points in [polygon.get("points", "")]
    ]
    for x, y, fill, _ in dots(svg).values():
        inside = {colour for colour, corners in regions if contains(corners, x, y, slack=0.05)}
        assert fill in inside


def contains(corners, x, y, slack) -> bool:
    """Whether a convex polygon holds a point, give or take `slack` drawing units."""
    a = np.array(corners)
    b = np.roll(a, -1, axis=0)
    length = np.hypot(*(b - a).T)
    a, b, length = a[length > 0], b[length > 0], length[length > 0]
    side = ((b - a)[:, 0] * (y - a[:, 1]) - (b - a)[:, 1] * (x - a[:, 0])) / length
    return bool((side >= -slack).all() or (side <= slack).all())


def test_the_lines_of_the_thresholds_move_with_them():
    assert plot_pixel([panel()], Thresholds(0.1, 0.05), 0, NAMES) != plot_pixel(
        [panel()], Thresholds(0.2, 0.05), 0, NAMES
    )
    xs = []
    for Ts in (0.05, 0.2):
        (svg,) = panels_of(plot_pixel([panel()], Thresholds(0.1, Ts), 0, NAMES))
        (vertical,) = [e for e in square(svg).iter(f"{SVG}line") if e.get("stroke-dasharray")]
        assert vertical.get("x1") == vertical.get("x2")
        xs.append(float(vertical.get("x1", "")))
    unit = (dots(svg)["image 0"][0] - xs[1]) / (0.8 - 0.2)
    assert xs[1] - xs[0] == pytest.approx(0.15 * unit, abs=0.05)


@pytest.mark.parametrize("scale", np.geomspace(0.001, 1, 40))
@pytest.mark.parametrize("panels", [1, 2])
def test_numbers_of_the_axes_lie_neither_over_each_other_nor_over_the_names(scale, panels):
    thresholds = Thresholds(0.1, 0.05 * scale)
    drawing = plot_pixel([panel(scale * I, scale * L)] * panels, thresholds, 0, NAMES)
    svg = next(iter(parse(drawing)))
    digit = 6.0
    numbers = {anchor: [] for anchor in ("middle", "end")}
    for text in svg.iterfind(f"{SVG}text"):
        if text.get("x") and (text.text or "").lstrip("-").replace(".", "").isdigit():
            numbers[text.get("text-anchor")].append((float(text.get("x", "")), text.text))
    below = sorted(numbers["middle"])
    assert len(below) >= 2
    for (x, one), (further, other) in pairwise(below):
        assert x + digit * len(one) / 2 < further - digit * len(other) / 2
    name = 10 + 4  # where the upright name ends
    assert min(x - digit * len(text) for x, text in numbers["end"]) > name


def test_methods_share_their_axes_and_keep_their_titles():
    shifted = panel(l=L + np.float32(0.2), title="statistical")
    left, right = panels_of(plot_pixel([panel(), shifted], THRESHOLDS, 0, NAMES))
    assert [svg.findtext(f"{SVG}text") for svg in (left, right)] == ["robust", "statistical"]
    for name in NAMES:
        assert dots(left)[name][0] == dots(right)[name][0]
        assert dots(left)[name][1] > dots(right)[name][1]


def test_names_cannot_become_markup():
    hostile = ['<img src=x onerror="alert(1)">', "a&b", "]]>", "'\"", "\udcff.png"]
    html = plot_pixel([panel(title="<script>x</script>")], THRESHOLDS, 0, hostile)
    assert "<img" not in html
    assert "<script" not in html
    (svg,) = panels_of(html.replace("&#56575;", "?"))
    assert {e.tag.removeprefix(SVG) for e in svg.iter()} <= {
        "svg", "g", "title", "text", "circle", "line", "polygon", "rect"
    }  # fmt: skip
    assert svg.findtext(f"{SVG}text") == "<script>x</script>"
    html.encode()


def test_an_unknown_value_has_no_dot_and_a_wild_one_stays_on_the_border():
    l = L.copy()
    l[1], l[2], l[4] = np.nan, -1000, 1000
    (svg,) = panels_of(plot_pixel([panel(l=l)], THRESHOLDS, 0, NAMES))
    found = dots(svg)
    assert "image 1" not in found
    side = float(square(svg).get("height", ""))
    assert found["image 2"][1] == pytest.approx(side)
    assert found["image 4"][1] == pytest.approx(0)
    assert 0 < found["image 0"][1] < side


@pytest.mark.parametrize("thresholds", [Thresholds(1.0, 0.0), Thresholds(1e-6, 0.999)])
def test_extreme_thresholds_and_a_black_pixel_still_make_a_plot(thresholds):
    black = np.zeros(5, np.float32)
    for l in (black, np.full(5, np.nan, np.float32)):
        (svg,) = panels_of(plot_pixel([panel(black, l)], thresholds, 0, NAMES))
        assert svg is not None
