"""What a server does with exclusions that cannot be, before and when a tab is opened."""

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
from photolin.errors import OptionError
from photolin.load import LoadOptions
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.saved import Saved, encode_saved
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
