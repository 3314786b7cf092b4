"""The panels of one tab and the keys that work them: built once, read and drawn as one."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import viser

from photolin.factors import LETTERS, Factor
from photolin.stack import ImageStack

from .canvas import Canvas
from .clicks import Clicks
from .frame import Frame
from .saved import Saved
from .state import Pixel, ViewState
from .views.cloud import CloudView
from .views.compare import CompareView
from .views.diagnosis import DiagnosisView
from .views.export import ExportView
from .views.help import HelpView
from .views.landscape import LandscapeView
from .views.legend import LegendView
from .views.notes import NotesView
from .views.overview import OverviewView
from .views.picture import PictureView
from .views.pixel import PixelView
from .views.run import RunView
from .views.samples import SamplesView
from .views.shape import ShapeView
from .views.shares import SharesView
from .views.summary import SummaryView
from .views.thresholds import ThresholdView
from .viser_internals import button_hints


@dataclass(frozen=True)
class Actions:
    """What panels and keys ask their tab to do; all return at once."""

    changed: Callable[[], None]
    """Read all widgets again, and draw what differs."""
    suggest: Callable[[], None]
    """Set T and Ts to what the data suggest."""
    linearize: Callable[[], None]
    """Linearize again with T and Ts as they stand."""
    stop: Callable[[], None]
    """Stop the long work."""
    download: Callable[[str, bool], None]
    """Send files of a kind, of all images or of the one shown."""
    recover: Callable[[], None]
    """Recover the shape."""
    retract: Callable[[], None]
    """Take back what was said of what did not work."""
    pin: Callable[[], None]
    """Pin the selected pixel, or take its pin away."""
    unpin: Callable[[], None]
    """Take all pins away."""
    exclude: Callable[[int, bool], None]
    """Leave an image of the whole stack out, or where false take it in again."""
    copy: Callable[[], None]
    """Copy the command that makes what is shown."""
    tell: Callable[[Exception], None]
    """Say what went wrong."""


class Panels:
    """All widgets of a tab."""

    def __init__(
        self,
        client: viser.ClientHandle,
        canvas: Canvas,
        stack: ImageStack,
        state: ViewState,
        actions: Actions,
        *,
        known: bool,
        whole: ImageStack,
    ) -> None:
        """Build them.

        Args:
            known: whether frames come with the truth.
            whole: `stack` with the images that are left out.
            state: whose method and thresholds are set at first.
        """
        gui, changed = client.gui, actions.changed
        self.clicks = clicks = Clicks(client)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Tune", viser.Icon.ADJUSTMENTS):
            self.picture = PictureView(gui, stack, changed, canvas.fit, canvas.one_to_one)
            self.thresholds = ThresholdView(
                gui, state.thresholds, changed, actions.suggest, actions.linearize
            )
            self.run = RunView(gui, state.method, changed, actions.stop)
            shares = SharesView(gui)
            self.pixel = PixelView(gui, changed)
            with gui.add_folder("Display"):
                self.legend = LegendView(gui, stack, changed)
            with gui.add_folder("About this result"):
                summary = SummaryView(gui)
        with tabs.add_tab("Overview", viser.Icon.PHOTO):
            self.overview = OverviewView(
                gui, clicks, whole, self.picture, changed, actions.exclude, actions.tell
            )
        with tabs.add_tab("Samples", viser.Icon.CHART_HISTOGRAM):
            self.thresholds.add_steps(gui)
            setters = (self.thresholds.set_T, self.thresholds.set_Ts)
            self.samples = SamplesView(gui, clicks, canvas, changed, *setters)
            canvas.on_box(self.samples.take_box)
        with tabs.add_tab("Map", viser.Icon.MAP):
            self.landscape = LandscapeView(
                gui, clicks, self.thresholds.set, actions.tell, known=known
            )
        with tabs.add_tab("Pixel", viser.Icon.TARGET):
            self.diagnosis = DiagnosisView(gui, clicks, actions.pin, actions.unpin, self.picture.go)
        with tabs.add_tab("Lights", viser.Icon.BULB):
            self.cloud = CloudView(gui, clicks, actions.tell)
        with tabs.add_tab("Compare", viser.Icon.LAYOUT_COLUMNS):
            add_choice = self.pixel.add_choice
            self.compare = CompareView(gui, clicks, changed, add_choice, known=known)
            canvas.second.on_divide(self.compare.divide)
        with tabs.add_tab("Shape", viser.Icon.CUBE):
            retry = (actions.recover, actions.retract)
            self.shape = ShapeView(
                gui, stack, changed, *retry, canvas.set_sketch, self.picture.show
            )
            clicks.see("shape", self.shape.see)
            self.run.add_progress(gui)
        with tabs.add_tab("Export", viser.Icon.DOWNLOAD):
            self.export = ExportView(gui, actions.download, self.run.add_progress)
            with gui.add_folder("Session"):
                self.notes = NotesView(gui, changed, actions.copy)
            self.export.explain(gui)
        with tabs.add_tab("Help", viser.Icon.HELP):
            HelpView(gui)
        both = (self.picture, self.thresholds, self.pixel)
        self._readers = (self.run, *both, self.legend, self.compare, self.shape, self.overview)
        self._drawers = (
            *(*both, self.samples, self.landscape, shares, summary),
            *(self.diagnosis, self.cloud, self.compare, self.shape, self.overview),
        )
        self._keys = self._bind(actions)
        for slider, most in self.thresholds.typed:
            canvas.set_reach(slider, most)
        canvas.set_titles(button_hints(client))

    def close(self) -> None:
        """Stop what panels compute."""
        self.landscape.close()
        self.overview.close()
        self.cloud.close()

    def read(self, state: ViewState) -> ViewState:
        """The state with all that widgets stand for."""
        for view in self._readers:
            state = view.read(state)
        return state

    def restore(self, saved: Saved) -> None:
        """Set all widgets as a session was kept."""
        for view in self._readers:
            view.restore(saved.state)
        self.notes.restore(saved.notes)

    def draw(self, frame: Frame) -> None:
        """Show a frame in all panels."""
        for view in self._drawers:
            view.draw(frame)

    def redraw(self) -> None:
        """Show what changed in panels without a change of the state."""
        self.samples.redraw()
        self.compare.redraw()

    def take(self, pixel: Pixel) -> bool:
        """Take a click on the picture where a panel asked for clicks; whether one did."""
        return self.samples.take(pixel) or self.shape.take(pixel)

    def press(self, key: str) -> None:
        """Do what a key stands for, if anything."""
        action = self._keys.get(key, self._keys.get(key.lower()))
        if action is not None:
            action()

    def _bind(self, actions: Actions) -> dict[str, Callable[[], object]]:
        classes: dict[str, Callable[[], object]] = {
            number: partial(self.legend.toggle, factor)
            for number, factor in zip("12345", LETTERS, strict=True)
        }
        return classes | {
            "arrowleft": partial(self.picture.step, -1),
            "arrowright": partial(self.picture.step, 1),
            "arrowup": partial(self.picture.turn, -1),
            "arrowdown": partial(self.picture.turn, 1),
            "[": partial(self.thresholds.nudge, T=-1),
            "]": partial(self.thresholds.nudge, T=1),
            "{": partial(self.thresholds.nudge, Ts=-1),
            "}": partial(self.thresholds.nudge, Ts=1),
            "z": self.thresholds.undo,
            "Z": self.thresholds.redo,
            "m": self.run.turn,
            "r": actions.linearize,
            "s": actions.suggest,
            "k": self.overview.leave_out,
            "K": self.overview.take_all_in,
            "e": lambda: actions.download(*self.export.chosen()),
            "p": actions.pin,
            "b": self.compare.flicker,
            "B": self.compare.show_both,
            "x": partial(self.diagnosis.next, Factor.SPECULAR),
            "u": partial(self.diagnosis.next, Factor.UNDEFINED),
            "c": actions.copy,
            "n": actions.recover,
            "d": self.shape.toggle,
            "escape": lambda: (actions.stop(), self.samples.stop()),
        }
