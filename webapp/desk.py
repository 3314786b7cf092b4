"""What long work needs of its tab."""

from collections.abc import Callable
from dataclasses import dataclass

from photolin.factors import Thresholds

from .state import ViewState


@dataclass(frozen=True)
class Desk:
    """Functions of a tab; all may be called from any thread."""

    read: Callable[[], ViewState]
    """The state that all widgets together stand for."""
    begin: Callable[[Thresholds], None]
    """Move the sliders to where they start."""
    move: Callable[[Thresholds], None]
    """Move the sliders."""
    busy: Callable[[bool], None]
    """Show or hide the progress bar."""
    progress: Callable[[str, float], None]
    """Show the stage, and the fraction of it that is done."""
    send: Callable[[str, bytes], None]
    """Hand a file of that name to the browser."""
    shaped: Callable[[], None]
    """A shape was recovered."""
    tell: Callable[[Exception], None]
    """Say what went wrong."""
    refuse: Callable[[], None]
    """Say that something is running still."""
    changed: Callable[[], None]
    """Something is to be drawn anew."""
