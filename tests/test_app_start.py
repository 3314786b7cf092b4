"""Tabs without a picture: how they begin, with exclusions that cannot be too, and how they end."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from browser import wait_until
from test_access import CAMERA
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from photolin.analysis import Options
from photolin.errors import Cancelled, OptionError
from photolin.load import LoadOptions
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.runs import Runs
from webapp.saved import Saved, decode_saved, encode_saved
from webapp.session import Session
from webapp.source import Source
from webapp.viser_internals import SUBPROTOCOL

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STACK = render_scene("sphere_cone", size=(24, 32), images=8).stack
OPTIONS = Options(T=0.05, Ts=0.02, samples=50)


def nearly_flat() -> ImageStack:
    """Without image 7 all lights lie in one plane."""
    angles = np.linspace(0.1, 1.2, 8)
    lights = np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    lights[7] = 0, 0.6, 0.8
    return replace(STACK, lights=lights)


@contextmanager
def open_tab(app: App) -> Iterator[Session]:
    """A page that takes whatever is sent, until it is left."""
    address, before = app.server.url.rstrip("/"), set(app._sessions)
    with connect(
        address.replace("http", "ws"),
        origin=Origin(address),
        subprotocols=[Subprotocol(SUBPROTOCOL)],
        max_size=None,
    ) as socket:
        socket.send(msgspec.msgpack.encode(CAMERA))
        threading.Thread(target=drain, args=(socket,), daemon=True).start()
        wait_until(lambda: bool(set(app._sessions) - before))
        (number,) = set(app._sessions) - before
        yield app._sessions[number]
    wait_until(lambda: number not in app._sessions)


def drain(socket: Any) -> None:
    try:
        for _ in socket:
            pass
    except ConnectionClosed:
        pass


def test_images_that_are_not_there_are_refused_before_a_page_is_served() -> None:
    with pytest.raises(OptionError, match="exclude is 99"):
        App(Source(STACK, None, OPTIONS, reading=LoadOptions(exclude=(99,))), port=0)


def test_a_session_whose_exclusions_cannot_be_any_more_opens_without_them(tmp_path: Path) -> None:
    place = tmp_path / "session.json"
    place.write_bytes(encode_saved(Saved(exclusions=(7,), notes="mine")))
    app = App(Source(nearly_flat(), None, OPTIONS, place=place), port=0)
    try:
        with open_tab(app) as session:
            assert session._bench.runs.excluded == ()
            assert session._panels.notes.read() == "mine"
    finally:
        app.stop()


def rested(session: Session) -> bool:
    """Whether the tab knows what it shows, and has kept it."""
    return session._record.latest is not None and session._record.latest.state == session._read()


def test_what_is_done_just_before_a_tab_is_closed_is_kept() -> None:
    app = App(Source(STACK, None, OPTIONS), port=0)
    try:
        with open_tab(app) as session:
            wait_until(lambda: rested(session), 60)
            session._panels.press("]")
            session._panels.notes._notes.value = "the last word"
            last = session._read()
        wait_until(lambda: app._keeper.latest is not None)
        assert app._keeper.latest == Saved(last, (), "the last word")
    finally:
        app.stop()


def test_what_is_done_just_before_the_end_is_in_the_file(tmp_path: Path) -> None:
    place = tmp_path / "session.json"
    app = App(Source(STACK, None, OPTIONS, place=place), port=0)
    with open_tab(app) as session:
        wait_until(lambda: rested(session), 60)
        session._panels.press("]")
        last = session._read()
        app.stop()
    assert decode_saved(place.read_bytes(), STACK.shape)[0].state == last


def test_what_is_left_out_is_kept_though_its_run_is_cancelled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app = App(Source(STACK, None, OPTIONS), port=0)
    try:
        with open_tab(app) as session:
            wait_until(lambda: rested(session), 60)

            def cancel(*asked: object) -> None:
                raise Cancelled("as asked")

            monkeypatch.setattr(Runs, "run", cancel)
            session._exclude(3)
            wait_until(lambda: session._bench.runs.excluded == (3,))
            session._panels.notes._notes.value = "image 3 is blurred"
            wait_until(lambda: app._keeper.latest is not None)
            assert app._keeper.latest is not None
            wait_until(lambda: "blurred" in getattr(app._keeper.latest, "notes", ""))
            assert app._keeper.latest.exclusions == (3,)
    finally:
        app.stop()
