"""How close `robust` comes to the truth with nothing given, five seeds, the worst counts:

    python -m pytest -o addopts="-p no:cacheprovider" tests/benchmarks/test_accuracy.py -rP

The second table switches one ingredient off at a time.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from photolin import (
    ImageStack,
    LoadOptions,
    analyze,
    factorize,
    load_stack,
    load_truth,
    refine,
    render_scene,
    robust,
    thresholds,
)
from photolin.analysis import Options
from photolin.evaluate import evaluate, light_error
from photolin.factors import Thresholds, classify
from photolin.synthetic import SCENES, Truth

SHARED = Path(__file__).parents[3] / "shared" / "data"
SEEDS = range(5)
NOISY = {"noise": 0.01, "bits": 8, "seed": 1}
RAY_TRACED = {
    "pov_sphere_cone": {"macro": 99.5, "ratio": 0.95, "light": 0.02},
    "pov_sphere_obstacles": {"macro": 98.8, "p99": 0.004, "light": 0.02},
}
"""Stacks beside the checkout, and what they have to reach."""


def measure(stack: ImageStack, truth: Truth, seeds: range = SEEDS) -> dict[str, float]:
    """Worst figures of the seeds."""
    runs = []
    for seed in seeds:
        a = analyze(stack, Options(seed=seed))
        # undetermined pixels count as what result.npz holds of them: 0
        bases = np.nan_to_num(a.linearized_bases)
        runs.append(evaluate(a.labels, a.coefficients, bases, truth, stack.images))
    return {
        "macro": min(e.macro for e in runs),
        "ratio": max(e.oracle_ratio for e in runs),
        "p99": max(e.p99 for e in runs),
        "light": max(e.light_error for e in runs),
    }


def row(name: str, figures: dict[str, float]) -> str:
    """One line of the table."""
    return f"{name:32}" + "".join(f"{key} {value:9.4f}  " for key, value in figures.items())


@pytest.mark.parametrize("name", SCENES)
def test_noise_free_scenes(name: str) -> None:
    scene = render_scene(name)
    figures = measure(scene.stack, scene.truth)
    print(row(name, figures))
    assert figures["light"] <= 0.02
    assert figures["macro"] >= 97.5
    if name == "sphere_cone":
        a = analyze(scene.stack)
        e = evaluate(a.labels, a.coefficients, a.linearized_bases, scene.truth)
        print(row("C, A, D, S", dict(zip("CADS", e.confusion.diagonal(), strict=True))))
        assert (e.confusion.diagonal() >= (99.9, 99.9, 99.5, 99)).all()


@pytest.mark.parametrize("name", SCENES)
def test_scenes_with_one_percent_noise_in_8_bits(name: str) -> None:
    scene = render_scene(name, **NOISY)
    figures = measure(scene.stack, scene.truth)
    limit = best_on_grid(scene.stack.images, scene.truth.ideal, scene.truth, GRID_T, GRID_TS)
    print(row(f"{name}, 8 bit, 1 % noise", figures | {"perfect images": limit}))
    assert figures["light"] <= 0.15
    assert figures["ratio"] <= 1.5
    assert figures["macro"] >= limit - 3
    if figures["macro"] < 90:
        pytest.xfail(row(f"the bar is 90; {name}", figures | {"perfect images": limit}))


GRID_T = np.geomspace(0.005, 0.2, 30)
GRID_TS = np.geomspace(0.001, 0.1, 30)


def macro_accuracy(i: np.ndarray, l: np.ndarray, truth: Truth, T: float, Ts: float) -> float:
    """Percent of the true classes labelled right, for observations i (K,P) and a fit l (K,P)."""
    labels, true = classify(i, l, Thresholds(T, Ts)), truth.labels[:, truth.mask]
    return float(np.mean([100 * (labels[true == f] == f).mean() for f in (1, 2, 3, 4)]))


def best_on_grid(
    images: np.ndarray,
    linearized: np.ndarray,
    truth: Truth,
    tolerances: np.ndarray,
    levels: np.ndarray,
) -> float:
    """Best macro accuracy of any T and Ts of a grid, for images and a fit (K,H,W)."""
    i, l = images[:, truth.mask], linearized[:, truth.mask]
    return max(macro_accuracy(i, l, truth, T, Ts) for T in tolerances for Ts in levels)


def labelled_stacks() -> dict[str, Callable[[], tuple[ImageStack, Truth]]]:
    """Every stack with known labels, clean and noisy, by name."""

    def rendered(name: str, options: dict) -> tuple[ImageStack, Truth]:
        scene = render_scene(name, **options)
        return scene.stack, scene.truth

    def ray_traced(name: str) -> tuple[ImageStack, Truth]:
        return load_stack(SHARED / name), load_truth(SHARED / name)

    return (
        {name: partial(rendered, name, {}) for name in SCENES}
        | {f"{name}, noise": partial(rendered, name, NOISY) for name in SCENES}
        | {name: partial(ray_traced, name) for name in RAY_TRACED if (SHARED / name).is_dir()}
    )


@pytest.mark.parametrize("name", labelled_stacks())
def test_suggested_thresholds_come_near_the_best_of_a_grid(name: str) -> None:
    """Of 30 x 30 T and Ts: all of them for the labels alone, every sixth in T and Ts for a whole
    run with them."""
    stack, truth = labelled_stacks()[name]()
    a = analyze(stack)
    i, own = stack.images[:, truth.mask], np.stack([a.linearized(k) for k in range(len(a.names))])
    got = macro_accuracy(i, own[:, truth.mask], truth, a.thresholds.T, a.thresholds.Ts)
    relabelled = best_on_grid(stack.images, own, truth, GRID_T, GRID_TS)
    runs = [analyze(stack, Options(T=T, Ts=Ts)) for T in GRID_T[2::6] for Ts in GRID_TS[2::6]]
    again = max(evaluate(r.labels, r.coefficients, r.linearized_bases, truth).macro for r in runs)
    print(row(name, {"suggested": got, "best labels": relabelled, "best run": again}))
    assert got >= max(relabelled, again) - 1.5


@pytest.mark.parametrize("name", RAY_TRACED)
def test_ray_traced_scenes(name: str) -> None:
    if not (SHARED / name).is_dir():
        pytest.skip(f"{name} is not beside this checkout")
    figures = measure(load_stack(SHARED / name), load_truth(SHARED / name))
    print(row(name, figures))
    for key, bar in RAY_TRACED[name].items():
        assert figures[key] >= bar if key == "macro" else figures[key] <= bar


@pytest.mark.parametrize(("name", "bar"), [("diligent_ball", 0.3), ("diligent_cat", 0.6)])
def test_real_stacks_with_lights_unknown(name: str, bar: float) -> None:
    if not (SHARED / name).is_dir():
        pytest.skip(f"{name} is not beside this checkout")
    stack = load_stack(SHARED / name, LoadOptions(lights="none"))
    lights = np.loadtxt(SHARED / name / "light_directions.txt")
    worst = max(
        light_error(analyze(stack, Options(seed=seed)).coefficients, lights) for seed in SEEDS
    )
    print(row(name, {"light": worst}))
    assert worst <= bar


INGREDIENTS: dict[str, Callable[[pytest.MonkeyPatch], None]] = {
    "everything": lambda patch: None,
    "one choice of base images": lambda patch: patch.setattr(
        thresholds, "find_starts", first_start(thresholds.find_starts)
    ),
    "no balance of directions": lambda patch: patch.setattr(
        factorize, "balance_directions", lambda bases, rng: bases
    ),
    "one round of refinement": lambda patch: patch.setattr(
        thresholds, "refine_coefficients", partial(thresholds.refine_coefficients, rounds=1)
    ),
    "no annealing": lambda patch: patch.setattr(refine, "FIRST_WIDTH", refine.LAST_WIDTH),
    "no settling by neighbours": lambda patch: patch.setattr(
        robust, "settle_ties", lambda seen, bases, *rest, **more: bases
    ),
    "no refit without shared highlights": lambda patch: patch.setattr(
        robust, "refit_bases", lambda seen, bases, *rest: bases
    ),
    "no weighted first fit": lambda patch: (
        patch.setattr(robust, "REACH", 0.0),
        patch.setattr(robust, "LEAST_REACH", 0.0),
    )[0],
}


def first_start(find: Callable) -> Callable:
    """`find_starts`, the best choice alone."""
    return lambda *args: find(*args)[:1]


@pytest.mark.parametrize("name", INGREDIENTS)
def test_what_each_ingredient_contributes(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    INGREDIENTS[name](monkeypatch)
    for scene_name, options in (("sphere_cone", {}), ("sphere_cone", NOISY), ("cup", NOISY)):
        scene = render_scene(scene_name, **options)
        figures = measure(scene.stack, scene.truth, range(2))
        noise = "8 bit, 1 % noise" if options else "noise-free"
        print(row(f"{name}: {scene_name}, {noise}", figures))
        assert np.isfinite(figures["macro"])
