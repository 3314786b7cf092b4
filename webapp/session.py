"""One browser tab.

Widgets and the canvas only report that something changed. One worker thread re-reads them all,
makes a new ViewState and draws what differs; changes that arrive meanwhile make one more round, so
the last value always wins and nothing is drawn twice. Long work (`bench`) runs in threads of its
own and reports through the same worker.
"""

from dataclasses import replace
from threading import Event, Thread
from time import monotonic

import viser

from photolin.analysis import Analysis, Method
from photolin.errors import Cancelled, OptionError, PhotolinError
from photolin.factors import Thresholds

from .bench import Bench
from .canvas import Canvas
from .courtesy import urgent
from .desk import Desk
from .frame import Frame, compose
from .keeper import Keeper
from .live import Preview
from .notices import Notices
from .pace import REST, STEP, Pace
from .painter import Painter
from .panels import Actions, Panels
from .pointing import Pointing
from .record import Record
from .saved import Saved
from .selections import Selections, follow_image
from .state import SURFACE, Pixel, ViewState
from .theme import set_theme

PATIENCE = 0.25
"""Seconds after which a preview gives way to newer thresholds before it is done."""
PARTING = 2.0
"""Seconds that are waited, at most, for a tab that was closed to keep what it showed."""


class Session:
    """The widgets, the state and the worker of one tab."""

    def __init__(
        self,
        client: viser.ClientHandle,
        selections: Selections,
        keeper: Keeper,
        start: Saved,
        *,
        again: bool,
    ) -> None:
        """Build the tab and start to work for it.

        Args:
            start: what it shows at first.
            again: whether somebody has chosen that, so that no thresholds are suggested.
        """
        self._client, self._source = client, selections.source
        self._pace, self._closed = Pace(), Event()
        self.notices = Notices(client, self._closed)
        self._frame: Frame | None = None
        self._shown_results: dict[Method, Analysis] | None = None
        self._excluded = start.exclusions
        self._record = Record(keeper, again=again)
        first = None if again else start.state.thresholds
        self._bench = Bench(selections, self._excluded, first, self._desk())
        self._pointing = Pointing(self._pace.wake)
        self._build(start.state)
        if (found := self._bench.work.recovered) is not None:  # a result came with it
            self._shaped()
            self._panels.shape.recall(found.shape.resolved, found.shape.px_mm)
        if again:
            self._pointing.restore(start.state)
            self._panels.restore(start)
        self._pace.wake()
        self._worker = Thread(target=self._draw, name="tab", daemon=True)
        self._worker.start()

    def close(self) -> None:
        """Stop all work for the tab."""
        self._closed.set()
        self._bench.close()
        self._panels.close()
        self._pace.wake()

    def wait(self) -> None:
        """Wait, once it is closed, until what was done last is kept."""
        self._worker.join(PARTING)

    def _build(self, state: ViewState) -> None:
        _, H, W = self._source.stack.shape
        client, pointing, gui = self._client, self._pointing, self._client.gui
        set_theme(gui, state.theme)
        gui.main_panel.dock_right()
        self._canvas = canvas = Canvas(client, H, W)
        self._painter = Painter(canvas)
        known = self._source.truth is not None
        stack = self._bench.runs.stack
        whole, actions = self._source.stack, self._actions()
        self._panels = Panels(client, canvas, stack, state, actions, known=known, whole=whole)
        canvas.on_pick(self._pick)
        canvas.on_hover(pointing.hover)
        canvas.on_key(self._press)
        canvas.on_view(pointing.see)
        canvas.on_light(pointing.shine)
        canvas.on_hold(self._hold)

    # --- what the work does ---

    def _desk(self) -> Desk:
        return Desk(
            read=self._read,
            begin=self._start,
            move=self._move,
            busy=self._busy,
            progress=self._progress,
            send=self._send,
            shaped=self._shaped,
            tell=self.notices.tell,
            refuse=self.notices.refuse,
            changed=self._pace.wake,
        )

    # the panels that these move are made later

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
        self.notices.retract()
        self._panels.picture.offer(surface=True)
        if self._read().layer not in SURFACE:
            self._panels.picture.show("relit")
        self._pace.wake()

    # --- what the user does ---

    def _actions(self) -> Actions:
        return Actions(
            changed=self._pace.wake,
            suggest=self._bench.suggest,
            linearize=self._bench.linearize,
            stop=self._bench.stop,
            download=self._download,
            recover=self._recover,
            retract=self.notices.retract,
            exclude=self._exclude,
            copy=self._copy,
            pin=self._pointing.pin,
            unpin=self._pointing.unpin,
            tell=self.notices.tell,
        )

    def _hold(self, on: bool) -> None:
        self._pace.touch()  # what a slider says last may come after it was let go of
        self._pointing.hold(on)

    def _press(self, key: str) -> None:
        try:
            self._panels.press(key)
        except Exception as error:
            self.notices.tell(error)

    def _recover(self) -> None:
        view = self._panels.shape
        try:
            self._bench.work.recover(view.known(), view.given_lights(), view.px_mm())
        except PhotolinError as error:
            self.notices.tell(error)

    def _pick(self, pixel: Pixel) -> None:
        if not self._panels.take(pixel):
            self._pointing.select(pixel)

    def _download(self, kind: str, everything: bool) -> None:
        notes, convention = self._panels.notes.read(), self._panels.export.convention()
        self._bench.work.download(kind, everything, notes, convention)

    def _exclude(self, image: int, out: bool = True) -> None:
        """Leave an image of the whole stack out, or take it in again."""
        others = {*self._excluded} - {image}
        self._excluded = tuple(sorted(others | {image} if out else others))
        self._pace.wake()

    def _copy(self) -> None:
        """Copy the command line that makes what is shown."""
        state, runs = self._read(), self._bench.runs
        options = replace(runs.options, method=state.method)
        command = self._source.command(options, state.thresholds, runs.excluded)
        if command is None:
            why = "this stack is in memory only; no command line makes its result"
            self.notices.tell(OptionError(why))
        else:
            self._canvas.copy(command)
            self.notices.say("Copied", command)

    # --- drawing ---

    def _draw(self) -> None:
        rough = False
        while not self._closed.is_set():
            self._pace.wait(rough=rough)
            try:
                with urgent():
                    rough = self._round()
            except Cancelled:
                rough = True  # overtaken by newer thresholds, which are next
            except Exception as error:
                rough = False
                self.notices.tell(error)
        known = self._record.latest is not None
        if known:  # what was done just before the tab was closed is kept too
            self._keep(self._read(), rested=True)

    def _read(self) -> ViewState:
        """The state that all widgets together stand for."""
        return self._panels.read(self._pointing.read(ViewState()))

    def _round(self) -> bool:
        """Read all widgets and draw what differs; true when something better is to come."""
        if self._excluded != self._bench.runs.excluded:
            self._select()
        bench, pointing = self._bench, self._pointing
        state, results, frame = self._read(), bench.work.results, self._frame
        if frame is None or state != frame.state:
            self._pace.touch()
        rested = self._pace.rested(REST)
        holding = pointing.holding  # letting go wakes the worker
        step = self._pace.rested(STEP) and not holding
        moving = self._panels.thresholds.settle(state.thresholds, step) and not holding
        bench.work.ensure(state)
        preview = self._follow(state, results)
        recovered = bench.work.recovered
        marks = tuple((*pin, str(n)) for n, pin in enumerate(state.pins, 1))
        known = (
            frame is not None
            and (state, recovered) == (frame.state, frame.recovered)
            and results is self._shown_results
        )
        if frame is None or not known or preview is not frame.preview:
            self._frame = frame = compose(bench.runs, results, state, preview, recovered, frame)
            self._shown_results = results
            rough = self._painter.paint(frame, pointing.pointer, marks, rested=rested)
            self._panels.draw(frame)
        else:
            rough = self._painter.paint(frame, pointing.pointer, marks, rested=rested)
            self._panels.redraw()
        behind = bench.catch_up.pursue(state, results.get(state.method), rested)
        return self._keep(state, rested) or behind or rough or moving

    def _follow(self, state: ViewState, results: dict[Method, Analysis]) -> Preview | None:
        """What the thresholds of the view make of what is on screen, where no run is right yet."""
        near, began = results.get(state.method), monotonic()
        if near is None:
            return None

        def overtaken() -> bool:
            # a step that is nearly done is worth showing: else a moving slider would show nothing
            late = monotonic() - began > PATIENCE
            return self._closed.is_set() or (late and self._read().thresholds != state.thresholds)

        return self._bench.live.follow(state, near, self._pointing.window, overtaken)

    def _select(self) -> None:
        """Go on without the images that are left out, with the one shown if it is still there."""
        before, shown = self._bench.runs.excluded, self._read().image
        had_shape = self._bench.work.recovered is not None
        try:
            self._bench.select(self._excluded)
        except PhotolinError as error:
            self._excluded = before
            self.notices.tell(error)
            return
        runs = self._bench.runs
        image = follow_image(len(self._source.stack.images), shown, before, runs.excluded)
        self._panels.picture.restock(len(runs.stack.images), image)
        if self._bench.work.recovered is not None:
            self._panels.picture.offer(surface=True)
        elif had_shape:
            self.notices.say("Shape", "it was of other images; recover it again (key: N)")

    def _keep(self, state: ViewState, rested: bool) -> bool:
        """Keep the session once it rests; whether that is still to come."""
        now = Saved(state, self._bench.runs.excluded, self._panels.notes.read())
        return self._record.follow(now, rested=rested, begun=bool(self._bench.work.results))
