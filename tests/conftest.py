"""A real browser for the tests marked `browser`, and an address that nobody else may use."""

import importlib
import os
import shutil
from collections.abc import Iterator
from typing import Any, NoReturn

import pytest

CHROMIUM_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHROMIUM_FLAGS = (
    "--no-sandbox",
    "--no-first-run",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-features=Translate,OptimizationHints,MediaRouter",
    "--force-color-profile=srgb",
)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium with software WebGL and an empty profile."""
    try:
        playwright = importlib.import_module("playwright.sync_api")
    except ImportError:
        _leave_out("playwright is not installed")
    found = [path for name in CHROMIUM_NAMES if (path := shutil.which(name))]
    if not found:
        _leave_out("no Chromium on PATH (Debian: apt install chromium)")
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=found[0], args=[*CHROMIUM_FLAGS])
        yield chromium
        chromium.close()


def _leave_out(why: str) -> NoReturn:
    """Skip, or fail where PHOTOLIN_REQUIRE_BROWSER asks for a browser."""
    if os.environ.get("PHOTOLIN_REQUIRE_BROWSER"):
        pytest.fail(f"{why}, and PHOTOLIN_REQUIRE_BROWSER is set")
    pytest.skip(why)


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A page of 1440 x 900; fails when a request left the machine or the page raised an error."""
    context = browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    requests: list[str] = []
    errors: list[str] = []
    context.on("request", lambda request: requests.append(request.url))
    context.on("weberror", lambda error: errors.append(str(error.error)))
    opened = context.new_page()
    opened.on("websocket", lambda socket: requests.append(socket.url))
    yield opened
    context.close()
    local = ("http://127.0.0.1:", "ws://127.0.0.1:", "blob:http://127.0.0.1:", "data:", "about:")
    assert [url for url in requests if not url.startswith(local)] == []
    assert errors == []
