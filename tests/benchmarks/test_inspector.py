"""What the inspector costs its server, and whether it forgets, apart from the default run:

    python -m pytest -o addopts="-p no:cacheprovider" tests/benchmarks/test_inspector.py -rP

`-o addopts` takes the place of the options that leave this folder out. The clients are
connections without a browser, so that only the server is measured. MINUTES in the environment
shortens the random use.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from browser import wait_until
from pytest_benchmark.fixture import BenchmarkFixture
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from photolin import analyze, render_scene
from photolin.allocator import use_few_arenas
from photolin.analysis import METHODS, Options
from photolin.factors import Factor
from webapp.app import App
from webapp.canvas import Window
from webapp.pace import LULL
from webapp.session import Session
from webapp.source import Source
from webapp.state import LAYERS, SURFACE
from webapp.viser_internals import SUBPROTOCOL

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

LIMIT = 0.15
"""Seconds of server time of an interaction."""
MINUTES = float(os.environ.get("MINUTES", "10"))
TABS = 200
GROWTH = 1.05

use_few_arenas()  # as the command line does


@contextmanager
def open_tab(app: App) -> Iterator[Session]:
    """A client that takes whatever is sent, until it is left."""
    origin = app.server.url.rstrip("/")
    before = set(app._sessions)
    with connect(
        origin.replace("http", "ws"),
        origin=Origin(origin),
        subprotocols=[Subprotocol(SUBPROTOCOL)],
        max_size=None,
    ) as socket:
        camera = {
            "type": "ViewerCameraMessage",
            "wxyz": (1.0, 0.0, 0.0, 0.0),
            "position": (0.0, 0.0, -10.0),
            "fov": 0.8,
            "near": 0.01,
            "far": 1000.0,
            "image_height": 900,
            "image_width": 1440,
            "look_at": (0.0, 0.0, 0.0),
            "up_direction": (0.0, -1.0, 0.0),
        }
        socket.send(msgspec.msgpack.encode(camera))
        threading.Thread(target=drain, args=(socket,), daemon=True).start()
        wait_until(lambda: bool(set(app._sessions) - before), 30)
        (number,) = set(app._sessions) - before
        yield app._sessions[number]
    wait_until(lambda: number not in app._sessions, 30)


def drain(socket: Any) -> None:
    try:
        for _ in socket:
            pass
    except ConnectionClosed:
        pass


@dataclass
class Watch:
    """Times what a session does in its worker."""

    session: Session
    taken: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        work = self.session._round

        def timed() -> bool:
            began = time.perf_counter()
            try:
                return work()
            finally:
                self.taken.append(time.perf_counter() - began)

        self.session._round = timed

    def after(self, act: Callable[[], object]) -> float:
        """Seconds of an interaction: the call itself and the longest round that follows."""
        self.taken.clear()
        began = time.perf_counter()
        act()
        call = time.perf_counter() - began
        self.session._pace.wake()
        wait_until(lambda: bool(self.taken), 60)
        time.sleep(0.5)  # what is drawn again at rest is part of it
        wait_until(lambda: not self.session._bench.work._job._running, 120)
        time.sleep(0.1)
        return max(call, *self.taken)


def interactions(session: Session) -> dict[str, Callable[[], object]]:
    """All that a person does, by name."""
    panels, pointing = session._panels, session._pointing
    _, H, W = session._source.stack.shape
    rng = np.random.default_rng(0)

    def pixel() -> tuple[int, int]:
        return int(rng.integers(H)), int(rng.integers(W))

    acts: dict[str, Callable[[], object]] = {
        "next image": lambda: panels.picture.step(1),
        "T up": lambda: panels.thresholds.nudge(T=1),
        "T down": lambda: panels.thresholds.nudge(T=-1),
        "Ts up": lambda: panels.thresholds.nudge(Ts=1),
        "Ts down": lambda: panels.thresholds.nudge(Ts=-1),
        "undo": panels.thresholds.undo,
        "redo": panels.thresholds.redo,
        "pixel": lambda: pointing.select(pixel()),
        "hover": lambda: pointing.hover(pixel()),
        "pin": pointing.pin,
        "class": lambda: panels.legend.toggle(Factor.SPECULAR),
        "next specular": lambda: panels.diagnosis.next(Factor.SPECULAR),
        "flicker": panels.compare.flicker,
        "zoom": lambda: pointing.see(Window(H // 4, H // 2, W // 4, W // 2, 2.0)),
        "T up, a part in view": lambda: panels.thresholds.nudge(T=1),
        "T down, a part in view": lambda: panels.thresholds.nudge(T=-1),
        "zoom out": lambda: pointing.see(Window(0, H, 0, W, 1.0)),
    }
    for layer in LAYERS:
        if layer not in SURFACE:
            acts[f"view {layer}"] = lambda layer=layer: panels.picture.show(layer)
    return acts


def test_no_interaction_takes_over_150_ms_of_server_time(benchmark: BenchmarkFixture) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    stack = render_scene("sphere_cone", size=(612, 512), images=96).stack
    result = analyze(stack, Options())
    app = App(Source(stack, result, result.options), port=0)
    try:
        with open_tab(app) as session:
            wait_until(lambda: session._frame is not None)
            see_all(session)
            watch = Watch(session)
            acts = interactions(session)
            for act in acts.values():
                watch.after(act)  # compiled, and read into memory; how often is in view at the end
            took = {name: max(watch.after(act) for _ in range(3)) for name, act in acts.items()}
    finally:
        app.stop()
    benchmark.extra_info |= took
    print({name: f"{1000 * value:.0f} ms" for name, value in took.items()})
    assert max(took.values()) <= LIMIT, max(took, key=lambda name: took[name])


def see_all(session: Session) -> None:
    """As if every panel were in view, which costs the most."""
    for seen in session._panels.clicks._seen.values():
        seen(True)


def resident() -> float:
    """MB of memory in use, some seconds after the last tab was closed."""
    time.sleep(2 * LULL)
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


def use(session: Session, seconds: float, seed: int) -> int:
    """Random interactions for some time; how many."""
    rng = np.random.default_rng(seed)
    acts = [
        *interactions(session).values(),
        session._panels.run.turn,
        session._bench.suggest,
        session._bench.linearize,
        lambda: session._exclude(int(rng.integers(3)), bool(rng.integers(2))),
    ]
    end, count = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        acts[rng.integers(len(acts))]()
        session._pace.wake()
        time.sleep(0.05 if rng.random() < 0.9 else 0.6)
        count += 1
    wait_until(lambda: not session._bench.work._job._running, 60)
    return count


def test_memory_stays_after_200_tabs_and_ten_minutes_of_use(benchmark: BenchmarkFixture) -> None:
    benchmark.pedantic(lambda: None, rounds=1)
    stack = render_scene("sphere_cone", size=(256, 256), images=16).stack
    app = App(Source(stack, analyze(stack, Options()), Options()), port=0)
    try:
        with open_tab(app) as session:
            for method in METHODS:
                session._panels.run._method.value = method
                session._pace.wake()
                bench = session._bench
                wait_until(lambda m=method, b=bench: m in b.work.results, 60)
            use(session, 60 * MINUTES / 5, 1)
        for _ in range(TABS // 10):
            with open_tab(app) as session:
                wait_until(lambda s=session: s._frame is not None)
        before = resident()
        for _ in range(TABS):
            with open_tab(app) as session:
                wait_until(lambda s=session: s._frame is not None)
        tabs = resident()
        with open_tab(app) as session:
            used = use(session, 60 * MINUTES, 2)
        del session, bench
        after = resident()
    finally:
        app.stop()
    figures = {"before": before, f"{TABS} tabs": tabs, f"{used} interactions": after}
    benchmark.extra_info |= figures
    print({name: f"{value:.0f} MB" for name, value in figures.items()})
    assert max(tabs, after) <= GROWTH * before
