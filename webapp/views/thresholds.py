"""T and Ts, and whether the linearized bases belong to them."""

from collections.abc import Callable
from dataclasses import replace
from math import nextafter
from threading import Lock

import viser

from photolin.factors import Thresholds

from ..frame import Frame
from ..history import History
from ..readout import escape, preview_status, threshold_status
from ..state import ViewState
from ..values import clamp_number, set_reach
from . import ATTENTION

STEP = 0.0005
RANGES = {"T": (0.0005, 0.2), "Ts": (0.0, 0.2)}
"""Where the sliders end, unless they are to stand beyond."""
MOST = {"T": 1.0, "Ts": nextafter(1, 0)}
"""What may be typed."""
DECIMALS = 6
"""Of what is typed and shown in the boxes."""
KEY_FACTOR = 1.1
SUGGEST, LINEARIZE = "suggest T, Ts", "linearize again"
UNDO, REDO, RESET = "undo", "redo", "reset"


class ThresholdView:
    """The two sliders that everything follows."""

    def __init__(
        self,
        gui: viser.GuiApi,
        initial: Thresholds,
        changed: Callable[[], None],
        suggest: Callable[[], None],
        linearize: Callable[[], None],
    ) -> None:
        self._stepping = Lock()
        """The worker settles while keys and buttons undo."""
        self._T = gui.add_slider(
            "T",
            *RANGES["T"],
            STEP,
            RANGES["T"][0],
            marks=(),
            hint="Relative tolerance, a share of i without unit: an observation i counts as "
            "diffuse while |i - l| is at most T times i. Up to 1 can be typed (keys: [ and ])",
        )
        self._Ts = gui.add_slider(
            "Ts",
            *RANGES["Ts"],
            STEP,
            RANGES["Ts"][0],
            marks=(),
            hint="Shadow level, fraction of full scale: darker observations are shadow. Up to just "
            "below 1 can be typed (keys: { and })",
        )
        self._live = gui.add_checkbox(
            "live",
            True,
            hint="Linearize again while T or Ts move: what the screen shows at once (preview), "
            "everything when they rest (final). By the method robust; off: the labels alone follow",
        )
        self._status = gui.add_html("")
        self._buttons = gui.add_button_group(
            " ",
            (SUGGEST, LINEARIZE),
            hint="suggest: T from the noise below the fit, but 0.016 at least, Ts from the dark "
            "end of the histogram and from attached shadows (key: S). linearize again: T and Ts "
            "enter the linearization itself; until then only the labels follow the sliders (key: "
            "R)",
        )
        self.begin(initial)
        for handle, most in self.typed:
            handle.precision = DECIMALS
            set_reach(handle, most)
        for handle in (self._T, self._Ts, self._live):

            @handle.on_update
            async def _(_: viser.GuiEvent) -> None:
                self._reach()
                changed()

        actions = {SUGGEST: suggest, LINEARIZE: linearize}

        @self._buttons.on_click
        async def _(_: viser.GuiEvent) -> None:
            actions[self._buttons.value]()

    @property
    def typed(self) -> tuple[tuple[viser.GuiSliderHandle[float], float], ...]:
        """The sliders beside whose boxes more can be typed, each with how much."""
        return ((self._T, MOST["T"]), (self._Ts, MOST["Ts"]))

    def add_steps(self, gui: viser.GuiApi) -> None:
        """Add the buttons that undo, redo and reset; where there is room for them."""
        steps = gui.add_button_group(
            "T and Ts",
            (UNDO, REDO, RESET),
            hint="undo, redo: changes of T and Ts, a step for each rest of the sliders (keys: Z, "
            "Shift-Z), as long as this page is open. reset: T and Ts of the first result",
        )

        actions = {UNDO: self.undo, REDO: self.redo, RESET: self.reset}

        @steps.on_click
        async def _(_: viser.GuiEvent) -> None:
            actions[steps.value]()

    def begin(self, thresholds: Thresholds) -> None:
        """Move both sliders to where they start, without a step that could be undone."""
        with self._stepping:
            self._first, self._history = thresholds, History(thresholds)
            self._place(thresholds)

    def restore(self, state: ViewState) -> None:
        """Move the sliders to a state's T and Ts, without a step that could be undone."""
        self.begin(state.thresholds)
        self._live.value = state.live

    def settle(self, thresholds: Thresholds, rested: bool) -> bool:
        """Take note of where the sliders have come to rest; whether that is still to come."""
        with self._stepping:
            # what was read before an undo is no step after it
            if rested and self._present() == thresholds:
                self._history = self._history.settle(thresholds)
            return self._history.now != thresholds

    def undo(self) -> None:
        """Go back to where the sliders rested before, also where they do not rest yet."""
        self._go(lambda history: history.undo())

    def redo(self) -> None:
        """Take back an undo."""
        self._go(lambda history: history.redo())

    def reset(self) -> None:
        """Go to T and Ts of the first result; can be undone."""
        self.set(self._first)

    def set(self, thresholds: Thresholds) -> None:
        """Move both sliders, which is a step to undo, and so is where they stood before."""
        with self._stepping:
            self._history = self._history.settle(self._present()).settle(thresholds)
            self._place(thresholds)

    def _go(self, step: Callable[[History[Thresholds]], History[Thresholds]]) -> None:
        with self._stepping:
            now = self._present()
            history = step(self._history.settle(now))
            if history.now != now:
                self._history = history
                self._place(history.now)

    def _present(self) -> Thresholds:
        return self.read(ViewState()).thresholds

    def _place(self, thresholds: Thresholds) -> None:
        """Move both sliders, which end where they did at first or, if need be, there."""
        self._fallback = thresholds
        for handle, name in ((self._T, "T"), (self._Ts, "Ts")):
            value, (low, high) = getattr(thresholds, name), RANGES[name]
            handle.min, handle.max = min(low, value), max(high, value)
            handle.value = value

    def _reach(self) -> None:
        """Widen the sliders to what was typed."""
        for handle in (self._T, self._Ts):
            handle.max = max(handle.max, handle.value)

    def set_T(self, T: float) -> None:
        """Move the slider T."""
        self.set(replace(self._present(), T=T))

    def set_Ts(self, Ts: float) -> None:
        """Move the slider Ts."""
        self.set(replace(self._present(), Ts=Ts))

    def nudge(self, T: int = 0, Ts: int = 0) -> None:
        """Move a slider by a tenth of its value, at least one step, `T` or `Ts` times."""
        for handle, times in ((self._T, T), (self._Ts, Ts)):
            if times:
                steps = max(1, round(handle.value * (KEY_FACTOR - 1) / STEP))
                value = round(handle.value / STEP) * STEP + times * steps * STEP
                handle.value = round(min(max(value, handle.min), handle.max), 4)

    def read(self, state: ViewState) -> ViewState:
        """The state with T and Ts as set here."""
        T, Ts = (
            clamp_number(handle.value, handle.min, handle.max, fallback)
            for handle, fallback in ((self._T, self._fallback.T), (self._Ts, self._fallback.Ts))
        )
        return replace(state, T=T, Ts=Ts, live=self._live.value is True)

    def draw(self, frame: Frame) -> None:
        """Say what the labels and what the bases were computed with."""
        shown, preview, result = frame.state.thresholds, frame.preview, frame.analysis
        if preview is not None:
            whole, took = preview.whole is not None, preview.analysis.seconds["total"]
            text, stale = preview_status(shown, preview.part.step, whole, took), ""
        elif result is None:
            text, stale = threshold_status(shown, None), ""
        else:
            text = threshold_status(shown, result.thresholds, result.seconds["total"])
            stale = "" if result.thresholds == shown else ATTENTION
        self._status.content = (
            f'<div style="margin:0 var(--mantine-spacing-xs);font-size:0.8em;{stale}">'
            f"{escape(text)}</div>"
        )
