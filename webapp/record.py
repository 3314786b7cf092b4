"""What a tab keeps of its session, and when."""

from .keeper import Keeper
from .saved import Saved


class Record:
    """The session of one tab, handed to the keeper of all each time that it rests.

    A tab in which nobody has done anything keeps nothing: what it shows at first is known once
    the first result has moved the sliders, where it does. Later there may be no result for long,
    or for good, of the images that are left.
    """

    def __init__(self, keeper: Keeper, *, again: bool) -> None:
        """Tell whether somebody has chosen what the tab shows at first."""
        self._keeper, self._again = keeper, again
        self.latest: Saved | None = None
        """What is kept, or was shown at first."""

    def follow(self, now: Saved, *, rested: bool, begun: bool) -> bool:
        """Keep what is shown now once it rests; whether that is still to come.

        Args:
            begun: whether there is a result.
        """
        if self.latest is None and not (self._again or begun):
            return False
        if now == self.latest or not rested:
            return now != self.latest
        if self.latest is not None:
            self._keeper.keep(now)
        self.latest = now
        return False
