"""The comparison without a page: who counts its labels."""

import threading
from unittest.mock import MagicMock

import pytest

from photolin.analysis import Options
from photolin.synthetic import render_scene
from webapp.frame import compose
from webapp.runs import Runs
from webapp.state import ViewState
from webapp.views import compare as module
from webapp.views.compare import CompareView

STACK = render_scene("sphere_cone", size=(16, 20), images=8).stack


def test_coming_into_view_counts_nothing_on_the_loop_of_all_tabs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counted: list[int] = []

    def count(*_: object) -> None:
        counted.append(threading.get_ident())

    monkeypatch.setattr(module, "measure_agreement", count)
    clicks, wake = MagicMock(), threading.Event()
    view = CompareView(MagicMock(), clicks, wake.set, MagicMock(), known=False)
    seen = clicks.see.call_args.args[1]
    frame = compose(Runs(STACK, Options()), {}, ViewState(against="residual"))
    view.draw(frame)
    seen(True)
    assert (counted, wake.is_set()) == ([], True)
    view.redraw()
    view.redraw()
    assert len(counted) == 1
    view.draw(frame)
    assert len(counted) == 2
    seen(False)
    view.redraw()
    view.draw(frame)
    assert len(counted) == 2
