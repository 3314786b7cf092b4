"""Why a pixel is what it is: the scatter of Fig. 4 and the rule in words."""

from collections.abc import Callable
from dataclasses import replace

import viser

from photolin.analysis import METHODS, Analysis

from ..frame import Frame, PixelValues, pixel_values
from ..plots import PixelPanel, plot_pixel
from ..readout import describe_pixel, escape, explain
from ..state import ViewState

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

    def read(self, state: ViewState) -> ViewState:
        """The state with the compared method as set here."""
        beside = next((method for method in METHODS if method == self._beside.value), None)
        return replace(state, beside=None if beside == state.method else beside)

    def draw(self, frame: Frame) -> None:
        """Plot the pixel and say which rule decided."""
        state, stack = frame.state, frame.stack
        if state.pixel is None or frame.analysis is None:
            self._plot.content = _text("Click a pixel to see why it is labelled as it is.")
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
        width = 280 if len(panels) == 1 else 600
        plot = plot_pixel(panels, state.thresholds, state.image, stack.names)
        k, own = state.image, values[0]
        sentences = (
            explain(float(own.i[k]), float(own.l[k]), state.thresholds, f"Image {k}"),
            describe_pixel(row, column, own.i, state.thresholds),
        )
        self._plot.content = (
            f'<div style="max-width:{width}px;margin:0 auto;padding:0 0.8em">{plot}</div>'
            f"{_text(*sentences)}"
        )


def _panel(analysis: Analysis, values: PixelValues) -> PixelPanel:
    return PixelPanel(analysis.options.method, values.i, values.l, values.labels)


def _text(*sentences: str) -> str:
    return (
        '<div style="padding:0 1em;font-size:0.85em">'
        f"{'<br>'.join(escape(sentence) for sentence in sentences)}</div>"
    )
