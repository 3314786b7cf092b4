"""The view of samples: what counts, when it listens, and that it works in the thread that draws."""

from dataclasses import dataclass, field, replace
from html import unescape
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp.box import Box
from webapp.frame import Frame
from webapp.sampling import ONE_IMAGE
from webapp.state import ViewState
from webapp.views import samples as module
from webapp.views.samples import CLEAR, START, UNDO, SamplesView

STACK = render_scene("sphere_cone", size=(24, 32), images=8, noise=0.01, bits=8).stack
RESULT = analyze(STACK, Options(T=0.05, Ts=0.03, samples=20))
BOX = Box(3, 9, 5, 12)


class Handle(SimpleNamespace):
    """A widget without a page."""

    def on_click(self, callback: Any) -> Any:
        return callback


class FakeGui:
    """Makes widgets that only remember."""

    def add_markdown(self, content: str) -> Handle:
        return Handle(content=content)

    add_html = add_markdown

    def add_dropdown(self, _: str, options: Any, initial_value: str, hint: str) -> Handle:
        return Handle(value=initial_value, options=options, hint=hint)

    def add_button(self, label: str, **look: Any) -> Handle:
        return Handle(label=label, **look)

    def add_button_group(self, _: str, options: Any, hint: str) -> Handle:
        return Handle(options=options, hint=hint)


@dataclass
class Tab:
    """A view in view, and what it did."""

    stack: ImageStack = STACK
    changed: int = 0
    sampling: list[str | None] = field(default_factory=list)
    boxes: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        clicks = SimpleNamespace(see=lambda name, seen: name)
        canvas = SimpleNamespace(set_sampling=self.sampling.append, set_boxes=self.boxes.append)
        given: tuple[Any, ...] = (FakeGui(), clicks, canvas)
        self.view = SamplesView(*given, self.change, lambda _: None, lambda _: None)
        self.show(0)
        self.view._see(True)
        self.view.redraw()

    def change(self) -> None:
        self.changed += 1

    def show(self, image: int, excluded: tuple[int, ...] = ()) -> None:
        state = ViewState(image=image, T=0.05, Ts=0.03)
        self.view.draw(Frame(self.stack, state, RESULT, None, None, None, excluded=excluded))

    @property
    def told(self) -> str:
        return unescape(self.view._told.content)


def test_nothing_is_taken_unless_a_kind_is_sampled_in_view() -> None:
    tab = Tab()
    assert not tab.view.take_box(BOX)
    assert not tab.view.take((5, 5))
    tab.view._do("shadow", START)
    assert tab.view.take_box(BOX)
    tab.view._see(False)
    assert not tab.view.take_box(BOX)
    tab.view._see(True)
    assert tab.view.take((5, 5))
    tab.view.stop()
    assert not tab.view.take_box(BOX)
    assert [sample.count for sample in tab.view._samples] == [42, 25]


def test_the_tab_is_told_of_each_change_and_draws_in_its_own_time() -> None:
    tab = Tab()
    tab.view._do("lit", START)
    before, told = tab.changed, tab.told
    tab.view.take_box(BOX)
    assert tab.changed == before + 1
    assert tab.told == told
    tab.view.redraw()
    assert "Lit pixels: 42 pixels in 1 sample" in tab.told
    content = tab.view._told.content = "as it is"
    tab.view.redraw()  # nothing new
    assert tab.view._told.content == content


def test_samples_of_the_image_shown_are_outlined_while_sampling() -> None:
    tab = Tab()
    tab.view._do("shadow", START)
    tab.view.take_box(BOX)
    tab.show(3)
    assert tab.boxes[-1] == ()
    tab.view._do("lit", START)
    tab.view.take_box(Box(0, 1, 0, 1))
    tab.view.redraw()
    assert tab.boxes[-1] == ((Box(0, 1, 0, 1), module.COLOURS["lit"]),)
    tab.show(0)
    assert tab.boxes[-1] == ((BOX, module.COLOURS["shadow"]),)
    assert tab.sampling[-1] == module.COLOURS["lit"]
    sent = len(tab.boxes)
    tab.show(0)
    assert len(tab.boxes) == sent  # the same again is not sent
    tab.view._see(False)
    tab.view.redraw()
    assert (tab.boxes[-1], tab.sampling[-1]) == ((), None)


def test_undo_and_clear_leave_the_other_kind_alone() -> None:
    tab = Tab()
    for kind in ("shadow", "lit", "shadow", "lit"):
        tab.view._do(kind, START)
        tab.view.take_box(BOX)
    tab.view._do("shadow", UNDO)
    assert [s.kind for s in tab.view._samples] == ["shadow", "lit", "lit"]
    tab.view._do("lit", CLEAR)
    assert [s.kind for s in tab.view._samples] == ["shadow"]
    tab.view._do("lit", UNDO)  # none there
    tab.view._do("shadow", UNDO)
    tab.view._do("shadow", UNDO)
    assert tab.view._samples == ()


def test_lit_pixels_alone_propose_no_Ts() -> None:
    tab = Tab()
    tab.view._do("lit", START)
    tab.view.take_box(BOX)
    tab.view.redraw()
    assert tab.view._set_Ts.disabled
    tab.view._do("shadow", START)
    tab.view.take_box(BOX)
    tab.view.redraw()
    assert not tab.view._set_Ts.disabled
    tab.view._do("shadow", CLEAR)
    tab.view.redraw()
    assert tab.view._set_Ts.disabled
    assert tab.view._set_Ts.label == "Set Ts"


def test_a_box_without_the_object_and_one_too_many_are_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mask = np.zeros((24, 32), bool)
    mask[:12] = True
    tab = Tab(replace(STACK, mask=mask))
    tab.view._do("shadow", START)
    tab.view.take_box(Box(12, 20, 0, 32))
    tab.view.redraw()
    assert "No pixel of the mask lies there." in tab.told
    assert tab.view._samples == ()
    monkeypatch.setattr(module, "MOST_SAMPLES", 3)
    for _ in range(4):
        tab.view.take_box(BOX)
    tab.view.redraw()
    assert len(tab.view._samples) == 3
    assert "samples are the most; undo or clear some." in tab.told
    tab.view._do("shadow", UNDO)
    tab.view.redraw()
    assert "are the most" not in tab.told


def test_samples_of_images_that_are_left_out_leave_room_for_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "MOST_SAMPLES", 1)
    tab = Tab()
    tab.view._do("shadow", START)
    assert tab.view.take_box(BOX)
    tab.view.redraw()
    tab.view.take_box(BOX)
    tab.view.redraw()
    assert module.FULL in tab.told
    tab.show(0, excluded=(0,))  # another image is the first of those left
    tab.view.take_box(BOX)
    tab.view.redraw()
    assert module.FULL not in tab.told
    assert len(tab.view._samples) == 2


def test_shadows_of_one_image_alone_are_told() -> None:
    tab = Tab()
    tab.view._do("lit", START)
    tab.view.take_box(BOX)
    tab.view.redraw()
    assert ONE_IMAGE not in tab.told
    tab.view._do("shadow", START)
    tab.view.take_box(BOX)
    tab.view.redraw()
    assert ONE_IMAGE in tab.told
    tab.show(1)
    tab.view.take_box(BOX)
    tab.view.redraw()
    assert ONE_IMAGE not in tab.told


def test_T_is_proposed_only_by_what_the_sliders_stand_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """While they move nothing is measured, and what was measured before is not offered."""
    measured, measure = [], module.measure_residuals

    def counted(*of: Any) -> Any:
        measured.append(of)
        return measure(*of)

    monkeypatch.setattr(module, "measure_residuals", counted)
    tab = Tab()
    assert not tab.view._set_T.disabled
    assert len(measured) == 1
    preview: Any = SimpleNamespace(near=RESULT)
    state = ViewState(T=0.06, Ts=0.05)
    tab.view.draw(Frame(STACK, state, RESULT, None, None, None, preview))
    assert tab.view._set_T.disabled
    assert len(measured) == 1
    tab.view.draw(Frame(STACK, state, RESULT, None, None, None))
    assert not tab.view._set_T.disabled
    assert len(measured) == 2
    tab.view.draw(Frame(STACK, state, None, None, None, None))
    assert tab.view._set_T.disabled


def test_samples_stay_with_their_image_when_others_are_left_out() -> None:
    tab = Tab()
    tab.view._do("shadow", START)
    tab.show(3)
    tab.view.take_box(BOX)
    tab.show(1, excluded=(0, 2))
    assert len(tab.boxes[-1]) == 1
    tab.view.take_box(BOX)
    tab.show(3)
    assert len(tab.boxes[-1]) == 2
    tab.show(1, excluded=(3, 0))
    assert tab.boxes[-1] == ()
    assert {sample.image for sample in tab.view._samples} == {3}


def test_samples_of_images_that_are_left_out_count_again_once_these_are_back() -> None:
    tab = Tab()
    tab.view._do("shadow", START)
    tab.show(3)
    tab.view.take_box(BOX)
    tab.show(1)
    tab.view.take_box(BOX)
    tab.view.redraw()
    both = tab.view._level
    assert "Shadows: 84 pixels in 2 samples" in tab.told
    tab.show(1, excluded=(3,))
    assert "Shadows: 42 pixels in 1 sample" in tab.told
    assert tab.view._level is not None
    tab.show(1, excluded=(1, 3))
    assert tab.view._level is None
    assert tab.view._set_Ts.disabled
    tab.show(1)
    assert tab.view._level == both
