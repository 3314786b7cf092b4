"""The cloud of coefficient candidates (Fig. 3). Pure; SVG text and words.

Text colour is inherited, so that all reads on a light and a dark page.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photolin.candidates import Cloud
from photolin.factors import Factor, css_colour

from .box_plot import Box, View, choose_box, draw_box
from .landscape_plot import colour
from .lights_plot import AXES, format_vector

STEPS = 8
"""Colours of support."""
SHADES = (0.4, 0.84)
"""Part of the colours that shows on black and on white."""
PATH = css_colour(Factor.UNDEFINED)


def plot_cloud(
    cloud: Cloud, coefficients: ArrayLike, view: View, zoom: float = 1.0
) -> tuple[str, int]:
    """Candidates coloured by support, the winner, the centre's path, and the coefficients found.

    Args:
        coefficients: (3,) of the result shown.
        zoom: 1 or more, around the winner.

    Returns:
        One SVG, and how many candidates lie outside it.
    """
    found = np.asarray(coefficients, np.float64)
    important = np.stack([cloud.best, found, cloud.path[-1]])
    box = choose_box(cloud.candidates, important, cloud.best, view, zoom)
    inside = box.holds(cloud.candidates)
    inner = _dots(cloud, box, inside) + _centre(cloud.path, box)
    marks = (_ring(box, cloud.best, "winner"), _cross(box, found, "result"))
    title = f"candidates for the coefficients of image {cloud.image}"
    drawing = draw_box(box, AXES, inner + "".join(marks), title)
    return drawing, int(np.count_nonzero(~inside))


def plot_legend(cloud: Cloud) -> str:
    """What colours and marks mean, as HTML."""
    low, high = (100 * end / cloud.pixels for end in _span(cloud.support))
    less = "≤ " if cloud.support.min() < 0 else ""
    shades = ",".join(_shades())
    bar = (
        f'<span style="display:inline-block;width:4em;height:0.7em;margin:0 0.3em;'
        f'background:linear-gradient(to right,{shades})"></span>'
    )
    items = (
        ('<circle r="6" fill="none" stroke="currentColor" stroke-width="2"/>', "winner"),
        ('<path d="M-5 -5L5 5M-5 5L5 -5" stroke="currentColor" stroke-width="2"/>', "result"),
        (
            f'<path d="M-7 0H3" stroke="{PATH}"/><circle cx="4" r="3" fill="{PATH}"/>',
            "centre of gravity",
        ),
    )
    drawn = "".join(
        '<span style="white-space:nowrap"><svg width="16" height="16" viewBox="-8 -8 16 16" '
        f'style="vertical-align:-3px">{mark}</svg> {words}</span>'
        for mark, words in items
    )
    return (
        '<div style="display:flex;flex-wrap:wrap;gap:0 1em;justify-content:center">'
        f'<span style="white-space:nowrap">support {less}{low:.0f}{bar}{high:.0f} %</span>'
        f"{drawn}</div>"
    )


def describe_cloud(cloud: Cloud, coefficients: ArrayLike, outside: int) -> str:
    """Winner, result and centre of gravity in words with numbers.

    Args:
        coefficients: (3,) of the result shown.
        outside: candidates that the drawing leaves out.
    """
    n, near = len(cloud.candidates), int(np.count_nonzero(cloud.inliers))
    support = 100 * int(cloud.support[cloud.winner]) / cloud.pixels
    of = "D + A + C" if cloud.source == "base images" else "D + A + C - U"
    away = [_percent(cloud, point) for point in (coefficients, cloud.path[-1])]
    left = int(cloud.left[-1])
    sentences = [
        f"Image {cloud.image}: {near} of {n} candidates within T = "
        f"{100 * cloud.thresholds.T:g} % of the winner, c = {format_vector(cloud.best)}, "
        f"whose support ({of}) is {support:.1f} % of {cloud.pixels} pixels.",
        f"Result: c = {format_vector(coefficients)}, {away[0]} from the winner.",
        f"Centre of gravity of the last {left}: {format_vector(cloud.path[-1])}, {away[1]} from "
        "the winner.",
    ]
    if outside:
        sentences.append(f"{outside} lie outside the drawing.")
    return " ".join(sentences)


def _percent(cloud: Cloud, point: ArrayLike) -> str:
    away = 100 * float(cloud.distances(point))
    return f"{away:.1f} %" if away < 1000 else "over 1000 %"


def _span(support: NDArray[np.int32]) -> tuple[int, int]:
    """What the colours span; less than nothing has the colour of nothing."""
    return max(int(support.min()), 0), max(int(support.max()), 1)


def _shades() -> list[str]:
    """CSS colours from the least support to the most."""
    return [f"rgb({r},{g},{b})" for r, g, b in colour(np.linspace(*SHADES, STEPS)).tolist()]


def _dots(cloud: Cloud, box: Box, inside: NDArray[np.bool_]) -> str:
    """Candidates as dots, one path for each colour, those of the most support last (on top)."""
    low, high = _span(cloud.support)
    scaled = (cloud.support - low) / max(high - low, 1)
    step = np.clip((scaled * STEPS).astype(int), 0, STEPS - 1)
    parts = []
    for near, wide, ink in ((False, 2.6, 0.7), (True, 4.0, 0.9)):
        for number, shade in enumerate(_shades()):
            some = inside & (step == number) & (cloud.inliers == near)
            if some.any():
                places = box.place(cloud.candidates[some]).tolist()
                marks = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in places)
                parts.append(
                    f'<path d="{marks}" stroke="{shade}" stroke-width="{wide}" '
                    f'stroke-opacity="{ink}"/>'
                )
    return f'<g fill="none" stroke-linecap="round">{"".join(parts)}</g>'


def _centre(path: NDArray[np.float64], box: Box) -> str:
    """The way of the centre of gravity, as far as it lies inside; its end is a large dot."""
    inside = box.holds(path)
    places = box.place(path[inside]).tolist()
    if not places:
        return ""
    line = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
    dots = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{3.6 if last else 1.8}" fill="{PATH}"/>'
        for (x, y), last in zip(places, [*[False] * (len(places) - 1), True], strict=True)
    )
    return f'<path d="{line}" fill="none" stroke="{PATH}" stroke-width="1.5"/>{dots}'


def _ring(box: Box, point: ArrayLike, name: str) -> str:
    x, y = box.place(point)
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="7" fill="none" stroke="currentColor" '
        f'stroke-width="2"><title>{name}</title></circle>'
    )


def _cross(box: Box, point: ArrayLike, name: str) -> str:
    if not box.holds(point):
        return ""
    x, y = box.place(point)
    return (
        f'<path d="M{x - 5:.1f} {y - 5:.1f}l10 10m-10 0l10 -10" stroke="currentColor" '
        f'stroke-width="2"><title>{name}</title></path>'
    )
