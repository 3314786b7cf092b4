"""What was set before, and what was undone. Pure."""

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

Value = TypeVar("Value")
MOST = 200
"""Steps kept."""


@dataclass(frozen=True)
class History(Generic[Value]):
    """A value with the ones before it and the ones that were undone; a change makes a new one."""

    now: Value
    past: tuple[Value, ...] = ()
    """Oldest first."""
    future: tuple[Value, ...] = ()
    """Undone, the latest to be redone first."""

    def settle(self, value: Value) -> "History[Value]":
        """Take a new value; what was undone is forgotten. The same value is no step."""
        if value == self.now:
            return self
        return History(value, (*self.past, self.now)[-MOST:])

    def undo(self) -> "History[Value]":
        """One step back; nothing where there is none."""
        if not self.past:
            return self
        return replace(
            self, now=self.past[-1], past=self.past[:-1], future=(self.now, *self.future)
        )

    def redo(self) -> "History[Value]":
        """One step forward again; nothing where none was undone."""
        if not self.future:
            return self
        now, *future = self.future
        return History(now, (*self.past, self.now), tuple(future))
