"""Which image, and which layer of it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import viser

from photolin.stack import ImageStack

from ..frame import Frame
from ..readout import escape
from ..state import LAYERS, SURFACE, Layer, ViewState
from ..values import choose_option, clamp_integer
from . import INDENT

PREVIOUS, NEXT, FIT, ONE_TO_ONE = "◀ previous", "next ▶", "fit", "1:1"


class PictureView:
    """Image slider with its buttons, and the layer."""

    def __init__(
        self,
        gui: viser.GuiApi,
        stack: ImageStack,
        changed: Callable[[], None],
        fit: Callable[[], None],
        one_to_one: Callable[[], None],
    ) -> None:
        self._count = len(stack.images)
        self._name = gui.add_html("")
        self._image = gui.add_slider(
            "Image",
            0,
            self._count - 1,
            1,
            0,
            marks=(),  # their numbers would lie under the handle
            hint="Number among the images that are not left out, from 0 (keys: left and right "
            "arrow)",
        )
        self._buttons = gui.add_button_group(
            " ",
            (PREVIOUS, NEXT, FIT, ONE_TO_ONE),
            hint="previous, next: image, round the ends. fit: the whole picture (key: F). 1:1: one "
            "image pixel on one pixel of the screen (key: G)",
        )
        self._layer = gui.add_dropdown(
            "View",
            tuple(layer for layer in LAYERS if layer not in SURFACE),
            initial_value="input",
            hint="input: as photographed. linearized: diffuse reflection alone, signed, zero is "
            "mid-grey. residual: input minus linearized, zero is white. Both show labels only as "
            "outlines. labels: the label map alone. how often: in how many images each "
            "pixel is what the tab Overview says. Once a shape is there: its albedo, normals and "
            "depth, and the scene under a light of your own (keys: up and down arrow)",
        )
        for handle in (self._image, self._layer):

            @handle.on_update
            async def _(_: viser.GuiEvent) -> None:
                changed()

        actions = {
            PREVIOUS: lambda: self.step(-1),
            NEXT: lambda: self.step(1),
            FIT: fit,
            ONE_TO_ONE: one_to_one,
        }

        @self._buttons.on_click
        async def _(_: viser.GuiEvent) -> None:
            actions[self._buttons.value]()

    def restore(self, state: ViewState) -> None:
        """Set image and layer of a state; layers of a shape wait for one."""
        self._image.value = min(state.image, self._count - 1)
        if state.layer in self._layer.options:
            self._layer.value = state.layer

    def restock(self, count: int, image: int) -> None:
        """Go on with a stack of `count` images, at `image`, and without a shape."""
        if self._layer.value in SURFACE:
            self._layer.value = "input"
        self.offer(surface=False)
        self._count = count
        self._image.value, self._image.max = image, count - 1

    def offer(self, surface: bool) -> None:
        """Offer the layers of a shape too, or not."""
        layers = tuple(layer for layer in LAYERS if surface or layer not in SURFACE)
        if self._layer.options != layers:
            self._layer.options = layers

    def show(self, layer: Layer) -> None:
        """Go to a layer."""
        self._layer.value = layer

    def step(self, by: int) -> None:
        """Go `by` images on, round the ends."""
        self._image.value = (self._read_image() + by) % self._count

    def go(self, image: int) -> None:
        """Go to an image."""
        self._image.value = image

    def turn(self, by: int) -> None:
        """Go `by` layers on, round the ends."""
        layers = self._layer.options
        at = layers.index(choose_option(self._layer.value, layers, "input"))
        self._layer.value = layers[(at + by) % len(layers)]

    def read(self, state: ViewState) -> ViewState:
        """The state with image and layer as set here."""
        return replace(
            state,
            image=self._read_image(),
            layer=choose_option(self._layer.value, LAYERS, "input"),
        )

    def draw(self, frame: Frame) -> None:
        """Name what is shown."""
        K, H, W = frame.stack.shape
        file = frame.stack.names[frame.state.image]
        out = len(frame.excluded)
        left = f" ({out} left out)" if out else ""
        number = f" ({frame.number} in the whole stack)" if out else ""
        self._name.content = (
            f'<div style="{INDENT};font-size:0.8em"><b>{escape(frame.stack.title)}</b> '
            f"&nbsp;{K} images{left}, {H} rows × {W} columns "
            f"&nbsp;<b>{escape(Path(file).name)}</b>{number}</div>"
        )

    def _read_image(self) -> int:
        return clamp_integer(self._image.value, 0, self._count - 1, 0)
