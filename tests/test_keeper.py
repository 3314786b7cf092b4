"""The file of a session: where it is, when it is written, and what happens when it cannot be."""

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from photolin.export import is_result
from photolin.load import load_stack
from webapp import keeper as keeper_module
from webapp.keeper import NAME, Keeper, saved_place
from webapp.saved import Saved, decode_saved, encode_saved
from webapp.state import ViewState

SHAPE = (10, 20, 30)


class Tab:
    """A keeper and what it told."""

    def __init__(self, place: Path | None) -> None:
        self.told: list[str] = []
        self.keeper = Keeper(place, SHAPE, self.told.append)


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Path]:
    yield tmp_path / NAME
    tmp_path.chmod(0o700)


def session(n: int) -> Saved:
    return Saved(ViewState(T=n / 1000), notes=str(n))


def content(place: Path) -> Saved:
    return decode_saved(place.read_bytes(), SHAPE)[0]


def wait_for(place: Path, n: int) -> None:
    end = time.monotonic() + 10
    while not place.exists() or content(place) != session(n):
        assert time.monotonic() < end, f"session {n} was not written"
        time.sleep(0.01)


def test_what_one_start_keeps_the_next_one_reads(place: Path) -> None:
    first = Tab(place)
    assert first.keeper.latest is None
    first.keeper.keep(session(3))
    first.keeper.close()
    second = Tab(place)
    assert second.keeper.latest == session(3)
    second.keeper.close()
    assert first.told == second.told == []
    assert [path.name for path in place.parent.iterdir()] == [NAME]


def test_closing_writes_the_last_of_many_at_once(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keeper_module, "PERIOD", 60.0)
    tab = Tab(place)
    tab.keeper.keep(session(1))
    wait_for(place, 1)
    for n in range(2, 100):
        tab.keeper.keep(session(n))
    assert tab.keeper.latest == session(99)
    time.sleep(0.3)
    assert content(place) == session(1)  # the period is not over
    tab.keeper.close()
    assert content(place) == session(99)


def test_a_change_is_written_without_closing_and_only_once_a_period(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keeper_module, "PERIOD", 0.2)
    written: list[str] = []
    write = keeper_module.write_files

    def watch(folder: Path, files: dict[str, bytes]) -> None:
        written.extend(json.loads(data)["notes"] for data in files.values())
        write(folder, files)

    monkeypatch.setattr(keeper_module, "write_files", watch)
    tab = Tab(place)
    tab.keeper.keep(session(1))
    wait_for(place, 1)
    for n in range(2, 50):
        tab.keeper.keep(session(n))
    wait_for(place, 49)
    tab.keeper.keep(session(49))
    tab.keeper.close()
    assert written == ["1", "49"]


def test_after_closing_nothing_is_kept(place: Path) -> None:
    tab = Tab(place)
    tab.keeper.close()
    tab.keeper.keep(session(1))
    tab.keeper.close()
    assert not place.exists()
    assert tab.keeper.latest is None


def test_of_two_the_last_writer_wins_with_a_whole_file(place: Path) -> None:
    tabs = [Tab(place), Tab(place)]
    for n in range(1, 30):
        tabs[n % 2].keeper.keep(session(n))
    tabs[1].keeper.close()
    tabs[0].keeper.close()
    assert content(place) in (session(28), session(29))
    assert [path.name for path in place.parent.iterdir()] == [NAME]


def test_without_a_place_it_is_kept_in_memory(tmp_path: Path) -> None:
    tab = Tab(None)
    tab.keeper.keep(session(5))
    tab.keeper.close()
    assert tab.keeper.latest == session(5)
    assert (tab.told, list(tmp_path.iterdir())) == ([], [])


@pytest.mark.parametrize("trouble", ["read-only", "gone"])
def test_a_place_that_cannot_be_written_is_told_once_and_memory_goes_on(
    trouble: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keeper_module, "PERIOD", 0.01)
    if trouble == "gone":
        place = place.parent / "stack" / NAME
        place.parent.mkdir()
    tab = Tab(place)
    if trouble == "gone":
        place.parent.rmdir()
    elif os.access(place.parent.chmod(0o500) or place.parent, os.W_OK):
        pytest.skip("permissions do not bind this user")
    tab.keeper.keep(session(1))
    end = time.monotonic() + 10
    while not tab.told and time.monotonic() < end:
        time.sleep(0.01)
    tab.keeper.keep(session(2))
    tab.keeper.close()
    assert tab.keeper.latest == session(2)
    (sentence,) = tab.told
    assert str(place) in sentence
    assert sentence.endswith("; the session is kept until photolin ends, and not in a file")
    assert not place.exists()


def test_a_disk_that_fills_up_leaves_the_earlier_session_whole(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place.write_bytes(encode_saved(session(1)))
    tab = Tab(place)

    def full(self: Path, data: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    tab.keeper.keep(session(2))
    tab.keeper.close()
    monkeypatch.undo()
    assert content(place) == session(1)
    assert "No space left on device" in tab.told[0]


@pytest.mark.parametrize("data", [b"", b"\xff\x00", b'{"version": 99}', b'{"version": 1, "sta'])
def test_a_file_that_is_no_session_is_kept_aside_and_told(data: bytes, place: Path) -> None:
    for n in (1, 2):
        place.write_bytes(data)
        tab = Tab(place)
        assert tab.keeper.latest is None
        (sentence,) = tab.told
        assert f"is kept as {NAME}.unread{n}, and the session starts anew" in sentence
        tab.keeper.keep(session(n))
        tab.keeper.close()
        assert content(place) == session(n)
        assert place.with_name(f"{NAME}.unread{n}").read_bytes() == data


def test_a_folder_in_the_place_of_the_file_is_moved_too(place: Path) -> None:
    (place / "inside").mkdir(parents=True)
    tab = Tab(place)
    assert "is no file; it is kept as" in tab.told[0]
    tab.keeper.close()


def test_a_file_that_can_be_neither_read_nor_moved_is_not_written_over(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place.write_bytes(b"precious")

    def refuse(self: Path, target: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "rename", refuse)
    tab = Tab(place)
    tab.keeper.keep(session(1))
    tab.keeper.close()
    assert place.read_bytes() == b"precious"
    assert "cannot be read or moved (Permission denied); the session is kept until" in tab.told[0]
    assert tab.keeper.latest == session(1)


def test_entries_that_were_not_taken_are_told_and_the_rest_is_read(place: Path) -> None:
    place.write_text('{"version": 1, "notes": "mine", "state": {"layer": "heat"}}')
    tab = Tab(place)
    tab.keeper.close()
    assert tab.keeper.latest == Saved(notes="mine")
    assert tab.told[0].startswith("session: layer is not as it can be")


def test_no_loader_takes_a_session_for_an_image_or_a_result(tmp_path: Path) -> None:
    """In a folder of images, beside a stack that is a file, and in a result."""
    images = np.random.default_rng(0).integers(9, 250, (6, 8, 9), np.uint8)
    folder = tmp_path / "mask gt dark"
    folder.mkdir()
    for k, image in enumerate(images):
        Image.fromarray(image).save(folder / f"photolin_session{k}.png")
    np.save(folder / "s.npy", images)
    before = load_stack(folder)
    for stack in (folder, folder / "s.npy", folder / "photolin_session1.png"):
        place = saved_place(stack)
        assert not place.exists()
        place.write_bytes(encode_saved(session(1)))
        place.with_name(f"{place.name}.unread1").write_bytes(b"")
        assert not is_result(folder)
    after = load_stack(folder)
    assert (after.files, after.notes) == (before.files, before.notes)
    assert len(load_stack(folder / "s.npy").names) == 6
    (folder / "report.json").write_text("{}")
    assert saved_place(folder) == saved_place(folder / "result.npz") == folder / NAME
    (folder / "result.npz").write_bytes(b"")
    assert saved_place(folder / "result.npz") == folder / NAME
