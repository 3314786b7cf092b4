"""What computes for one tab: results, preview and the run that catches up, of some of the images.

When other images are left out, all of it is made anew; what was running for the ones before is
stopped, and what still comes of it is of no interest to anybody.
"""

from collections.abc import Callable

from photolin.factors import Thresholds

from .catch_up import CatchUp
from .desk import Desk
from .live import Live
from .runs import Runs
from .selections import Selections
from .work import Work


class Bench:
    """The parts that work on one selection of images."""

    def __init__(
        self,
        selections: Selections,
        excluded: tuple[int, ...],
        first: Thresholds | None,
        desk: Desk,
    ) -> None:
        """Begin with the images that are not `excluded`; `first` as `Work` takes it.

        Raises:
            PhotolinError: as `Selections.without`.
        """
        self._selections, self._desk = selections, desk
        self._take(selections.without(excluded), first)

    def select(self, excluded: tuple[int, ...]) -> None:
        """Go on with other images, linearized by T and Ts as they stand.

        Raises:
            PhotolinError: as `Selections.without`; then all stays as it was.
        """
        runs = self._selections.without(excluded)
        begun = bool(self.work.results)
        self.close()
        self._desk.busy(False)
        self._take(runs, None if begun else self._first)

    def suggest(self) -> None:
        """Set T and Ts to what the data suggest."""
        self.work.suggest()

    def linearize(self) -> None:
        """Linearize again with T and Ts as they stand."""
        self.work.linearize()

    def stop(self) -> None:
        """Ask the long work to stop."""
        self.work.stop()

    def close(self) -> None:
        """Stop what is running, and start nothing any more."""
        self.work.close()
        self.catch_up.close()

    def _take(self, runs: Runs, first: Thresholds | None) -> None:
        self.runs, self._first = runs, first
        self.live = Live(runs.stack)
        self.work = Work(runs, self._selections.source, first, self._desk)
        tell: Callable[[Exception], None] = self._desk.tell
        self.catch_up = CatchUp(runs, self.work.deliver, tell, self._desk.changed)
