"""The adaptive stopping rule against a table, and rows fitted whatever the threads."""

from itertools import pairwise
from math import inf, log

import numpy as np
import pytest

from photolin import consensus
from photolin.consensus import CONFIDENCE, fit_rows, samples_needed, stopping_table


@pytest.mark.parametrize(
    ("share", "samples"),
    # Hartley and Zisserman 2004, table 4.3, samples of three, p = 0.99, and more by the formula
    [
        (0.95, 3),
        (0.9, 4),
        (0.8, 7),
        (0.75, 9),
        (0.7, 11),
        (0.6, 19),
        (0.5, 35),
        (0.3, 169),
        (0.1, 4603),
        (0.01, 4605168),
    ],
)
def test_the_rule_gives_the_table_of_hartley_and_zisserman(share: float, samples: int) -> None:
    assert samples_needed(share, 0.99) == samples


@pytest.mark.parametrize("confidence", [0.5, 0.99, 0.999])
@pytest.mark.parametrize("share", [0.02, 0.1, 0.3, 0.5, 0.77, 0.95])
def test_the_number_is_the_least_that_reaches_the_confidence(
    share: float, confidence: float
) -> None:
    n = samples_needed(share, confidence)
    miss = log(1 - share**3)
    assert n * miss <= log(1 - confidence)
    assert (n - 1) * miss > log(1 - confidence)


def test_no_inliers_take_forever_and_only_inliers_one_sample() -> None:
    assert samples_needed(0) == inf
    assert samples_needed(1) == 1
    assert samples_needed(0.9999, 0.99) == 1


@pytest.mark.parametrize("share", [1e-3, 1e-5, 1e-6, 1e-8, 1e-20, 1e-100, 1e-105, 1e-108, 1e-200])
def test_a_tiny_share_never_rounds_to_few_samples(share: float) -> None:
    """log(1 - w^3) rounds to log(1) = 0 below w = 6e-6 and would ask for -inf or 0 samples."""
    n = samples_needed(share)
    assert n == inf or n == pytest.approx(-log(1 - CONFIDENCE) / share**3, rel=1e-4)


def test_more_inliers_never_take_more_samples() -> None:
    needed = [samples_needed(w) for w in np.linspace(0, 1, 2001)]
    assert all(a >= b for a, b in pairwise(needed))


@pytest.mark.parametrize("limit", [10, 500, 100_000])
def test_the_table_falls_from_the_limit_to_one_and_is_never_too_short(limit: int) -> None:
    table = stopping_table(limit)
    assert table.dtype == np.int64
    assert (table[0], table[-1]) == (limit, 1)
    assert (np.diff(table) <= 0).all()
    for diffuse in range(38):
        entry = table[diffuse * (len(table) - 1) // 37]
        assert entry >= min(limit, samples_needed(diffuse / 37))


def rows() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Observations (M,N), factors (3,M), solutions (3,N): one in five observations is wrong."""
    rng = np.random.default_rng(0)
    A, V = rng.uniform(-1, 1, (3, 24)), rng.uniform(-0.5, 0.5, (3, 900))
    X = np.maximum(A.T @ V, 0)
    X[(rng.random(X.shape) < 0.2) & (X > 0)] += 0.2
    return X.astype(np.float32), A, V


def test_solutions_are_found_among_outliers() -> None:
    X, A, V = rows()
    v, score = fit_rows(X, np.arange(900), A, 0.01, 0.001, limit=500, seed=0)
    right = np.abs(v - V.T).max(axis=1) < 1e-3
    assert right[score >= 4].mean() > 0.97
    assert (score[right] >= 3).all()


def test_a_guess_that_fits_is_kept_or_bettered() -> None:
    X, A, V = rows()
    columns, settings = np.arange(900), {"T": 0.01, "Ts": 0.001, "limit": 10, "seed": 0}
    _, unaided = fit_rows(X, columns, A, **settings)
    _, aided = fit_rows(X, columns, A, **settings, guess=V.T)
    _, known = fit_rows(X, columns, A, **(settings | {"limit": 0}), guess=V.T)
    assert (aided >= known).all()
    assert aided.sum() > unaided.sum()


def test_neither_threads_nor_blocks_nor_neighbours_change_a_bit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    X, A, _ = rows()
    settings = {"T": 0.01, "Ts": 0.001, "limit": 100, "seed": 3}
    expected = fit_rows(X, np.arange(900), A, **settings)
    for block, threads in ((1, 1), (700, 3), (10**9, 2)):
        monkeypatch.setattr(consensus, "BLOCK", block)
        for one, other in zip(
            fit_rows(X, np.arange(900), A, **settings, threads=threads), expected, strict=True
        ):
            np.testing.assert_array_equal(one, other)
    some = np.array([700, 3, 41])
    np.testing.assert_array_equal(fit_rows(X, some, A, **settings)[0], expected[0][some])


def test_another_seed_draws_other_samples() -> None:
    X, A, _ = rows()
    one, other = (
        fit_rows(X, np.arange(900), A, 0.01, 0.001, limit=1, seed=seed)[0] for seed in (0, 1)
    )
    assert (one != other).any(axis=1).mean() > 0.5
