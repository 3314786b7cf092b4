"""How close `robust` comes to the truth with nothing given, five seeds, the worst counts:

    python -m pytest -o addopts="-p no:cacheprovider" tests/benchmarks/test_accuracy.py -rP

The second table switches one ingredient off at a time.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from photolin import (
    ImageStack,
    LoadOptions,
    analyze,
    factorize,
    linearize,
    load_stack,
    load_truth,
    refine,
    render_scene,
    thresholds,
)
from photolin.analysis import Options
from photolin.evaluate import evaluate, light_error
from photolin.synthetic import SCENES, Truth

SHARED = Path(__file__).parents[3] / "shared" / "data"
SEEDS = range(5)
NOISY = {"noise": 0.01, "bits": 8, "seed": 1}


def measure(stack: ImageStack, truth: Truth, seeds: range = SEEDS) -> dict[str, float]:
    """Worst figures of the seeds."""
    runs = []
    for seed in seeds:
        a = analyze(stack, Options(seed=seed))
        runs.append(evaluate(a.labels, a.coefficients, a.linearized_bases, truth, stack.images))
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


@pytest.mark.parametrize("name", SCENES)
def test_scenes_with_one_percent_noise_in_8_bits(name: str) -> None:
    scene = render_scene(name, **NOISY)
    figures = measure(scene.stack, scene.truth)
    print(row(f"{name}, 8 bit, 1 % noise", figures))
    assert figures["light"] <= 0.15
    assert figures["ratio"] <= 1.5


@pytest.mark.parametrize(
    ("name", "bars"),
    [
        ("pov_sphere_cone", {"macro": 99.5, "ratio": 0.95, "light": 0.02}),
        ("pov_sphere_obstacles", {"macro": 98.8, "p99": 0.004, "light": 0.02}),
    ],
)
def test_ray_traced_scenes(name: str, bars: dict[str, float]) -> None:
    if not (SHARED / name).is_dir():
        pytest.skip(f"{name} is not beside this checkout")
    figures = measure(load_stack(SHARED / name), load_truth(SHARED / name))
    print(row(name, figures))
    for key, bar in bars.items():
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
    "one round of refinement": lambda patch: (
        patch.setattr(refine, "ROUNDS", 1),
        patch.setattr(refine, "EARLY", 0),
    )[0],
    "no annealing": lambda patch: patch.setattr(refine, "FIRST_WIDTH", refine.LAST_WIDTH),
    "no weighted last fit": lambda patch: (
        patch.setattr(linearize, "REACH", 0.0),
        patch.setattr(linearize, "LEAST_REACH", 0.0),
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
