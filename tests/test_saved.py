"""Sessions as files: round trips, and files that others wrote."""

import json
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from photolin.errors import InputError, OptionError
from photolin.factors import Factor
from webapp.saved import MAX_BYTES, Saved, decode_saved, encode_saved
from webapp.state import MOST_PINS, ViewState
from webapp.values import MAX_TEXT

SHAPE = (10, 20, 30)
STATE = ViewState(
    image=7,
    layer="residual",
    often="any shadow",
    method="classification",
    beside="statistical",
    T=0.1 + 0.2,
    Ts=5e-324,
    live=False,
    opacity=0.25,
    shown=frozenset({Factor.CAST, Factor.UNDEFINED}),
    outlines=True,
    patterns=True,
    theme="light",
    against="truth",
    arrangement="side by side",
    divider=0.125,
    relief=True,
    arrows=False,
    light=(0.1, -0.2),
    pixel=(19, 29),
    pins=((0, 0), (19, 29), (5, 6), (0, 1)),
    gain=3.5,
    encoding="exact (PNG)",
)
FULL = Saved(STATE, (3, 8), "hé <b>\n\0 \u2028 \U0001f600")


def given(**entries: Any) -> bytes:
    return json.dumps({"version": 1, **entries}).encode()


def test_what_is_written_is_read_back() -> None:
    for name in (f.name for f in fields(ViewState)):
        assert getattr(STATE, name) != getattr(ViewState(), name), f"{name} is at its default"
    for saved in (FULL, Saved()):
        assert decode_saved(encode_saved(saved), SHAPE) == (saved, ())


def test_writing_what_was_read_gives_the_same_bytes() -> None:
    data = encode_saved(FULL)
    assert encode_saved(decode_saved(data, SHAPE)[0]) == data


def test_half_a_character_in_notes_becomes_a_question_mark() -> None:
    saved, _ = decode_saved(encode_saved(Saved(notes="a\ud800b")), SHAPE)
    assert saved.notes == "a?b"


def test_entries_that_are_missing_or_unknown_do_not_matter() -> None:
    saved, told = decode_saved(given(state={"T": 0.3, "colour": "red"}, later=[1]), SHAPE)
    assert (saved, told) == (Saved(ViewState(T=0.3)), ())


@pytest.mark.parametrize(
    ("name", "value", "becomes"),
    [
        ("T", 7, 1.0),
        ("Ts", 1e300, np.nextafter(1, 0)),
        ("Ts", -3.0, 0.0),
        ("opacity", 1e9, 1.0),
        ("opacity", -1, 0.0),
        ("divider", 7, 1.0),
        ("pins", [[0, 0], [20, 0], [-1, 5], [3, 4], [10**30, 1], [0, 0]], ((0, 0), (3, 4))),
        ("pins", [[0, k] for k in range(9)], tuple((0, k) for k in range(MOST_PINS))),
        ("gain", 1e300, 1e6),
        ("gain", 0, 1e-3),
        ("image", 10**60, 9),
        ("image", -4, 0),
        ("pixel", [20, 0], None),
        ("pixel", [0, 30], None),
        ("pixel", [-1, 10**40], None),
    ],
)
def test_numbers_are_brought_into_their_range(name: str, value: object, becomes: object) -> None:
    saved, told = decode_saved(given(state={name: value}), SHAPE)
    assert saved == Saved(replace(ViewState(), **{name: becomes}))
    assert told == ()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("T", value) for value in ("0.1", None, True, [0.1], {}, 10**400, 0, -1)),
        *(("image", value) for value in (1.5, "1", None, False)),
        *(("layer", value) for value in ("heat", "", 3, None, "x" * 10_000, "a\nb")),
        *(("method", value) for value in ("best", 0)),
        *(("shown", value) for value in ([9], ["D"], 3, [1, None])),
        *(("pixel", value) for value in ([1], [1, 2, 3], [1.5, 2], "12", {"0": 1})),
        *(("pins", value) for value in (3, [[1, 2], [3]], [1, 2], [["1", 2]], None)),
        *(("against", value) for value in ("heat", 1)),
        *(("light", value) for value in ([1, 1], [10**300, 0], [0, "0"], None)),
        *(("live", value) for value in (1, "yes", None)),
        ("gain", "bright"),
        ("encoding", "gif"),
        *(("often", value) for value in ("never", 3, None, ["lit"])),
    ],
)
def test_an_entry_that_cannot_be_is_as_at_first_and_told(name: str, value: object) -> None:
    saved, told = decode_saved(given(state={name: value, "opacity": 0.5}), SHAPE)
    assert saved == Saved(ViewState(opacity=0.5))
    (sentence,) = told
    assert sentence.startswith(f"session: {name} is not as it can be (")
    assert "\n" not in sentence
    assert len(sentence) < 250


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("state", [1], "Expected `object`"),
        ("notes", 3, "Expected `str`"),
        ("exclusions", ["3"], "Expected `int`"),
        ("exclusions", [3, 3], "twice"),
        ("exclusions", [-1], "from 0"),
        ("exclusions", [10], "not these images"),
        ("exclusions", [10**50], "not these images"),
        ("exclusions", [0, 1, 2, 3, 4], "too few"),
    ],
)
def test_what_is_not_of_the_view_is_judged_too(name: str, value: object, words: str) -> None:
    entries = {"state": {"T": 0.3}, "notes": "kept"} | {name: value}
    saved, told = decode_saved(given(**entries), SHAPE)
    assert len(told) == 1
    assert words in told[0]
    assert saved.notes == ("" if name == "notes" else "kept")
    assert saved.state == ViewState(T=0.05 if name == "state" else 0.3)
    assert saved.exclusions == ()


def test_notes_that_are_too_long_are_cut_and_told() -> None:
    saved, told = decode_saved(given(notes="x" * 9999), SHAPE)
    assert saved.notes == "x" * MAX_TEXT
    assert told == ("session: the first 4096 characters of the notes are kept",)


def test_the_image_counts_those_that_are_left() -> None:
    saved, _ = decode_saved(given(state={"image": 9}, exclusions=[1, 2, 3]), SHAPE)
    assert saved.state.image == 6


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "cut short"),
        (encode_saved(FULL)[:-20], "cut short"),
        (b"\x00\xff\xfe", "no session of photolin"),
        (b"[1]", "no session of photolin"),
        (b'{"version":1,"state":{"T":NaN}}', "no session of photolin"),
        (b'{"version":1,"state":{"T":1e999}}', "no session of photolin"),
        (b'{"version":1,"state":{"T":Infinity}}', "no session of photolin"),
        (b'{"version":1,"notes":"\\ud800"}', "no session of photolin"),
        (b'{"version":1,"notes":' + b"[" * 200_000, "no session of photolin"),
        (b"{}", "no session of version 1"),
        (given(version=2), "no session of version 1"),
        (given(version="1"), "no session of version 1"),
        (given(version=True), "no session of version 1"),
        (given(notes="x" * MAX_BYTES), "larger than 262144 bytes"),
    ],
)
def test_what_is_no_session_is_refused_in_words(data: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        decode_saved(data, SHAPE)


def test_random_damage_never_raises_anything_else() -> None:
    rng, whole = np.random.default_rng(0), encode_saved(FULL)
    refused = 0
    for _ in range(2000):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), 3):
            data[place] = rng.integers(32, 127)
        try:
            saved, _ = decode_saved(bytes(data), SHAPE)
        except InputError:
            refused += 1
            continue
        assert saved.state.image < SHAPE[0]
        assert len(saved.state.pins) <= MOST_PINS
    assert 500 < refused < 2000


def test_no_session_holds_more_than_a_file_can() -> None:
    longest = Saved(STATE, tuple(range(5000)), "\0" * MAX_TEXT)
    assert len(encode_saved(longest)) < MAX_BYTES
    with pytest.raises(OptionError, match="notes of 4097 characters; up to 4096"):
        Saved(notes="x" * (MAX_TEXT + 1))
    with pytest.raises(OptionError, match="exclude names image 1 twice"):
        Saved(exclusions=(1, 1))


def test_no_image_is_left_out_once_there_are_more_or_fewer() -> None:
    saved = Saved(replace(STATE, image=3), exclusions=(4, 7), notes="mine")
    for count in (SHAPE[0], None):
        assert decode_saved(encode_saved(saved, count), SHAPE) == (saved, ())
    for K in (SHAPE[0] - 1, SHAPE[0] + 1):
        found, (told,) = decode_saved(encode_saved(saved, SHAPE[0]), (K, *SHAPE[1:]))
        assert (found.exclusions, found.state, found.notes) == ((), saved.state, "mine")
        assert f"of {SHAPE[0]} images, where there are {K} now" in told
        assert decode_saved(encode_saved(Saved(), SHAPE[0]), (K, *SHAPE[1:]))[1] == ()
    hostile = encode_saved(saved, SHAPE[0]).replace(b'"images": 10', b'"images": "many"')
    found, told = decode_saved(hostile, SHAPE)
    assert found == saved
    assert "images is not as it can be" in told[0]
