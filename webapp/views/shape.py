"""From the linearized images to a surface: what is known of the scene, and how it is looked at."""

import re
from collections.abc import Callable
from dataclasses import replace

import viser

from photolin.errors import OptionError
from photolin.shape.known import Known, Sphere, lights_in_text, points_in_text
from photolin.shape.resolved import Kind, Resolved
from photolin.stack import ImageStack

from ..frame import Frame
from ..live import is_behind
from ..pointed import FIRST, ON, RIM
from ..readout import describe_shape, doubt_shape, escape, shape_status
from ..sketch import Sketch
from ..state import SURFACE, Layer, Pixel, ViewState
from ..values import choose_option, clamp_number, set_longest
from . import ATTENTION, INDENT
from .sphere import LARGEST, SphereView

LIGHTS, POINTS, BALL, NORMALS, SOME, NOTHING = (
    "the lights of the stack",
    "points on a sphere",
    "a whole sphere",
    "normals of some pixels",
    "lights of some images",
    "nothing",
)
LISTS = {
    NORMALS: "Lines of row column x y z: a pixel, its unit normal. x right, y up, z to the camera.",
    SOME: "Lines of name x y z: an image, its light. x right, y up, z to the camera.",
}
"""Kinds that are told by lines of text, and what those hold."""
KINDS: dict[Kind, str] = {
    "lights": LIGHTS,
    "points": POINTS,
    "sphere": BALL,
    "some lights": SOME,
    "integrability": NOTHING,
}
"""What was known, by how a shape was resolved."""
NO_SHAPE = "No shape yet. Say what is known of the scene, then recover it."
MANY = 30
"""Lights from which on they are not drawn unless asked for."""
ID = "photolin-shape"
"""Of what is there while the panel is in view."""
LONGEST = 200_000
"""Characters of a list."""

RECOVER = "Normals, albedo and depth from the linearized images (key: N)"


class ShapeView:
    """What is known, what was clicked, and the switches of the 3D view."""

    def __init__(
        self,
        gui: viser.GuiApi,
        stack: ImageStack,
        changed: Callable[[], None],
        recover: Callable[[], None],
        retract: Callable[[], None],
        show: Callable[[Sketch | None], None],
        look: Callable[[Layer], None],
    ) -> None:
        """Build it; `retract` and `show` as `SphereView` takes them, `look` goes to a layer."""
        self._names = stack.names
        kinds = (POINTS, BALL, NORMALS, SOME, NOTHING)
        self._known = gui.add_dropdown(
            "Known",
            kinds if stack.lights is None else (LIGHTS, *kinds),
            initial_value=NOTHING if stack.lights is None else LIGHTS,
            hint="What tells tilt and relief of the surface. With nothing, they are a convention",
        )
        self._sphere = SphereView(gui, stack, recover, retract, show)
        self._told = gui.add_html("")
        self._list = gui.add_text("List", "", multiline=True, hint="Paste the lines of a file")
        set_longest(self._list, LONGEST)
        self._px_mm = gui.add_number(
            "Pixel, mm",
            0.0,
            min=0.0,
            max=LARGEST,
            step=0.001,
            hint="Side of a pixel on the object, for lengths in mm. 0: in pixels",
        )
        self._button = gui.add_button("Recover shape", icon=viser.Icon.CUBE, hint=RECOVER)
        self._note = gui.add_html(f'<div id="{ID}"></div>')
        self._relief = gui.add_checkbox(
            "3D", False, hint="The picture on the surface: drag turns it (key: D)"
        )
        self._arrows = gui.add_checkbox(
            "lights", len(stack.images) <= MANY, hint="In 3D, as arrows; orange: of this image"
        )
        self._layers = gui.add_button_group(
            "Look at",
            SURFACE,
            visible=False,  # until there is a shape
            hint="What of the shape the picture shows; View in the tab Tune too",
        )
        self._bind(changed, recover, look)
        self._arrange()

    def _bind(
        self,
        changed: Callable[[], None],
        recover: Callable[[], None],
        look: Callable[[Layer], None],
    ) -> None:
        @self._layers.on_click
        async def _(_: viser.GuiEvent) -> None:
            look(choose_option(self._layers.value, SURFACE, "relit"))

        for handle in (self._relief, self._arrows):
            handle.disabled = True  # until there is a shape

            @handle.on_update
            async def _(_: viser.GuiEvent) -> None:
                self._sphere.see(flat=not self._relief.value)
                changed()

        @self._known.on_update
        async def _(_: viser.GuiEvent) -> None:
            self._arrange()

        @self._button.on_click
        async def _(_: viser.GuiEvent) -> None:
            recover()

    def see(self, shown: bool) -> None:
        """Whether the panel is in view: else clicks are not for it."""
        self._sphere.see(in_view=shown)

    def take(self, pixel: Pixel) -> bool:
        """Take a click on the picture where the sphere is pointed out; whether it was taken."""
        return self._sphere.take(pixel)

    def toggle(self) -> None:
        """Flat or 3D, once there is a shape."""
        if not self._relief.disabled:
            self._relief.value = not self._relief.value

    def known(self) -> Known:
        """What is known of the scene, as set here.

        Raises:
            OptionError: it does not go together, or the outline of a sphere is not set.
            InputError: a list cannot be read.
        """
        kind = choose_option(self._known.value, self._known.options, NOTHING)
        if kind == NORMALS:
            return points_in_text(str(self._list.value), "the list")
        if kind == SOME:
            return lights_in_text(str(self._list.value), self._names, "the list")
        if kind not in (POINTS, BALL):
            return Known()
        pointed = self._sphere.pointed
        if pointed.guessed:
            raise OptionError(f"the outline of the sphere is not set. {FIRST}")
        return Known(pointed.outline, pointed.points if kind == POINTS else ())

    def given_lights(self) -> bool:
        """Whether the lights of the stack are to be used."""
        return self._known.value == LIGHTS

    def px_mm(self) -> float | None:
        """Side of a pixel, mm; None where unknown."""
        value = clamp_number(self._px_mm.value, 0, LARGEST, 0.0)
        return value if value > 0 else None

    def recall(self, resolved: Resolved, px_mm: float | None) -> None:
        """Set what was known when a shape was recovered, as far as the shape tells."""
        kind = KINDS[resolved.kind]
        if (outline := outline_in_note(resolved)) is not None:
            self._sphere.set(outline)
        if kind in self._known.options:
            self._known.value = kind
        self._px_mm.value = px_mm or 0.0
        self._arrange()

    def restore(self, state: ViewState) -> None:
        """Set the lights of a state; 3D waits for a shape."""
        self._arrows.value = state.arrows

    def read(self, state: ViewState) -> ViewState:
        """The state with the switches of the 3D view as set here."""
        return replace(state, relief=self._relief.value is True, arrows=self._arrows.value is True)

    def draw(self, frame: Frame) -> None:
        """Say how the shape was found."""
        self._names = frame.stack.names
        self._sphere.draw(frame)
        found = frame.shape
        text = NO_SHAPE if found is None else describe_shape(found)
        note = f'<div style="{INDENT};font-size:0.8em;margin-bottom:0.6em">{escape(text)}</div>'
        doubts = () if found is None else doubt_shape(found)
        attention = "".join(
            '<div style="margin:0 var(--mantine-spacing-xs) 0.5em;font-size:0.8em;'
            f'{ATTENTION}">{escape(sentence)}</div>'
            for sentence in (*doubts, status_of(frame))
            if sentence
        )
        self._note.content = f'<div id="{ID}">{attention}{note}</div>'
        for handle in (self._relief, self._arrows):
            handle.disabled = found is None
        if self._layers.visible == (found is None):
            self._layers.visible = found is not None

    def _arrange(self) -> None:
        kind = choose_option(self._known.value, self._known.options, NOTHING)
        self._sphere.want(ON if kind == POINTS else RIM if kind == BALL else None)
        self._told.visible = self._list.visible = kind in LISTS
        self._told.content = (
            f'<div style="{INDENT};font-size:0.8em">{escape(LISTS.get(kind, ""))}</div>'
        )


def status_of(frame: Frame) -> str:
    """That the shape is of another result than recovering again would take, or nothing."""
    if frame.recovered is None:
        return ""
    shown = frame.analysis
    behind = shown is not None and is_behind(frame.state, shown)
    wanted = frame.state.thresholds if shown is None or behind else shown.thresholds
    return shape_status(frame.recovered.analysis, shown, wanted)


def outline_in_note(resolved: Resolved) -> Sphere | None:
    """The outline of the sphere that resolved a shape, from the sentence that tells it."""
    number = r"(-?[0-9.]+(?:e[+-]?[0-9]+)?)"
    text = f"sphere at row {number}, column {number}, radius {number} pixels"
    found = re.search(text, resolved.note) if resolved.kind == "sphere" else None
    return None if found is None else (float(found[1]), float(found[2]), float(found[3]))
