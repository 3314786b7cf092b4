"""What all other thresholds would make of the result shown, and going there by a click."""

from collections.abc import Callable
from functools import partial
from threading import RLock
from time import monotonic

import viser

from photolin.analysis import Analysis
from photolin.compiling import COMPILING, tell_compiling
from photolin.errors import Cancelled
from photolin.factors import Thresholds
from photolin.landscape import Landscape, map_landscape, plateau

from ..clicks import Clicks
from ..frame import Frame
from ..job import Job
from ..landscape_plot import (
    QUANTITIES,
    Quantity,
    describe_cell,
    plot_landscape,
    thresholds_at,
)
from ..readout import escape
from ..values import choose_option
from . import INDENT

KEPT = 4
"""Maps kept, for results that are shown again."""
PATIENCE = 0.3
"""Seconds after which progress is shown; most maps take less."""
HELP = (
    "Click to set T and Ts. Each cell tells of the labels that its T and Ts would give, without "
    "linearizing again. Cross: T and Ts as the sliders stand. Ring: the middle of the widest area "
    "where labels hardly change."
)


class LandscapeView:
    """The map of one quantity, made in a thread of its own while it is in view.

    Maps are made one at a time; of results that arrive meanwhile only the latest gets one.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        clicks: Clicks,
        move: Callable[[Thresholds], None],
        tell: Callable[[Exception], None],
        known: bool = False,
    ) -> None:
        """Build the widgets.

        Args:
            move: moves the sliders; called with T and Ts of the cell that is clicked.
            tell: called with what went wrong.
            known: whether frames come with the truth; then the map tells accuracy too.
        """
        self._move, self._tell = move, tell
        self._lock = RLock()
        self._frame: Frame | None = None
        self._in_view = False
        self._maps: list[tuple[Analysis, Landscape]] = []
        self._making: Analysis | None = None
        self._declined: Analysis | None = None
        """The result whose map was cancelled or failed; not tried again until opened again."""
        self._began = 0.0
        self._job = Job(lambda work: work(), self._ended)
        self._offered: tuple[Quantity, ...] = tuple(
            q for q in QUANTITIES if known or q != "macro accuracy"
        )
        self._quantity = gui.add_dropdown(
            "Map of",
            self._offered,
            initial_value="change",
            hint="change: labels that differ in the next cell. The classes: their share of all "
            "observations. Undefined labels are impossible: light can only be added",
        )
        self._picture = gui.add_html("")
        self._bar = gui.add_progress_bar(0, visible=False, animated=True)
        self._cancel = gui.add_button(
            "Cancel", visible=False, icon=viser.Icon.X, hint="Stop making the map"
        )
        self._map_id = clicks.watch("landscape", self._click, lambda shown: None)
        self._view_id = clicks.see("landscape-view", self._see)
        self._show()

        @self._quantity.on_update
        async def _(_: viser.GuiEvent) -> None:
            self._show()

        @self._cancel.on_click
        async def _(_: viser.GuiEvent) -> None:
            self.cancel()

    def draw(self, frame: Frame) -> None:
        """Show the map of the latest whole result, and make it where there is none yet."""
        with self._lock:
            self._frame = frame
        self._pursue()
        self._show()

    def cancel(self) -> None:
        """Stop making a map; it is made when the view is opened again."""
        with self._lock:
            self._declined = self._making
        self._job.stop()

    def close(self) -> None:
        """Stop, and make nothing any more."""
        self._job.close()

    def _click(self, x: float, y: float) -> None:
        with self._lock:
            landscape = self._landscape()
        if landscape is not None:
            self._move(thresholds_at(landscape, x, y))

    def _see(self, shown: bool) -> None:
        with self._lock:
            self._in_view = shown
            if shown:
                self._declined = None
        self._pursue()

    def _wanted(self) -> Analysis | None:
        """The result whose map is to be shown; of a preview, the run that it is made from."""
        if self._frame is None:
            return None
        preview = self._frame.preview
        return self._frame.analysis if preview is None else preview.near

    def _landscape(self) -> Landscape | None:
        wanted = self._wanted()
        return next((land for result, land in self._maps if result is wanted), None)

    def _pursue(self) -> None:
        """Make the map that is wanted, unless another is being made: that is stopped first."""
        with self._lock:
            frame, wanted = self._frame, self._wanted()
            idle = wanted is None or not self._in_view or self._landscape() is not None
            if idle or wanted is self._declined:
                wanted = None
            if self._making is not None and self._making is not wanted:
                self._job.stop()
            if frame is None or wanted is None or self._making is not None:
                return
            self._making, self._began = wanted, monotonic()
            if not self._job.start(partial(self._make, frame, wanted)):
                self._making = None  # the last is just ending, and comes back here

    def _make(self, frame: Frame, analysis: Analysis) -> None:
        try:
            with tell_compiling(self._progress) as told:
                made = map_landscape(
                    frame.stack,
                    analysis,
                    truth=frame.truth,
                    progress=told,
                    cancel=self._job.stopping,
                )
            with self._lock:
                self._maps = [(analysis, made), *self._maps][:KEPT]
        except Cancelled:
            pass
        except Exception as error:
            with self._lock:
                self._declined = analysis
            self._tell(error)
        finally:
            with self._lock:
                self._making = None
            self._busy(False)

    def _ended(self) -> None:
        self._pursue()
        self._show()

    def _progress(self, stage: str, fraction: float) -> None:
        if stage == COMPILING or monotonic() - self._began > PATIENCE:
            self._busy(True)
            self._bar.value = round(100 * min(max(fraction, 0.04), 1))

    def _busy(self, running: bool) -> None:
        for handle in (self._bar, self._cancel):
            if handle.visible != running:
                handle.visible = running

    def _show(self) -> None:
        with self._lock:
            look = f"{INDENT};font-size:0.85em"
            inner = self._content()
            self._picture.content = f'<div id="{self._view_id}" style="{look}">{inner}</div>'

    def _content(self) -> str:
        frame, landscape = self._frame, self._landscape()
        if frame is None or landscape is None:
            wanted = self._wanted()
            if wanted is None:
                return escape("There is no result yet; the map will be of it.")
            if wanted is self._declined:
                return escape("There is no map of this result; open this part again to make it.")
            return escape("The map is being made.")
        chosen = choose_option(self._quantity.value, self._offered, "change")
        quantity = self._offered[self._offered.index(chosen)]
        present, ring = frame.state.thresholds, plateau(landscape)
        plot = plot_landscape(landscape, quantity, present, ring, self._map_id)
        sentence = describe_cell(landscape, quantity, present, ring)
        earlier = "" if frame.preview is None else "The map is of the last final result. "
        return f"{plot}{escape(earlier + sentence)}<br><small>{escape(HELP)}</small>"
