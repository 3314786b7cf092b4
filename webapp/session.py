"""One browser tab.

Widgets and the canvas only report that something changed. One worker thread re-reads them all,
makes a new ViewState and draws what differs; changes that arrive meanwhile make one more round, so
the last value always wins and nothing is drawn twice. Long work (`work`) runs in a thread of its
own and reports through the same worker.
"""

import traceback
from threading import Event, Thread
from time import monotonic
from typing import Literal

import viser

from photolin.analysis import Analysis, Method
from photolin.errors import Cancelled, PhotolinError
from photolin.factors import Thresholds

from .canvas import Canvas, Window
from .catch_up import CatchUp
from .downloads import Pack
from .frame import Frame, compose
from .live import Live, Preview
from .painter import Painter
from .panels import Actions, Panels
from .runs import Runs
from .state import MOST_PINS, SURFACE, Pixel, ViewState
from .theme import set_theme
from .work import Desk, Work

REST = 0.3
"""Seconds without a change after which a rough picture is drawn again without loss."""
PATIENCE = 0.25
"""Seconds after which a preview gives way to newer thresholds before it is done."""
FIRST = Thresholds(0.05, 0.02)
"""Where the sliders stand until thresholds are given or suggested."""


class Session:
    """The widgets, the state and the worker of one tab."""

    def __init__(self, client: viser.ClientHandle, runs: Runs, pack: Pack) -> None:
        """Build the tab and start to work for it."""
        self._client, self._runs, self._stack = client, runs, runs.stack
        self._frame: Frame | None = None
        self._shown_results: dict[Method, Analysis] | None = None
        self._pixel: Pixel | None = None
        self._pointer: Pixel | None = None
        self._pins: tuple[Pixel, ...] = ()
        self._light = ViewState.light
        T, Ts = runs.options.T, runs.options.Ts
        self._first = Thresholds(FIRST.T if T is None else T, FIRST.Ts if Ts is None else Ts)
        if runs.result is not None:
            self._first = runs.result.thresholds
        self._wake, self._closed = Event(), Event()
        self._live = Live(self._stack)
        self._window: Window | None = None
        self._work = Work(runs, pack, self._first, self._desk())
        self._catch_up = CatchUp(runs, self._work.deliver, self._tell, self._wake.set)
        self._changed = monotonic()
        self._build(client)
        self._wake.set()
        Thread(target=self._draw, name="tab", daemon=True).start()

    def close(self) -> None:
        """Stop all work for the tab."""
        self._closed.set()
        self._work.close()
        self._panels.close()
        self._catch_up.close()
        self._wake.set()

    def _build(self, client: viser.ClientHandle) -> None:
        _, H, W = self._stack.shape
        gui = client.gui
        set_theme(gui, ViewState.theme)
        gui.main_panel.dock_right()
        self._canvas = canvas = Canvas(client, H, W)
        self._painter = Painter(canvas)
        method = self._runs.options.method
        self._panels = Panels(client, canvas, self._stack, method, self._first, self._actions())
        canvas.on_pick(self._pick)
        canvas.on_hover(self._point)
        canvas.on_key(self._press)
        canvas.on_view(self._see)
        canvas.on_light(self._shine)

    # --- what the work does ---

    def _actions(self) -> Actions:
        return Actions(
            changed=self._wake.set,
            suggest=self._work.suggest,
            linearize=self._work.linearize,
            stop=self._work.stop,
            download=self._work.download,
            recover=self._recover,
            resample=self._resample,
            pin=self._pin,
            unpin=self._unpin,
            tell=self._tell,
        )

    def _desk(self) -> Desk:
        return Desk(
            read=self._read,
            begin=self._start,
            move=self._move,
            busy=self._busy,
            progress=self._progress,
            send=self._send,
            shaped=self._shaped,
            tell=self._tell,
            refuse=self._refuse,
            changed=self._wake.set,
        )

    def _start(self, thresholds: Thresholds) -> None:
        self._panels.thresholds.begin(thresholds)

    def _move(self, thresholds: Thresholds) -> None:
        self._panels.thresholds.set(thresholds)

    def _busy(self, running: bool) -> None:
        self._panels.run.busy(running)

    def _progress(self, stage: str, fraction: float) -> None:
        self._panels.run.progress(stage, fraction)

    def _send(self, name: str, data: bytes) -> None:
        # viser's page itself tells the name and the size
        self._client.send_file_download(name, data, save_immediately=True)

    def _shaped(self) -> None:
        self._panels.picture.offer(surface=True)
        if self._read().layer not in SURFACE:
            self._panels.picture.show("relit")
        self._wake.set()

    def _refuse(self) -> None:
        self._notify("Still running", "wait until it ends, or cancel it, and try again", "gray")

    # --- what the user does ---

    def _press(self, key: str) -> None:
        try:
            self._panels.press(key)
        except Exception as error:
            self._report(error)

    def _recover(self) -> None:
        view = self._panels.shape
        try:
            self._work.recover(view.known(), view.given_lights(), view.px_mm())
        except PhotolinError as error:
            self._tell(error)

    def _pick(self, pixel: Pixel) -> None:
        if not self._panels.take(pixel):
            self._pixel = pixel
            self._wake.set()

    def _resample(self) -> None:
        if self._frame is not None:
            self._panels.samples.draw(self._frame)
        self._wake.set()

    def _pin(self) -> None:
        """Pin the selected pixel, or take its pin away; the oldest of too many goes."""
        if (pixel := self._pixel) is None:
            return
        others = tuple(pin for pin in self._pins if pin != pixel)
        self._pins = others if pixel in self._pins else (*others, pixel)[-MOST_PINS:]
        self._wake.set()

    def _unpin(self) -> None:
        self._pins = ()
        self._wake.set()

    def _shine(self, light: tuple[float, float]) -> None:
        self._light = light
        self._wake.set()

    def _point(self, pixel: Pixel | None) -> None:
        self._pointer = pixel
        self._wake.set()

    def _see(self, window: Window) -> None:
        self._window = window
        self._wake.set()

    # --- drawing ---

    def _draw(self) -> None:
        rough = False
        while not self._closed.is_set():
            self._wake.wait(max(self._changed + REST - monotonic(), 0.01) if rough else None)
            self._wake.clear()
            try:
                rough = self._round()
            except Cancelled:
                rough = True  # overtaken by newer thresholds, which are next
            except Exception as error:
                rough = False
                self._report(error)

    def _read(self) -> ViewState:
        """The state that all widgets together stand for."""
        state = ViewState(pixel=self._pixel, pins=self._pins, light=self._light)
        return self._panels.read(state)

    def _round(self) -> bool:
        """Read all widgets and draw what differs; true when something better is to come."""
        state, results, frame = self._read(), self._work.results, self._frame
        if frame is None or state != frame.state:
            self._changed = monotonic()
        rested = monotonic() - self._changed >= REST
        moving = self._panels.thresholds.settle(state.thresholds, rested)
        self._work.ensure(state)
        preview = self._follow(state, results)
        recovered = self._work.recovered
        pins = tuple((*pin, str(n)) for n, pin in enumerate(self._pins, 1))
        marks = (*pins, *self._panels.marks())
        known = (
            frame is not None
            and (state, recovered) == (frame.state, frame.recovered)
            and results is self._shown_results
        )
        if frame is None or not known or preview is not frame.preview:
            self._frame = frame = compose(self._stack, results, state, preview, recovered)
            self._shown_results = results
            rough = self._painter.paint(frame, self._pointer, marks, rested=rested)
            self._panels.draw(frame)
        else:
            rough = self._painter.paint(frame, self._pointer, marks, rested=rested)
        return self._catch_up.pursue(state, results.get(state.method), rested) or rough or moving

    def _follow(self, state: ViewState, results: dict[Method, Analysis]) -> Preview | None:
        """What the thresholds of the view make of what is on screen, where no run is right yet."""
        near, began = results.get(state.method), monotonic()
        if near is None:
            return None

        def overtaken() -> bool:
            # a step that is nearly done is worth showing: else a moving slider would show nothing
            late = monotonic() - began > PATIENCE
            return self._closed.is_set() or (late and self._read().thresholds != state.thresholds)

        return self._live.follow(state, near, self._window, overtaken)

    # --- telling ---

    def _notify(self, title: str, body: str, color: Literal["red", "gray"]) -> None:
        if not self._closed.is_set():
            seconds = None if color == "red" else 6
            self._client.add_notification(title, body, auto_close_seconds=seconds, color=color)

    def _tell(self, error: Exception) -> None:
        if isinstance(error, Cancelled):
            self._notify("Cancelled", str(error), "gray")
        elif isinstance(error, PhotolinError):
            self._notify("This did not work", str(error), "red")
        else:
            self._report(error)

    def _report(self, error: Exception) -> None:
        """A fault of the program: a short note on screen, the trace in the terminal."""
        if self._closed.is_set():
            return
        traceback.print_exception(error)
        self._notify("photolin made a mistake", f"{type(error).__name__}: {error}", "red")
