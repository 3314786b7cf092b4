"""What every browser test does with a page: open it, find a pixel on screen, read colours back."""

import io
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from PIL import Image

from webapp.viser_internals import widget_id

READY = "window.photolin?.similarity() != null"
# The picture settles a little after the last message: textures load and frames are drawn in turn.
CHANGED_MS = 10_000


def wait_until(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    """Poll until `condition()` is true; fails after `seconds`."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing happened in time"
        time.sleep(0.02)


def open_canvas(page: Any, url: str, *, hint: bool = False) -> None:
    """Open the tool and wait until its canvas is placed; without the hint of a first visit."""
    if not hint:  # it lies on the picture
        page.add_init_script("localStorage.setItem('photolin-hint-dismissed', 'yes')")
    page.goto(url)
    page.wait_for_function(READY)


def similarity(page: Any) -> tuple[float, float, float]:
    """(scale, left, top) of the picture, CSS pixels, once the camera has come to rest."""
    rest = """() => new Promise((done) => {
        let last = "", still = 0;
        const look = () => {
            const { camera, cameraControl } = window.__viserMutable ?? {};
            const goal = cameraControl?.getPosition(camera.position.clone(), true);
            const moving = !goal || goal.distanceTo(camera.position) > 1e-6 * goal.length();
            const now = JSON.stringify(window.photolin?.similarity() ?? null);
            still = now === last && now !== "null" && !moving ? still + 1 : 0;
            last = now;
            still > 2 ? done(JSON.parse(now)) : setTimeout(look, 40);
        };
        look();
    })"""
    found = page.evaluate(rest)
    return found["scale"], found["left"], found["top"]


def place_of(page: Any, row: float, column: float) -> tuple[float, float]:
    """Where (row, column) lies in the window, (x, y) CSS pixels; centres are at + 0.5."""
    scale, left, top = similarity(page)
    return left + column * scale, top + row * scale


def click_pixel(page: Any, row: int, column: int) -> None:
    """Click the centre of a pixel."""
    page.mouse.click(*place_of(page, row + 0.5, column + 0.5))


def screenshot(page: Any) -> np.ndarray:
    """The window, (H, W, 3) uint8."""
    return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))


def colours_on_screen(page: Any, shape: tuple[int, int], at: float = 0.5) -> np.ndarray:
    """Colour of each pixel of the picture, (H, W, 3) uint8, read at (row + at, column + at)."""
    scale, left, top = similarity(page)
    window = screenshot(page)
    rows = np.floor(top + (np.arange(shape[0]) + at) * scale).astype(int)
    columns = np.floor(left + (np.arange(shape[1]) + at) * scale).astype(int)
    return window[np.ix_(rows, columns)]


def wait_for_colours(page: Any, expected: np.ndarray, tolerance: int = 0) -> None:
    """Wait until the whole picture (H, W, 3), in view, shows `expected`; fails with the worst."""
    end = time.monotonic() + CHANGED_MS / 1000
    while True:
        shown = colours_on_screen(page, expected.shape[:2]).astype(int)
        worst = np.abs(shown - expected).max()
        if worst <= tolerance:
            return
        assert time.monotonic() < end, f"colours differ by up to {worst}"
        time.sleep(0.1)


def camera_rotation(page: Any) -> np.ndarray:
    """Quaternion of the camera, (4,)."""
    return np.array(page.evaluate("window.__viserMutable.camera.quaternion.toArray()"))


def encode_png(pixels: np.ndarray) -> bytes:
    """PNG of (H, W, 3 or 4) uint8."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "png")
    return buffer.getvalue()


def widget(page: Any, handle: Any) -> Any:
    return page.locator(f"[id='{widget_id(handle)}']")


def press(page: Any, *keys: str) -> None:
    """Keys one by one; inputs closer than 50 ms would be merged by viser."""
    for key in keys:
        page.keyboard.press(key)
        page.wait_for_timeout(70)


def choose(page: Any, handle: Any, option: str) -> None:
    widget(page, handle).click()
    page.get_by_role("option", name=option, exact=True).click()
    wait_for_keys(page)


def wait_for_keys(page: Any) -> None:
    """Wait until no widget has the keys, a moment after a click."""
    page.wait_for_function("document.activeElement === document.body")


def go_to(page: Any, tab: str) -> None:
    """Open a tab of the panel; the keys are the picture's again."""
    page.get_by_role("tab", name=tab, exact=True).click()
    wait_for_keys(page)


def wait_for_text(page: Any, text: str) -> None:
    """Wait until a text is seen, in one place at least."""
    page.get_by_text(text).first.wait_for(timeout=10_000)
