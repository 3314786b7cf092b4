"""A sphere in the scene, pointed out by clicks on the picture or by numbers."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import viser

from photolin.shape.known import Sphere
from photolin.stack import ImageStack

from ..frame import Frame
from ..pointed import ON, RIM, Part, Pointed
from ..readout import escape
from ..sketch import Sketch
from ..state import Pixel
from ..values import clamp_number
from . import ATTENTION, INDENT

SELECT, UNDO, CLEAR = "select", "undo", "clear"
LARGEST = 1e5


class SphereView:
    """What to do next, buttons for it, and the outline in numbers."""

    def __init__(
        self,
        gui: viser.GuiApi,
        stack: ImageStack,
        recover: Callable[[], None],
        retract: Callable[[], None],
        show: Callable[[Sketch | None], None],
    ) -> None:
        """Build it, out of sight until `want`.

        Args:
            recover: there are points enough.
            retract: what was said of earlier points does not hold any more.
            show: draw on the picture.
        """
        self._recover, self._retract, self._show = recover, retract, show
        row, column, radius = (round(value, 1) for value in outline_of(stack))
        self._guess: Sphere = row, column, max(radius, 0.5)
        self._pointed = Pointed(self._guess)
        self._flat, self._in_view = True, False
        self._frame: Frame | None = None
        self._sketch: Sketch | None = None
        self._steps = gui.add_html("")
        self._pick = gui.add_button_group(
            "Click on picture", (RIM, ON, SELECT), hint="What clicks on the flat picture are"
        )
        self._forget = gui.add_button_group(
            "Clicked so far", (UNDO, CLEAR), hint="Forget the last click, or all"
        )
        self._keep = gui.add_button(
            "Keep the dashed outline", color="gray", hint="A guess from the mask"
        )
        self._numbers = tuple(
            gui.add_number(name, value, min=low, max=LARGEST, step=0.1, hint="Outline, pixels")
            for name, value, low in (
                ("Centre row", row, -LARGEST),
                ("Centre column", column, -LARGEST),
                ("Radius", self._guess[2], 0.5),
            )
        )
        self._bind()
        self._tell()

    @property
    def pointed(self) -> Pointed:
        """What was clicked and set."""
        return self._pointed

    def want(self, wanted: Part | None) -> None:
        """Ask for a sphere where that is new; None goes out of sight."""
        if wanted != self._pointed.wanted:
            self._go(self._pointed.want(wanted))

    def set(self, outline: Sphere) -> None:
        """Take an outline that is known."""
        self._go(self._pointed.set(outline))

    def see(self, *, flat: bool | None = None, in_view: bool | None = None) -> None:
        """Take clicks only while the picture is flat and the panel in view."""
        self._flat = self._flat if flat is None else flat
        self._in_view = self._in_view if in_view is None else in_view
        self._tell()

    def draw(self, frame: Frame) -> None:
        """Take the result that points need values of."""
        self._frame = frame

    def take(self, pixel: Pixel) -> bool:
        """Take a click while outline or points are being clicked; whether it was one of those."""
        before = self._pointed
        if before.picking is None or not (self._flat and self._in_view):
            return False
        self._go(before.click(pixel, None if self._frame is None else self._frame.analysis))
        return True

    def press(self, what: str) -> None:
        """Do what a button says: outline, points, select, undo or clear."""
        pointed = self._pointed
        if what == UNDO:
            self._go(pointed.undo())
        elif what == CLEAR:
            self._go(replace(pointed, clicks=(), outline=self._guess, guessed=True).pick(RIM))
        else:
            self._go(pointed.pick(RIM if what == RIM else ON if what == ON else None))

    def _bind(self) -> None:
        for group in (self._pick, self._forget):

            @group.on_click
            async def _(event: viser.GuiEvent) -> None:
                self.press(event.target.value)

        @self._keep.on_click
        async def _(_: viser.GuiEvent) -> None:
            self._go(self._pointed.keep())

        for number in self._numbers:

            @number.on_update
            async def _(event: viser.GuiEvent) -> None:
                if event.client is not None:  # else it was written here, maybe one of three so far
                    self._measure()

    def _measure(self) -> None:
        """Take the numbers, which someone has typed."""
        row, column, radius = (clamp_number(n.value, -LARGEST, LARGEST, 1.0) for n in self._numbers)
        outline = row, column, max(radius, 0.5)
        if outline != self._pointed.outline:
            self._go(self._pointed.set(outline))

    def _go(self, pointed: Pointed) -> None:
        """Take a step."""
        before, self._pointed = self._pointed, pointed
        for number, value in zip(self._numbers, pointed.outline, strict=True):
            if number.value != value:
                number.value = value
        if pointed.clicks != before.clicks:
            self._retract()
            if pointed.is_enough:
                self._recover()
        self._tell()

    def _tell(self) -> None:
        """Show what to do, what is there, and what was wrong."""
        pointed = self._pointed
        wanted = pointed.wanted is not None
        for handle in (self._steps, self._pick, self._forget, *self._numbers):
            handle.visible = wanted
        self._keep.visible = wanted and pointed.guessed
        lines = "".join(
            f'<div style="font-weight:{700 if now else 400}">{escape(text)}</div>'
            for text, now in pointed.steps(flat=self._flat)
        )
        if pointed.refused:
            lines += f'<div style="{ATTENTION};margin-top:0.3em">{escape(pointed.refused)}</div>'
        self._steps.content = (
            f'<div style="{INDENT};font-size:0.8em;margin-bottom:0.6em">{lines}</div>'
        )
        sketch = None
        if wanted and self._in_view:
            points = pointed.points if pointed.wanted == ON else ()
            sketch = Sketch(pointed.outline, pointed.guessed, pointed.rim, points)
        if sketch != self._sketch:
            self._sketch = sketch
            self._show(sketch)


def outline_of(stack: ImageStack) -> Sphere:
    """Centre row, column and radius of the circle with the centre and the area of the mask."""
    rows, columns = np.divmod(stack.pixels, stack.shape[2])
    return float(rows.mean()), float(columns.mean()), float(np.sqrt(len(rows) / np.pi))
