"""What a tab keeps of its session: each rest, and nothing where nobody has done anything."""

from types import SimpleNamespace
from typing import Any

from webapp.record import Record
from webapp.saved import Saved
from webapp.state import ViewState


def saved(image: int) -> Saved:
    return Saved(ViewState(image=image), (), "")


def record(*, again: bool = False) -> tuple[Record, list[Saved]]:
    kept: list[Saved] = []
    keeper: Any = SimpleNamespace(keep=kept.append)
    return Record(keeper, again=again), kept


def test_what_is_shown_at_first_is_not_kept_and_what_comes_after_is_once_it_rests() -> None:
    own, kept = record()
    assert not own.follow(saved(0), rested=True, begun=True)
    assert own.latest == saved(0)
    assert own.follow(saved(1), rested=False, begun=True)
    assert own.follow(saved(2), rested=False, begun=True)
    assert kept == []
    assert not own.follow(saved(3), rested=True, begun=True)
    assert kept == [saved(3)]
    assert not own.follow(saved(3), rested=True, begun=True)
    assert kept == [saved(3)]


def test_before_the_first_result_nothing_counts_as_done() -> None:
    own, kept = record()
    assert not own.follow(saved(0), rested=True, begun=False)
    assert own.latest is None
    own.follow(saved(1), rested=True, begun=True)
    assert kept == []
    # later there may be none for long, of the images that are left
    own.follow(saved(2), rested=True, begun=False)
    assert kept == [saved(2)]


def test_a_session_that_goes_on_needs_no_result_to_be_kept() -> None:
    own, kept = record(again=True)
    own.follow(saved(0), rested=True, begun=False)
    own.follow(saved(1), rested=True, begun=False)
    assert kept == [saved(1)]
