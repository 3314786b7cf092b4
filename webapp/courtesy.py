"""Work in the background gives way to what somebody waits for, in all tabs of the program.

The cores are shared by all threads, and so is what is said here: that a tab is following its
sliders or drawing is known to the whole program.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Condition

LONGEST = 1.0
"""Seconds after which work goes on all the same: a tab that never rests would else stop it."""

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


def give_way() -> None:
    """Rest, for a while at most, as long as something urgent is being done."""
    with _free:
        _free.wait_for(lambda: not _urgent, LONGEST)
