"""The shares of the classes, and the doubt whether Ts is too low."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from photolin import Options, analyze, render_scene
from photolin.factors import Factor
from webapp.frame import compose
from webapp.runs import Runs
from webapp.state import ViewState
from webapp.views.shares import SharesView

STACK = render_scene("sphere_cone", size=(20, 25), images=8).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02, samples=50))


class Gui:
    """Makes one HTML handle, as viser does."""

    def __init__(self) -> None:
        self.handle = SimpleNamespace(content="")

    def add_html(self, content: str) -> Any:
        self.handle.content = content
        return self.handle


def shown(**pixels: int) -> str:
    """What is drawn for so many pixels of each class, of 500; the rest is diffuse."""
    labels = np.full((20, 25), Factor.DIFFUSE, np.uint8)
    at = 0
    for name, count in pixels.items():
        labels.flat[at : at + count] = Factor[name]
        at += count
    gui: Any = Gui()
    frame = compose(Runs(STACK, Options()), {"robust": RESULT}, ViewState(T=0.05, Ts=0.02))
    SharesView(gui).draw(replace(frame, labels=labels))
    return gui.handle.content


def test_shares_are_of_the_labels_shown() -> None:
    text = shown(CAST=50, SPECULAR=100)
    assert all(share in text for share in ("C 10.0 %", "S 20.0 %", "D 70.0 %", "U 0.0 %"))


@pytest.mark.parametrize(
    ("pixels", "doubted"),
    [
        ({"UNDEFINED": 20, "CAST": 5}, True),
        ({"UNDEFINED": 20, "CAST": 6}, False),  # shadows are found
        ({"UNDEFINED": 14}, False),  # little is undefined
        ({"UNDEFINED": 20, "ATTACHED": 40}, False),
    ],
)
def test_hardly_any_shadow_beside_much_undefined_makes_Ts_doubtful(
    pixels: dict[str, int], doubted: bool
) -> None:
    assert ("Ts may be too low" in shown(**pixels)) is doubted


@pytest.mark.parametrize(("whole", "signs"), [(None, 5), (RESULT, 0)])
def test_shares_of_a_preview_of_a_part_are_told_as_about_right(whole: Any, signs: int) -> None:
    """Those of the method beside it are right."""
    gui: Any = Gui()
    frame = compose(Runs(STACK, Options()), {"robust": RESULT}, ViewState(T=0.05, Ts=0.02))
    preview: Any = SimpleNamespace(whole=whole)
    SharesView(gui).draw(replace(frame, preview=preview, beside=RESULT, beside_labels=frame.labels))
    assert gui.handle.content.count(" %</span>") == 10
    assert gui.handle.content.count("≈") == signs
