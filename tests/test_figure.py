"""Figures as the inspector sends them: by T and Ts on screen, other methods run where wanted."""

from dataclasses import replace

import pytest

from photolin import Options, analyze, render_scene
from photolin.analysis import METHODS
from photolin.errors import Cancelled
from photolin.figures import draw_figure
from webapp.downloads import relabel
from webapp.figure import KINDS, make_figure
from webapp.runs import Runs
from webapp.state import ViewState

SCENE = render_scene("sphere_cone", size=(20, 28), images=8)
STACK = SCENE.stack
OPTIONS = Options(samples=50)
STATE = ViewState(T=0.07, Ts=0.03, image=4)
SHOWN = relabel(STACK, analyze(STACK, replace(OPTIONS, T=0.05, Ts=0.02)), STATE.thresholds)


def make(kind: str, state: ViewState = STATE, cancel: bool = False) -> tuple[str, bytes]:
    runs = Runs(STACK, OPTIONS, truth=SCENE.truth.labels)
    return make_figure(runs, kind, lambda *_: None, lambda: cancel, SHOWN, state)


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_drawn_of_what_is_on_screen_with_all_methods_where_the_figure_has_them(
    kind: str,
) -> None:
    name, data = make(kind)
    results = {"robust": SHOWN}
    if kind in ("figure 6", "figure 8", "figure 15"):
        results |= {
            m: analyze(STACK, replace(OPTIONS, method=m, T=0.07, Ts=0.03))
            for m in METHODS
            if m != "robust"
        }
    assert data == draw_figure(KINDS[kind], STACK, results, 4, SCENE.truth.labels)
    part = "_004" if kind in ("figure 6", "figure 10") else ""
    assert name == f"sphere_cone{part}_{kind.replace(' ', '_')}.png"


def test_cancelling_says_that_nothing_is_saved() -> None:
    with pytest.raises(Cancelled, match="figure 6 cancelled; nothing is saved"):
        make("figure 6", cancel=True)
