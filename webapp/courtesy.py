"""Work in the background gives way to what somebody waits for, in all tabs of the program.

The cores are shared by all threads, and so is what is said here: that a tab is following its
sliders or drawing is known to the whole program.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Condition

LONGEST = 0.5
"""Seconds after which work goes on all the same: a tab that never rests would else stop it."""
TURN = 0.25
"""Seconds that it then goes on for before it rests again: it takes three times as long at most."""

_urgent: set[object] = set()
"""One for each round that a tab is in the middle of."""
_free = Condition()


@contextmanager
def urgent() -> Iterator[None]:
    """While this lasts, work that gives way rests."""
    own = object()
    with _free:
        _urgent.add(own)
    try:
        yield
    finally:
        with _free:
            _urgent.remove(own)
            _free.notify_all()


def give_way(ended: Callable[[], bool] = bool) -> bool:
    """Rest, for a while at most, as long as something urgent is being done.

    Args:
        ended: whether there is nothing to rest for any more; looked at again by `end_rests`.

    Returns:
        Whether it was long enough.
    """
    with _free:
        return _free.wait_for(lambda: not _urgent or ended(), LONGEST)


def end_rests() -> None:
    """Let all that rest look at whether they are to go on."""
    with _free:
        _free.notify_all()
