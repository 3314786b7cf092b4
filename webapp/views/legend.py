"""The classes: switches, opacity, outlines, patterns; brightness of the picture; the theme."""

from collections.abc import Callable
from dataclasses import replace

import viser

from photolin.factors import LETTERS, TITLES, Factor
from photolin.stack import ImageStack

from ..render import choose_gain
from ..state import ENCODINGS, THEMES, Theme, ViewState
from ..theme import set_theme
from ..values import choose_option, clamp_number

MIN_GAIN, MAX_GAIN = 0.5, 20.0


class LegendView:
    """One switch a class, and how overlay and picture are drawn."""

    def __init__(self, gui: viser.GuiApi, stack: ImageStack, changed: Callable[[], None]) -> None:
        self._first_gain = round(min(choose_gain(stack.images, stack.mask), MAX_GAIN), 1)
        self._switches = {
            factor: gui.add_checkbox(
                f"{letter} {TITLES[factor].removesuffix(' shadow')}",
                True,
                hint=f"Show {TITLES[factor]} (key: {number})",
            )
            for number, (factor, letter) in enumerate(LETTERS.items(), 1)
        }
        self._opacity = gui.add_slider(
            "Opacity",
            0.0,
            1.0,
            0.05,
            0.55,
            marks=(),
            hint="Of the overlay, 0 to 1; diffuse is drawn fainter, specular stronger",
        )
        self._outlines = gui.add_checkbox(
            "outlines",
            False,
            hint="Draw the borders of the classes instead of their areas, "
            "also over linearized and residual",
        )
        self._patterns = gui.add_checkbox(
            "patterns",
            False,
            hint="Mark the areas by patterns too: S dots, A horizontal lines, C vertical lines, "
            "U crossed lines, D none",
        )
        self._gain = gui.add_slider(
            "Brightness",
            MIN_GAIN,
            MAX_GAIN,
            0.1,
            self._first_gain,
            marks=(),
            hint="Factor for showing the input; stored values are not changed",
        )
        self._encoding = gui.add_dropdown(
            "Sent as",
            ENCODINGS,
            initial_value=ENCODINGS[0],
            hint="How the picture travels to the browser: JPEG is quicker over slow connections, "
            "PNG shows every grey value as it is; labels are always exact",
        )
        self._theme = gui.add_dropdown(
            "Theme",
            THEMES,
            initial_value=ViewState.theme,
            hint="Ground of panel and canvas, dark or light",
        )
        looks = (self._opacity, self._outlines, self._patterns, self._gain, self._encoding)
        for handle in (*self._switches.values(), *looks, self._theme):

            @handle.on_update
            async def _(_: viser.GuiEvent) -> None:
                changed()

        @self._theme.on_update
        async def _(_: viser.GuiEvent) -> None:
            set_theme(gui, self._read_theme())

    def toggle(self, factor: Factor) -> None:
        """Show or hide a class."""
        self._switches[factor].value = not self._switches[factor].value

    def restore(self, state: ViewState) -> None:
        """Set the switches of a state, and how its overlay, its picture and the page look."""
        for factor, handle in self._switches.items():
            handle.value = factor in state.shown
        self._opacity.value, self._outlines.value = state.opacity, state.outlines
        if state.gain is not None:
            self._gain.value = min(max(state.gain, MIN_GAIN), MAX_GAIN)
        self._encoding.value = state.encoding
        self._patterns.value, self._theme.value = state.patterns, state.theme

    def read(self, state: ViewState) -> ViewState:
        """The state with switches, opacity, outlines, patterns, theme and gain as set here."""
        return replace(
            state,
            shown=frozenset(f for f, handle in self._switches.items() if handle.value is True),
            opacity=clamp_number(self._opacity.value, 0, 1, 0.55),
            outlines=self._outlines.value is True,
            patterns=self._patterns.value is True,
            theme=self._read_theme(),
            gain=clamp_number(self._gain.value, MIN_GAIN, MAX_GAIN, self._first_gain),
            encoding=choose_option(self._encoding.value, ENCODINGS, ENCODINGS[0]),
        )

    def _read_theme(self) -> Theme:
        return choose_option(self._theme.value, THEMES, ViewState.theme)
