"""Who may connect, and what a connected page may say: pure rules first, then raw sockets."""

import contextlib
import gzip
import inspect
import math
import socket
import time
from collections.abc import Iterator
from typing import Any
from urllib.request import Request, urlopen

import msgspec
import numpy as np
import pytest
import viser
import viser.infra._infra
import websockets.asyncio.server
from browser import encode_png, wait_until
from viser import _gui_api, _gui_handles, _messages, _viser
from websockets.sync.client import ClientConnection, connect

from photolin.errors import OptionError
from webapp import access, viser_internals
from webapp.access import (
    MAX_CLIENTS,
    SECURITY_HEADERS,
    Door,
    Server,
    open_server,
    refusal,
)
from webapp.values import (
    MAX_TEXT,
    accepted_value,
    choose_option,
    clamp_integer,
    clamp_number,
    set_longest,
)

NAN, INF = math.nan, math.inf


# --- numbers ---


@pytest.mark.parametrize("value", [NAN, INF, -INF, "1", "abc", None, [0.1], {"a": 1}, True, b"1"])
def test_what_is_no_finite_number_becomes_the_fallback(value: object) -> None:
    assert clamp_number(value, 0, 1, 0.25) == 0.25
    assert clamp_integer(value, 0, 23, 7) == 7


@pytest.mark.parametrize(("value", "expected"), [(1e300, 1), (10**400, 1), (-5, 0), (0.3, 0.3)])
def test_numbers_are_clamped_to_their_range(value: float, expected: float) -> None:
    clamped = clamp_number(value, 0, 1, 0.25)
    assert clamped == expected and isinstance(clamped, float)


def test_image_numbers_are_whole() -> None:
    assert clamp_integer(3.0, 0, 23, 7) == 3
    assert clamp_integer(1e300, 0, 23, 7) == 23
    assert isinstance(clamp_integer(2.6, 0, 23, 7), int)


def test_an_unknown_option_becomes_the_fallback() -> None:
    assert choose_option("robust", ("robust", "statistical"), "statistical") == "robust"
    for value in ("ROBUST", None, 3, ["robust"]):
        assert choose_option(value, ("robust", "statistical"), "statistical") == "statistical"


# --- who may connect: the rule ---

DOOR = Door(frozenset({"localhost", "127.0.0.1", "[::1]"}), 8080, None)
LOCKED = Door(frozenset({"lab-pc"}), 8080, "s3cret")


def asked(door: Door, path: str = "/", **headers: str | list[str]) -> str | None:
    values = {
        name.lower(): [value] if isinstance(value, str) else value
        for name, value in headers.items()
    }
    return refusal(door, values, path, "10.0.0.5" if door.token else "127.0.0.1")


@pytest.mark.parametrize(
    "host", ["localhost:8080", "127.0.0.1:8080", "[::1]:8080", "LOCALHOST:8080"]
)
def test_pages_of_this_server_are_served(host: str) -> None:
    assert asked(DOOR, Host=host) is None
    assert asked(DOOR, Host=host, Origin=f"http://{host}", Upgrade="websocket") is None


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8080", "localhost", "localhost:8081", "127.0.0.1.:8080", ""],
)
def test_a_foreign_host_is_refused_by_name(host: str) -> None:
    assert f"this server is not {host}" in (asked(DOOR, Host=host) or "")


def test_no_host_or_two_hosts_are_refused() -> None:
    assert asked(DOOR) is not None
    assert asked(DOOR, Host=["localhost:8080", "localhost:8080"]) is not None


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "http://localhost:8081",
        "https://localhost:8080",
        "http://127.0.0.1:8080",
        "http://localhost:8080.evil.example",
    ],
)
def test_a_page_of_another_origin_is_refused(origin: str) -> None:
    for more in ({}, {"Upgrade": "websocket"}):
        reason = asked(DOOR, Host="localhost:8080", Origin=origin, **more)
        assert reason == f"the page {origin} is not part of this server"


def test_a_websocket_without_origin_is_refused() -> None:
    assert "Origin" in (asked(DOOR, Host="localhost:8080", Upgrade="websocket") or "")


@pytest.mark.parametrize(
    ("path", "cookie", "admitted"),
    [
        ("/?token=s3cret", "", True),
        ("/", "photolin-8080=s3cret", True),
        ("/", "other=1; photolin-8080=s3cret", True),
        ("/", "", False),
        ("/?token=", "", False),
        ("/?token=wrong", "photolin-8080=wrong", False),
        ("/?token=s3c", "photolin-8080=s3cre", False),
        ("/?token=s3cretly", "photolin-8080=s3cret1", False),
        ("/", "photolin-8081=s3cret", False),
        ("/", "][;=", False),
        ("/?token=s%C3%A9cret", "", False),
    ],
)
def test_beyond_loopback_the_token_is_needed(path: str, cookie: str, admitted: bool) -> None:
    for host in ("lab-pc:8080", "10.0.0.5:8080"):
        for more in ({}, {"Upgrade": "websocket", "Origin": f"http://{host}"}):
            reason = asked(LOCKED, path, Host=host, Cookie=cookie, **more)
            assert (reason is None) == admitted
            assert admitted or "token" in (reason or "")


# --- host and port ---


def test_a_busy_port_is_one_sentence_and_no_other_port() -> None:
    with socket.socket() as busy:
        busy.bind(("127.0.0.1", 0))
        busy.listen()
        port = busy.getsockname()[1]
        with pytest.raises(OptionError, match=rf"127\.0\.0\.1:{port} .*another --port"):
            open_server(port=port)


@pytest.mark.parametrize("host", ["203.0.113.7", "", "not a host"])
def test_an_unusable_host_is_one_sentence_and_no_hang(host: str) -> None:
    started = time.monotonic()
    with pytest.raises(OptionError, match=f"{host}.*127.0.0.1"):
        open_server(host=host, port=0)
    assert time.monotonic() - started < 5


@pytest.mark.parametrize("port", [-1, 65536])
def test_a_port_out_of_range_is_named(port: int) -> None:
    with pytest.raises(OptionError, match=f"port {port} .*1 to 65535"):
        open_server(port=port)


def test_the_port_is_the_one_asked_for_whatever_the_environment_says(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "1")
    server = open_server(port=port)
    assert server.url == f"http://127.0.0.1:{port}/" and server.server.get_port() == port
    server.stop()
    server.stop()
    assert capfd.readouterr() == ("", "")
    open_server(port=port).stop()


def test_every_address_but_loopback_gets_a_random_token() -> None:
    tokens = set()
    for _ in range(2):
        server = open_server(host="0.0.0.0", port=0)
        assert server.token is not None and server.url.endswith(f"/?token={server.token}")
        assert len(server.token) >= 32
        tokens.add(server.token)
        server.stop()
    assert len(tokens) == 2


# --- raw sockets ---

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0, 0, 0],
    "position": [0, 0, -10],
    "fov": 0.5,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 900,
    "image_width": 1116,
    "look_at": [0, 0, 0],
    "up_direction": [0, -1, 0],
}


class App:
    """A server with one slider, number, menu, text and button for each client."""

    def __init__(self, server: Server) -> None:
        self.server = server
        self.port = server.server.get_port()
        self.widgets: dict[int, dict[str, Any]] = {}
        self.seen: list[tuple[int, str, object]] = []
        server.server.on_client_connect(self.connect)
        server.server.on_client_disconnect(lambda client: self.widgets.pop(client.client_id))

    async def connect(self, client: viser.ClientHandle) -> None:
        gui = client.gui
        widgets = {
            "T": gui.add_slider("T", 0.0, 1.0, 0.01, 0.5),
            "image": gui.add_slider("Image", 0, 23, 1, 3),
            "Ts": gui.add_number("Ts", 0.02, min=0.0, max=1.0),
            "layer": gui.add_dropdown("Layer", ("input", "labels")),
            "show": gui.add_checkbox("Show", True),
            "note": gui.add_text("Note", ""),
            "range": gui.add_multi_slider("Range", 0.0, 1.0, 0.1, (0.2, 0.8)),
            "run": gui.add_button("Run"),
        }
        for name, widget in widgets.items():
            # The widget's callbacks are typed one by one.
            async def updated(event: Any, name: str = name) -> None:
                self.seen.append((event.client_id, name, event.target.value))

            widget.on_update(updated) if name != "run" else widget.on_click(updated)
        self.widgets[client.client_id] = widgets


class Tab:
    """A client that speaks viser's protocol without a browser."""

    def __init__(self, app: App, **options: Any) -> None:
        self.app = app
        before = set(app.widgets)
        self.connection: ClientConnection = connect(
            f"ws://127.0.0.1:{app.port}{options.pop('path', '')}",
            origin=options.pop("origin", f"http://127.0.0.1:{app.port}"),
            subprotocols=[viser_internals.SUBPROTOCOL],  # pyright: ignore[reportArgumentType]
            compression=None,
            max_size=None,
            **options,
        )
        self.say(CAMERA)
        wait_until(lambda: len(set(app.widgets) - before) == 1)
        (self.id,) = set(app.widgets) - before
        self.widgets = app.widgets[self.id]

    def say(self, message: object) -> None:
        self.connection.send(msgspec.msgpack.encode(message))

    def update(self, name: str, **attributes: object) -> None:
        uuid = viser_internals.widget_id(self.widgets[name])
        self.say({"type": "GuiUpdateMessage", "uuid": uuid, "updates": attributes})

    def works(self) -> bool:
        """Whether a new value still comes through; messages before it have been handled then."""
        wanted = "works" if self.widgets["note"].value != "works" else "still works"
        self.update("note", value=wanted)
        wait_until(lambda: (self.id, "note", wanted) in self.app.seen)
        return True

    def close(self) -> None:
        self.connection.close()


@pytest.fixture
def app() -> Iterator[App]:
    server = open_server(port=0)
    yield App(server)
    server.stop()


@pytest.fixture
def tab(app: App) -> Iterator[Tab]:
    with contextlib.closing(Tab(app)) as opened:
        yield opened


def raw_request(port: int, *lines: str) -> tuple[int, str]:
    """Status and body of a request written byte by byte."""
    with socket.create_connection(("127.0.0.1", port), timeout=5) as raw:
        raw.sendall("\r\n".join([*lines, "", ""]).encode())
        answer = b""
        while chunk := raw.recv(65536):
            answer += chunk
    head, _, body = answer.partition(b"\r\n\r\n")
    return int(head.split()[1]), body.decode(errors="replace")


UPGRADE = (
    "GET / HTTP/1.1",
    "Upgrade: websocket",
    "Connection: Upgrade",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    f"Sec-WebSocket-Protocol: {viser_internals.SUBPROTOCOL}",
)


def test_foreign_pages_and_hosts_get_403_and_a_reason(app: App, tab: Tab) -> None:
    own = f"127.0.0.1:{app.port}"
    for first in (UPGRADE, ("GET / HTTP/1.1",)):
        for host, origin in ((own, "http://evil.example"), ("evil.example", f"http://{own}")):
            status, body = raw_request(app.port, *first, f"Host: {host}", f"Origin: {origin}")
            assert status == 403 and "evil.example" in body
    assert raw_request(app.port, *UPGRADE, f"Host: {own}")[0] == 403
    assert raw_request(app.port, "GET /../../etc/passwd HTTP/1.1", f"Host: {own}")[0] == 404
    assert tab.works()


def test_the_page_is_ours_and_carries_security_headers(app: App) -> None:
    for coding in ("identity", "gzip"):
        request = Request(app.server.url, headers={"Accept-Encoding": coding})
        with urlopen(request) as answer:
            body = answer.read()
            assert answer.headers["Content-Encoding"] == coding
            assert SECURITY_HEADERS.items() <= dict(answer.headers).items()
            assert "Set-Cookie" not in answer.headers
        page = gzip.decompress(body) if coding == "gzip" else body
        assert page.count(b"<title>photolin</title>") == 1
        assert viser_internals.PAGE_TITLE not in page


def test_beyond_loopback_a_websocket_needs_the_token_or_its_cookie() -> None:
    server = open_server(host="0.0.0.0", port=0)
    app = App(server)
    own = f"127.0.0.1:{app.port}"
    lines = (*UPGRADE, f"Host: {own}", f"Origin: http://{own}")
    for cookie in ("", f"Cookie: photolin-{app.port}=wrong"):
        status, body = raw_request(app.port, *lines, *filter(None, [cookie]))
        assert status == 403 and "token" in body
    head = f"Cookie: photolin-{app.port}={server.token}"
    cookie = dict([head.split(": ")])
    for options in ({"additional_headers": cookie}, {"path": f"/?token={server.token}"}):
        with contextlib.closing(Tab(app, **options)) as opened:
            assert opened.works()
    server.stop()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("T", value) for value in (NAN, INF, "abc", None, [0.3], {}, True, b"1", "0.7")],
        *[("image", value) for value in (NAN, "12", None, [1])],
        *[("layer", value) for value in ("secret", 1, None, ["input"])],
        *[("show", value) for value in (0, "no", None)],
        *[("note", value) for value in (1, None, "x" * (MAX_TEXT + 1), ["x"])],
        *[("range", value) for value in ([0.1], [0.1, NAN], [0.1, "x"], 0.5, "01", None)],
        *[("run", value) for value in (1, "yes", None)],
    ],
)
def test_a_value_of_the_wrong_kind_changes_nothing(
    app: App, tab: Tab, name: str, value: object
) -> None:
    tab.update(name, value=value)
    assert tab.works()
    assert app.seen == [(tab.id, "note", "works")]


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("T", 1e300, 1.0),
        ("T", -3, 0.0),
        ("T", 0.3, 0.3),
        ("image", 9999, 23),
        ("image", -5, 0),
        ("image", 7.0, 7),
        ("Ts", 10**18, 1.0),
        ("layer", "labels", "labels"),
        ("show", False, False),
        ("range", [-1, 5], (0.0, 1.0)),
        ("run", True, True),
    ],
)
def test_a_value_of_the_right_kind_arrives_within_its_range(
    app: App, tab: Tab, name: str, value: object, expected: object
) -> None:
    tab.update(name, value=value)
    assert tab.works()
    assert app.seen[0] == (tab.id, name, expected)
    assert type(app.seen[0][2]) is type(expected)


@pytest.mark.parametrize(
    "attribute", ["update_cb", "sync_cb", "removed", "props", "uuid", "gui_api"]
)
def test_no_client_can_touch_more_of_a_widget_than_its_value(
    app: App, tab: Tab, attribute: str
) -> None:
    tab.update("T", **{attribute: []})
    tab.update("T", value=0.9, **{attribute: []})
    tab.update("T", value=0.6)
    assert tab.works()
    assert [seen for seen in app.seen if seen[1] == "T"] == [(tab.id, "T", 0.6)]


def test_garbage_and_forbidden_messages_disturb_no_one(
    app: App, tab: Tab, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shared: list[str] = []
    monkeypatch.setattr(
        viser.ViserServer, "request_share_url", lambda *_, **__: shared.append("tunnel")
    )
    uuid = viser_internals.widget_id(tab.widgets["T"])
    with contextlib.closing(Tab(app)) as hostile:
        for frame in (b"", b"\xc1garbage", b"\x91" * 100_000, b"\x80", "text", "\x00"):
            hostile.connection.send(frame)
        for message in (
            {"type": "ShareUrlRequest"},
            {"type": "ShareUrlDisconnect"},
            {"type": "NoSuchMessage"},
            {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": 0.9}},
            {"type": "GuiUpdateMessage", "uuid": "unknown", "updates": {"value": 1}},
            {"type": "GuiUpdateMessage", "uuid": uuid},
            {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {}},
            {"type": "RunJavascriptMessage", "source": "alert(1)"},
            {"type": "FileTransferStartUpload", "source_component_uuid": uuid},
            {"type": "CommandTriggerMessage", "uuid": "unknown"},
            {**CAMERA, "fov": NAN},
            {**CAMERA, "position": [0, 0]},
            {**CAMERA, "image_height": 10**12},
            {**CAMERA, "extra": 1},
            {
                "type": "GuiUpdateMessage",
                "uuid": uuid,
                "updates": {"value": msgspec.msgpack.Ext(5, b"")},
            },
        ):
            hostile.say(message)
        assert hostile.works()
    assert tab.works()
    assert tab.widgets["T"].value == 0.5
    assert shared == []
    assert capfd.readouterr().err == ""


def test_a_flood_from_one_client_slows_that_client_alone(app: App, tab: Tab) -> None:
    with contextlib.closing(Tab(app)) as flooding:
        for number in range(2000):
            flooding.update("note", value=str(number))
        asked = time.perf_counter()
        assert tab.works()
        assert (flooding.id, "note", "1999") not in app.seen
        assert time.perf_counter() - asked < 2000 / access.RATE / 4


def test_a_message_over_the_limit_ends_only_its_own_connection(app: App, tab: Tab) -> None:
    hostile = Tab(app)
    with contextlib.suppress(Exception):  # closed while we are still sending
        hostile.connection.send(b"\x00" * (2 << 20))
    wait_until(lambda: hostile.id not in app.widgets)
    hostile.close()
    assert tab.works()


def test_one_tab_more_than_the_limit_is_refused_until_another_closes(app: App) -> None:
    own = f"127.0.0.1:{app.port}"
    lines = (*UPGRADE, f"Host: {own}", f"Origin: http://{own}")
    tabs = [Tab(app) for _ in range(MAX_CLIENTS)]
    status, body = raw_request(app.port, *lines)
    assert status == 503 and f"{MAX_CLIENTS} tabs" in body
    tabs.pop().close()
    wait_until(lambda: len(app.widgets) == MAX_CLIENTS - 1)
    tabs.append(Tab(app))
    assert all(tab.works() for tab in tabs)
    for tab in tabs:
        tab.close()


# --- private names of viser ---


def test_viser_is_the_series_whose_private_names_are_used() -> None:
    assert viser.__version__.startswith(viser_internals.VISER_SERIES), (
        "read webapp/viser_internals.py against the new viser, then change VISER_SERIES"
    )


def test_the_private_names_of_viser_still_mean_the_same() -> None:
    worker = inspect.getsource(viser.infra._infra.WebsockServer._background_worker)
    assert "websockets.asyncio.server.serve(" in worker
    assert all(name in worker for name in ("process_request=", "max_size=", "self._port = "))
    assert "websocket.recv()" in inspect.getsource(viser.infra._infra._message_consumer)
    assert callable(viser.infra._infra.WebsockServer.unregister_handler)
    assert "self._websock_server = server" in inspect.getsource(_viser.ViserServer.__init__)
    registered = inspect.getsource(_gui_api.GuiApi.__init__)
    for name in ("_websock_interface", "_gui_input_handle_from_uuid", "_command_handle_from_uuid"):
        assert f"self.{name}" in registered
    assert _messages.RunJavascriptMessage("1").source == "1"
    assert {"_format", "_data"} <= set(_messages.ImageProps.__annotations__)
    assert "uuid" in _gui_handles._GuiHandleState.__annotations__
    assert inspect.signature(websockets.asyncio.server.serve.__init__).parameters.keys() >= {
        "process_request",
        "create_connection",
        "max_size",
    }


def test_the_same_bytes_are_sent_once(app: App, tab: Tab, monkeypatch: pytest.MonkeyPatch) -> None:
    client = app.server.server.get_clients()[tab.id]
    handle = client.scene.add_image("/picture", np.zeros((1, 1, 3), np.uint8), 1.0, 1.0)
    sent: list[str] = []
    monkeypatch.setattr(type(handle), "_queue_update", lambda _, name, __: sent.append(name))
    for _ in range(2):
        viser_internals.set_encoded(handle, encode_png(np.ones((2, 2, 3), np.uint8)), "png")
    assert sent == ["_format", "_data"]
    assert handle._data.startswith(b"\x89PNG")


def test_a_text_field_takes_as_many_characters_as_it_was_told_to() -> None:
    server = open_server(port=0)
    notes, lines = (server.server.gui.add_text(name, "") for name in ("notes", "lines"))
    set_longest(lines, MAX_TEXT + 5)
    for handle, longest in ((notes, MAX_TEXT), (lines, MAX_TEXT + 5)):
        assert accepted_value(handle, "x" * longest) == "x" * longest
        assert accepted_value(handle, "x" * (longest + 1)) is None
    server.stop()
