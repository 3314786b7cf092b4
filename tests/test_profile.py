"""One pixel over all images: what is drawn, said and counted."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from photolin import analyze, render_scene
from photolin.factors import Factor, Thresholds, classify
from webapp.plots import PixelPanel
from webapp.profile import (
    Profile,
    describe_confidence,
    next_image,
    plot_profile,
    tabulate_pixel,
)

SVG = "{http://www.w3.org/2000/svg}"
THRESHOLDS = Thresholds(0.1, 0.05)
I = np.array([0.8, 0.6, 0.01, 0.01, 0.3], np.float32)
L = np.array([0.8, 0.3, -0.2, np.nan, 0.6], np.float32)
NAMES = tuple(f"<{k}>.png" for k in range(5))


def panel(i: np.ndarray = I, l: np.ndarray = L) -> PixelPanel:
    return PixelPanel("robust", i, l, classify(i, l, THRESHOLDS))


def test_every_image_has_a_dot_and_the_line_is_broken_where_l_is_unknown() -> None:
    svg = ET.fromstring(plot_profile([Profile("row 1, column 2", panel())], THRESHOLDS, 1))
    assert len(svg.findall(f"{SVG}circle")) == 5
    (path,) = svg.findall(f"{SVG}path")
    assert path.get("d", "").count("M") == 2
    assert path.get("d", "").count("L") == 2


def test_dots_are_higher_the_brighter_and_farther_right_the_later() -> None:
    svg = ET.fromstring(plot_profile([Profile("p", panel())], THRESHOLDS, 0))
    circles = svg.findall(f"{SVG}circle")
    y = np.array([float(c.get("cy", "")) for c in circles])
    x = np.array([float(c.get("cx", "")) for c in circles])
    np.testing.assert_array_equal(np.argsort(-y, kind="stable"), np.argsort(I, kind="stable"))
    assert (np.diff(x) > 0).all()


def test_four_pixels_have_four_kinds_of_line() -> None:
    profiles = [Profile(str(n), panel(I * (1 - n / 10))) for n in range(4)]
    svg = ET.fromstring(plot_profile(profiles, THRESHOLDS, 0))
    assert len({p.get("stroke-dasharray") for p in svg.findall(f"{SVG}path")}) == 4
    assert len(svg.findall(f"{SVG}circle")) == 20


@pytest.mark.parametrize("l", [np.full(5, np.nan), np.zeros(5), np.full(5, -3.0)])
def test_pixels_without_light_or_without_a_fit_are_drawn(l: np.ndarray) -> None:
    drawn = plot_profile(
        [Profile("p", panel(np.zeros(5, np.float32), l.astype(np.float32)))], THRESHOLDS, 4
    )
    assert "nan" not in drawn
    assert len(ET.fromstring(drawn).findall(f"{SVG}circle")) == 5


def test_the_table_has_every_image_with_its_rule_and_names_are_escaped() -> None:
    html = tabulate_pixel(panel(), THRESHOLDS, 1, NAMES)
    assert html.count("<tr") == 6
    told = ("i is l within T", "brighter than l", "dark&#44; faces away", "l unknown")
    for words in told:
        assert words in html
    assert "<0>" not in html
    rows = html.split("<tr")
    assert "background" in rows[3]
    assert not any("background" in row for row in (*rows[:3], *rows[4:]))


def test_the_next_image_of_a_class_goes_round_the_end() -> None:
    labels = np.array([2, 1, 2, 0, 1], np.uint8)
    assert next_image(labels, 0, Factor.SPECULAR) == 2
    assert next_image(labels, 2, Factor.SPECULAR) == 0
    assert next_image(labels, 3, Factor.UNDEFINED) == 3
    assert next_image(labels, 0, Factor.CAST) is None


def test_confidence_is_told_by_what_the_result_counts() -> None:
    a = analyze(render_scene("sphere_cone", size=(40, 50), images=8).stack)
    assert a.confidence is not None
    c = a.confidence
    for pixel in ((20, 25), (3, 3), (30, 40)):
        told = describe_confidence(c, pixel, 8)
        assert f"in {c.lit[pixel]} of 8 images" in told
        assert f"diffuse in {c.diffuse[pixel]}" in told
    (row, column), *_ = np.argwhere(c.lit < 3)
    assert "too few to determine it" in describe_confidence(c, (int(row), int(column)), 8)
    assert "does not say" in describe_confidence(None, (0, 0), 8)
