"""The 2D canvas of one tab: a picture, an overlay on it, marks, and the pixel under the pointer.

viser draws 3D scenes, so the picture is a plane that the camera faces squarely; `page/` keeps
it so in the page (drag pans, wheel zooms at the pointer, nothing rotates, pixels stay square) and
fits it, at first and on double click. Pixels are (row, column) throughout.

Callbacks run one at a time on viser's event loop, which all tabs share: they must return at once.
"""

import functools
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import viser

from photolin.shape.recover import Shape

from .box import Box, box_in_text
from .hint import HINT
from .keys import KEYS
from .relief import MESH, Relief
from .second import PLANES, Second
from .sketch import Sketch
from .state import Pixel
from .values import MAX_TEXT
from .viser_internals import call_javascript, run_javascript, set_encoded, widget_id

WORLD_HEIGHT = 10.0
"""Height of the picture in viser's world, whatever its pixels."""
_PLANES = ("/canvas/base", "/canvas/overlay")


class Window(NamedTuple):
    """The part of the picture on screen, half-open."""

    row0: int
    row1: int
    column0: int
    column1: int
    scale: float
    """Pixels of the screen for one of the picture."""


class Canvas:
    """The picture plane of one client; its parts are freed with the client."""

    def __init__(self, client: viser.ClientHandle, height: int, width: int) -> None:
        """An empty canvas for pictures of `height` rows and `width` columns."""
        self._client = client
        self._shape = (height, width)
        self._marker: Pixel | None = None
        self._pins: tuple[tuple[int, int, str], ...] = ()
        self._readout = ""
        self._base, self._overlay = (
            client.scene.add_image(
                name,
                np.zeros((1, 1, 4), np.uint8),
                render_width=WORLD_HEIGHT * width / height,
                render_height=WORLD_HEIGHT,
                format="png",
                cast_shadow=False,
                receive_shadow=False,
            )
            for name in _PLANES
        )
        # viser has no events for hovering and keys, and its clicks miss by half a CSS pixel on
        # screens with more than one pixel in it: the page writes them into hidden fields.
        self._hover, self._pick, self._key, self._view, self._light, self._band, self._hold = (
            client.gui.add_text(name, "", visible=False)
            for name in ("hover", "pick", "key", "view", "light", "band", "hold")
        )
        self._relief = Relief(client, height, width, WORLD_HEIGHT)
        self.second = Second(client, WORLD_HEIGHT * width / height, WORLD_HEIGHT)
        run_javascript(client, _javascript())
        options = {
            "rows": height,
            "columns": width,
            "planes": _PLANES,
            "relief": MESH,
            "worldHeight": WORLD_HEIGHT,
            "hoverId": widget_id(self._hover),
            "pickId": widget_id(self._pick),
            "keyId": widget_id(self._key),
            "viewId": widget_id(self._view),
            "lightId": widget_id(self._light),
            "others": PLANES,
            "dividerId": self.second.divider_id,
            "bandId": widget_id(self._band),
            "holdId": widget_id(self._hold),
            "keys": [(key.shown, key.does) for key in KEYS],
            "hint": HINT,
            "mostText": MAX_TEXT,
        }
        call_javascript(client, "window.openCanvas", options)

    def set_base(self, encoded: bytes, image_format: Literal["jpeg", "png"]) -> None:
        """Show an encoded (H, W) picture; it may have any resolution of the same shape."""
        set_encoded(self._base, encoded, image_format)

    def set_overlay(self, encoded: bytes | None) -> None:
        """Lay a PNG with transparency over the picture; None removes it."""
        if encoded is not None:
            set_encoded(self._overlay, encoded, "png")
        if self._overlay.visible != (encoded is not None):
            self._overlay.visible = encoded is not None

    def set_marker(self, pixel: Pixel | None) -> None:
        """Ring one pixel (row, column); None removes the ring."""
        self._marker = pixel
        self._send_marks()

    def set_pins(self, pins: Sequence[tuple[int, int, str]]) -> None:
        """Put short texts at pixels, (row, column, text) each, in place of the earlier ones."""
        self._pins = tuple(pins)
        self._send_marks()

    def set_surface(self, shape: Shape | None) -> None:
        """The surface that the picture can be laid on; None removes it."""
        self._relief.set(shape)
        self._send_marks()

    def set_orbit(self, on: bool) -> None:
        """Lay the picture on the surface and let the camera turn around it, or show it flat."""
        call_javascript(self._client, "window.photolin.setOrbit", on)

    def set_arrows(self, shape: Shape | None, chosen: int) -> None:
        """Draw the lights of a shape around it, that of image `chosen` in a colour; None: none."""
        self._relief.set_arrows(shape, chosen)

    def set_light(self, light: tuple[float, float] | None) -> None:
        """Show the ball on which a light is dragged, at x right, y up; None hides it."""
        call_javascript(self._client, "window.photolin.setLight", light)

    def set_sketch(self, sketch: Sketch | None) -> None:
        """Draw what is known of a sphere on the flat picture, in place of the earlier; or not."""
        told = None if sketch is None else asdict(sketch)
        call_javascript(self._client, "window.photolin.setSketch", told)

    def set_sampling(self, colour: str | None) -> None:
        """Let drags draw rectangles of a CSS colour "#rrggbb"; None: they move the picture again.

        With Shift or another button they still move it; in 3D nothing is drawn.
        """
        call_javascript(self._client, "window.photolin.setSampling", colour)

    def set_boxes(self, boxes: Sequence[tuple[Box, str]]) -> None:
        """Outline boxes of pixels in CSS colours, in place of the earlier ones; not in 3D."""
        listed = [(*box, colour) for box, colour in boxes]
        call_javascript(self._client, "window.photolin.setBoxes", listed)

    def set_readout(self, text: str) -> None:
        """Write one line in the lower left corner; an empty text removes it."""
        if text != self._readout:
            self._readout = text
            call_javascript(self._client, "window.photolin.setReadout", text)

    def copy(self, text: str) -> None:
        """Put text on the clipboard of the page's machine, after a click or a key."""
        call_javascript(self._client, "window.photolin.copy", text)

    def fit(self) -> None:
        """Show the whole picture, centred in the free part of the window."""
        call_javascript(self._client, "window.photolin.fit")

    def one_to_one(self) -> None:
        """Show each image pixel as one pixel of the screen (1 / devicePixelRatio CSS pixels)."""
        call_javascript(self._client, "window.photolin.oneToOne")

    def set_reach(self, slider: viser.GuiSliderHandle[float], most: float) -> None:
        """Let numbers up to `most` be typed beside a slider that ends earlier."""
        call_javascript(self._client, "window.photolin.setReach", widget_id(slider), most)

    def set_titles(self, titles: Mapping[str, str]) -> None:
        """Give buttons, by their names in the page, tooltips."""
        call_javascript(self._client, "window.photolin.setTitles", list(titles.items()))

    def on_pick(self, callback: Callable[[Pixel], None]) -> None:
        """Call back with the pixel that was clicked; clicks beside the picture do nothing."""

        @self._pick.on_update
        async def _(_: viser.GuiEvent) -> None:
            if (pixel := self._pixel(self._pick.value.partition(" ")[2])) is not None:
                callback(pixel)

    def on_hover(self, callback: Callable[[Pixel | None], None]) -> None:
        """Call back with the pixel under the pointer, None beside it, at most 20 times a second."""

        @self._hover.on_update
        async def _(_: viser.GuiEvent) -> None:
            callback(self._pixel(self._hover.value))

    def on_box(self, callback: Callable[[Box], object]) -> None:
        """Call back with each rectangle that was drawn; see `set_sampling`."""

        @self._band.on_update
        async def _(_: viser.GuiEvent) -> None:
            if box := box_in_text(self._band.value.partition(" ")[2], self._shape):
                callback(box)

    def on_view(self, callback: Callable[[Window], None]) -> None:
        """Call back with the part of the picture on screen, once it has come to rest."""

        @self._view.on_update
        async def _(_: viser.GuiEvent) -> None:
            if (window := window_in_text(self._view.value, self._shape)) is not None:
                callback(window)

    def on_light(self, callback: Callable[[tuple[float, float]], None]) -> None:
        """Call back with x right and y up of the unit direction that the light is dragged to."""

        @self._light.on_update
        async def _(_: viser.GuiEvent) -> None:
            if (light := light_in_text(self._light.value)) is not None:
                callback(light)

    def on_key(self, callback: Callable[[str], None]) -> None:
        """Call back with each key pressed outside text fields: KeyboardEvent.key, "ArrowLeft".

        Keys that act in the page (`Key.in_page`) are not reported, nor are keys with Ctrl, Alt or
        Meta, arrows on a focused slider, and the Escape that closes the list of keys.
        """

        @self._key.on_update
        async def _(_: viser.GuiEvent) -> None:
            callback(self._key.value.partition(" ")[2])

    def on_hold(self, callback: Callable[[bool], None]) -> None:
        """Call back when the pointer is pressed on a slider, true, and when it is let go of."""

        @self._hold.on_update
        async def _(_: viser.GuiEvent) -> None:
            callback(self._hold.value == "held")

    def _pixel(self, text: str) -> Pixel | None:
        return pixel_in_text(text, self._shape) or self._relief.pixel_on(text)

    def _send_marks(self) -> None:
        marker = [] if self._marker is None else [(*self._marker, "")]
        marks = [
            (row, column, text, self._relief.height((row, column)))
            for row, column, text in (*self._pins, *marker)
        ]
        call_javascript(self._client, "window.photolin.setMarks", marks)


def window_in_text(text: str, shape: tuple[int, int]) -> Window | None:
    """The window that the page wrote as "row0,row1,column0,column1,scale", or None."""
    found = re.fullmatch(r"([0-9]{1,6}),([0-9]{1,6}),([0-9]{1,6}),([0-9]{1,6}),([0-9.]{1,9})", text)
    if found is None or found[5].count(".") > 1 or not found[5].strip("."):
        return None
    row0, row1, column0, column1 = (int(number) for number in found.groups()[:4])
    inside = row0 < row1 <= shape[0] and column0 < column1 <= shape[1]
    scale = float(found[5])
    return Window(row0, row1, column0, column1, scale) if inside and scale > 0 else None


def pixel_in_text(text: str, shape: tuple[int, int]) -> Pixel | None:
    """The pixel that the page wrote as "row,column", or None when it is none of the picture."""
    numbers = re.fullmatch(r"([0-9]{1,6}),([0-9]{1,6})", text)
    pixel = (int(numbers[1]), int(numbers[2])) if numbers else shape
    return pixel if pixel[0] < shape[0] and pixel[1] < shape[1] else None


def light_in_text(text: str) -> tuple[float, float] | None:
    """x and y of a direction on the camera's side that the page wrote as "x,y", or None."""
    number = r"(-?[01]\.[0-9]{1,6})"
    if (found := re.fullmatch(f"{number},{number}", text)) is None:
        return None
    x, y = float(found[1]), float(found[2])
    return (x, y) if x * x + y * y < 1 else None


@functools.cache
def _javascript() -> str:
    """The files of `page/`, as the body of one function: they see each other and nobody else."""
    files = sorted((Path(__file__).parent / "page").glob("*.js"))
    return "\n".join(['"use strict";', *(file.read_text(encoding="utf-8") for file in files)])
