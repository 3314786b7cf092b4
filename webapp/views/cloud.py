"""How the coefficients of the image shown came about, and the lights of all images."""

from collections.abc import Callable
from functools import partial
from time import monotonic
from typing import Any, NamedTuple

import viser

from photolin.analysis import Analysis
from photolin.candidates import SOURCES, Cloud, Source, draw_candidates
from photolin.errors import Cancelled, PhotolinError
from photolin.factors import Thresholds
from photolin.stack import ImageStack

from ..box_plot import View
from ..clicks import Clicks
from ..cloud_plot import describe_cloud, plot_cloud, plot_legend
from ..frame import Frame
from ..job import Job
from ..lights_plot import (
    describe_coefficients,
    describe_lights,
    plot_coefficients,
    plot_lights,
)
from ..readout import escape
from ..values import choose_option, clamp_number
from . import INDENT
from .watched import Watched

COUNTS = ("500", "2000", "5000")
KEPT = 16
"""Clouds kept for stepping back and forth."""
PATIENCE = 0.5
"""Seconds after which a cloud gives way to a newer one that is wanted."""
FIRST = View(35, 25)
TURN, TILT = 240.0, 180.0
"""Degrees that dragging across the whole width and height of the drawing turns it."""
MOST_ZOOM = 50.0
HELP = (
    "Drag the cube to turn it. Each dot: three pixels drawn at random and solved for this image's "
    "coefficients, those of the base images in Eq. 2. Large dots agree with the winner. The line "
    "is the way of the centre of gravity while the farthest are dropped, as the method statistical "
    "does. Percentages compare linearized images where the image is lit (root mean square)."
)


class Wanted(NamedTuple):
    """What decides a cloud."""

    stack: ImageStack
    analysis: Analysis | None
    """Whose linearized bases are solved; None where the base images are."""
    base_images: tuple[int, int, int]
    image: int
    thresholds: Thresholds
    source: Source
    candidates: int
    seed: int


class CloudView(Watched):
    """The cloud of the image shown, drawn in a thread of its own while it is in view."""

    def __init__(
        self,
        gui: viser.GuiApi,
        clicks: Clicks,
        tell: Callable[[Exception], None],
    ) -> None:
        """Build the widgets; `tell` is called with what went wrong by a fault of the program."""
        super().__init__(clicks, "cloud")
        self._tell = tell
        self._clouds: dict[Wanted, Cloud | str] = {}
        """Or why there is none; the latest last."""
        self._last: tuple[ImageStack, Cloud] | None = None
        """The latest on screen, and of what."""
        self._job = Job(lambda work: work(), self._redraw)
        # turning is drawn in a thread, for all tabs share the one that tells of it
        self._pen, self._due = Job(lambda work: work(), self._draw_due), False
        self._rest = (0.0, 0.0)
        """Degrees that were dragged beyond what the sliders say."""
        self._drag_id = clicks.drag("cloud-cube", self._drag)
        self._build(gui)

    def _build(self, gui: viser.GuiApi) -> None:
        self._lights = gui.add_html("")
        gui.add_markdown("**How the coefficients of the image shown were found**")
        self._source = gui.add_dropdown(
            "Solved from",
            SOURCES,
            initial_value=SOURCES[0],
            hint="base images: the photographs, as in the paper's Fig. 3. linearized bases: those "
            "of the result, free of shadows and highlights; undefined pixels count against",
        )
        self._count = gui.add_dropdown(
            "Candidates", COUNTS, initial_value="2000", hint="Random samples of three pixels"
        )
        self._zoom = gui.add_slider("Zoom", 1, MOST_ZOOM, 0.5, 1.0, hint="Around the winner")
        self._html = gui.add_html(f'<div id="{self._id}"></div>')
        self._turn = gui.add_slider("Turn", -180, 180, 1, FIRST.azimuth, hint="Or drag the cube")
        self._tilt = gui.add_slider("Tilt", -90, 90, 1, FIRST.elevation, hint="Or drag the cube")
        for handle in (self._source, self._count, self._turn, self._tilt, self._zoom):

            @handle.on_update
            async def _(_: Any) -> None:
                self._redraw()

    def close(self) -> None:
        """Stop, and draw nothing any more."""
        self._job.close()
        self._pen.close()

    def _drag(self, right: float, down: float) -> None:
        """Turn the cube with the pointer, as if it were held."""
        view, (turn, tilt) = self._view(), self._rest
        azimuth = (view.azimuth + turn - TURN * right + 180) % 360 - 180
        elevation = min(max(view.elevation + tilt + TILT * down, -90), 90)
        # sliders hold whole degrees; a slow drag would else be rounded with each step
        self._rest = azimuth - round(azimuth), elevation - round(elevation)
        self._turn.value, self._tilt.value = round(azimuth), round(elevation)

    def _view(self) -> View:
        return View(
            clamp_number(self._turn.value, -180, 180, FIRST.azimuth),
            clamp_number(self._tilt.value, -90, 90, FIRST.elevation),
        )

    def _want(self, frame: Frame) -> Wanted | None:
        if frame.analysis is None:
            return None
        source = choose_option(self._source.value, SOURCES, SOURCES[0])
        source = SOURCES[SOURCES.index(source)]
        count = int(choose_option(self._count.value, COUNTS, COUNTS[1]))
        analysis, state = frame.analysis, frame.state
        return Wanted(
            frame.stack,
            analysis if source == "linearized bases" else None,
            analysis.base_images,
            state.image,
            state.thresholds,
            source,
            count,
            analysis.options.seed,
        )

    def _redraw(self) -> None:
        """Draw once more, soon; returns at once."""
        self._due = True
        self._draw_due()

    def _draw_due(self) -> None:
        if self._due:
            self._pen.start(self._draw_again)  # refused while drawing; the end comes back here

    def _draw_again(self) -> None:
        self._due = False
        with self._lock:
            if self._shown and self._frame is not None:
                self._show(self._frame)

    def _show(self, frame: Frame) -> None:
        """Show the cloud that is wanted; until it is there, the last one, and begin to draw it."""
        wanted = self._want(frame)
        found = None if wanted is None else self._clouds.get(wanted)
        if wanted is not None and found is None and frame.analysis is not None:
            # refused while another is drawn; that one's end comes back here
            self._job.start(partial(self._make, wanted, frame.analysis))
        look = f'style="{INDENT};font-size:0.85em"'
        self._html.content = f'<div id="{self._id}" {look}>{self._draw_cloud(frame, found)}</div>'
        self._lights.content = f"<div {look}>{self._draw_lights(frame)}</div>"

    def _make(self, wanted: Wanted, analysis: Analysis) -> None:
        began = monotonic()

        def overtaken() -> bool:
            frame, late = self._frame, monotonic() - began > PATIENCE
            stale = not self._shown or (frame is not None and self._want(frame) != wanted)
            return self._job.stopping() or (late and stale)

        made: Cloud | str
        try:
            made = draw_candidates(
                wanted.stack,
                analysis,
                wanted.image,
                source=wanted.source,
                count=wanted.candidates,
                thresholds=wanted.thresholds,
                cancel=overtaken,
            )
        except Cancelled:
            return
        except PhotolinError as error:
            made = f"There is no cloud: {error}."
        except Exception as error:
            made = "There is no cloud; photolin made a mistake."
            self._tell(error)
        with self._lock:
            self._clouds[wanted] = made
            # what they are of is kept with them: stacks and results that are gone are not
            for other in [w for w in self._clouds if not is_alike(w, wanted)]:
                del self._clouds[other]
            for oldest in list(self._clouds)[:-KEPT]:
                del self._clouds[oldest]

    def _draw_cloud(self, frame: Frame, found: Cloud | str | None) -> str:
        if frame.analysis is None:
            return _paragraph("There is no result yet; its coefficients will be shown here.")
        if isinstance(found, str):
            return _paragraph(found)
        image = frame.state.image
        if found is not None:
            self._last = frame.stack, found
        if self._last is None or self._last[0] is not frame.stack:
            return _paragraph(f"Candidates for image {image} are being drawn.")
        cloud = self._last[1]
        coefficients = frame.analysis.coefficients[cloud.image]
        zoom = clamp_number(self._zoom.value, 1, MOST_ZOOM, 1)
        drawing, outside = plot_cloud(cloud, coefficients, self._view(), zoom)
        words = describe_cloud(cloud, coefficients, outside)
        if found is None:
            words = f"Candidates for image {image} are being drawn; those of image {cloud.image} "
            words += "are shown."
        elif image in frame.analysis.base_images and cloud.source == "base images":
            words = f"Image {image} is a base image: all candidates are its unit vector. {words}"
        faint = "opacity:0.4;" if found is None else ""
        return (
            f'<div id="{self._drag_id}" style="{faint}cursor:grab;touch-action:none">{drawing}'
            f"</div>{plot_legend(cloud)}{_paragraph(words)}{_note(HELP)}"
        )

    def _draw_lights(self, frame: Frame) -> str:
        analysis, image, names = frame.analysis, frame.state.image, frame.stack.names
        if analysis is None:
            return ""
        shape = frame.shape
        lights = analysis.lights if shape is None else shape.lights
        if lights is None:
            plot = plot_coefficients(analysis.coefficients, image, names, self._view())
            return _paragraph(describe_coefficients(len(names), image)) + plot
        told = describe_lights(len(names), image, recovered=shape is not None)
        return _paragraph(told) + plot_lights(lights, image, names)


def is_alike(one: Wanted, other: Wanted) -> bool:
    """Whether both are of one stack, and not of two results."""
    of_one = one.analysis is other.analysis or None in (one.analysis, other.analysis)
    return one.stack is other.stack and of_one


def _paragraph(text: str) -> str:
    return f'<div style="margin:0.3em 0">{escape(text)}</div>'


def _note(text: str) -> str:
    return f"<small>{escape(text)}</small>"
