"""The web tool: one server, one session for each tab."""

import warnings
import webbrowser
from threading import Lock, Timer

import viser

from photolin.allocator import give_back
from photolin.errors import PhotolinError

from .access import Server, open_server
from .keeper import Keeper
from .pace import LULL
from .saved import Saved
from .selections import Selections
from .session import Session
from .source import Source
from .start import leave_out, start_from


class App:
    """Serves one stack; attaches a session to each tab and detaches it."""

    def __init__(self, source: Source, *, host: str = "127.0.0.1", port: int = 8080) -> None:
        """Start serving.

        Raises:
            PhotolinError: the host or port cannot be used, or there is nothing to show without the
                images that are to be left out at first.
        """
        self._selections = Selections(source)
        self._selections.without(source.reading.exclude)  # kept for the first tab
        self._sessions: dict[int, Session] = {}
        self._tidy = Timer(LULL, give_back)
        """Gives back the memory of tabs that were closed; not started while none was."""
        self._lock = Lock()
        self._untold: list[str] = []
        """What is to be said to the next tab, as there was none."""
        self.server: Server = open_server(host, port)
        self._keeper = Keeper(source.place, source.stack.shape, self._tell)
        self._found = self._keeper.latest
        """What an earlier program kept."""
        self.server.server.on_client_connect(self._attach)
        self.server.server.on_client_disconnect(self._detach)

    def stop(self) -> None:
        """Close all tabs and free the port."""
        with self._lock:
            sessions = list(self._sessions.values())
            self._sessions.clear()
            self._tidy.cancel()
        for session in sessions:
            session.close()
        for session in sessions:
            session.wait()
        self._keeper.close()
        self.server.stop()

    def _tell(self, sentence: str) -> None:
        """Say something of the session file in all tabs."""
        with self._lock:
            sessions = list(self._sessions.values())
            if not sessions:
                self._untold.append(sentence)
        for session in sessions:
            session.notices.say("Session", sentence, "red")

    def _attach(self, client: viser.ClientHandle) -> None:
        kept = self._keeper.latest
        if kept is None or kept is self._found:  # not set since the command line was given
            start = start_from(self._selections.source, kept)
        else:
            start = kept
        again = kept is not None
        start = self._possible(start)
        session = Session(client, self._selections, self._keeper, start, again=again)
        with self._lock:
            self._sessions[client.client_id] = session
            untold, self._untold = self._untold, []
        for sentence in untold:
            session.notices.say("Session", sentence, "red")
        if client.client_id not in self.server.server.get_clients():  # left while it was built
            self._detach(client)

    def _possible(self, start: Saved) -> Saved:
        """A start that a tab can be built from; other lights may have come that lie in a plane."""
        source = self._selections.source
        try:
            self._selections.without(start.exclusions)
        except PhotolinError as error:
            with self._lock:
                self._untold.append(f"images are not left out as they were: {error}")
            return leave_out(source, start, source.reading.exclude)
        return start

    def _detach(self, client: viser.ClientHandle) -> None:
        with self._lock:
            session = self._sessions.pop(client.client_id, None)
            if session is None:  # closed with all others
                return
            self._tidy.cancel()  # one for all tabs that are closed together
            self._tidy = Timer(LULL, give_back)
            self._tidy.daemon = True
            self._tidy.start()
        session.close()


def serve(
    source: Source,
    *,
    host: str,
    port: int,
    open_browser: bool,
) -> None:
    """Serve until Ctrl-C; opens the browser or prints the address.

    Raises:
        PhotolinError: as `App`.
    """
    # a tab may close while its worker draws; viser warns of every such message
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
    app = App(source, host=host, port=port)
    print(f"photolin: {source.stack.title} at {app.server.url} (Ctrl-C ends it)", flush=True)
    try:
        if open_browser:
            webbrowser.open(app.server.url)
        app.server.server.sleep_forever()
    finally:
        app.stop()
