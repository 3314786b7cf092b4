"""What a tab says beside the picture."""

from threading import Event
from types import SimpleNamespace
from typing import Any

import pytest

from photolin.errors import Cancelled, InputError
from webapp.notices import SECONDS, Notices


class Client:
    """Takes notes as viser does."""

    def __init__(self) -> None:
        self.notes: list[tuple[str, str, float | None, str]] = []

    def add_notification(self, title: str, body: str, **how: Any) -> Any:
        note = (title, body, how["auto_close_seconds"], how["color"])
        self.notes.append(note)
        return SimpleNamespace(remove=lambda: self.notes.remove(note))


@pytest.fixture
def client() -> Client:
    return Client()


def notices(client: Any, closed: Event | None = None) -> Notices:
    return Notices(client, closed or Event())


def test_what_the_user_can_mend_is_told_in_its_own_words_until_dismissed(client: Client) -> None:
    notices(client).tell(InputError("no images here; PNG is accepted"))
    assert client.notes == [("This did not work", "no images here; PNG is accepted", None, "red")]


def test_what_was_cancelled_or_refused_is_a_passing_note(client: Client) -> None:
    said = notices(client)
    said.tell(Cancelled("linearization cancelled"))
    said.refuse()
    assert [note[0] for note in client.notes] == ["Cancelled", "Still running"]
    assert {note[2:] for note in client.notes} == {(SECONDS, "gray")}


def test_a_fault_of_the_program_leaves_its_trace_in_the_terminal(
    client: Client, capsys: pytest.CaptureFixture[str]
) -> None:
    notices(client).tell(ZeroDivisionError("by zero"))
    assert client.notes[0][:2] == ("photolin made a mistake", "ZeroDivisionError: by zero")
    assert "ZeroDivisionError: by zero" in capsys.readouterr().err


def test_a_closed_tab_is_told_nothing(client: Client, capsys: pytest.CaptureFixture[str]) -> None:
    closed = Event()
    closed.set()
    said = notices(client, closed)
    for error in (InputError("a"), Cancelled("b"), RuntimeError("c")):
        said.tell(error)
    said.refuse()
    assert client.notes == []
    assert capsys.readouterr().err == ""


def test_what_did_not_work_is_taken_back_and_nothing_else(client: Client) -> None:
    said = notices(client)
    said.retract()
    said.tell(InputError("one"))
    said.say("Session", "cannot be written", "red")
    said.tell(InputError("two"))
    said.retract()
    said.retract()
    assert [note[0] for note in client.notes] == ["Session"]


def test_nothing_is_taken_back_in_a_closed_tab(client: Client) -> None:
    closed = Event()
    said = notices(client, closed)
    said.tell(InputError("one"))
    closed.set()
    said.retract()
    assert len(client.notes) == 1
