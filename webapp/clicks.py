"""Clicks and drags on parts of the panel, as fractions of their size, and whether they are in view.

Pictures in viser's panel tell no clicks, and tabs do not tell when they are opened. `clicks.js`
looks for elements by id in the page and writes what happens into one hidden field. The elements may
be replaced at any time, or be made later.

Callbacks run one at a time on viser's event loop, which all tabs share: they must return at once.
"""

import functools
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import viser

from .viser_internals import call_javascript, run_javascript, widget_id


class Click(NamedTuple):
    """A click on an element."""

    name: str
    x: float
    """From its left border to its right, 0 to 1."""
    y: float
    """From its upper border to its lower, 0 to 1."""


class Choice(NamedTuple):
    """A click on a numbered part of an element."""

    name: str
    part: str
    """What kind of part it is, small letters."""
    number: int
    """Up to six digits; whether there is such a part is for the caller to say."""


class Drag(NamedTuple):
    """The pointer moved while it held an element."""

    name: str
    right: float
    """By how much of its width, -1 to 1."""
    down: float
    """By how much of its height, -1 to 1."""


class Sight(NamedTuple):
    """An element came into view or went out of it."""

    name: str
    shown: bool


class Clicks:
    """The elements of one client's page that are watched; freed with the client."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._clicked: dict[str, Callable[[float, float], None]] = {}
        self._chosen: dict[str, Callable[[str, int], None]] = {}
        self._dragged: dict[str, Callable[[float, float], None]] = {}
        self._seen: dict[str, Callable[[bool], None]] = {}
        self._field = client.gui.add_text("clicks", "", visible=False)
        run_javascript(client, _javascript())
        call_javascript(client, "window.openClicks", {"fieldId": widget_id(self._field)})

        @self._field.on_update
        async def _(_: viser.GuiEvent) -> None:
            match event_in_text(self._field.value):
                case Click(name, x, y) if name in self._clicked:
                    self._clicked[name](x, y)
                case Choice(name, part, number) if name in self._chosen:
                    self._chosen[name](part, number)
                case Drag(name, right, down) if name in self._dragged:
                    self._dragged[name](right, down)
                case Sight(name, shown) if name in self._seen:
                    self._seen[name](shown)

    def watch(
        self, name: str, clicked: Callable[[float, float], None], seen: Callable[[bool], None]
    ) -> str:
        """Call back with clicks on an element, and with whether it is in view when that changes.

        Args:
            name: small letters and dashes, up to 40.
            clicked: called with x and y, fractions of the element's width and height, from its
                upper left corner.
            seen: called with true when the element is in view, false when it is not any more.

        Returns:
            The id to give to the element, an HTML or SVG one.
        """
        self._clicked[name], self._seen[name] = clicked, seen
        call_javascript(self._client, "window.photolinClicks.watch", name)
        return f"photolin-{name}"

    def watch_parts(
        self, name: str, chosen: Callable[[str, int], None], seen: Callable[[bool], None]
    ) -> str:
        """Call back with which part of an element is clicked.

        Parts say what they are in an attribute: data-part="image-12" is the part "image" with the
        number 12. Of parts within each other the innermost counts.

        Args:
            name: as `watch` takes it.
            chosen: called with what the page says: 1 to 12 small letters, and a number from 0 to
                999999. There need not be such a part.
            seen: as `watch` takes it.

        Returns:
            As `watch`.
        """
        self._chosen[name] = chosen
        return self.watch(name, _ignore, seen)

    def see(self, name: str, seen: Callable[[bool], None]) -> str:
        """`watch` without clicks."""
        return self.watch(name, _ignore, seen)

    def drag(self, name: str, dragged: Callable[[float, float], None]) -> str:
        """Call back while an element is dragged, up to 20 times a second.

        Args:
            name: as `watch` takes it.
            dragged: called with how far the pointer moved since the last call, to the right and
                down, fractions of the element's width and height.

        Returns:
            The id to give to the element; its content may be replaced meanwhile.
        """
        self._dragged[name] = dragged
        call_javascript(self._client, "window.photolinClicks.drag", name)
        return f"photolin-{name}"


def _ignore(x: float, y: float) -> None:
    """Clicks on an element that is only looked at."""


def event_in_text(text: str) -> Click | Choice | Drag | Sight | None:
    """What the page wrote: a number, a name, and "x,y", "part-number", "by right,down", "shown" or
    "hidden"."""
    found = re.fullmatch(r"[0-9]{1,9} ([a-z-]{1,40}) (by )?(.{1,30})", text, re.ASCII)
    if found is None:
        return None
    name, by, rest = found.groups()
    if rest in ("shown", "hidden") and by is None:
        return Sight(name, rest == "shown")
    part = re.fullmatch(r"([a-z]{1,12})-([0-9]{1,6})", rest, re.ASCII)
    if part is not None and by is None:
        return Choice(name, part[1], int(part[2]))
    number = r"(-?[01]\.[0-9]{1,6})"
    pair = re.fullmatch(f"{number},{number}", rest, re.ASCII)
    if pair is None:
        return None
    x, y = float(pair[1]), float(pair[2])
    if max(abs(x), abs(y)) > 1 or (by is None and "-" in rest):
        return None
    return Click(name, x, y) if by is None else Drag(name, x, y)


@functools.cache
def _javascript() -> str:
    return Path(__file__).with_name("clicks.js").read_text(encoding="utf-8")
