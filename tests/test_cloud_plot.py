"""The picture of the cloud: dots, marks and numbers read back from it."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from photolin.candidates import Cloud
from photolin.factors import Thresholds
from webapp.box_plot import View
from webapp.cloud_plot import PATH, describe_cloud, plot_cloud, plot_legend

SVG = "{http://www.w3.org/2000/svg}"
N = 400
RNG = np.random.default_rng(0)
TRUE = np.array([0.5, -0.2, 0.9])
CANDIDATES = (TRUE + RNG.normal(size=(N, 3)) * 0.3).astype(np.float32)
CANDIDATES[:150] = TRUE + RNG.normal(size=(150, 3)) * 0.01
CANDIDATES[-20:] *= 1000
CLOUD = Cloud(
    image=7,
    source="base images",
    thresholds=Thresholds(0.05, 0.02),
    candidates=CANDIDATES,
    support=np.where(np.arange(N) < 150, 900, 300).astype(np.int32),
    winner=3,
    inliers=np.arange(N) < 150,
    path=np.array([[50.0, 50, 50], [0.6, -0.1, 0.8], [0.55, -0.15, 0.85]]),
    left=np.array([400, 200, 30]),
    pixels=1000,
    lit=800,
    gram=np.eye(3),
)
FOUND = TRUE + 0.02
HERE = View(35, 25)


def drawing(cloud: Cloud = CLOUD, zoom: float = 1) -> tuple[ElementTree.Element, int]:
    text, outside = plot_cloud(cloud, FOUND, HERE, zoom)
    return ElementTree.fromstring(text), outside


def dots(svg: ElementTree.Element) -> dict[tuple[str, str], int]:
    """How many dots of each colour and width."""
    (group,) = [g for g in svg.iter(f"{SVG}g") if g.get("stroke-linecap") == "round"]
    return {
        (p.get("stroke", ""), p.get("stroke-width", "")): p.get("d", "").count("h0") for p in group
    }


def named(svg: ElementTree.Element, name: str) -> list[ElementTree.Element]:
    return [e for e in svg.iter() if any(t.text == name for t in e.findall(f"{SVG}title"))]


def test_every_candidate_is_a_dot_or_counted_as_outside() -> None:
    svg, outside = drawing()
    assert 20 <= outside < N / 2
    assert sum(dots(svg).values()) == N - outside


def test_inliers_are_larger_and_another_support_is_another_colour() -> None:
    found = dots(drawing()[0])
    (few, many) = sorted(found, key=lambda look: float(look[1]))
    assert found[many] == 150
    assert few[0] != many[0]
    same = replace(CLOUD, support=np.full(N, 500, np.int32))
    assert len({colour for colour, _ in dots(drawing(same)[0])}) == 1


def test_support_below_nothing_has_the_colour_of_nothing() -> None:
    support = np.where(np.arange(N) < 150, 900, -(10**6)).astype(np.int32)
    negative = replace(CLOUD, support=support)
    zero = replace(CLOUD, support=np.maximum(support, 0))
    assert dots(drawing(negative)[0]) == dots(drawing(zero)[0])
    assert "≤ 0" in re.sub("<[^>]*>", "", plot_legend(negative))
    assert "≤" not in plot_legend(CLOUD)


def test_winner_and_result_are_marked_where_they_are() -> None:
    svg, _ = drawing()
    (ring,), (cross,) = named(svg, "winner"), named(svg, "result")
    at = [float(ring.get("cx", "")), float(ring.get("cy", ""))]
    across, up = (HERE.rotation[:2] @ (FOUND - CLOUD.best)).tolist()
    start = re.match(r"M([-0-9.]+) ([-0-9.]+)l10 10", cross.get("d", ""))
    assert start is not None
    way = [float(start[1]) + 5 - at[0], float(start[2]) + 5 - at[1]]
    assert np.hypot(*way) > 1
    assert np.arctan2(-way[1], way[0]) == pytest.approx(np.arctan2(up, across), abs=0.1)


def test_the_path_is_drawn_as_far_as_it_lies_inside_and_its_end_is_largest() -> None:
    svg, _ = drawing()
    spots = [c for c in svg.iter(f"{SVG}circle") if c.get("fill") == PATH]
    assert len(spots) == 2
    assert float(spots[1].get("r", "")) > float(spots[0].get("r", ""))
    ElementTree.fromstring(plot_cloud(CLOUD, FOUND, HERE, 50)[0])  # nothing of it inside


def test_zoom_keeps_the_winner_and_leaves_more_outside() -> None:
    wide, near = drawing(), drawing(zoom=20)
    assert near[1] > wide[1]
    assert named(near[0], "winner")


@pytest.mark.parametrize("n", [1, 2])
def test_a_cloud_of_one_place_is_drawn(n: int) -> None:
    point = np.array([[1, 0, 0]] * n, np.float32)
    one = replace(
        CLOUD,
        candidates=point,
        support=np.full(n, 1000, np.int32),
        winner=0,
        inliers=np.ones(n, bool),
        path=point[:1].astype(float),
        left=np.array([n]),
    )
    text, outside = plot_cloud(one, point[0], HERE)
    assert outside == 0
    assert sum(dots(ElementTree.fromstring(text)).values()) == n


def test_the_sentence_has_the_numbers() -> None:
    told = describe_cloud(CLOUD, FOUND, 61)
    best = ", ".join(f"{value:.3f}" for value in CLOUD.best.tolist())
    away = 100 * np.linalg.norm(FOUND - CLOUD.best) / np.linalg.norm(CLOUD.best)
    end = 100 * np.linalg.norm(CLOUD.path[-1] - CLOUD.best) / np.linalg.norm(CLOUD.best)
    assert told == (
        f"Image 7: 150 of 400 candidates within T = 5 % of the winner, c = ({best}), whose support "
        "(D + A + C) is 90.0 % of 1000 pixels. Result: c = (0.520, -0.180, 0.920), "
        f"{away:.1f} % from the winner. Centre of gravity of the last 30: (0.550, -0.150, 0.850), "
        f"{end:.1f} % from the winner. 61 lie outside the drawing."
    )
    assert "outside" not in describe_cloud(CLOUD, FOUND, 0)
    assert "(D + A + C - U)" in describe_cloud(replace(CLOUD, source="linearized bases"), FOUND, 0)
    assert "over 1000 % from" in describe_cloud(CLOUD, FOUND * 1e9, 0)
