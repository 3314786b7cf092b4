"""Speed, apart from the default run:

    python -m pytest -o addopts="-p no:cacheprovider" tests/benchmarks

`-o addopts` takes the place of the options that leave this folder out. Figures are printed
(``-rP`` shows them) and stored with ``--benchmark-json FILE`` under `extra_info`.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import count
from time import perf_counter

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from photolin import analyze, render_scene
from photolin.analysis import Options
from photolin.bases import choose_bases
from photolin.coefficients import draw_samples
from photolin.factors import Thresholds, classifiable, classify
from photolin.label import label_images
from photolin.sample import draw_sample
from photolin.stack import ImageStack
from webapp.render import encode_labels

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


def test_robust_takes_a_200th_of_classification_in_numpy(
    stack: ImageStack, benchmark: BenchmarkFixture
) -> None:
    """24 images of 512 x 512, T and Ts suggested.

    The twin tries 10 samples on all pixels, scaled to all samples; that this is right is seen from
    every 4th and 8th row and column with all samples, scaled by pixels (small arrays stay in the
    cache: a lower bound).
    """
    analyze(stack)  # compiled code is loaded
    benchmark.pedantic(lambda: analyze(stack), rounds=5)
    (bases,) = choose_bases(draw_sample(stack, 0), THRESHOLDS.Ts, 0)
    X, small = stack.images.reshape(24, -1), {n: thin(stack, n).images for n in (4, 8)}
    seconds = {
        f"numpy {score.__name__}": classification_in_numpy(X, bases, score, 10)[2]
        for score in (as_written, shortened)
    } | {
        f"numpy shortened, every {n}th row and column": n**2
        * classification_in_numpy(images.reshape(24, -1), bases, shortened)[2]
        for n, images in small.items()
    }
    robust = benchmark.stats.stats.median
    benchmark.extra_info |= {"robust": robust} | seconds
    for name, value in benchmark.extra_info.items():
        print(f"{name:40}{value:8.2f} s {value / robust:8.0f} times robust")
    assert seconds["numpy as_written"] >= 200 * robust


def test_a_step_of_T_gives_a_new_overlay_of_a_megapixel_in_15_ms(
    benchmark: BenchmarkFixture,
) -> None:
    """From T to the bytes that go to the browser: the labels of one image and their picture."""
    scene = render_scene("sphere_cone", size=(1024, 1024), images=6)
    lights = (scene.truth.lights * scene.truth.power[:, None]).astype(float)
    c = lights @ np.linalg.inv(lights[:3])
    image, bases, mask = scene.stack.images[5:], scene.truth.ideal[:3], scene.stack.mask
    steps = count(1)

    def move() -> bytes:
        thresholds = replace(THRESHOLDS, T=0.01 + 0.001 * (next(steps) % 90))
        return encode_labels(label_images(image, bases, c[5:], mask, thresholds)[0])

    move()
    size = len(benchmark(move))
    benchmark.extra_info |= {"median (ms)": 1000 * benchmark.stats.stats.median, "bytes": size}
    print(benchmark.extra_info)
    assert benchmark.stats.stats.median < 0.015
