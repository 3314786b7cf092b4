"""The web tool: one server, one session for each tab."""

import warnings
import webbrowser
from threading import Lock

import viser

from photolin.analysis import Analysis, Options
from photolin.export import result_files
from photolin.stack import ImageStack

from .access import Server, open_server
from .downloads import Pack
from .runs import Runs
from .session import Session


class App:
    """Serves one stack; attaches a session to each tab and detaches it."""

    def __init__(
        self,
        stack: ImageStack,
        result: Analysis | None = None,
        *,
        options: Options | None = None,
        pack: Pack = result_files,
        host: str = "127.0.0.1",
        port: int = 8080,
    ) -> None:
        """Start serving; `result` is shown at once, otherwise the first tab computes by `options`.

        `pack` gives the files of a result that a tab downloads.

        Raises:
            OptionError: the host or port cannot be used.
        """
        self._runs = Runs(stack, options or Options(), result)
        self._pack = pack
        self._sessions: dict[int, Session] = {}
        self._lock = Lock()
        self.server: Server = open_server(host, port)
        self.server.server.on_client_connect(self._attach)
        self.server.server.on_client_disconnect(self._detach)

    def stop(self) -> None:
        """Close all tabs and free the port."""
        with self._lock:
            sessions = list(self._sessions.values())
            self._sessions.clear()
        for session in sessions:
            session.close()
        self.server.stop()

    def _attach(self, client: viser.ClientHandle) -> None:
        session = Session(client, self._runs, self._pack)
        with self._lock:
            self._sessions[client.client_id] = session
        if client.client_id not in self.server.server.get_clients():  # left while it was built
            self._detach(client)

    def _detach(self, client: viser.ClientHandle) -> None:
        with self._lock:
            session = self._sessions.pop(client.client_id, None)
        if session is not None:
            session.close()


def serve(
    stack: ImageStack,
    result: Analysis | None,
    *,
    options: Options,
    pack: Pack,
    host: str,
    port: int,
    open_browser: bool,
) -> None:
    """Serve until Ctrl-C; opens the browser or prints the address.

    Raises:
        OptionError: the host or port cannot be used.
    """
    # a tab may close while its worker draws; viser warns of every such message
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
    app = App(stack, result, options=options, pack=pack, host=host, port=port)
    print(f"photolin: {stack.title} at {app.server.url} (Ctrl-C ends it)", flush=True)
    try:
        if open_browser:
            webbrowser.open(app.server.url)
        app.server.server.sleep_forever()
    finally:
        app.stop()
