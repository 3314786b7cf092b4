"""Ts the paper's way, from pixels that someone points out, and T from the residuals."""

from collections.abc import Callable
from dataclasses import replace

import viser

from photolin.analysis import Analysis
from photolin.residuals import Residuals, measure_residuals
from photolin.shadow_level import ShadowLevel, sample_shadow_level

from ..box import Box, box_around
from ..canvas import Canvas
from ..clicks import Clicks
from ..frame import Frame
from ..histograms import plot_residuals, plot_samples
from ..readout import tell_threshold
from ..sampling import (
    COLOURS,
    NAMES,
    WANTED,
    Kind,
    Sample,
    pool_samples,
    take_sample,
    tell_level,
    tell_sampling,
)
from ..state import Pixel
from . import INDENT
from .watched import Watched

START, UNDO, CLEAR = "sample", "undo", "clear"
SIDES = {"1 pixel": 0, "5 x 5": 2, "15 x 15": 7, "41 x 41": 20}
"""What a click takes, and how far it reaches from the pixel."""
MOST_SAMPLES = 200
FULL = f"{MOST_SAMPLES} samples are the most; undo or clear some"
OUTSIDE = "No pixel of the mask lies there"


class SamplesView(Watched):
    """Rectangles and clicks on shadows and lit pixels, their histogram, and the Ts between.

    Sampling pauses while the panel is out of view: drags then move the picture, as they do in all
    other panels.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        clicks: Clicks,
        canvas: Canvas,
        changed: Callable[[], None],
        set_T: Callable[[float], None],
        set_Ts: Callable[[float], None],
    ) -> None:
        """Build it.

        Args:
            changed: asks that `redraw` is called soon, by the thread that draws.
            set_T, set_Ts: move the sliders.
        """
        self._changed, self._canvas = changed, canvas
        self._picking: Kind | None = None
        self._samples: tuple[Sample, ...] = ()
        self._note = ""
        self._stale = False
        self._sketched: tuple[object, ...] = (None, ())
        self._level: ShadowLevel | None = None
        self._residuals: tuple[Analysis, float, Residuals] | None = None
        super().__init__(clicks, "samples")
        gui.add_markdown("**Ts** from pixels in **shadow**; **lit** ones help.")
        self._kinds = {kind: self._add_kind(gui, kind) for kind in NAMES}
        self._side = gui.add_dropdown(
            "A click takes", tuple(SIDES), initial_value="5 x 5", hint="Pixels around the click"
        )
        self._stop = gui.add_button(
            "Stop sampling", disabled=True, hint="Drags move the picture, clicks select (key: Esc)"
        )
        self._told = gui.add_html("")
        self._set_Ts = gui.add_button(
            "Set Ts",
            disabled=True,
            hint="Move the slider Ts to the level found, close above the shadows; Z undoes it",
        )
        gui.add_markdown("**T** from the noise: what is darker than the fit.")
        self._plot = gui.add_html(f'<div id="{self._id}"></div>')
        self._set_T = gui.add_button(
            "Set T",
            disabled=True,
            hint="Move the slider T to the level found, about 1.4 standard deviations of the "
            "noise: a larger T takes highlights for diffuse. Passed: share of the observations "
            "below the fit that T takes for diffuse. S sets T and Ts from the data; Z undoes it",
        )
        self._listen(set_T, set_Ts)

    def _add_kind(self, gui: viser.GuiApi, kind: Kind) -> viser.GuiButtonGroupHandle:
        """The buttons of one kind."""
        group = gui.add_button_group(
            NAMES[kind],
            (START, UNDO, CLEAR),
            hint=f"sample: drag rectangles over {WANTED[kind]}, or click them. undo: forget the "
            "last sample of this kind. clear: forget all",
        )

        @group.on_click
        async def _(_: viser.GuiEvent) -> None:
            self._do(kind, group.value)

        return group

    def _listen(self, set_T: Callable[[float], None], set_Ts: Callable[[float], None]) -> None:
        @self._stop.on_click
        async def _(_: viser.GuiEvent) -> None:
            self.stop()

        @self._set_Ts.on_click
        async def _(_: viser.GuiEvent) -> None:
            if self._level is not None:
                set_Ts(self._level.Ts)

        @self._set_T.on_click
        async def _(_: viser.GuiEvent) -> None:
            if self._residuals is not None:
                set_T(self._residuals[2].T)

    # --- what is sampled ---

    def take(self, pixel: Pixel) -> bool:
        """Take the pixels around a click while sampling; whether they were taken."""
        if self._frame is None:
            return False
        reach = SIDES.get(self._side.value, 0)
        return self.take_box(box_around(pixel, reach, self._frame.stack.shape[1:]))

    def take_box(self, box: Box) -> bool:
        """Take the mask pixels of a box in the image shown, while sampling; whether it was."""
        kind, frame = self._sampling(), self._frame
        if kind is None or frame is None:
            return False
        found = take_sample(frame.stack, kind, frame.state.image, box)
        sample = None if found is None else replace(found, image=frame.number)
        if sample is None:
            self._note = OUTSIDE
        elif len(self._samples_left(frame)) >= MOST_SAMPLES:
            self._note = FULL
        else:
            self._note = ""
            self._samples = (*self._samples, sample)
        self._change()
        return True

    def stop(self) -> None:
        """Let clicks and drags on the picture do what they do elsewhere."""
        self._picking = None
        self._change()

    def _do(self, kind: Kind, what: str) -> None:
        own = [sample for sample in self._samples if sample.kind == kind]
        if what == START:
            self._picking = kind
        elif what == UNDO:
            own = own[-1:]
        if what != START:
            self._samples = tuple(sample for sample in self._samples if sample not in own)
        self._note = ""
        self._change()

    def _sampling(self) -> Kind | None:
        """The kind that is being sampled; None while none is, or nobody sees the panel."""
        return self._picking if self._shown else None

    # --- drawing ---

    def redraw(self) -> None:
        """Show what was sampled since; from the thread that draws."""
        if self._stale and self._frame is not None:
            self._stale = False
            self.draw(self._frame)

    def draw(self, frame: Frame) -> None:
        """Show a frame, and outline the samples of its image."""
        super().draw(frame)
        kind = self._sampling()
        here = self._samples if kind is not None else ()
        boxes = tuple((s.box, COLOURS[s.kind]) for s in here if s.image == frame.number)
        if (kind, boxes) != self._sketched:
            self._sketched = (kind, boxes)
            self._canvas.set_sampling(None if kind is None else COLOURS[kind])
            self._canvas.set_boxes(boxes)

    def _see(self, shown: bool) -> None:
        self._shown = shown
        self._change()

    def _change(self) -> None:
        self._stale = True
        self._changed()

    def _show(self, frame: Frame) -> None:
        """Draw both histograms and say what they stand for."""
        now = frame.state.thresholds
        samples = self._samples_left(frame)
        shadows, lit = (pool_samples(samples, kind) for kind in NAMES)
        self._level = level = sample_shadow_level(shadows, lit) if shadows.size else None
        told = [*tell_sampling(self._picking, samples, self._note)]
        if level is not None:
            told += [plot_samples(shadows, lit, level.Ts, now.Ts), tell_level(level, now.Ts)]
        self._told.content = (
            f'<div style="{INDENT};padding-bottom:0.3em;font-size:0.8em">{"".join(told)}</div>'
        )
        self._stop.disabled = self._picking is None
        self._set_Ts.disabled = level is None
        self._set_Ts.label = "Set Ts" if level is None else f"Set Ts to {tell_threshold(level.Ts)}"
        self._set_T.disabled = True
        plot = "" if frame.analysis is None else self._plot_residuals(frame, frame.analysis)
        self._plot.content = f'<div id="{self._id}" style="{INDENT}">{plot}</div>'

    def _samples_left(self, frame: Frame) -> tuple[Sample, ...]:
        """Those of images that are not left out: others have no say."""
        return tuple(s for s in self._samples if s.image not in frame.excluded)

    def _plot_residuals(self, frame: Frame, analysis: Analysis) -> str:
        """Measured once for each result and Ts; while sliders move, the last ones are shown."""
        T, Ts = frame.state.thresholds.T, frame.state.thresholds.Ts
        moving = frame.preview is not None
        if not moving and (self._residuals is None or self._residuals[:2] != (analysis, Ts)):
            found = measure_residuals(frame.stack, analysis, Ts)
            self._residuals = (analysis, Ts, found)
        if self._residuals is None:
            return ""
        residuals = self._residuals[2]
        passed = f" ({residuals.passed(residuals.T):.1%} passed)" if residuals.values.size else ""
        self._set_T.label = f"Set T to {residuals.T:.4f}{passed}"
        self._set_T.disabled = moving  # it is of thresholds that the sliders have left
        return plot_residuals(residuals.values, residuals.T, T)
