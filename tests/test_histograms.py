"""Histograms behind T and Ts: every value in its bin, the line in its place."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from photolin.factors import Factor, css_colour
from webapp.histograms import (
    BINS,
    plot_histogram,
    plot_residuals,
    plot_samples,
)

SVG = "{http://www.w3.org/2000/svg}"


def bars(html: str, colour: str) -> list[tuple[float, float]]:
    """Left ends and heights of the bars of a colour."""
    found = [r for r in ET.fromstring(html).iter(f"{SVG}rect") if r.get("fill") == colour]
    return [(float(r.get("x", "")), float(r.get("height", ""))) for r in found]


def line_at(html: str, *, dashed: bool = False) -> float | None:
    """Where the line of the proposed level is, or the dashed one of the level that is set."""
    upright = [x for x in ET.fromstring(html).iter(f"{SVG}line") if x.get("x1") == x.get("x2")]
    lines = [x for x in upright if (x.get("stroke-dasharray") is not None) == dashed]
    return float(lines[0].get("x1", "")) if lines else None


def test_bars_are_as_high_as_their_bins_are_full_and_the_fullest_fills_the_plot() -> None:
    values = np.repeat([0.05, 0.25, 0.85], [10, 40, 20])
    found = bars(plot_histogram([(values, "red")], 1.0, 0.5, 0.4, "x"), "red")
    heights = [height for _, height in found]
    assert len(found) == 3
    np.testing.assert_allclose(np.array(heights) / max(heights), [0.25, 1, 0.5], atol=0.01)
    assert [round((x - 8) / 284 * BINS) for x, _ in found] == [2, 12, 40]


@pytest.mark.parametrize(("line", "seen"), [(0.0, True), (0.5, True), (1.0, True), (1.1, False)])
def test_the_lines_are_where_they_should_be_or_not_there(line: float, seen: bool) -> None:
    expected = pytest.approx(8 + 284 * line, abs=0.01) if seen else None
    html = plot_histogram([(np.array([0.2]), "red")], 1.0, line, 0.3, "x")
    assert line_at(html) == expected
    assert line_at(html, dashed=True) == pytest.approx(8 + 284 * 0.3, abs=0.01)
    html = plot_histogram([(np.array([0.2]), "red")], 1.0, 0.3, line, "x")
    assert line_at(html, dashed=True) == expected
    assert line_at(html) == pytest.approx(8 + 284 * 0.3, abs=0.01)


def test_nothing_sampled_is_drawn_without_bars() -> None:
    html = plot_histogram([(np.empty(0), "red")], 1.0, 0.2, 0.1, "a < b & c")
    assert bars(html, "red") == []


@pytest.mark.parametrize(("proposed", "present"), [(0.05, 0.02), (0.02, 0.2), (0.12, 1.0)])
def test_both_T_lie_within_the_axis_of_their_residuals(proposed: float, present: float) -> None:
    for values in (np.full(9, 0.3, np.float32), np.empty(0, np.float32)):
        html = plot_residuals(values, proposed, present)
        left, right = line_at(html), line_at(html, dashed=True)
        assert left is not None
        assert right is not None
        assert (left < right) == (proposed < present)
        assert len(bars(html, css_colour(Factor.DIFFUSE))) == (values.size > 0)


def test_sampled_shadows_and_lit_pixels_have_the_colours_of_their_classes() -> None:
    shadows, lit = np.full(5, 0.01, np.float32), np.linspace(0.05, 0.5, 50, dtype=np.float32)
    html = plot_samples(shadows, lit, 0.03, 0.2)
    (dark,) = bars(html, css_colour(Factor.CAST))
    bright = bars(html, css_colour(Factor.DIFFUSE))
    assert dark[0] < min(x for x, _ in bright)
    assert dark[0] < (line_at(html) or 0) < min(x for x, _ in bright) + 10
    assert (line_at(html, dashed=True) or 0) > (line_at(html) or 0)


def test_values_beyond_the_axis_are_told_as_a_share_of_their_kind() -> None:
    few, many = np.array([0.1] * 98 + [2.0] * 2), np.array([0.1, 2.0, 3.0, 4.0])
    texts = [
        "".join(text.itertext())
        for text in ET.fromstring(
            plot_histogram([(few, "red"), (many, "green")], 1.0, 0.2, 0.3, "x")
        ).iter(f"{SVG}text")
    ]
    assert [text.split(" ")[0] for text in texts if "beyond" in text] == ["2%", "75%"]
    hardly = np.array([0.1] * 299 + [2.0])
    html = plot_histogram([(hardly, "red")], 1.0, 0.2, 0.3, "x")
    assert "beyond" not in html
