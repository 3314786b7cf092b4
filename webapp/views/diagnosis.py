"""The selected pixel and the pinned ones in all images: profile, table, what they rest on."""

from collections.abc import Callable

import viser

from photolin.factors import Factor, Thresholds

from ..clicks import Clicks
from ..frame import Frame, pixel_values
from ..plots import PixelPanel, plot_pixel
from ..profile import Profile, describe_confidence, next_image, plot_profile, tabulate_pixel
from ..readout import escape
from ..state import Pixel
from . import INDENT
from .watched import Watched

PIN, UNPIN = "pin", "unpin all"
SPECULAR, UNDEFINED = "next specular", "next undefined"


class DiagnosisView(Watched):
    """What one pixel is, in numbers."""

    def __init__(
        self,
        gui: viser.GuiApi,
        clicks: Clicks,
        pin: Callable[[], None],
        unpin: Callable[[], None],
        go: Callable[[int], None],
    ) -> None:
        super().__init__(clicks, "pixel")
        self._go = go
        self._buttons = gui.add_button_group(
            " ",
            (PIN, UNPIN),
            hint="pin: keep the selected pixel to compare others with, up to four; again unpins it "
            "(key: P)",
        )
        self._nexts = gui.add_button_group(
            "  ",
            (SPECULAR, UNDEFINED),
            hint="Go to the next image where the selected pixel is specular, or undefined (keys: "
            "X and U)",
        )
        self._text = gui.add_html(f'<div id="{self._id}"></div>')
        actions = {PIN: pin, UNPIN: unpin}

        @self._buttons.on_click
        async def _(_: viser.GuiEvent) -> None:
            actions[self._buttons.value]()

        @self._nexts.on_click
        async def _(_: viser.GuiEvent) -> None:
            self.next(Factor.SPECULAR if self._nexts.value == SPECULAR else Factor.UNDEFINED)

    def next(self, factor: Factor) -> None:
        """Go to the next image in which the selected pixel is of a class; nowhere without one."""
        frame = self._frame
        if frame is None or frame.analysis is None or frame.state.pixel is None:
            return
        state = frame.state
        values = pixel_values(frame.stack, frame.analysis, frame.state.pixel, state.thresholds)
        if (found := next_image(values.labels, state.image, factor)) is not None:
            self._go(found)

    def _show(self, frame: Frame) -> None:
        """Draw the selected pixel first, then the pinned ones."""
        state, analysis = frame.state, frame.analysis
        chosen = [] if state.pixel is None else [state.pixel]
        pixels = [p for p in (*chosen, *state.pins) if frame.stack.mask[p]]
        pixels = list(dict.fromkeys(pixels))
        if analysis is None or not pixels:
            inner = _paragraph("Click a pixel of the object to see it in all images.")
            self._text.content = f'<div id="{self._id}" style="{INDENT}">{inner}</div>'
            return
        T = state.thresholds
        profiles = []
        for row, column in pixels:
            values = pixel_values(frame.stack, analysis, (row, column), T)
            name = f"row {row}, column {column}"
            profiles.append(Profile(name, PixelPanel(name, values.i, values.l, values.labels)))
        parts = [self._describe(frame, pixels, profiles, T)]
        if len(profiles) > 1:
            panels = [p.panel for p in profiles]
            parts.append(plot_pixel(panels, T, state.image, frame.stack.names))
        parts.append(plot_profile(profiles[:4], T, state.image))
        parts.append(tabulate_pixel(profiles[0].panel, T, state.image, frame.stack.names))
        self._text.content = f'<div id="{self._id}" style="{INDENT}">{"".join(parts)}</div>'

    def _describe(
        self, frame: Frame, pixels: list[Pixel], profiles: list[Profile], thresholds: Thresholds
    ) -> str:
        assert frame.analysis is not None
        sentences = []
        for n, (pixel, profile) in enumerate(zip(pixels, profiles, strict=True)):
            known = describe_confidence(frame.analysis.confidence, pixel, len(profile.panel.i))
            dash = ("line", "dashes", "dots", "dash and dots")[min(n, 3)]
            legend = f" ({dash})" if len(pixels) > 1 else ""
            sentences.append(f"Pixel {profile.name}{legend}. {known}")
        return "".join(_paragraph(s) for s in sentences)


def _paragraph(text: str) -> str:
    return f'<div style="font-size:0.8em;margin-bottom:0.3em">{escape(text)}</div>'
