"""What the user points at with the mouse: pixels, pins, the light, the part in view."""

from collections.abc import Callable
from dataclasses import replace

from .canvas import Window
from .state import MOST_PINS, Pixel, ViewState


class Pointing:
    """The part of a tab's state that no widget holds."""

    def __init__(self, changed: Callable[[], None]) -> None:
        """Begin with nothing; `changed` is called after each change."""
        self._changed = changed
        self.pixel: Pixel | None = None
        self.pointer: Pixel | None = None
        self.pins: tuple[Pixel, ...] = ()
        self.light = ViewState.light
        self.window: Window | None = None
        self.holding = False
        """Whether a slider is held: where it stands is not where it is to stay."""

    def read(self, state: ViewState) -> ViewState:
        """The state with pixel, pins and light as they are here."""
        return replace(state, pixel=self.pixel, pins=self.pins, light=self.light)

    def restore(self, state: ViewState) -> None:
        """Take pixel, pins and light of a state."""
        self.pixel, self.pins, self.light = state.pixel, state.pins, state.light

    def select(self, pixel: Pixel) -> None:
        """Select a pixel."""
        self.pixel = pixel
        self._changed()

    def pin(self) -> None:
        """Pin the selected pixel, or take its pin away; the oldest of too many goes."""
        if (pixel := self.pixel) is None:
            return
        others = tuple(pin for pin in self.pins if pin != pixel)
        self.pins = others if pixel in self.pins else (*others, pixel)[-MOST_PINS:]
        self._changed()

    def unpin(self) -> None:
        """Take all pins away."""
        self.pins = ()
        self._changed()

    def shine(self, light: tuple[float, float]) -> None:
        """Take the direction of the user's own light."""
        self.light = light
        self._changed()

    def hover(self, pixel: Pixel | None) -> None:
        """Take what the pointer is on."""
        self.pointer = pixel
        self._changed()

    def see(self, window: Window) -> None:
        """Take the part of the picture that is in view."""
        self.window = window
        self._changed()

    def hold(self, on: bool) -> None:
        """Take whether a slider is held."""
        self.holding = on
        self._changed()
