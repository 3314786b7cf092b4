"""All images of the stack: what each is made of, what is wrong with it, and leaving it out."""

from collections.abc import Callable
from dataclasses import replace
from threading import RLock

import viser

from photolin.stack import ImageStack

from ..clicks import Clicks
from ..frame import Frame
from ..readout import escape
from ..reviewer import Reviewer, kept_images, reviewed_of
from ..state import OFTEN, ViewState
from ..strip import ORDERS, Order, deal_cards, draw_status, draw_strip, style_strip, summarize_strip
from ..values import choose_option
from . import INDENT
from .picture import PictureView

SHOW, BACK = "show on picture", "back to input"
OUT, IN = "leave this out", "take all in"
HELP = (
    "Click an image to go to it, × to leave it out, + to take it in again; all is then linearized "
    "anew. The bar is its classes at T and Ts as they stand. Point at a bar, a name or a yellow "
    "word for more. Numbers count all images, those too that are left out."
)


class OverviewView:
    """The cards of all images, and what the view how often counts; drawn while in view."""

    def __init__(
        self,
        gui: viser.GuiApi,
        clicks: Clicks,
        whole: ImageStack,
        picture: PictureView,
        changed: Callable[[], None],
        exclude: Callable[[int, bool], None],
        tell: Callable[[Exception], None],
    ) -> None:
        """Build the widgets.

        Args:
            whole: the stack with all its images.
            picture: goes to images and layers.
            changed: called when the state is to be read again.
            exclude: leaves an image of `whole` out, or where false takes it in again; as often as
                it is asked, for the frame follows later.
            tell: called with what went wrong.
        """
        self._whole, self._picture, self._exclude = whole, picture, exclude
        self._lock = RLock()
        self._frame: Frame | None = None
        self._in_view = False
        self._reviewer = Reviewer(whole, self._show, tell)
        self._view_id = clicks.watch_parts("overview", self._choose, self._see)
        self._strip_id = clicks.watch_parts("strip", self._choose, lambda shown: None)
        self._often = gui.add_dropdown(
            "How often",
            OFTEN,
            initial_value=OFTEN[0],
            hint="The view how often shows in how many images each pixel is so, by T and Ts as "
            "they stand. lit: diffuse or specular",
        )
        self._views = gui.add_button_group(
            " ", (SHOW, BACK), hint="The view how often in the tab Tune, and the view input"
        )
        self._order = gui.add_dropdown(
            "Order", ORDERS, initial_value=ORDERS[0], hint="worst first: with the most findings"
        )
        self._choices = gui.add_button_group(
            "  ",
            (OUT, IN),
            hint="this: the image in the picture (key: K). all: those left out (key: Shift-K)",
        )
        self._told = gui.add_html("")
        self._style = gui.add_html("")
        self._cards = gui.add_html("")
        self._listen(changed)
        self._show()

    def _listen(self, changed: Callable[[], None]) -> None:
        @self._often.on_update
        async def _(event: viser.GuiEvent) -> None:
            if event.client is not None:  # a person chose it, and wants to see it
                self._picture.show("how often")
            changed()

        @self._views.on_click
        async def _(_: viser.GuiEvent) -> None:
            self._picture.show("how often" if self._views.value == SHOW else "input")

        @self._order.on_update
        async def _(_: viser.GuiEvent) -> None:
            self._show()

        @self._choices.on_click
        async def _(_: viser.GuiEvent) -> None:
            (self.leave_out if self._choices.value == OUT else self.take_all_in)()

    def read(self, state: ViewState) -> ViewState:
        """The state with what is counted as set here."""
        return replace(state, often=choose_option(self._often.value, OFTEN, OFTEN[0]))

    def restore(self, state: ViewState) -> None:
        """Set what is counted."""
        self._often.value = state.often

    def draw(self, frame: Frame) -> None:
        """Show the cards of a frame, while they are in view."""
        with self._lock:
            self._frame = frame
        if self._in_view:
            self._reviewer.look_at(frame)
            self._show()

    def leave_out(self) -> None:
        """Leave the image shown out."""
        if (frame := self._frame) is not None:
            self._exclude(kept_images(frame, self._whole)[frame.state.image], True)

    def take_all_in(self) -> None:
        """Take all images in again."""
        for image in range(len(self._whole.images)):
            self._exclude(image, False)

    def close(self) -> None:
        """Stop looking at results."""
        self._reviewer.close()

    def _choose(self, part: str, number: int) -> None:
        """Do what a click on a card, or on cancel, asks for; what is neither does nothing."""
        if (frame := self._frame) is None or number >= len(self._whole.images):
            return
        if part == "toggle":
            self._exclude(number, number not in frame.excluded)
        elif part == "image" and number not in frame.excluded:
            self._picture.go(kept_images(frame, self._whole).index(number))
        elif part == "cancel":
            self._reviewer.cancel()

    def _see(self, shown: bool) -> None:
        with self._lock:
            self._in_view = shown
        self._reviewer.look_at(self._frame if shown else None)
        self._show()

    def _show(self) -> None:
        with self._lock:
            frame, known = self._frame, self._reviewer
            told, note, cards = "The images appear with the first picture.", "", ""
            if frame is not None and self._in_view:
                order: Order = choose_option(self._order.value, ORDERS, ORDERS[0])
                dealt = deal_cards(
                    self._whole.names, frame.excluded, known.shares, known.health, order
                )
                now = kept_images(frame, self._whole)[frame.state.image]
                told, note = summarize_strip(dealt), self._tell_status(frame)
                cards = draw_strip(dealt, now, known.sheet, frame.state.gain, self._strip_id)
            elif frame is not None:
                return
            status = draw_status(told, note, known.fraction)
            self._told.content = f'<div id="{self._view_id}" style="{INDENT}">{status}</div>'
            style = style_strip(known.sheet)
            if self._style.content != style:
                self._style.content = style
            help_text = f'<small style="display:block;margin-top:0.5rem">{escape(HELP)}</small>'
            self._cards.content = f'<div style="{INDENT}">{cards}{help_text}</div>'

    def _tell_status(self, frame: Frame) -> str:
        if reviewed_of(frame) is None:
            return "They are not linearized yet."
        if self._reviewer.is_declined(frame):
            return "Not all were looked at; open this tab again for that."
        return "" if self._reviewer.is_reviewed(frame) else "Looking at each of them."
