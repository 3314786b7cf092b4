"""Normals from few points of known normal, alone and together with what all normals have in common:

    python -m pytest -o addopts="-p no:cacheprovider" tests/benchmarks/test_points.py -rP

Points are pixels of true normal on real photographs (DiLiGenT, ../shared/data/diligent_ball and
diligent_cat from the checkout; skipped where they are not there). Means of twelve draws, degrees.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from photolin import LoadOptions, analyze, load_stack
from photolin.shape.directions import angles_between
from photolin.shape.grazing import fit_grazing
from photolin.shape.integrability import resolve_by_integrability
from photolin.shape.normals import normals_from_bases
from photolin.shape.points import resolve_from_points
from photolin.shape.surface_points import resolve_from_surface_points
from photolin.shape.true_surface import read_benchmark

SHARED = Path(__file__).parents[3] / "shared" / "data"
DRAWS, CANDIDATES, STEEPEST = 12, 200, 0.35


@pytest.mark.parametrize(("name", "worse"), [("diligent_ball", 0.2), ("diligent_cat", 0.0)])
def test_few_points_with_the_surface_beat_points_alone(name: str, worse: float) -> None:
    if not (SHARED / name).is_dir():
        pytest.skip(f"{SHARED / name} is not there")
    stack, true = (
        load_stack(SHARED / name, LoadOptions(lights="none")),
        read_benchmark(SHARED / name),
    )
    a = analyze(stack)
    bases, graze, there = a.linearized_bases, fit_grazing(stack, a), a.determined()

    def error(matrix: np.ndarray) -> float:
        found = normals_from_bases(graze, matrix)[0][there].astype(float)
        return float(angles_between(found, true.normals[there]).mean())

    seen = binary_erosion((true.normals[..., 2] > STEEPEST) & there, np.ones((7, 7)))
    rows, columns = np.nonzero(seen)
    nothing = resolve_by_integrability(bases, a.mask, a.coefficients)
    print(f"{name}: nothing known {error(nothing.matrix):.2f}")
    for count in (5, 6, 8):
        rng, errors = np.random.default_rng(0), []
        for _ in range(DRAWS):
            drawn = rng.choice(len(rows), CANDIDATES, replace=False)
            normals = true.normals[rows[drawn], columns[drawn]]
            some = [0]
            while len(some) < count:  # each as far from the others as there is
                some.append(int((normals @ normals[some].T).max(axis=1).argmin()))
            points = rows[drawn[some]], columns[drawn[some]], normals[some]
            alone = resolve_from_points(bases, *points)
            together = resolve_from_surface_points(bases, a.mask, *points)
            errors.append((error(alone.matrix), error(together.matrix)))
        alone, together = np.mean(errors, axis=0)
        print(f"{name}: {count} points alone {alone:.2f}, together {together:.2f}")
        assert together < alone + worse
