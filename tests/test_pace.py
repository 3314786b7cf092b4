"""When the worker of a tab draws: at once for a change, again at a rest, and never for nothing."""

from threading import Event, Thread

import pytest

from webapp import courtesy
from webapp import pace as module
from webapp.pace import REST, Pace


class Clock:
    """Time that passes when it is told to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    own = Clock()
    monkeypatch.setattr(module, "monotonic", own)
    return own


def test_a_change_ends_the_wait_also_where_it_came_before(clock: Clock) -> None:
    pace = Pace()
    pace.wake()
    pace.wake()
    pace.wait(rough=False)  # would hang
    ended = Event()
    Thread(target=lambda: (pace.wait(rough=False), ended.set()), daemon=True).start()
    assert not ended.wait(0.1)  # two changes make one wait
    pace.wake()
    assert ended.wait(5)


def test_rest_is_counted_from_the_last_change(clock: Clock) -> None:
    pace = Pace()
    assert not pace.rested(REST)
    clock.now += REST
    assert pace.rested(REST)
    pace.touch()
    assert not pace.rested(REST)
    assert pace.rested(0)


def test_what_is_rough_is_drawn_again_at_the_next_rest(clock: Clock) -> None:
    waited: list[float | None] = []
    pace = Pace()
    pace._wake.wait = lambda timeout=None: waited.append(timeout) or False
    pace.wait(rough=True)
    clock.now += module.REST
    pace.wait(rough=True)
    clock.now += 10
    pace.wait(rough=True)
    assert waited == pytest.approx([module.REST, module.STEP - module.REST, 0.01])


def test_memory_is_given_back_once_in_a_lull_and_after_other_tabs(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    did: list[str] = []
    monkeypatch.setattr(module, "LULL", 0.05)
    monkeypatch.setattr(module, "give_way", lambda ended: did.append("give way"))
    monkeypatch.setattr(module, "give_back", lambda: did.append("give back"))
    pace, ended = Pace(), Event()
    Thread(target=lambda: (pace.wait(rough=False), ended.set()), daemon=True).start()
    assert not ended.wait(0.4)
    assert did == ["give way", "give back"]
    pace.wake()
    assert ended.wait(5)
    pace.wake()
    pace.wait(rough=False)
    assert did == ["give way", "give back"]


def test_a_tab_that_waits_for_others_in_a_lull_draws_at_once_when_it_is_to(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LULL", 0.05)
    monkeypatch.setattr(courtesy, "LONGEST", 60.0)
    given: list[str] = []
    monkeypatch.setattr(module, "give_back", lambda: given.append("memory"))
    pace, ended = Pace(), Event()
    with courtesy.urgent():
        Thread(target=lambda: (pace.wait(rough=False), ended.set()), daemon=True).start()
        assert not ended.wait(0.3)
        pace.wake()
        assert ended.wait(5)
    assert given == []
