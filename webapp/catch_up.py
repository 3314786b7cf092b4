"""The run of the whole stack that takes the place of a preview when the sliders rest."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from photolin.analysis import Analysis, Method
from photolin.errors import Cancelled
from photolin.factors import Thresholds

from .job import Job
from .live import is_behind
from .runs import Runs
from .state import ViewState


class CatchUp:
    """Runs in a thread of its own, without a progress bar: it is quick, and gives way at once."""

    def __init__(
        self,
        runs: Runs,
        deliver: Callable[[Method, Analysis], None],
        tell: Callable[[Exception], None],
        ended: Callable[[], None],
    ) -> None:
        """Tell what to do with what comes of it.

        Args:
            deliver: called in the thread with a result.
            tell: called in the thread with what went wrong.
            ended: called in the thread when the next run can be started.
        """
        self._runs, self._deliver, self._tell = runs, deliver, tell
        self._job = Job(lambda work: work(), ended)
        self._running: Thresholds | None = None
        self._refused: Thresholds | None = None
        """Thresholds that gave no result; not tried again unasked."""

    def pursue(self, state: ViewState, near: Analysis | None, rested: bool) -> bool:
        """Stop a run for other thresholds than the state's; start one for these, where it rests.

        Args:
            near: the latest result of the whole stack by the state's method.

        Returns:
            Whether one is to be started once the state rests.
        """
        wanted = state.thresholds
        if near is None or not is_behind(state, near) or wanted == self._refused:
            self._job.stop()
            return False
        if self._running not in (None, wanted):
            self._job.stop()
        if rested and self._running is None:
            self._running = wanted
            if not self._job.start(partial(self._run, state.method, wanted)):
                self._running = None
        return not rested

    def close(self) -> None:
        """Stop, and start nothing any more."""
        self._job.close()

    def _run(self, method: Method, thresholds: Thresholds) -> None:
        options = replace(self._runs.options, method=method, T=thresholds.T, Ts=thresholds.Ts)
        try:
            result = self._runs.run(options, lambda stage, fraction: None, self._job.stopping)
            self._deliver(method, result)
        except Cancelled:
            pass
        except Exception as error:
            self._refused = thresholds
            self._tell(error)
        finally:
            self._running = None
