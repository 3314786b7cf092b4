"""The session of a stack, what the user chose, as a file: written, and read back with suspicion."""

from dataclasses import dataclass, field, replace
from math import nextafter
from typing import Any, get_type_hints

import msgspec

from photolin.errors import InputError, OptionError
from photolin.load import LoadOptions
from photolin.stack import MIN_IMAGES

from .state import MOST_PINS, ViewState
from .values import MAX_TEXT

VERSION = 1
"""Of the file's layout; files of another are not read."""
MAX_BYTES = 1 << 18
"""Of a file; far more than the longest notes take."""
RANGES: dict[str, tuple[float, float]] = {
    "T": (0.0, 1.0),
    "Ts": (0.0, nextafter(1, 0)),
    "opacity": (0.0, 1.0),
    "divider": (0.0, 1.0),
    "gain": (1e-3, 1e6),
}
"""Where numbers of a file are brought to; a T of 0 is then refused, as nothing near it is meant."""


@dataclass(frozen=True)
class Saved:
    """What a new tab needs to look like the one before."""

    state: ViewState = field(default_factory=ViewState)
    """T, Ts, method, image, layer, selected pixel, pins and how all is shown; its image counts
    those that are left."""
    exclusions: tuple[int, ...] = ()
    """Images left out, as in `LoadOptions.exclude`: numbers of the whole stack."""
    notes: str = ""
    """The user's own words, MAX_TEXT characters at most; any text."""

    def __post_init__(self) -> None:
        if len(self.notes) > MAX_TEXT:
            raise OptionError(
                f"notes of {len(self.notes)} characters; up to {MAX_TEXT} are accepted"
            )
        object.__setattr__(self, "exclusions", LoadOptions(exclude=self.exclusions).exclude)


def encode_saved(saved: Saved, count: int | None = None) -> bytes:
    """The file of a session: JSON for people to read too.

    Args:
        count: of the images of the whole stack, by which the reader tells whether their numbers
            mean the same still; None where that is not to be told.
    """
    notes = saved.notes.encode(errors="replace").decode()  # half a character is no text
    told = msgspec.to_builtins(replace(saved, notes=notes))
    entries = {"version": VERSION, "images": count, **told}
    return msgspec.json.format(msgspec.json.encode(entries), indent=1) + b"\n"


def decode_saved(data: bytes, shape: tuple[int, int, int]) -> tuple[Saved, tuple[str, ...]]:
    """The session of a file, whatever it holds.

    Numbers beyond their range are brought into it; images, pixels and pins that the stack does not
    have are dropped, as it may have changed, and so are pins beyond the most there can be. No image
    is left out where the stack had another number of them: it might be a wrong one. What else
    cannot be is as in a new session.

    Args:
        shape: (K,H,W) of the whole stack.

    Returns:
        The session, and a sentence for each entry that was not taken as it was.

    Raises:
        InputError: not a session of this version at all.
    """
    entries = _entries(data)
    told: list[str] = []

    def take(name: str, kind: Any, default: Any) -> Any:
        try:
            return msgspec.convert(entries.get(name, default), kind)
        except (msgspec.ValidationError, OverflowError) as error:
            told.append(_sentence(name, error))
            return default

    K, H, W = shape
    notes = take("notes", str, "")
    if len(notes) > MAX_TEXT:
        told.append(f"session: the first {MAX_TEXT} characters of the notes are kept")
    exclusions = take("exclusions", tuple[int, ...], ())
    try:
        exclusions = LoadOptions(exclude=exclusions).exclude
        if exclusions and (exclusions[-1] >= K or K - len(exclusions) < MIN_IMAGES):
            raise OptionError("not these images, or too few besides, are there")
        if exclusions and (count := take("images", int | None, None)) not in (None, K):
            raise OptionError(f"of {count} images, where there are {K} now")
    except OptionError as error:
        told.append(_sentence("exclusions", error))
        exclusions = ()
    state, faults = _read_state(take("state", dict, {}), (K - len(exclusions), H, W))
    return Saved(state, exclusions, notes[:MAX_TEXT]), (*told, *faults)


def _entries(data: bytes) -> dict[str, Any]:
    if len(data) > MAX_BYTES:
        raise InputError(f"is larger than {MAX_BYTES} bytes, which no session is")
    try:
        entries = msgspec.json.decode(data, type=dict[str, Any])
    except (msgspec.MsgspecError, RecursionError, ValueError) as error:
        raise InputError("is no session of photolin, or was cut short") from error
    if entries.get("version") != VERSION or isinstance(entries["version"], bool):
        raise InputError(f"is no session of version {VERSION}")
    return entries


def _read_state(
    entries: dict[str, Any], shape: tuple[int, int, int]
) -> tuple[ViewState, list[str]]:
    """Each entry of a ViewState on its own, so that a bad one costs no other."""
    K, H, W = shape
    ranges = {**RANGES, "image": (0, K - 1)}

    def inside(pixel: tuple[int, int]) -> bool:
        return 0 <= pixel[0] < H and 0 <= pixel[1] < W

    state, told = ViewState(), []
    for name, kind in get_type_hints(ViewState).items():
        if name not in entries:
            continue
        try:
            value = msgspec.convert(entries[name], kind)
            if name in ranges and value is not None:
                low, high = ranges[name]
                value = min(max(value, low), high)
            elif name == "pixel" and value is not None:
                value = value if inside(value) else None
            elif name == "pins" and value is not None:
                value = tuple(dict.fromkeys(filter(inside, value)))[:MOST_PINS]
            state = replace(state, **{name: value})
        except (msgspec.ValidationError, OptionError, OverflowError) as error:
            told.append(_sentence(name, error))
    return state, told


def _sentence(name: str, error: Exception) -> str:
    why = " ".join(str(error).split())[:120]
    return f"session: {name} is not as it can be ({why}); it is as at first"
