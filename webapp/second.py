"""The second picture of a canvas, compared with the first: split, beside it, or in its place.

The page cuts both pictures as `page/compare.js` says; a line that is dragged there is drawn at once
and told later.
"""

import re
from collections.abc import Callable
from typing import Literal

import numpy as np
import viser

from .state import Arrangement
from .viser_internals import call_javascript, set_encoded, widget_id

PLANES = ("/canvas/other", "/canvas/other_overlay")


class Second:
    """The picture and its overlay; not to be seen until it is arranged."""

    def __init__(self, client: viser.ClientHandle, width: float, height: float) -> None:
        """As large as the first picture, in units of viser's world."""
        self._client = client
        self._base, self._overlay = (
            client.scene.add_image(
                name,
                np.zeros((1, 1, 4), np.uint8),
                render_width=width,
                render_height=height,
                format="png",
                cast_shadow=False,
                receive_shadow=False,
                visible=False,
            )
            for name in PLANES
        )
        self._field = client.gui.add_text("divider", "", visible=False)

    @property
    def divider_id(self) -> str:
        """Where the page writes the share of the width at which the line is."""
        return widget_id(self._field)

    def set_base(self, encoded: bytes, image_format: Literal["jpeg", "png"]) -> None:
        """The encoded picture, of any resolution of the first one's shape."""
        set_encoded(self._base, encoded, image_format)

    def set_overlay(self, encoded: bytes | None) -> None:
        """The PNG with transparency over it; None removes it."""
        if encoded is not None:
            set_encoded(self._overlay, encoded, "png")
        if self._overlay.visible != (encoded is not None):
            self._overlay.visible = encoded is not None

    def arrange(self, arrangement: Arrangement | None, divider: float) -> None:
        """Show both pictures, the second from the share `divider` of the width on if split.

        None and the difference, which is one picture, show the first alone.
        """
        how = None if arrangement == "difference" else arrangement
        if self._base.visible != (how is not None):
            self._base.visible = how is not None
        call_javascript(self._client, "window.photolin.setComparison", how, divider)

    def on_divide(self, callback: Callable[[float], None]) -> None:
        """Call back with where the line is dragged to, 0 to 1, at most 20 times a second."""

        @self._field.on_update
        async def _(_: viser.GuiEvent) -> None:
            if (divider := divider_in_text(self._field.value)) is not None:
                callback(divider)


def divider_in_text(text: str) -> float | None:
    """The share, 0 to 1, that the page wrote as "0.1234", or None."""
    found = re.fullmatch(r"[01]\.[0-9]{1,6}", text)
    return float(text) if found is not None and float(text) <= 1 else None
