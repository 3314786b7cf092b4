"""Undo and redo: each step once, in both directions."""

from webapp.history import MOST, History


def test_what_is_undone_can_be_redone_step_by_step() -> None:
    h = History(0).settle(1).settle(2).settle(3)
    back = h.undo().undo()
    assert back.now == 1
    assert back.redo().redo() == h
    assert back.undo().undo().now == 0


def test_the_same_value_is_no_step() -> None:
    h = History(0).settle(1)
    assert h.settle(1) is h
    assert h.undo().settle(0) == h.undo()


def test_a_new_value_forgets_what_was_undone() -> None:
    h = History(0).settle(1).settle(2).undo().settle(5)
    assert h.redo() is h
    assert h.undo().now == 1


def test_nothing_to_undo_or_redo_changes_nothing() -> None:
    h = History("first")
    assert h.undo() is h
    assert h.redo() is h


def test_the_oldest_steps_are_forgotten_first() -> None:
    h = History(-1)
    for value in range(MOST + 10):
        h = h.settle(value)
    for _ in range(MOST + 20):
        h = h.undo()
    assert h.now == 9
