"""All keys, in one table that the help and the list over the picture are made from."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Key:
    """One or more keys that belong together."""

    shown: str
    """As people call them."""
    does: str
    """What they do, in the same order."""
    names: tuple[str, ...]
    """What `Panels.press` knows them by, or the page: KeyboardEvent.key, in small letters where
    case does not matter."""
    in_page: bool = False
    """They act in the page, and are not reported."""


KEYS = (
    Key("← →", "previous, next image", ("arrowleft", "arrowright")),
    Key("↑ ↓", "view: input, linearized, residual, labels, how often, and those of a shape",
        ("arrowup", "arrowdown")),
    Key("[ ]", "T down, up", ("[", "]")),
    Key("{ }", "Ts down, up", ("{", "}")),
    Key("S", "suggest T and Ts", ("s",)),
    Key("R", "linearize again with T and Ts", ("r",)),
    Key("Z, Shift-Z", "undo, redo a change of T or Ts; with Ctrl too", ("z", "Z")),
    Key("M", "next method", ("m",)),
    Key("K, Shift-K", "leave this image out, take all images in again", ("k", "K")),
    Key("P", "pin the selected pixel to compare with", ("p",)),
    Key("X, U", "next image where it is specular, undefined", ("x", "u")),
    Key("B, Shift-B", "compare: one picture alone and the other in turn, both again", ("b", "B")),
    Key("1 … 5", "show or hide D, S, A, C, U", ("1", "2", "3", "4", "5")),
    Key("space held", "without overlay", (" ",), in_page=True),
    Key("N", "recover the shape, as the tab Shape says", ("n",)),
    Key("D", "3D, flat again", ("d",)),
    Key("F, G", "fit, one image pixel on one screen pixel", ("f", "g"), in_page=True),
    Key("E", "export as chosen", ("e",)),
    Key("C", "copy the command line of what is shown", ("c",)),
    Key("Esc", "cancel what is running, stop sampling", ("escape",)),
    Key("H", "show or hide the hint of the first visit", ("h",), in_page=True),
    Key("?", "show or hide this list over the picture", ("?",), in_page=True),
)  # fmt: skip
"""In the order they are listed."""


def tabulate_keys(keys: Sequence[Key] = KEYS) -> str:
    """The list as a table in Markdown."""
    rows = (f"| {key.shown} | {key.does} |" for key in keys)
    return "\n".join(("| key | does |", "|---|---|", *rows))
