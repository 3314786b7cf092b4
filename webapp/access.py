"""Who may connect.

viser by itself admits any page open in the user's browser. Here a request is answered only when
its Host and Origin are this server's own and, beyond loopback, when it carries the token; what a
connected page may say is in `values`.
"""

import asyncio
import atexit
import errno
import functools
import gzip
import hmac
import ipaddress
import secrets
import socket
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import viser
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from photolin.errors import OptionError

from . import viser_internals
from .values import sift
from .viser_internals import Answer

MAX_CLIENTS = 16
"""Tabs connected at the same time; the next one is refused with 503."""
MAX_MESSAGE = 1 << 20
"""Bytes a client may send in one message."""
RATE = 250.0
"""Messages a second that are read from one client; a page sends 100 at the most. The rest waits in
its own connection, because all tabs share one event loop."""
BURST = 250.0
"""Messages that may come at once after a rest."""

SECURITY_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    # viser's client is one page of inline script that starts workers from blobs.
    "Content-Security-Policy": (
        "default-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
}


@dataclass(frozen=True)
class Door:
    """What a request must carry to be let in."""

    hosts: frozenset[str]
    """Host names of this server, lower case, without port; an IPv6 address in brackets."""
    port: int
    token: str | None
    """Needed in the address or in the cookie; None: not needed."""

    @property
    def cookie(self) -> str:
        """Name of the cookie; browsers do not keep the cookies of two ports apart."""
        return f"photolin-{self.port}"


@dataclass(frozen=True)
class Server:
    """A running web server."""

    server: viser.ViserServer
    url: str
    """The address to open, with the token when one is needed."""
    token: str | None

    def stop(self) -> None:
        """Close every connection and free the port; harmless the second time."""
        atexit.unregister(self.stop)
        with viser_internals.silent():
            self.server.stop()


def open_server(host: str = "127.0.0.1", port: int = 8080, token: str | None = None) -> Server:
    """Start the web server on exactly this host and port (0: any free one).

    A host other than loopback gets a random token unless one is given.
    Raises OptionError when the host or port cannot be used.
    """
    listening = _listen(host, port)
    address, bound_port = listening.getsockname()[:2]
    loopback = ipaddress.ip_address(address).is_loopback
    if token is None and not loopback:
        token = secrets.token_urlsafe(24)
    door = Door(_host_names(host, address), bound_port, token)
    running: list[viser.ViserServer] = []

    class Connection(ServerConnection):
        """Hands on only what one of our own widgets could have sent, and not faster than RATE."""

        _paid = 0.0

        async def recv(self, decode: bool | None = None) -> Any:
            while True:
                frame = await super().recv(decode)
                now = asyncio.get_running_loop().time()
                self._paid = max(self._paid, now - BURST / RATE) + 1 / RATE
                await asyncio.sleep(max(0.0, self._paid - now))
                while not running:  # the constructor of viser has not returned yet
                    await asyncio.sleep(0.01)
                if (message := sift(frame, running[0])) is not None:
                    return message

    guard = functools.partial(_guarded, door)
    server = viser_internals.start_server(listening, guard, Connection, MAX_MESSAGE)
    running.append(server)
    atexit.unregister(server.stop)
    result = Server(server, _address(host, address, door), token)
    atexit.register(result.stop)
    return result


def refusal(
    door: Door, headers: Mapping[str, Sequence[str]], path: str, local_host: str
) -> str | None:
    """Why a request is refused, or None.

    `headers` has lower-case names with all their values; `local_host` is the address of this
    machine that the request reached.
    """
    hosts = headers.get("host", ())
    names = {*door.hosts, local_host}
    own = {f"{name}:{door.port}" for name in names} | (names if door.port == 80 else set())
    if len(hosts) != 1 or hosts[0].lower() not in own:
        return f"this server is not {', '.join(hosts) or 'without a name'}"
    origins = headers.get("origin", ())
    if "upgrade" in headers and len(origins) != 1:
        return "a WebSocket must say which page opens it (Origin)"
    if any(origin.lower() != f"http://{hosts[0].lower()}" for origin in origins):
        return f"the page {', '.join(origins)} is not part of this server"
    if door.token is not None and not _shows_token(door, headers, path):
        return "open the complete address that photolin printed, with its token"
    return None


def _listen(host: str, port: int) -> socket.socket:
    """A listening socket on exactly this host and port."""
    if not 0 <= port <= 65535:
        raise OptionError(
            f"port {port} cannot be used: give a number from 1 to 65535, or 0 for any"
        )
    unknown = f"host {host!r} is not known here: give 127.0.0.1 or an address of this machine"
    if not host:
        raise OptionError(unknown)
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise OptionError(unknown) from error
    family, _, _, _, address = min(found, key=lambda entry: entry[0] != socket.AF_INET)
    listening = socket.socket(family, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen()
    except OSError as error:
        listening.close()
        raise OptionError(_unusable(host, port, error)) from error
    listening.setblocking(False)
    return listening


def _unusable(host: str, port: int, error: OSError) -> str:
    remedy = {
        errno.EADDRINUSE: "stop the program that uses it or give another --port",
        errno.EACCES: "give a --port of 1024 or above",
    }.get(error.errno or 0, "give --host 127.0.0.1 or another address of this machine")
    return f"cannot listen on {host}:{port} ({error.strerror}): {remedy}"


def _host_names(host: str, address: str) -> frozenset[str]:
    bound = ipaddress.ip_address(address)
    names = {host.lower(), _bracketed(address)}
    if bound.is_loopback or bound.is_unspecified:
        names |= {"localhost", "127.0.0.1", "[::1]"}
    if not bound.is_loopback:
        names.add(socket.gethostname().lower())
    return frozenset(names)


def _bracketed(address: str) -> str:
    return f"[{address}]" if ":" in address else address


def _address(host: str, address: str, door: Door) -> str:
    """The address to print: by name when bound to all addresses, else as bound."""
    wildcard = ipaddress.ip_address(address).is_unspecified
    name = socket.gethostname() if wildcard else _bracketed(address)
    return f"http://{name}:{door.port}/" + (f"?token={door.token}" if door.token else "")


def _shows_token(door: Door, headers: Mapping[str, Sequence[str]], path: str) -> bool:
    shown = parse_qs(urlsplit(path).query).get("token", [])
    for line in headers.get("cookie", ()):
        try:
            cookies = SimpleCookie(line)
        except CookieError:
            continue
        shown += [cookies[door.cookie].value] if door.cookie in cookies else []
    expected = (door.token or "").encode()
    return any(hmac.compare_digest(given.encode(), expected) for given in shown)


def _guarded(door: Door, answer: Answer) -> Answer:
    """viser's own `answer` to a request, given only to those who may have it."""

    def process_request(connection: ServerConnection, request: Request) -> Response | None:
        headers = {name.lower(): request.headers.get_all(name) for name in request.headers}
        local_host = _bracketed(connection.local_address[0])
        if (reason := refusal(door, headers, request.path, local_host)) is not None:
            return _secured(connection.respond(HTTPStatus.FORBIDDEN, f"Refused: {reason}.\n"))
        if "upgrade" in headers and len(connection.server.connections) >= MAX_CLIENTS:
            text = f"Refused: {MAX_CLIENTS} tabs are open already; close one.\n"
            return _secured(connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, text))
        response = answer(connection, request)
        if response is not None:
            _title(response)
            if door.token is not None:
                response.headers["Set-Cookie"] = (
                    f"{door.cookie}={door.token}; Path=/; HttpOnly; SameSite=Strict"
                )
            _secured(response)
        return response

    return process_request


def _secured(response: Response) -> Response:
    for name, value in SECURITY_HEADERS.items():
        response.headers[name] = value
    return response


def _title(response: Response) -> None:
    """Name the page after this program."""
    if response.headers.get("Content-Type", "").startswith("text/html") and response.body:
        zipped = response.headers.get("Content-Encoding") == "gzip"
        response.body = _titled(bytes(response.body), zipped)
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))


@functools.cache
def _titled(page: bytes, zipped: bool) -> bytes:
    page = gzip.decompress(page) if zipped else page
    page = page.replace(viser_internals.PAGE_TITLE, b"<title>photolin</title>")
    return gzip.compress(page, mtime=0) if zipped else page
