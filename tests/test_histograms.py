"""Histograms behind T and Ts: every value in its bin, the line in its place."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from photolin import analyze, render_scene
from photolin.factors import Factor, Thresholds, css_colour
from webapp.histograms import (
    BINS,
    plot_histogram,
    plot_residuals,
    plot_samples,
    residuals_below,
)

SVG = "{http://www.w3.org/2000/svg}"


def bars(html: str, colour: str) -> list[tuple[float, float]]:
    """Left ends and heights of the bars of a colour."""
    found = [r for r in ET.fromstring(html).iter(f"{SVG}rect") if r.get("fill") == colour]
    return [(float(r.get("x", "")), float(r.get("height", ""))) for r in found]


def line_at(html: str) -> float | None:
    """Where the dashed line is."""
    lines = [x for x in ET.fromstring(html).iter(f"{SVG}line") if x.get("stroke-dasharray")]
    return float(lines[0].get("x1", "")) if lines else None


def test_bars_are_as_high_as_their_bins_are_full_and_the_fullest_fills_the_plot() -> None:
    values = np.repeat([0.05, 0.25, 0.85], [10, 40, 20])
    found = bars(plot_histogram([(values, "red")], 1.0, 0.5, "x"), "red")
    heights = [height for _, height in found]
    assert len(found) == 3
    np.testing.assert_allclose(np.array(heights) / max(heights), [0.25, 1, 0.5], atol=0.01)
    assert [round((x - 8) / 284 * BINS) for x, _ in found] == [2, 12, 40]


@pytest.mark.parametrize(("line", "seen"), [(0.0, True), (0.5, True), (1.0, True), (1.1, False)])
def test_the_line_is_where_it_should_be_or_not_there(line: float, seen: bool) -> None:
    at = line_at(plot_histogram([(np.array([0.2]), "red")], 1.0, line, "x"))
    assert at == (pytest.approx(8 + 284 * line, abs=0.01) if seen else None)


def test_nothing_sampled_is_drawn_without_bars() -> None:
    html = plot_histogram([(np.empty(0), "red")], 1.0, 0.2, "a < b & c")
    assert bars(html, "red") == []


def test_residuals_are_of_lit_observations_below_the_fit() -> None:
    scene = render_scene("sphere_cone", size=(40, 50), images=8, noise=0.01, bits=None)
    a = analyze(scene.stack)
    Ts = a.thresholds.Ts
    found = residuals_below(scene.stack, a, Ts, most=10**9)
    l = np.stack([a.linearized(k) for k in range(8)])[:, a.determined()]
    i = scene.stack.images[:, a.determined()]
    below = (i >= Ts) & (l > i)
    np.testing.assert_allclose(np.sort(found), np.sort((l - i)[below] / i[below]), atol=1e-5)
    few = residuals_below(scene.stack, a, Ts, most=2000)
    assert 100 < few.size < found.size
    assert np.median(few) == pytest.approx(np.median(found), rel=0.2)


def test_T_lies_within_the_axis_of_its_residuals() -> None:
    for values in (np.full(9, 0.3, np.float32), np.empty(0, np.float32)):
        html = plot_residuals(values, Thresholds(0.05, 0.01))
        assert line_at(html) is not None
        assert len(bars(html, css_colour(Factor.DIFFUSE))) == (values.size > 0)


def test_sampled_shadows_and_lit_pixels_have_the_colours_of_their_classes() -> None:
    shadows, lit = np.full(5, 0.01, np.float32), np.linspace(0.05, 0.5, 50, dtype=np.float32)
    html = plot_samples(shadows, lit, 0.03)
    (dark,) = bars(html, css_colour(Factor.CAST))
    bright = bars(html, css_colour(Factor.DIFFUSE))
    assert dark[0] < min(x for x, _ in bright)
    assert dark[0] < (line_at(html) or 0) < min(x for x, _ in bright) + 10
