"""Why a pixel is what it is: the scatter of Fig. 4 and the rule in words."""

from collections.abc import Callable
from dataclasses import replace

import viser

from photolin.analysis import METHODS, Analysis

from ..frame import Frame, PixelValues, pixel_values
from ..plots import PixelPanel, plot_pixel
from ..readout import describe_pixel, escape, explain
from ..state import ViewState
from . import INDENT

ALONE = "no other method"
CHOICES: tuple[str, ...] = (ALONE, *METHODS)


class PixelView:
    """The selected pixel in all images."""

    def __init__(self, gui: viser.GuiApi, changed: Callable[[], None]) -> None:
        self._plot = gui.add_html("")
        self._beside = gui.add_dropdown(
            "Compare with",
            CHOICES,
            initial_value=ALONE,
            hint="Plot the pixel by another method beside it (Fig. 9 of the paper)",
        )

        @self._beside.on_update
        async def _(_: viser.GuiEvent) -> None:
            changed()

    def add_choice(self, gui: viser.GuiApi) -> None:
        """Offer the compared method in a second place too, where pictures are compared."""
        twin = self._twin = gui.add_dropdown(
            "By method",
            CHOICES,
            initial_value=ALONE,
            hint="Whose result the right picture is of; the same choice as Compare with in the "
            "tab Tune",
        )

        @twin.on_update
        async def _(_: viser.GuiEvent) -> None:
            if self._beside.value != twin.value:
                self._beside.value = twin.value

        @self._beside.on_update
        async def _(_: viser.GuiEvent) -> None:
            if twin.value != self._beside.value:
                twin.value = self._beside.value

    def restore(self, state: ViewState) -> None:
        """Set the compared method of a state."""
        self._beside.value = ALONE if state.beside is None else state.beside

    def read(self, state: ViewState) -> ViewState:
        """The state with the compared method as set here."""
        beside = next((method for method in METHODS if method == self._beside.value), None)
        return replace(state, beside=None if beside == state.method else beside)

    def draw(self, frame: Frame) -> None:
        """Plot the pixel and say which rule decided, by each method."""
        state, stack = frame.state, frame.stack
        if state.pixel is None or frame.analysis is None:
            self._plot.content = _text(_invite(state))
            return
        row, column = state.pixel
        if not stack.mask[row, column]:
            i = stack.images[:, row, column]
            outside = describe_pixel(row, column, i, state.thresholds, inside=False)
            self._plot.content = _text(outside)
            return
        results = [a for a in (frame.analysis, frame.beside) if a is not None]
        values = [pixel_values(stack, a, state.pixel, state.thresholds) for a in results]
        panels = [_panel(a, v) for a, v in zip(results, values, strict=True)]
        plot = plot_pixel(panels, state.thresholds, state.image, stack.names)
        k = state.image
        sentences = []
        for panel in panels:
            name = f"{panel.title}, image {k}" if len(panels) > 1 else f"Image {k}"
            sentences.append(explain(float(panel.i[k]), float(panel.l[k]), state.thresholds, name))
        if state.beside is not None and frame.beside is None:
            sentences.append(f"There is no result by {state.beside} yet.")
        sentences.append(describe_pixel(row, column, values[0].i, state.thresholds))
        self._plot.content = f'<div style="{INDENT}">{plot}</div>{_text(*sentences)}'


def _invite(state: ViewState) -> str:
    if state.pixel is not None:
        return (
            f"There is no result by {state.method} yet; it will say why this pixel is what it is."
        )
    if state.beside is None:
        return "Click a pixel to see why it is labelled as it is."
    return f"Click a pixel to see why {state.method} and {state.beside} label it as they do."


def _panel(analysis: Analysis, values: PixelValues) -> PixelPanel:
    return PixelPanel(analysis.options.method, values.i, values.l, values.labels)


def _text(*sentences: str) -> str:
    return (
        f'<div style="{INDENT};font-size:0.85em">'
        f"{'<br>'.join(escape(sentence) for sentence in sentences)}</div>"
    )
