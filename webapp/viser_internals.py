"""The one module that touches private names of viser (pinned to 1.1.x).

Each function names what it relies on; `tests/test_access.py` fails when one of them changes.
"""

import contextlib
import io
import json
import threading
from collections.abc import Callable, Iterator
from socket import socket
from typing import Any, Literal

import viser
import websockets.asyncio.server
from viser import _messages
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

VISER_SERIES = "1.1."
SUBPROTOCOL = f"viser-v{viser.__version__}"
"""What the client asks for when it opens its WebSocket."""
PAGE_TITLE = b"<title>Viser</title>"
"""Occurs once in the page that viser serves."""

Answer = Callable[[ServerConnection, Request], Response | None]
_starting = threading.Lock()


def start_server(
    listening: socket,
    guard: Callable[[Answer], Answer],
    connection: type[ServerConnection],
    max_message: int,
) -> viser.ViserServer:
    """Start viser on a socket that is already listening, behind `guard`.

    viser hard-codes the arguments of `websockets.serve`, so that call alone is wrapped while the
    server starts: `guard` gets viser's own answer to a request and returns the one to use,
    `connection` makes the connections, `max_message` is in bytes. The socket decides host and
    port, hence neither another port nor _VISER_PORT_OVERRIDE can be used.
    """
    serve = websockets.asyncio.server.serve

    def serve_guarded(handler: Any, host: str, port: int, **options: Any) -> Any:
        options["process_request"] = guard(options["process_request"])
        options["max_size"] = max_message
        return serve(handler, sock=listening, create_connection=connection, **options)

    host, port = listening.getsockname()[:2]
    with _starting, silent():
        websockets.asyncio.server.serve = serve_guarded
        try:
            server = viser.ViserServer(host=host, port=port, verbose=False)
        finally:
            websockets.asyncio.server.serve = serve
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    return server


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """viser prints a banner and a farewell whatever `verbose` says."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield


def find_input(server: viser.ViserServer, uuid: str) -> Any | None:
    """The handle of an input widget of any client, or None."""
    for owner in (server, *server.get_clients().values()):
        if (handle := owner.gui._gui_input_handle_from_uuid.get(uuid)) is not None:
            return handle
    return None


def widget_id(handle: Any) -> str:
    """The name under which the page and the server speak of a widget."""
    return handle._impl.uuid


def button_hints(client: viser.ClientHandle) -> dict[str, str]:
    """Name and hint of each button that has one; viser's page shows those of other widgets only."""
    handles = client.gui._gui_input_handle_from_uuid.values()
    buttons = (handle for handle in handles if isinstance(handle, viser.GuiButtonHandle))
    return {handle._impl.uuid: handle.hint for handle in buttons if handle.hint is not None}


def has_command(server: viser.ViserServer, uuid: str) -> bool:
    """Whether `uuid` is an entry of a command palette."""
    owners = (server, *server.get_clients().values())
    return any(uuid in owner.gui._command_handle_from_uuid for owner in owners)


def run_javascript(client: viser.ClientHandle, source: str) -> None:
    """Run `source` as the body of a function in the client's page, after earlier messages."""
    message = _messages.RunJavascriptMessage(source)
    client.gui._websock_interface.queue_message(message)


def call_javascript(client: viser.ClientHandle, function: str, *arguments: object) -> None:
    """Call a global function of the client's page with arguments sent as JSON."""
    run_javascript(client, f"{function}({', '.join(map(json.dumps, arguments))})")


def set_encoded(
    handle: viser.ImageHandle, encoded: bytes, image_format: Literal["jpeg", "png"]
) -> None:
    """Show bytes that are already encoded; the same bytes again are not sent."""
    handle._format = image_format
    handle._data = encoded
