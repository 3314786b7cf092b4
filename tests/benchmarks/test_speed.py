"""Speed and memory, apart from the default run:

    python -m pytest -o addopts="-p no:cacheprovider" tests/benchmarks/test_speed.py -rP

`-o addopts` takes the place of the options that leave this folder out. Figures are printed
(``-rP`` shows them) and stored with ``--benchmark-json FILE`` under `extra_info`. Times are told in
copies: how often the float32 stack could be copied, in the same process, into memory that is there.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import Any

import imagecodecs
import numpy as np
import pytest
from browser import READY
from pytest_benchmark.fixture import BenchmarkFixture

from photolin import analyze, render_scene
from photolin.analysis import Analysis, Options
from photolin.bases import choose_bases
from photolin.coefficients import draw_samples
from photolin.evaluate import tabulate
from photolin.factors import Thresholds, classifiable, classify
from photolin.label import label_images
from photolin.sample import draw_sample
from photolin.stack import ImageStack
from photolin.synthetic import Scene
from webapp.canvas import Window
from webapp.frame import compose
from webapp.live import Live
from webapp.render import encode_labels
from webapp.runs import Runs
from webapp.state import ViewState

SAMPLES = 500
"""Samples of the published method for each image and pixel."""
THRESHOLDS = Thresholds(0.01, 0.003)


Bases = tuple[int, int, int]
Samples = tuple[np.ndarray, np.ndarray]
"""Triples (n,3) and the inverses (n,3,3) that solve them, as the program draws them."""
Score = Callable[[np.ndarray, np.ndarray, int | None], np.ndarray]
"""Support of linearized l given input i, summed over an axis or over all."""


def as_written(i: np.ndarray, l: np.ndarray, axis: int | None) -> np.ndarray:
    """Eq. (3), then Eq. (4), then the sum of Eq. (5) or (6), by the program's own functions."""
    return classifiable(classify(i, l, THRESHOLDS)).sum(axis=axis)


def shortened(i: np.ndarray, l: np.ndarray, axis: int | None) -> np.ndarray:
    """The same up to a constant: shadows count for every candidate, so D alone is compared."""
    near = np.abs(i - l) <= np.float32(THRESHOLDS.T) * i
    return (near & (i >= np.float32(THRESHOLDS.Ts))).sum(axis=axis)


def step_1(X: np.ndarray, A: np.ndarray, samples: Samples, score: Score) -> np.ndarray:
    """Coefficients (K,3) of images X (K,P) with bases A (3,P): Eq. (5), vectorised over pixels."""
    triples, inverses = samples
    candidates = np.einsum("nij,knj->kni", inverses, X[:, triples])
    return np.stack(
        [
            v[np.argmax([score(x, c @ A, None) for c in v])]
            for x, v in zip(X, candidates, strict=True)
        ]
    )


def step_2(X: np.ndarray, c: np.ndarray, samples: Samples, score: Score) -> np.ndarray:
    """Linearized bases (3,P): Eq. (6), vectorised over pixels and images."""
    best, bases = np.full(X.shape[1], -1), np.zeros((3, X.shape[1]), np.float32)
    for triple, inverse in zip(*samples, strict=True):
        candidate = inverse @ X[triple]
        support = score(X, c @ candidate, 0)
        better = support > best
        best[better] = support[better]
        bases[:, better] = candidate[:, better]
    return bases


def classification_in_numpy(
    X: np.ndarray, bases: Bases, score: Score, limit: int = SAMPLES
) -> tuple[np.ndarray, np.ndarray, float]:
    """Steps 1 and 2 of the 2007 paper on images X (K,P), in single precision.

    Returns:
        Coefficients (K,3), linearized bases (3,P), and seconds: when only `limit` samples are
        tried, scaled to all that are drawn, for each does the same work.
    """
    X = np.ascontiguousarray(X)
    A = X[list(bases)]
    others = np.setdiff1d(np.arange(len(X)), bases)
    triples, inverses = draw_samples(A, SAMPLES, np.random.default_rng([0, 1]))
    start = perf_counter()
    c = step_1(X, A, (triples[:limit], inverses[:limit]), score)
    seconds = (perf_counter() - start) * len(triples) / len(triples[:limit])
    c[list(bases)] = np.eye(3)
    triples, inverses = draw_samples(c[others].T, SAMPLES, np.random.default_rng([0, 2]))
    start = perf_counter()
    v = step_2(X, c, (others[triples[:limit]], inverses[:limit]), score)
    seconds += (perf_counter() - start) * len(triples) / len(triples[:limit])
    return c, v, seconds


@pytest.fixture(scope="module")
def stack() -> ImageStack:
    """24 images of 512 x 512."""
    return render_scene("sphere_cone", size=(512, 512), images=24).stack


def thin(stack: ImageStack, step: int) -> ImageStack:
    """Every `step`-th row and column."""
    images = np.ascontiguousarray(stack.images[:, ::step, ::step])
    return ImageStack(images, np.ones(images.shape[1:], bool), stack.names)


@pytest.mark.parametrize("score", [as_written, shortened])
def test_the_numpy_twin_gives_the_labels_of_the_program(stack: ImageStack, score: Score) -> None:
    """Else its time would say nothing. Equal support is settled by rounding, hence not exactly."""
    small = thin(stack, 8)
    options = Options(method="classification", T=THRESHOLDS.T, Ts=THRESHOLDS.Ts)
    compiled = analyze(small, options)
    c, v, _ = classification_in_numpy(small.images.reshape(24, -1), compiled.base_images, score)
    v = v.reshape(3, 64, 64)
    labels = label_images(small.images, v, c.astype(float), small.mask, THRESHOLDS)
    assert (labels == compiled.labels).mean() > 0.97


def time_copy(images: np.ndarray) -> float:
    """Median seconds of copying a stack."""
    there = np.zeros_like(images)
    times = []
    for _ in range(9):
        start = perf_counter()
        np.copyto(there, images)
        times.append(perf_counter() - start)
    return float(np.median(times))


def in_copies(benchmark: BenchmarkFixture, work: Callable[[], object], images: np.ndarray) -> float:
    """Median time of `work` in copies of the stack, printed."""
    work()  # compiled code is loaded
    benchmark.pedantic(work, rounds=7)
    seconds, copy = benchmark.stats.stats.median, time_copy(images)
    benchmark.extra_info |= {"seconds": seconds, "copy": copy, "copies": seconds / copy}
    print({name: round(value, 4) for name, value in benchmark.extra_info.items()})
    return seconds / copy


@pytest.fixture(scope="module")
def megapixel() -> Scene:
    """24 images of 1024 x 1024."""
    return render_scene("sphere_cone", size=(1024, 1024), images=24)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_stack_of_24_megapixels_takes_40_copies(
    megapixel: Scene, benchmark: BenchmarkFixture, noise: float
) -> None:
    stack = megapixel.stack
    if noise:
        images = stack.images + np.random.default_rng(0).normal(0, noise, stack.shape)
        stack = replace(stack, images=np.clip(images, 0, 1).astype(np.float32))
    assert in_copies(benchmark, lambda: analyze(stack), stack.images) <= 40


def test_96_images_of_612_x_512_take_60_copies(benchmark: BenchmarkFixture) -> None:
    stack = render_scene("sphere_cone", size=(612, 512), images=96).stack
    assert in_copies(benchmark, lambda: analyze(stack), stack.images) <= 60


def test_all_label_maps_take_2_copies(megapixel: Scene, benchmark: BenchmarkFixture) -> None:
    stack, truth = megapixel.stack, megapixel.truth
    lights = (truth.lights * truth.power[:, None]).astype(float)
    c, bases = lights @ np.linalg.inv(lights[:3]), truth.ideal[:3]
    label = partial(label_images, stack.images, bases, c, stack.mask, THRESHOLDS)
    assert in_copies(benchmark, label, stack.images) <= 2


def test_robust_takes_a_500th_of_classification_in_numpy(
    megapixel: Scene, benchmark: BenchmarkFixture
) -> None:
    """24 megapixels, T and Ts suggested; numpy on every 4th row and column, scaled by pixels."""
    stack, small = megapixel.stack, thin(megapixel.stack, 4)
    robust = analyze(stack)  # compiled code is loaded
    benchmark.pedantic(lambda: analyze(stack), rounds=5)
    (bases,) = choose_bases(draw_sample(stack, 0), THRESHOLDS.Ts, 0)
    X = small.images.reshape(24, -1)
    seconds = benchmark.stats.stats.median
    for score in (as_written, shortened):
        c, v, took = classification_in_numpy(X, bases, score)
        labels = label_images(
            small.images, v.reshape(3, *small.shape[1:]), c, small.mask, THRESHOLDS
        )
        macro = accuracy(labels, megapixel.truth.labels[:, ::4, ::4])
        times = 16 * took / seconds
        benchmark.extra_info |= {f"times {score.__name__}": times, f"macro {score.__name__}": macro}
    own = accuracy(robust.labels, megapixel.truth.labels)
    benchmark.extra_info |= {"seconds": seconds, "macro robust": own}
    print({name: round(value, 2) for name, value in benchmark.extra_info.items()})
    assert own >= benchmark.extra_info["macro as_written"]
    assert benchmark.extra_info["times as_written"] >= 500


def accuracy(labels: np.ndarray, true: np.ndarray) -> float:
    """Mean percentage of the true classes that is labelled right."""
    return float(tabulate(labels, true)[1].diagonal().mean())


def follow_slider(
    benchmark: BenchmarkFixture, stack: ImageStack, window: Window, near: Analysis
) -> float:
    """Median and 95th percentile in ms, from a value of T to the bytes of the overlay."""
    live, runs, steps = Live(stack), Runs(stack, Options()), count()

    def move() -> bytes:
        T = 0.01 * 1.1 ** (next(steps) % 24)
        state = ViewState(T=round(T, 4), Ts=near.thresholds.Ts)
        frame = compose(runs, {"robust": near}, state, live.follow(state, near, window, idle))
        assert frame.labels is not None
        assert frame.preview is not None
        return encode_labels(frame.labels)

    move()
    benchmark.pedantic(move, rounds=72)
    times = np.array(benchmark.stats.stats.data) * 1000
    figures = {"median (ms)": np.median(times), "95 % below (ms)": np.quantile(times, 0.95)}
    benchmark.extra_info |= figures
    print({name: round(float(value), 1) for name, value in figures.items()})
    assert np.quantile(times, 0.95) <= 120
    return float(np.median(times))


def idle() -> bool:
    """Nothing newer is asked for."""
    return False


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_whole_linearization_follows_a_step_of_T_in_60_ms(
    benchmark: BenchmarkFixture, noise: float
) -> None:
    """24 images of 512 x 512, every pixel."""
    stack = render_scene("sphere_cone", size=(512, 512), images=24, noise=noise).stack
    window = Window(0, 512, 0, 512, 1.5)
    assert follow_slider(benchmark, stack, window, analyze(stack)) <= 60


def test_a_megapixel_on_screen_follows_a_step_of_T_in_60_ms(
    megapixel: Scene, benchmark: BenchmarkFixture
) -> None:
    """As a whole on a window of 850 rows."""
    window, near = Window(0, 1024, 0, 1024, 0.83), analyze(megapixel.stack)
    assert follow_slider(benchmark, megapixel.stack, window, near) <= 60


def test_a_step_of_T_gives_a_new_overlay_of_a_megapixel_in_15_ms(
    megapixel: Scene, benchmark: BenchmarkFixture
) -> None:
    """Labels alone, from T to the bytes that go to the browser."""
    stack, truth = megapixel.stack, megapixel.truth
    lights = (truth.lights * truth.power[:, None]).astype(float)
    c = lights @ np.linalg.inv(lights[:3])
    image, bases, mask = stack.images[5:6], truth.ideal[:3], stack.mask
    steps = count(1)

    def move() -> bytes:
        thresholds = replace(THRESHOLDS, T=0.01 + 0.001 * (next(steps) % 90))
        return encode_labels(label_images(image, bases, c[5:6], mask, thresholds)[0])

    move()
    size = len(benchmark(move))
    benchmark.extra_info |= {"median (ms)": 1000 * benchmark.stats.stats.median, "bytes": size}
    print(benchmark.extra_info)
    assert benchmark.stats.stats.median < 0.015


@pytest.mark.parametrize(
    ("sizes", "images"),
    [((512, 1024, 2048, 4096), (12,)), ((1024,), (12, 24, 48, 96))],
    ids=["pixels", "images"],
)
def test_time_grows_no_faster_than_the_stack(
    benchmark: BenchmarkFixture, sizes: tuple[int, ...], images: tuple[int, ...]
) -> None:
    """Up to 16 megapixels and up to 96 images; the smallest part of an image made larger."""
    small = render_scene("sphere_cone", size=(512, 512), images=max(images)).stack
    seconds = {}
    for size in sizes:
        for K in images:
            step = size // 512
            large = small.images[:K].repeat(step, axis=1).repeat(step, axis=2)
            stack = ImageStack(large, np.ones(large.shape[1:], bool), small.names[:K])
            times = []
            for _ in range(3):
                start = perf_counter()
                analyze(stack)
                times.append(perf_counter() - start)
            seconds[large.size / 2**20] = float(np.median(times))
    benchmark.pedantic(lambda: None, rounds=1)
    each = {size: took / size for size, took in seconds.items()}
    benchmark.extra_info |= {f"{size:g} M": took for size, took in seconds.items()}
    print({f"{size:g} M observations": round(took, 3) for size, took in seconds.items()})
    first, *others = each.values()
    assert all(one <= 1.15 * first for one in others)


def test_memory_is_the_stack_twice_and_200_MB(
    megapixel: Scene, benchmark: BenchmarkFixture, tmp_path: Path
) -> None:
    """16-bit files: the stack as stored, as float32, and the rest, the interpreter included."""
    for k, image in enumerate(megapixel.stack.images):
        stored = np.rint(image * 65535).astype(np.uint16)
        (tmp_path / f"{k:03d}.png").write_bytes(imagecodecs.png_encode(stored, level=1))
    program = (
        "import sys; from pathlib import Path; from photolin import *;"
        "status = lambda: Path('/proc/self/status').read_text();"
        "peak = lambda: int(status().split('VmHWM:')[1].split()[0]) / 1024;"
        "a = analyze(render_scene('sphere_cone', size=(200, 200), images=12).stack);"
        "print(peak()); a = analyze(load_stack(sys.argv[1])); print(peak());"
        "save_result(a, sys.argv[2]); print(peak())"
    )
    command = [sys.executable, "-c", program, tmp_path, tmp_path / "out"]
    benchmark.pedantic(lambda: None, rounds=1)
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    before, after, saved = (float(line) for line in out.split())
    limit = 6 * megapixel.stack.images.size / 2**20 + 200
    figures = {"program": before, "analyzed": after, "saved": saved, "limit": limit}
    benchmark.extra_info |= figures
    print({name: f"{value:.0f} MB" for name, value in figures.items()})
    assert after <= limit


def test_the_page_is_usable_within_5_s_cold_and_2_s_warm(
    page: Any, benchmark: BenchmarkFixture, tmp_path: Path
) -> None:
    """From starting the program to a page that answers; cold: nothing is compiled yet."""
    benchmark.pedantic(lambda: None, rounds=1)
    folder = Path(__file__).parents[2] / "sample_data" / "sphere_cone"
    command = [
        sys.executable,
        "-m",
        "photolin",
        "inspect",
        folder,
        "--no-browser",
        "--port",
        "8297",
    ]
    for name in ("cold", "warm"):
        start = perf_counter()
        with subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        ) as program:
            assert program.stdout is not None
            page.goto(program.stdout.readline().split(" at ")[1].split()[0])
            page.wait_for_function(READY)
            usable = perf_counter() - start
            page.get_by_text("final, linearized").wait_for(timeout=120_000)
            benchmark.extra_info |= {name: usable, f"{name}, labels": perf_counter() - start}
            program.terminate()
    print({name: round(value, 2) for name, value in benchmark.extra_info.items()})
    assert benchmark.extra_info["cold"] <= 5
    assert benchmark.extra_info["warm"] <= 2
