"""Ts the paper's way, from pixels that someone points out, and T from the residuals."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import viser
from numpy.typing import NDArray

from photolin.analysis import Analysis
from photolin.factors import Thresholds
from photolin.shadow_level import ShadowLevel, sample_shadow_level
from photolin.stack import ImageStack

from ..clicks import Clicks
from ..frame import Frame
from ..histograms import plot_residuals, plot_samples, residuals_below
from ..readout import escape
from ..state import Pixel
from . import INDENT
from .watched import Watched

SHADOW, LIT, UNDO, STOP = "shadow", "lit", "undo", "stop"
Kind = Literal["shadow", "lit"]
SIDES = {"1 pixel": 0, "5 x 5": 2, "15 x 15": 7, "41 x 41": 20}
"""What a click takes, and how far it reaches from the pixel."""


@dataclass(frozen=True)
class Click:
    """One click that takes samples."""

    kind: Kind
    image: int
    pixel: Pixel
    reach: int
    """Pixels around it."""


class SamplesView(Watched):
    """Clicks on shadows and on lit pixels, their histogram, and the Ts between them."""

    def __init__(
        self,
        gui: viser.GuiApi,
        clicks: Clicks,
        stack: ImageStack,
        changed: Callable[[], None],
        apply: Callable[[float], None],
    ) -> None:
        super().__init__(clicks, "samples")
        self._stack, self._changed = stack, changed
        self._picking: Kind | None = None
        self._clicks: tuple[Click, ...] = ()
        self._residuals: tuple[Analysis, float, NDArray[np.float32]] | None = None
        gui.add_markdown(
            "Click **shadows** in some images, and **lit** pixels if you like: Ts is put between "
            "both. Below: what is darker than the fit can only be noise, and T should let most of "
            "it pass."
        )
        self._kind = gui.add_button_group(
            "Click on picture",
            (SHADOW, LIT, UNDO, STOP),
            hint="shadow, lit: what the next clicks on the picture point out. undo: forget the "
            "last click. stop: clicks select pixels again",
        )
        self._side = gui.add_dropdown(
            "A click takes", tuple(SIDES), initial_value="5 x 5", hint="Pixels around the click"
        )
        self._told = gui.add_html("")
        self._apply = gui.add_button(
            "Set Ts", hint="Move the slider Ts to the level found; Z undoes it"
        )
        self._plot = gui.add_html(f'<div id="{self._id}"></div>')

        @self._kind.on_click
        async def _(_: viser.GuiEvent) -> None:
            self._begin(self._kind.value)

        @self._apply.on_click
        async def _(_: viser.GuiEvent) -> None:
            if (level := self.level()) is not None:
                apply(level.Ts)

    @property
    def marks(self) -> tuple[tuple[int, int, str], ...]:
        """(row, column, text) of the clicks in the image shown."""
        image = self._image()
        here = [click for click in self._clicks if click.image == image]
        return tuple((*click.pixel, click.kind) for click in here)

    def take(self, pixel: Pixel) -> bool:
        """Take a click while samples are being clicked; whether it was taken."""
        if self._picking is None:
            return False
        reach = SIDES.get(self._side.value, 0)
        self._clicks = (*self._clicks, Click(self._picking, self._image(), pixel, reach))
        self._changed()
        return True

    def level(self) -> ShadowLevel | None:
        """The Ts that the clicks stand for; None without a click on a shadow."""
        shadows, lit = self._sampled(SHADOW), self._sampled(LIT)
        return sample_shadow_level(shadows, lit) if shadows.size else None

    def _image(self) -> int:
        """Number of the image shown."""
        return 0 if self._frame is None else self._frame.state.image

    def _show(self, frame: Frame) -> None:
        """Draw both histograms and say what they stand for."""
        T = frame.state.thresholds
        shadows, lit = self._sampled(SHADOW), self._sampled(LIT)
        level = sample_shadow_level(shadows, lit) if shadows.size else None
        parts = []
        if level is not None:
            parts.append(plot_samples(shadows, lit, level.Ts))
        if frame.analysis is not None:
            parts.append(plot_residuals(self._below(frame, frame.analysis), T))
        self._plot.content = f'<div id="{self._id}" style="{INDENT}">{"".join(parts)}</div>'
        told = self._tell(level, shadows.size, lit.size, T)
        self._told.content = f'<div style="{INDENT};font-size:0.8em">{escape(told)}</div>'

    def _below(self, frame: Frame, analysis: Analysis) -> NDArray[np.float32]:
        """Residuals below the fit, computed once for each result and Ts."""
        Ts = frame.state.thresholds.Ts
        if self._residuals is None or self._residuals[:2] != (analysis, Ts):
            self._residuals = (analysis, Ts, residuals_below(frame.stack, analysis, Ts))
        return self._residuals[2]

    def _sampled(self, kind: str) -> NDArray[np.float32]:
        """(N,) intensities of the mask pixels that clicks of a kind take."""
        stack = self._stack
        found = []
        for click in self._clicks:
            if click.kind == kind:
                (row, column), r = click.pixel, click.reach
                part = np.s_[max(row - r, 0) : row + r + 1, max(column - r, 0) : column + r + 1]
                found.append(stack.images[click.image][part][stack.mask[part]])
        return np.concatenate(found) if found else np.empty(0, np.float32)

    def _tell(
        self, level: ShadowLevel | None, shadows: int, lit: int, thresholds: Thresholds
    ) -> str:
        doing = {
            None: "Clicks select pixels.",
            SHADOW: "Click shadows.",
            LIT: "Click lit pixels, dim ones too.",
        }[self._picking]
        if level is None:
            return f"{doing} No shadow sampled yet."
        wrong = f", {level.error:.1%} on the wrong side" if lit else ""
        counts = f"{shadows} {SHADOW}, {lit} {LIT} sampled"
        return f"{doing} {counts}: Ts {level.Ts:.4f}{wrong} (now {thresholds.Ts:.4f})."

    def _begin(self, what: str) -> None:
        if what == UNDO:
            self._clicks = self._clicks[:-1]
        else:
            self._picking = SHADOW if what == SHADOW else LIT if what == LIT else None
        self._changed()
