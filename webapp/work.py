"""The long work of one tab: linearizing, suggesting thresholds, packing files; one at a time."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from threading import Lock

from photolin.analysis import Analysis, Method
from photolin.compiling import tell_compiling
from photolin.errors import Cancelled, OptionError
from photolin.export.maps import Convention
from photolin.factors import Thresholds
from photolin.shape.known import Known
from photolin.shape.recover import recover_shape
from photolin.shape.resolve import resolve_ambiguity

from .desk import Desk
from .downloads import (
    REPORT,
    SHAPE,
    make_download,
    make_report,
    make_shape_download,
    relabel,
)
from .figure import KINDS as FIGURE_KINDS
from .figure import make_figure
from .frame import Recovered
from .job import Job, cancelling
from .live import is_behind
from .runs import Runs
from .source import Source
from .state import ViewState

EMPTY = "linearize again starts anew"
"""What follows from cancelling the first run."""


class Work:
    """The results of a tab, and what makes them."""

    def __init__(self, runs: Runs, source: Source, first: Thresholds | None, desk: Desk) -> None:
        """Begin with the result of `runs`, if it has one.

        Args:
            source: what `runs` are of, some images perhaps left out.
            first: where the sliders stand as long as nobody has moved them; None where they stand
                right, and the first run is by them.
        """
        self._runs, self._source, self._first, self._desk = runs, source, first, desk
        self._results: dict[Method, Analysis] = {}
        self._exchange = Lock()
        if runs.result is not None:
            self._results = {runs.result.options.method: runs.result}
        self._declined: frozenset[Method] = frozenset()
        """Methods that were cancelled or failed; not tried again unasked."""
        self._recovered: Recovered | None = None
        if source.shape is not None and runs.result is not None:  # both are of these images
            self._recovered = Recovered(source.shape, runs.result)
        self._waiting: Callable[[], None] | None = None
        """What is begun once the running work has ended."""
        self._job = Job(self._guarded, desk.changed)

    @property
    def results(self) -> dict[Method, Analysis]:
        """The latest result by each method; a new dictionary whenever one changes."""
        return self._results

    @property
    def recovered(self) -> Recovered | None:
        """The latest shape."""
        return self._recovered

    def deliver(self, method: Method, result: Analysis) -> None:
        """Take a result that was made elsewhere."""
        # a run and what follows the sliders may both end at once, each in a thread of its own
        with self._exchange:
            self._results = {**self._results, method: result}

    def stop(self) -> None:
        """Ask what is running to stop, and begin nothing after it."""
        self._waiting = None
        self._job.stop()

    def close(self) -> None:
        """Stop, and start nothing any more."""
        self._job.close()

    def suggest(self) -> None:
        """Set T and Ts to what the data suggest."""
        self._begin(self._suggest)

    def linearize(self) -> None:
        """Linearize again with T and Ts as the sliders stand."""
        state = self._desk.read()
        self._begin(partial(self._linearize, state.method, state.thresholds))

    def download(
        self, kind: str, everything: bool, notes: str, convention: Convention = "opengl"
    ) -> None:
        """Send files of what is on screen, see `downloads`.

        Args:
            notes: are part of a report.
            convention: of the normals' picture, with a shape.
        """
        if kind == SHAPE:
            self._begin(partial(self._promise, partial(self._send_shape, convention)))
        else:
            chosen = partial(self._pack, kind, everything)
            if kind == REPORT:
                chosen = partial(self._report, notes)
            elif kind in FIGURE_KINDS:
                job = self._job
                chosen = partial(make_figure, self._runs, kind, self._desk.progress, job.stopping)
            self._begin(partial(self._promise, partial(self._send, self._desk.read(), chosen)))

    def recover(self, known: Known, given_lights: bool, px_mm: float | None) -> None:
        """Recover the shape from the result on screen, when what is running has ended.

        What waited for that before is not recovered any more.

        Args:
            known: of the scene.
            given_lights: whether the stack's own lights are used where `known` says nothing.
            px_mm: side of a pixel, mm.
        """
        self._waiting = partial(self._recover, known, given_lights, px_mm)
        self._go_on()

    def ensure(self, state: ViewState) -> None:
        """Compute what is to be shown and is not there; the first time with T and Ts suggested."""
        right = self._results or self._first is None
        thresholds = state.thresholds if right else None
        for method in (state.method, state.beside):
            if method is not None and method not in (*self._results, *self._declined):
                self._job.start(partial(self._linearize, method, thresholds))
        self._go_on()

    def _go_on(self) -> None:
        """Begin what waits, unless something is running still."""
        with self._exchange:
            if self._waiting is not None and self._job.start(self._waiting):
                self._waiting = None

    def _begin(self, work: Callable[[], None]) -> None:
        if not self._job.start(work):
            self._desk.refuse()

    def _guarded(self, work: Callable[[], None]) -> None:
        if self._job.closed:
            return
        self._desk.busy(True)
        try:
            work()
        except Exception as error:
            if not self._job.closed:  # else others have taken over, and it is not of interest
                self._desk.tell(error)
        finally:
            if not self._job.closed:
                self._desk.busy(False)

    def _linearize(self, method: Method, thresholds: Thresholds | None) -> None:
        """Analyze by `method`; when None, with the thresholds asked for at first."""
        options = replace(self._runs.options, method=method)
        if thresholds is not None:
            options = replace(options, T=thresholds.T, Ts=thresholds.Ts)
        self._declined = frozenset((*self._declined, method))
        with cancelling("linearization", "the earlier result is kept" if self._results else EMPTY):
            result = self._runs.run(options, self._desk.progress, self._job.stopping)
        self._declined = frozenset(m for m in self._declined if m != method)
        if self._job.closed:
            return
        untouched = not self._results and self._desk.read().thresholds == self._first
        self.deliver(method, result)
        if untouched:
            self._desk.begin(result.thresholds)

    def _suggest(self) -> None:
        with cancelling("suggestion", "T and Ts are kept"):
            suggested = self._runs.suggest(self._desk.progress, self._job.stopping)
        if not self._job.closed:  # else they are of other images
            self._declined = frozenset()  # what failed may work by these
            self._desk.move(suggested)

    def _settled(self, state: ViewState) -> Analysis:
        """The result on screen; where that is a preview, a run for the same thresholds.

        Raises:
            OptionError: there is none yet.
        """
        analysis = self._results.get(state.method)
        if analysis is None:
            raise OptionError("there is no result yet; linearize first")
        if is_behind(state, analysis):
            self._linearize(state.method, state.thresholds)
            analysis = self._results[state.method]
        return analysis

    def _recover(self, known: Known, given_lights: bool, px_mm: float | None) -> None:
        analysis = self._settled(self._desk.read())
        self._desk.progress("shape", 0.0)
        earlier = "the earlier one is kept" if self._recovered else "there is none"
        with cancelling("shape", earlier), tell_compiling(self._desk.progress) as progress:
            told = analysis if given_lights else replace(analysis, lights=None)
            shape = recover_shape(
                self._runs.stack,
                analysis,
                resolve_ambiguity(told, known),
                px_mm=px_mm,
                progress=progress,
                cancel=self._job.stopping,
            )
        self._recovered = Recovered(shape, analysis)
        if not self._job.closed:  # else it is of other images, whose layers nobody can show
            self._desk.shaped()

    def _promise(self, send: Callable[[], None]) -> None:
        """Send files, or say that none will come, also after others have taken over."""
        try:
            send()
        except Cancelled:
            if self._job.closed:
                why = "export cancelled, as other images are left out; nothing was saved"
                self._desk.tell(Cancelled(why))
            raise

    def _send(
        self, state: ViewState, make: Callable[[Analysis, ViewState], tuple[str, bytes]]
    ) -> None:
        # files are of the whole, as a run would give them, even while a preview is shown
        analysis = self._settled(state)
        self._desk.progress("writing files", 0.5)
        shown = relabel(self._runs.stack, analysis, state.thresholds)
        self._hand_over(*make(shown, state))

    def _pack(
        self, kind: str, everything: bool, shown: Analysis, state: ViewState
    ) -> tuple[str, bytes]:
        pack = partial(self._source.pack, excluded=self._runs.excluded)
        return make_download(shown, kind, None if everything else state.image, pack)

    def _report(self, notes: str, shown: Analysis, state: ViewState) -> tuple[str, bytes]:
        runs, found = self._runs, self._recovered
        command = self._source.command(shown.options, state.thresholds, runs.excluded)
        shape = None if found is None else found.shape
        return make_report(shown, runs.stack, shape, command, notes)

    def _send_shape(self, convention: Convention) -> None:
        if (found := self._recovered) is None:
            raise OptionError("there is no shape yet; recover one in the tab Shape (key: N)")
        analysis, excluded = found.analysis, self._runs.excluded
        colour = self._source.colour(analysis, excluded, found.shape, self._desk.progress)
        self._desk.progress("writing files", 0.5)
        result = self._source.pack(analysis, excluded, found.shape)
        self._hand_over(*make_shape_download(found, result, colour, convention))

    def _hand_over(self, name: str, data: bytes) -> None:
        if self._job.stopping():
            raise Cancelled("export cancelled; nothing was saved")
        self._desk.send(name, data)
