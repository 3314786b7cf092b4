"""What a connected page may say: three kinds of message, each value as its widget could send it.

viser believes every value and lets a client set any attribute of a widget, its callbacks
included. A message that none of our own widgets could have sent is dropped here.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import viser

from . import viser_internals

Option = TypeVar("Option", bound=str)

MAX_TEXT = 4096
"""Characters of a text field."""


_Vector = tuple[float, float, float]


class _Sent(msgspec.Struct, tag_field="type", tag=True):
    """Named and shaped as in viser."""


class ViewerCameraMessage(_Sent):
    """The camera moved."""

    wxyz: tuple[float, float, float, float]
    position: _Vector
    fov: float
    near: float
    far: float
    image_height: Annotated[int, msgspec.Meta(ge=0, le=1 << 16)]
    image_width: Annotated[int, msgspec.Meta(ge=0, le=1 << 16)]
    look_at: _Vector
    up_direction: _Vector


class GuiUpdateMessage(_Sent):
    """A widget has a new value; any other attribute of it is none of the client's business."""

    uuid: str
    updates: Annotated[
        dict[Literal["value"], Any],
        msgspec.Meta(min_length=1, max_length=1),
    ]


class CommandTriggerMessage(_Sent):
    """An entry of the command palette was chosen."""

    uuid: str


_decoder = msgspec.msgpack.Decoder(ViewerCameraMessage | GuiUpdateMessage | CommandTriggerMessage)


def sift(frame: object, server: viser.ViserServer) -> bytes | None:
    """A client's message, checked and with its value put within range, or None to drop it."""
    if not isinstance(frame, bytes):
        return None
    try:
        message = _decoder.decode(frame)
        finite = _is_finite(message)
    except (msgspec.MsgspecError, RecursionError, TypeError, UnicodeDecodeError):
        return None  # TypeError: a value of a type that is only MessagePack's
    if not finite:
        return None
    match message:
        case GuiUpdateMessage(uuid, updates):
            handle = viser_internals.find_input(server, uuid)
            value = None if handle is None else accepted_value(handle, updates["value"])
            if value is None:
                return None
            message = GuiUpdateMessage(uuid, {"value": value})
        case CommandTriggerMessage(uuid) if not viser_internals.has_command(server, uuid):
            return None
    return msgspec.msgpack.encode(message)


def accepted_value(handle: Any, value: object) -> Any | None:
    """`value` as the widget `handle` could have sent it, clamped to its range; None: impossible.

    Wrong types, NaN, infinities, unknown options, texts over MAX_TEXT (or what `set_longest` says)
    and numbers above `reach` are impossible.
    """
    current = handle.value
    if isinstance(current, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(current):
            return None
        parts = [_accepted_scalar(handle, *pair) for pair in zip(current, value, strict=True)]
        return None if None in parts else tuple(parts)
    return _accepted_scalar(handle, current, value)


def set_longest(handle: viser.GuiTextHandle, most: int) -> None:
    """Accept texts of up to `most` characters from a field."""
    handle.__dict__["longest"] = most


def set_reach(handle: viser.GuiSliderHandle[float], most: float) -> None:
    """Accept up to `most` from the box beside a slider that ends earlier."""
    handle.__dict__["reach"] = most


def clamp_number(value: object, low: float, high: float, fallback: float) -> float:
    """`value` as a float in [low, high]; `fallback` when it is not a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return fallback
    if isinstance(value, float) and not math.isfinite(value):
        return fallback
    return float(min(max(value, low), high))


def clamp_integer(value: object, low: int, high: int, fallback: int) -> int:
    """`value` as an int in [low, high], rounded; `fallback` when it is not a finite number."""
    return round(clamp_number(value, low, high, fallback))


def choose_option(value: object, options: Sequence[Option], fallback: Option) -> Option:
    """`value` when it is one of `options`, else `fallback`."""
    return next((option for option in options if option == value), fallback)


def _is_finite(message: object) -> bool:
    """Whether no number anywhere in a decoded message is NaN or infinite."""
    stack = [msgspec.to_builtins(message)]
    while stack:
        match stack.pop():
            case float(number) if not math.isfinite(number):
                return False
            case dict(parts):
                stack.extend(parts.values())
            case list(parts) | tuple(parts):
                stack.extend(parts)
    return True


def _accepted_scalar(handle: Any, current: object, value: object) -> Any | None:
    options = getattr(handle, "options", None)
    match current:
        case bool():
            return value if isinstance(value, bool) else None
        case int() | float():
            low, high = _range(handle)
            number = clamp_number(value, low, getattr(handle, "reach", high), math.nan)
            beyond = hasattr(handle, "reach") and number != value and number > low
            if math.isnan(number) or beyond:
                return None
            return round(number) if isinstance(current, int) else number
        case str() if options is not None:
            return value if value in options else None
        case str():
            longest = getattr(handle, "longest", MAX_TEXT)
            return value if isinstance(value, str) and len(value) <= longest else None
    return None


def _range(handle: Any) -> tuple[float, float]:
    if isinstance(handle, viser.GuiRgbHandle | viser.GuiRgbaHandle):
        return 0, 255
    low, high = getattr(handle, "min", None), getattr(handle, "max", None)
    limits = (-1e9 if low is None else low), (1e9 if high is None else high)
    # Vectors have one limit for each component; none of ours uses them.
    return (-1e9, 1e9) if any(isinstance(limit, tuple) for limit in limits) else limits
