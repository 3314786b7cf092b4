"""From the linearized images to a surface: what is known of the scene, and how it is looked at."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
import viser

from photolin.errors import PhotolinError
from photolin.shape.circle import fit_circle
from photolin.shape.known import Known, Sphere
from photolin.stack import ImageStack

from ..frame import Frame
from ..live import is_behind
from ..readout import describe_shape, escape, shape_status
from ..state import Pixel, ViewState
from ..values import choose_option, clamp_number
from . import ATTENTION, INDENT

LIGHTS, POINTS, BALL, NOTHING = (
    "the lights of the stack",
    "points on a sphere",
    "a whole sphere",
    "nothing",
)
NO_SHAPE = "No shape yet. Say what is known of the scene, then recover it."
ENOUGH = 5
"""Points from which the shape is recovered at once: the paper's number."""
RIM, ON, SELECT, CLEAR = "outline", "points", "select", "clear"
Picking = Literal["outline", "points"]
LARGEST = 1e5


class ShapeView:
    """What is known, what was clicked, and the switches of the 3D view."""

    def __init__(
        self,
        gui: viser.GuiApi,
        stack: ImageStack,
        changed: Callable[[], None],
        recover: Callable[[], None],
    ) -> None:
        self._changed, self._recover = changed, recover
        self._picking: Picking | None = None
        self._rim: tuple[Pixel, ...] = ()
        self._points: tuple[Pixel, ...] = ()
        kinds = (POINTS, BALL, NOTHING) if stack.lights is None else (LIGHTS, POINTS, BALL, NOTHING)
        self._known = gui.add_dropdown(
            "Known",
            kinds,
            initial_value=NOTHING if stack.lights is None else LIGHTS,
            hint="With unknown lights, normals are known up to a 3x3 matrix. It is resolved by "
            "points on a sphere that you click (five or more), by all pixels of a sphere, or by "
            "nothing but that normals belong to a surface: then tilt and relief are a convention",
        )
        row, column, radius = outline_of(stack)
        self._numbers = tuple(
            gui.add_number(name, round(value, 1), min=low, max=LARGEST, step=0.1, hint=hint)
            for name, value, low, hint in (
                ("Centre row", row, -LARGEST, "Of the sphere's outline, pixels from the top"),
                ("Centre column", column, -LARGEST, "Of the sphere's outline, pixels from left"),
                ("Radius", radius, 0.5, "Of the sphere's outline, pixels"),
            )
        )
        self._pick = gui.add_button_group(
            "Click on picture",
            (RIM, ON, SELECT, CLEAR),
            hint="outline: three clicks or more on the sphere's rim set centre and radius. points: "
            "clicks on the sphere; from the fifth on, the shape is recovered at once. select: "
            "clicks select pixels again. clear: forget what was clicked",
        )
        self._told = gui.add_html("")
        self._px_mm = gui.add_number(
            "Pixel, mm",
            0.0,
            min=0.0,
            max=LARGEST,
            step=0.001,
            hint="Side of a pixel on the object; depth and mesh are in mm then. 0: in pixels",
        )
        self._button = gui.add_button(
            "Recover shape",
            icon=viser.Icon.CUBE,
            hint="Normals, albedo and depth from the linearized images (key: N)",
        )
        self._note = gui.add_html("")
        self._relief = gui.add_checkbox(
            "3D",
            False,
            hint="Lay the picture on the surface: drag turns, right-drag moves, wheel zooms, a "
            "click selects the pixel (key: D)",
        )
        self._arrows = gui.add_checkbox(
            "lights", True, hint="Arrows from the lights, orange for the image shown (only in 3D)"
        )
        for handle in (self._relief, self._arrows):
            handle.disabled = True  # until there is a shape

            @handle.on_update
            async def _(_: viser.GuiEvent) -> None:
                changed()

        @self._known.on_update
        async def _(_: viser.GuiEvent) -> None:
            self._arrange()

        @self._pick.on_click
        async def _(_: viser.GuiEvent) -> None:
            self._begin(self._pick.value)

        @self._button.on_click
        async def _(_: viser.GuiEvent) -> None:
            recover()

        self._arrange()

    @property
    def marks(self) -> tuple[tuple[int, int, str], ...]:
        """(row, column, text) of what was clicked."""
        rim = tuple((*pixel, "rim") for pixel in self._rim)
        return (*rim, *((*pixel, str(n)) for n, pixel in enumerate(self._points, 1)))

    def take(self, pixel: Pixel) -> bool:
        """Take a click while outline or points are being clicked; whether it was taken."""
        if self._picking == RIM:
            self._rim = (*self._rim, pixel)
            self._set_outline()
        elif self._picking == ON:
            self._points = (*self._points, pixel)
        else:
            return False
        self._tell()
        self._changed()
        if self._picking == ON and len(self._points) >= ENOUGH:
            self._recover()
        return True

    def toggle(self) -> None:
        """Flat or 3D, once there is a shape."""
        if not self._relief.disabled:
            self._relief.value = not self._relief.value

    def known(self) -> Known:
        """What is known of the scene, as set here.

        Raises:
            OptionError: it does not go together.
        """
        kind = choose_option(self._known.value, self._known.options, NOTHING)
        if kind == POINTS:
            return Known(self._outline(), self._points)
        return Known(self._outline()) if kind == BALL else Known()

    def given_lights(self) -> bool:
        """Whether the lights of the stack are to be used."""
        return self._known.value == LIGHTS

    def px_mm(self) -> float | None:
        """Side of a pixel, mm; None where unknown."""
        value = clamp_number(self._px_mm.value, 0, LARGEST, 0.0)
        return value if value > 0 else None

    def restore(self, state: ViewState) -> None:
        """Set the lights of a state; 3D waits for a shape."""
        self._arrows.value = state.arrows

    def read(self, state: ViewState) -> ViewState:
        """The state with the switches of the 3D view as set here."""
        return replace(state, relief=self._relief.value is True, arrows=self._arrows.value is True)

    def draw(self, frame: Frame) -> None:
        """Say how the shape was found."""
        text = NO_SHAPE if frame.shape is None else describe_shape(frame.shape)
        note = f'<div style="{INDENT};font-size:0.8em;margin-bottom:0.6em">{escape(text)}</div>'
        if stale := status_of(frame):
            note = (
                '<div style="margin:0 var(--mantine-spacing-xs) 0.5em;font-size:0.8em;'
                f'{ATTENTION}">{escape(stale)}</div>{note}'
            )
        self._note.content = note
        for handle in (self._relief, self._arrows):
            handle.disabled = frame.shape is None

    def _outline(self) -> Sphere:
        row, column, radius = (clamp_number(n.value, -LARGEST, LARGEST, 1.0) for n in self._numbers)
        return row, column, max(radius, 0.5)

    def _set_outline(self) -> None:
        try:
            centre, radius = fit_circle(*np.array(self._rim, float).T)
        except PhotolinError:  # too few clicks yet, or on a line
            return
        for handle, value in zip(self._numbers, (*centre, radius), strict=True):
            handle.value = round(value, 1)

    def _begin(self, what: str) -> None:
        if what == CLEAR:
            self._rim, self._points = (), ()
        self._picking = what if what in (RIM, ON) else None
        self._tell()
        self._changed()

    def _arrange(self) -> None:
        sphere = self._known.value in (POINTS, BALL)
        for handle in (*self._numbers, self._pick, self._told):
            handle.visible = sphere
        if not sphere:
            self._picking = None
        self._tell()

    def _tell(self) -> None:
        count = len(self._points)
        text = {
            None: "Clicks select pixels.",
            RIM: f"Click the sphere's rim, three times or more: {len(self._rim)} so far.",
            ON: f"Click points on the sphere, {ENOUGH} or more, spread wide: {count} so far.",
        }[self._picking]
        self._told.content = (
            f'<div style="{INDENT};font-size:0.8em;margin-bottom:0.6em">{escape(text)}</div>'
        )


def status_of(frame: Frame) -> str:
    """That the shape is of another result than recovering again would take, or nothing."""
    if frame.recovered is None:
        return ""
    shown = frame.analysis
    behind = shown is not None and is_behind(frame.state, shown)
    wanted = frame.state.thresholds if shown is None or behind else shown.thresholds
    return shape_status(frame.recovered.analysis, shown, wanted)


def outline_of(stack: ImageStack) -> Sphere:
    """Centre row, column and radius of the circle with the centre and the area of the mask."""
    rows, columns = np.divmod(stack.pixels, stack.shape[2])
    return float(rows.mean()), float(columns.mean()), float(np.sqrt(len(rows) / np.pi))
