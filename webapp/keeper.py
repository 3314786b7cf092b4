"""The file of a session: where it is, reading it once, writing it as the session changes.

One `Keeper` serves all tabs of a stack. Tabs do not share a session while they are open: each
keeps all of its own, so the file holds that of the tab that changed last, whole, and a new tab
starts from it. Two programs that look at one stack overwrite each other's file likewise.
"""

from collections.abc import Callable
from pathlib import Path
from threading import Condition, Lock, Thread

from photolin.errors import InputError, OutputError
from photolin.export import is_result, write_files

from .saved import MAX_BYTES, Saved, decode_saved, encode_saved

NAME = "photolin_session.json"
PERIOD = 2.0
"""Seconds between two writings, at least."""

_writing = Lock()  # temporary names are one for each program


def saved_place(path: str | Path) -> Path:
    """Where the session of a stack or a result is kept; no loader takes that file for an image.

    In the folder of images or of the result, or beside the file and named after it.
    """
    path = Path(path)
    if path.is_dir():
        return path / NAME
    return path.with_name(NAME if is_result(path) else f"{path.name}.{NAME}")


class Keeper:
    """Reads the session of a stack once, and writes it as it changes."""

    def __init__(
        self, place: Path | None, shape: tuple[int, int, int], tell: Callable[[str], None]
    ) -> None:
        """Read the file; one that is no session is renamed, never written over.

        Args:
            place: of the file; None keeps in memory only.
            shape: (K,H,W) of the whole stack.
            tell: told, from any thread, in a sentence whatever does not work.
        """
        self._place, self._tell, self._count = place, tell, shape[0]
        self._changed = Condition()
        self._latest: Saved | None = None
        self._unsaved = self._closed = False
        if place is not None:
            try:
                self._latest = _read(place, shape, tell)
            except OSError as error:
                self._stay_in_memory(f"{place}: cannot be read or moved ({error.strerror})")
        self._writer = Thread(target=self._write_changes, name="session", daemon=True)
        self._writer.start()

    @property
    def latest(self) -> Saved | None:
        """What was kept last, by a tab or in the file; None where there was nothing."""
        return self._latest

    def keep(self, saved: Saved) -> None:
        """Remember, and write soon; of several within PERIOD only the last. Does not wait."""
        with self._changed:
            if saved != self._latest and not self._closed:
                self._latest, self._unsaved = saved, True
                self._changed.notify()

    def close(self) -> None:
        """Write what is not written yet; nothing is kept any more."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._writer.join()

    def _write_changes(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._unsaved or self._closed)
                if not self._unsaved:
                    return
                saved, self._unsaved = self._latest, False
            if saved is not None and self._place is not None:
                self._write(saved, self._place)
            with self._changed:
                self._changed.wait_for(lambda: self._closed, PERIOD)

    def _write(self, saved: Saved, place: Path) -> None:
        try:
            if not place.parent.is_dir():
                raise OutputError(f"{place}: its folder is gone")
            with _writing:
                write_files(place.parent, {place.name: encode_saved(saved, self._count)})
        except OutputError as error:
            self._stay_in_memory(str(error))

    def _stay_in_memory(self, why: str) -> None:
        self._place = None
        self._tell(f"{why}; the session is kept until photolin ends, and not in a file")


def _read(place: Path, shape: tuple[int, int, int], tell: Callable[[str], None]) -> Saved | None:
    """The session in a file, if it is there and is one."""
    if not place.exists():
        return None
    try:
        if not place.is_file():
            raise InputError("is no file")
        with place.open("rb") as file:
            saved, told = decode_saved(file.read(MAX_BYTES + 1), shape)
    except InputError as error:
        aside = next(
            name
            for n in range(1, 10**6)
            if not (name := place.with_name(f"{place.name}.unread{n}")).exists()
        )
        place.rename(aside)
        tell(f"{place}: {error}; it is kept as {aside.name}, and the session starts anew")
        return None
    for sentence in told:
        tell(sentence)
    return saved
