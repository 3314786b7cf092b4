"""The overview as a person meets it, in a real browser: looking, leaving out, counting."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from browser import (
    choose,
    open_canvas,
    press,
    wait_for_colours,
    wait_for_keys,
    wait_until,
    widget,
)

from photolin.analysis import Analysis, Options
from photolin.factors import Factor
from photolin.load.exclude import exclude_images
from photolin.overview import count_classes
from photolin.pipeline import analyze
from photolin.stack import MIN_IMAGES, ImageStack
from photolin.synthetic import render_scene
from webapp.app import App
from webapp.often import CLASSES, render_often
from webapp.session import Session
from webapp.source import Source

pytestmark = [
    pytest.mark.browser,
    # a tab may close while its worker draws
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]


def spoiled() -> ImageStack:
    """Image 5 is a copy of 2, 7 is saturated."""
    stack = render_scene("pot", size=(72, 96), images=12, noise=0.002).stack
    images = stack.images.copy()
    images[5] = images[2]
    images[7] = np.minimum(8 * images[7], 1)
    return replace(stack, images=images)


STACK = spoiled()
RESULT = analyze(STACK, Options(T=0.05, Ts=0.02))


@pytest.fixture
def app() -> Iterator[App]:
    opened = App(Source(STACK, RESULT, RESULT.options), port=0)
    yield opened
    opened.stop()


def enter(page: Any, app: App) -> Session:
    """Open the overview; only labels follow T."""
    page.set_viewport_size({"width": 1000, "height": 640})  # software GL is slow
    open_canvas(page, app.server.url)
    wait_until(lambda: len(app._sessions) == 1)
    (session,) = app._sessions.values()
    wait_until(lambda: session._frame is not None)
    session._panels.thresholds._live.value = False
    page.get_by_role("tab", name="Overview").click()
    wait_for_keys(page)
    wait_until(lambda: settled(session), 60)
    return session


def settled(session: Session) -> bool:
    """Whether all that the overview shows of the present result is there."""
    frame, known = session._frame, session._panels.overview._reviewer
    if frame is None or frame.analysis is None or known._frame is not frame:
        return False
    return known.is_reviewed(frame) and known.sheet is not None and not known._job._running


def card(page: Any, image: int) -> Any:
    return page.locator(f"[data-part=image-{image}]")


def toggle(page: Any, image: int) -> None:
    page.locator(f"[data-part=toggle-{image}]").click()


def result_without(session: Session, *images: int) -> Analysis:
    """The result on screen, once it is without these images."""

    def there() -> bool:
        frame = session._frame
        return frame is not None and frame.excluded == images and frame.analysis is not None

    wait_until(there, 60)
    assert session._frame is not None
    assert session._frame.analysis is not None
    return session._frame.analysis


def test_a_copy_and_a_saturated_image_are_flagged_and_left_out(page: Any, app: App) -> None:
    session = enter(page, app)
    card(page, 5).get_by_text("copy").wait_for()
    card(page, 7).get_by_text("saturated").wait_for()
    title = card(page, 5).get_by_text("copy").get_attribute("title")
    assert title.startswith(f"Image 5 ({STACK.names[5]}) is the same as image 2 (")
    for other in (0, 1, 2, 3, 4):
        assert card(page, other).locator(".photolin-badge").count() == 0
    state = session._read()
    for gone in [(5,), (5, 7)]:
        toggle(page, gone[-1])
        found = result_without(session, *gone)
        options = Options(T=state.T, Ts=state.Ts)
        expected = analyze(exclude_images(STACK, gone), options)
        assert np.array_equal(found.labels, expected.labels)
        assert np.array_equal(found.linearized_bases, expected.linearized_bases)
        assert np.array_equal(found.coefficients, expected.coefficients)
        card(page, gone[-1]).get_by_text("left out").wait_for()
    page.get_by_text("12 images, 2 left out").wait_for()
    # what is below stays where it is
    heights = page.eval_on_selector_all(".photolin-card", "all => all.map((c) => c.offsetHeight)")
    assert len(heights) == 12
    assert len(set(heights)) == 1
    page.get_by_role("tab", name="Tune").click()
    shown = session._read().image
    session._panels.picture.go(6)
    page.get_by_text("(8 in the whole stack)").wait_for()
    session._panels.picture.go(shown)
    page.get_by_role("tab", name="Overview").click()
    press(page, "Shift+K")
    found = result_without(session)
    assert np.array_equal(found.labels, RESULT.labels)
    page.locator(".photolin-badge.gone").first.wait_for(state="detached")


def test_a_click_goes_to_the_image_whatever_is_left_out(page: Any, app: App) -> None:
    session = enter(page, app)
    card(page, 7).locator(".photolin-name").click()
    wait_until(lambda: session._read().image == 7)
    page.locator(".photolin-card.now[data-part=image-7]").wait_for()
    press(page, "k")
    result_without(session, 7)
    page.locator(".photolin-card.now[data-part=image-8]").wait_for()
    toggle(page, 2)
    result_without(session, 2, 7)
    wait_until(lambda: settled(session), 60)
    for image, left in [(9, 7), (0, 0), (3, 2)]:
        card(page, image).locator(".photolin-name").click()
        wait_until(lambda left=left: session._read().image == left)
        page.locator(f".photolin-card.now[data-part=image-{image}]").wait_for()
        wait_until(lambda left=left: session._frame.state.image == left)  # pyright: ignore
        frame = session._frame
        assert frame is not None
        assert np.array_equal(frame.stack.images[left], STACK.images[image])
        assert frame.stack.names[left] == STACK.names[image]
        page.get_by_text(f"{STACK.names[image]}").first.wait_for(state="attached")
    card(page, 7).locator(".photolin-name").click()  # there is nothing to go to
    toggle(page, 7)
    result_without(session, 2)
    assert session._read().image == 2


def test_too_few_images_are_refused_in_words_and_nothing_changes(page: Any, app: App) -> None:
    session = enter(page, app)
    most = tuple(range(len(STACK.images) - MIN_IMAGES))
    for image in most:
        session._exclude(image)
    result_without(session, *most)
    toggle(page, len(most))
    page.get_by_text(f"exclude leaves {MIN_IMAGES - 1} of 12 images").first.wait_for()
    wait_until(lambda: session._excluded == most)
    result_without(session, *most)


def test_how_often_is_chosen_here_shown_on_the_picture_and_kept(page: Any, app: App) -> None:
    session = enter(page, app)
    choose(page, session._panels.overview._often, "any shadow")
    wait_until(lambda: session._read().layer == "how often")
    counts = count_classes(RESULT.labels, Factor.ATTACHED, Factor.CAST)
    wait_for_colours(
        page, render_often(counts, len(STACK.images), STACK.mask).astype(int), tolerance=1
    )
    caption = f"(yellow) of 12 images, at most {counts.max()} here"
    wait_until(lambda: caption in session._painter._first.legend)
    toggle(page, 5)
    found = result_without(session, 5)
    counts = count_classes(found.labels, *CLASSES["any shadow"])
    wait_until(lambda: "(yellow) of 11 images" in session._painter._first.legend)
    wait_for_colours(page, render_often(counts, 11, STACK.mask).astype(int), tolerance=1)
    page.get_by_text("back to input", exact=True).click()
    wait_until(lambda: session._read().layer == "input")
    page.get_by_text("show on picture", exact=True).click()
    wait_until(lambda: session._read().layer == "how often")
    assert session._read().often == "any shadow"


def test_worst_first_and_what_a_page_makes_up(page: Any, app: App) -> None:
    session = enter(page, app)
    view = session._panels.overview
    choose(page, view._order, "worst first")
    first = page.locator(".photolin-card").first
    wait_until(lambda: first.get_attribute("data-part") in ("image-5", "image-7"))
    before = session._read()
    for part, number in [("image", 12), ("toggle", 999999), ("image", 12), ("rm", 3)]:
        view._choose(part, number)
    for value in ("best", "<b>", None, 7):
        view._often.value = view._order.value = value  # pyright: ignore
        view._show()
        assert session._read().often == "specular"
    wait_until(lambda: first.get_attribute("data-part") == "image-0")
    assert session._excluded == ()
    assert session._read().image == before.image
    assert widget(page, view._often).count() == 1
