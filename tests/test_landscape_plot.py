"""The picture of the landscape: colours, places and numbers read back from the drawing."""

import base64
import io
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from photolin.factors import TITLES, Factor, Thresholds
from photolin.landscape import Landscape
from webapp.landscape_plot import (
    LEFT,
    QUANTITIES,
    SIDE,
    TOP,
    colour,
    describe_cell,
    plot_landscape,
    quantity_values,
    thresholds_at,
)

SVG = "{http://www.w3.org/2000/svg}"
N = 12
RNG = np.random.default_rng(0)
SHARES = RNG.dirichlet(np.ones(5), (N, N)).transpose(2, 0, 1)
LAND = Landscape(
    T=np.geomspace(0.005, 0.2, N),
    Ts=np.geomspace(0.002, 0.1, N),
    shares=SHARES,
    change=RNG.random((N, N)) / 20,
    accuracy=RNG.uniform(50, 100, (N, N)),
    undetermined=0.0,
    pixels=100,
)
HERE = Thresholds(0.02, 0.01)


def drawing(land: Landscape = LAND, quantity: Any = "undefined", present=HERE, suggested=(3, 8)):
    return ElementTree.fromstring(plot_landscape(land, quantity, present, suggested, "the-map"))


def picture(svg: ElementTree.Element) -> np.ndarray:
    """(N,N,3) of the map's own pixels."""
    (group,) = [g for g in svg.iter(f"{SVG}g") if g.get("id") == "the-map"]
    (image,) = group
    data = base64.b64decode(image.get("href", "").partition(",")[2])
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


def crosshair(svg: ElementTree.Element) -> tuple[float, float]:
    (path, _) = [
        p for p in svg.iter(f"{SVG}path") if "V" in p.get("d", "") and "H" in p.get("d", "")
    ]
    x, y = path.get("d", "").removeprefix("M").split(f" 0V{SIDE}M0 ")
    return float(x), float(y.partition("H")[0])


def texts(svg: ElementTree.Element) -> list[str]:
    return ["".join(t.itertext()) for t in svg.iter(f"{SVG}text")]


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_each_cell_has_the_colour_of_its_value_with_Ts_upwards(quantity) -> None:
    values = quantity_values(LAND, quantity)
    scaled = (values - values.min()) / np.ptp(values)
    np.testing.assert_array_equal(picture(drawing(quantity=quantity))[::-1], colour(scaled))


def test_quantities_are_percent_of_what_they_are_called() -> None:
    for factor in Factor:
        np.testing.assert_array_equal(
            quantity_values(LAND, TITLES[factor]),  # pyright: ignore
            100 * SHARES[factor],
        )
    np.testing.assert_array_equal(quantity_values(LAND, "change"), 100 * LAND.change)
    assert quantity_values(LAND, "macro accuracy") is LAND.accuracy


def test_colours_rise_in_lightness_in_even_steps() -> None:
    """CIE L* of sRGB."""
    linear = ((colour(np.linspace(0, 1, 50)) / 255 + 0.055) / 1.055) ** 2.4
    lightness = 116 * np.cbrt(linear @ [0.2126, 0.7152, 0.0722]) - 16
    steps = np.diff(lightness)
    assert steps.min() > 0.5 * steps.mean()
    assert steps.max() < 1.5 * steps.mean()
    np.testing.assert_array_equal(colour(np.array([0.0, 1.0])), [[68, 1, 84], [253, 231, 37]])


@pytest.mark.parametrize(("row", "column"), [(0, 0), (3, 8), (11, 11), (0, 11)])
def test_crosshair_ring_and_click_agree_on_a_cell(row: int, column: int) -> None:
    there = Thresholds(float(LAND.T[column]), float(LAND.Ts[row]))
    svg = drawing(present=there, suggested=(row, column))
    x, y = crosshair(svg)
    assert (x, y) == pytest.approx(
        ((column + 0.5) * SIDE / N, SIDE - (row + 0.5) * SIDE / N), abs=0.06
    )
    for circle in svg.iter(f"{SVG}circle"):
        assert (float(circle.get("cx", "")), float(circle.get("cy", ""))) == pytest.approx((x, y))
    assert thresholds_at(LAND, x / SIDE, y / SIDE) == there


@pytest.mark.parametrize(
    ("x", "y", "column", "row"),
    [(0, 0, 0, 11), (1, 1, 11, 0), (0.0832, 0.5, 0, 6), (0.0834, 0.51, 1, 5), (-1, 9, 0, 0)],
)
def test_a_click_is_the_cell_under_it(x: float, y: float, column: int, row: int) -> None:
    assert thresholds_at(LAND, x, y) == Thresholds(float(LAND.T[column]), float(LAND.Ts[row]))


def test_axes_name_what_they_show_and_ticks_are_where_their_values_are() -> None:
    svg = drawing()
    said = texts(svg)
    assert "T, relative tolerance" in said
    assert "Ts, shadow level (fraction of full scale)" in said
    half = np.log(LAND.T[1] / LAND.T[0]) / 2
    low, high = np.log(LAND.T[0]) - half, np.log(LAND.T[-1]) + half
    ticks = [t for t in svg.iter(f"{SVG}text") if t.get("y") == str(TOP + SIDE + 15)]
    assert len(ticks) >= 3
    for tick in ticks:
        place = (np.log(float(tick.text or "")) - low) / (high - low)
        assert float(tick.get("x", "")) == pytest.approx(LEFT + SIDE * place, abs=0.06)
    assert sum(t.get("text-anchor") == "end" for t in svg.iter(f"{SVG}text")) >= 2


def test_the_legend_tells_the_range_in_percent() -> None:
    values = quantity_values(LAND, "macro accuracy")
    said = texts(drawing(quantity="macro accuracy"))
    assert f"{values.max():.0f} %" in said
    assert f"{values.min():.0f}" in said


def test_the_sentence_has_the_value_under_the_crosshair_and_at_the_ring() -> None:
    cell = LAND.cell(HERE.T, HERE.Ts)
    told = describe_cell(LAND, "specular", HERE, (3, 8))
    assert f"{100 * SHARES[Factor.SPECULAR][cell]:.2f} % specular of all observations" in told
    assert f"T {LAND.T[8]:.3g}, Ts {LAND.Ts[3]:.3g}: {100 * SHARES[2, 3, 8]:.2f} %" in told
    assert "; labels change least around it, the best T is often smaller." in told
    assert "border" not in told
    assert "; labels change least around there." in describe_cell(LAND, "change", HERE, cell)
    assert "of the labels change" in describe_cell(LAND, "change", HERE, cell)
    for beyond in (Thresholds(0.9, 0.01), Thresholds(0.02, 0.0), Thresholds(0.001, 0.01)):
        assert "the border of the map" in describe_cell(LAND, "change", beyond, cell)


# Degenerate and hostile


@pytest.mark.parametrize(
    ("present", "place"),
    [
        (Thresholds(1.0, 0.0), (SIDE, SIDE)),
        (Thresholds(1e-9, 0.999), (0, 0)),
    ],
)
def test_thresholds_beyond_the_map_are_at_its_border(present, place) -> None:
    assert crosshair(drawing(present=present)) == pytest.approx(place)


def test_a_flat_map_and_one_without_accuracy_are_drawn_in_the_least_colour() -> None:
    flat = replace(LAND, change=np.zeros((N, N)), accuracy=None)
    for quantity in ("change", "macro accuracy"):
        svg = drawing(flat, quantity)
        assert (picture(svg) == colour(np.array(0.0))).all()
        assert "0.00" in texts(svg)
    nothing = replace(LAND, accuracy=np.full((N, N), np.nan))
    assert (picture(drawing(nothing, "macro accuracy")) == colour(np.array(0.0))).all()


def test_no_id_can_leave_its_attribute_and_nothing_can_run() -> None:
    html = plot_landscape(LAND, "change", HERE, (0, 0), '"><script>alert(1)</script>')
    assert "<script" not in html
    svg = ElementTree.fromstring(html)
    assert {e.tag.removeprefix(SVG) for e in svg.iter()} <= {
        "svg", "g", "title", "text", "circle", "path", "image"
    }  # fmt: skip
    assert not [name for e in svg.iter() for name in e.attrib if name.startswith("on")]


@pytest.mark.parametrize("n", [2, 64])
@pytest.mark.parametrize(("low", "high"), [(1e-6, 0.9), (0.1, 0.11)])
def test_maps_of_any_size_and_range_have_ticks_within_their_axes(n, low, high) -> None:
    axis = np.geomspace(low, high, n)
    grid = np.zeros((n, n))
    land = Landscape(axis, axis, np.zeros((5, n, n)), grid, None, 0.0, 1)
    svg = drawing(land, suggested=(0, 0))
    for tick in svg.iter(f"{SVG}text"):
        if tick.get("y") == str(TOP + SIDE + 15):
            assert LEFT <= float(tick.get("x", "")) <= LEFT + SIDE
