"""What is pointed at: kept, told, and given to the state."""

from webapp.canvas import Window
from webapp.pointing import Pointing
from webapp.state import MOST_PINS, ViewState


def test_each_change_is_told_and_reaches_the_state() -> None:
    told: list[int] = []
    pointing = Pointing(lambda: told.append(1))
    pointing.select((3, 4))
    pointing.shine((0.1, 0.2))
    pointing.hover((5, 6))
    pointing.see(Window(0, 5, 0, 6, 1.0))
    state = pointing.read(ViewState(T=0.07))
    assert (state.pixel, state.light, state.T) == ((3, 4), (0.1, 0.2), 0.07)
    assert pointing.pointer == (5, 6)
    assert pointing.window == Window(0, 5, 0, 6, 1.0)
    assert len(told) == 4


def test_a_pixel_is_pinned_once_and_the_oldest_pin_goes() -> None:
    pointing = Pointing(lambda: None)
    pointing.pin()
    assert pointing.pins == ()
    for k in range(MOST_PINS + 1):
        pointing.select((k, k))
        pointing.pin()
    assert pointing.pins == tuple((k, k) for k in range(1, MOST_PINS + 1))
    pointing.pin()
    assert (MOST_PINS, MOST_PINS) not in pointing.pins
    pointing.unpin()
    assert pointing.pins == ()


def test_a_state_read_from_it_restores_it() -> None:
    one, other = Pointing(lambda: None), Pointing(lambda: None)
    one.select((1, 2))
    one.pin()
    one.shine((-0.3, 0.4))
    other.restore(one.read(ViewState()))
    assert other.read(ViewState()) == one.read(ViewState())
