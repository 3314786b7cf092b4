"""One pixel over all images: the profile of i and l, and a table. Pure; HTML without scripts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from photolin.analysis import Confidence
from photolin.export.html_plots import ticks
from photolin.factors import LETTERS, TITLES, Factor, Thresholds, css_colour

from .plots import PixelPanel
from .readout import escape, rule_of

WIDTH, HEIGHT = 300, 130
LEFT, TOP, BOTTOM = 34, 8, 26
DASHES = ("", "4 2", "1 2", "6 2 1 2")
"""Of the lines of the first to the fourth pixel."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A pixel to be drawn."""

    name: str
    """As "row 41, column 77"."""
    panel: PixelPanel


def plot_profile(profiles: Sequence[Profile], thresholds: Thresholds, current: int) -> str:
    """i (dots in the colours of their classes) and l (line) of pixels over the K images.

    Args:
        profiles: one to four.
        current: image number, from 0, at a vertical line.
    """
    i = np.concatenate([p.panel.i for p in profiles])
    l = np.concatenate([p.panel.l for p in profiles])
    l = l[np.isfinite(l)]
    high = 1.06 * max(float(i.max()), 2 * thresholds.Ts, float(l.max(initial=0)), 1e-3)
    low = min(float(l.min(initial=0)) * 1.06, -0.05 * high)
    K = len(profiles[0].panel.i)

    def at(k: float, value: float) -> tuple[float, float]:
        x = LEFT + (k + 0.5) / K * (WIDTH - LEFT - 6)
        return round(x, 2), round(TOP + (high - value) / (high - low) * (HEIGHT - TOP - BOTTOM), 2)

    left, right = at(-0.5, 0)[0], at(K - 0.5, 0)[0]
    parts = [_level(left, right, at(0, 0)[1], 'stroke-opacity="0.5"')]
    parts.append(_level(left, right, at(0, thresholds.Ts)[1], 'stroke-dasharray="4 3"'))
    x = at(current, 0)[0]
    parts.append(
        f'<line x1="{x}" x2="{x}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="currentColor" '
        'stroke-width="2" stroke-opacity="0.35"/>'
    )
    for profile, dashes in zip(profiles, DASHES, strict=False):
        parts.append(_curve(profile, dashes, at))
    for value in ticks(low, high):
        parts.append(
            f'<text x="{LEFT - 4}" y="{at(0, value)[1] + 4:g}" text-anchor="end">{value:g}</text>'
        )
    for k in sorted({0, K // 2, K - 1}):
        parts.append(
            f'<text x="{at(k, 0)[0]}" y="{HEIGHT - BOTTOM + 13}" text-anchor="middle">{k}</text>'
        )
    parts.append(
        f'<text x="{(left + right) / 2:g}" y="{HEIGHT - 2}" text-anchor="middle">'
        "image; dots: input i, line: linearized l (of full scale)</text>"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="100%" '
        'role="img" fill="currentColor" font-family="system-ui,sans-serif" font-size="10">'
        f"{''.join(parts)}</svg>"
    )


def _level(left: float, right: float, y: float, look: str) -> str:
    return f'<line x1="{left}" x2="{right}" y1="{y}" y2="{y}" stroke="currentColor" {look}/>'


def _curve(profile: Profile, dashes: str, at: Callable[[float, float], tuple[float, float]]) -> str:
    """The line of l, broken where it is unknown, and the dots of i."""
    panel = profile.panel
    runs: list[str] = []
    fresh = True
    for k, l in enumerate(panel.l.tolist()):
        if np.isfinite(l):
            x, y = at(k, l)
            runs.append(f"{'M' if fresh else 'L'}{x} {y}")
        fresh = not np.isfinite(l)
    line = (
        f'<path d="{" ".join(runs)}" fill="none" stroke="currentColor" stroke-width="1.2" '
        f'stroke-dasharray="{dashes}"/>'
    )
    dots = []
    for k, (i, label) in enumerate(zip(panel.i.tolist(), panel.labels.tolist(), strict=True)):
        x, y = at(k, i)
        title = f"{profile.name}, image {k}: i {i:.3f}, {TITLES[Factor(label)]}"
        dots.append(
            f'<circle cx="{x}" cy="{y}" r="2.6" fill="{css_colour(label)}" stroke="currentColor" '
            f'stroke-width="0.5"><title>{escape(title)}</title></circle>'
        )
    return line + "".join(dots)


def tabulate_pixel(
    panel: PixelPanel, thresholds: Thresholds, current: int, names: Sequence[str]
) -> str:
    """All K images of a pixel in a table: i, l, |i - l|/i, class, and the rule in words."""
    rows = []
    for k, (i, l, label) in enumerate(
        zip(panel.i.tolist(), panel.l.tolist(), panel.labels.tolist(), strict=True)
    ):
        share = f"{abs(i - l) / i:.3f}" if i > 0 and np.isfinite(l) else "–"
        linear = f"{l:z.3f}" if np.isfinite(l) else "–"
        here = ' style="background:rgba(128,128,128,0.3)"' if k == current else ""
        rule = escape(rule_of(i, l, thresholds))
        rows.append(
            f'<tr{here} title="{escape(names[k])}"><td>{k}</td><td>{i:.3f}</td><td>{linear}</td>'
            f'<td>{share}</td><td style="color:{css_colour(label)};font-weight:600;padding:0 6px">'
            f'{LETTERS[Factor(label)]}</td><td style="text-align:left">{rule}</td></tr>'
        )
    heads = ("image", "i", "l", "|i-l|/i", "", "rule")
    return (
        '<div style="max-height:max(16em,45vh);overflow-y:auto">'
        '<table style="border-collapse:collapse;width:100%;text-align:right;'
        'font-size:0.75em;font-variant-numeric:tabular-nums">'
        f"<tr>{''.join(f'<th>{escape(h)}</th>' for h in heads)}</tr>{''.join(rows)}</table></div>"
    )


def describe_confidence(confidence: Confidence | None, pixel: tuple[int, int], images: int) -> str:
    """What a pixel's linearized values rest on, in words."""
    if confidence is None:
        return "This result does not say what its pixels rest on."
    lit, diffuse = int(confidence.lit[pixel]), int(confidence.diffuse[pixel])
    margin, spread = int(confidence.margin[pixel]), float(confidence.spread[pixel])
    sentence = f"Lit and not saturated in {lit} of {images} images, diffuse in {diffuse}"
    if lit < 3:
        return f"{sentence}: too few to determine it."
    if diffuse <= 3:
        return f"{sentence}: three fit exactly, so nothing checks them."
    lights = "well apart" if spread > 0.3 else "near one plane" if spread < 0.05 else "apart"
    won = f"; the solution won by {margin} votes" if margin else ""
    return f"{sentence}, by lights that are {lights} (spread {spread:.2f} of 1){won}."


def next_image(labels: NDArray[np.uint8], current: int, factor: Factor) -> int | None:
    """The next image, round the end, in which a pixel with labels (K,) is of a class."""
    found = np.flatnonzero(labels == np.uint8(factor))
    if not found.size:
        return None
    later = found[found > current]
    return int(later[0] if later.size else found[0])
