"""The fit to observations that lights graze, against a plain twin, and what it leaves alone."""

import numpy as np
import pytest

from photolin.kernels import grazing_rows

RULES = (0.5, 0.1, 0.5, 8, 14, 4.0, 0.01)
"""dark, low, high, least, enough, cut, floor"""
Known = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.float32]
"""Observations, factors, white levels, powers, shadow level."""


def problem(seed: int, K: int = 30, N: int = 60) -> tuple[Known, np.ndarray]:
    """Pixels brighter than Lambert where they are bright, with shadows, sparks and noise; and
    their bases but for a tenth."""
    rng = np.random.default_rng(seed)
    A = rng.normal(0, 0.5, (3, K))
    A[0] = rng.uniform(0.5, 1.5, K)
    truth = np.stack([rng.uniform(0.3, 0.6, N), *rng.uniform(-0.1, 0.1, (2, N))])
    l = A.T @ truth
    X = l + 0.4 * np.maximum(l - 0.4, 0) + rng.normal(0, 0.004, l.shape)
    wrong = rng.random(X.shape)
    X[wrong < 0.05] = 0
    X[(wrong > 0.05) & (wrong < 0.08)] *= 0.3
    X[wrong > 0.97] += 0.2
    X[12:, :4] = 0  # lit in few images
    white = np.where(np.arange(K) % 5, np.inf, 0.6).astype(np.float32)
    white[0] = X[0, ::4] = 0.2  # exactly white, and dim enough to count if it were not
    known = (X.astype(np.float32), A, white, rng.uniform(0.8, 1.2, K), np.float32(0.03))
    return known, (truth * rng.uniform(0.9, 1.1, truth.shape)).T


def fit(
    known: Known, start: np.ndarray, *spans: tuple[int, int], rounds: int = 4, rules: tuple = RULES
) -> np.ndarray:
    X, A, white, powers, Ts = known
    out = start.copy()
    for span in spans or ((0, len(out)),):
        columns = np.arange(X.shape[1])
        grazing_rows(X, columns, A, white, powers, Ts, *rules, rounds, out, *span)
    return out


def twin(known: Known, start: np.ndarray, rounds: int) -> np.ndarray:
    X, A, white, powers, Ts = known
    dark, low, high, least, enough, cut, floor = RULES
    out = start.copy()
    for p, v in enumerate(out):
        seen = (X[:, p] >= Ts) & (X[:, p] < white)
        x, a, power = X[seen, p].astype(float), A[:, seen].T, powers[seen]
        for round_ in range(rounds):
            l = a @ v
            facing = np.flatnonzero((l > 0) & (x >= dark * l))
            if len(facing) < enough:
                break
            order = facing[np.argsort((l / power)[facing])]
            keep = max(int(np.ceil((high - low) * len(order))), least)
            drop = min(int(low * len(order)), len(order) - keep)
            used = order[drop : drop + keep]
            r = (x - l)[used]
            reach = cut * max(1.4826 * np.median(np.abs(r)), floor * np.linalg.norm(v))
            w = np.maximum(1 - (r / reach) ** 2, 0) ** 2 if round_ else np.ones(len(used))
            root = np.sqrt(w)
            v[:] = np.linalg.lstsq(root[:, None] * a[used], root * x[used])[0]
    return out


@pytest.mark.parametrize("rounds", [1, 2, 4])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_fit_is_the_twins(seed: int, rounds: int) -> None:
    known, start = problem(seed)
    right = twin(known, start, rounds)
    np.testing.assert_allclose(fit(known, start, rounds=rounds), right, rtol=1e-8, atol=1e-10)
    assert (right != start).any(axis=1).sum() > 40


def test_cuts_do_not_change_a_bit_and_other_rows_are_not_written() -> None:
    known, start = problem(3)
    whole = fit(known, start)
    np.testing.assert_array_equal(fit(known, start, (0, 1), (1, 23), (23, 60)), whole)
    part = fit(known, start, (10, 20))
    np.testing.assert_array_equal(part[10:20], whole[10:20])
    np.testing.assert_array_equal(
        np.delete(part, np.s_[10:20], 0), np.delete(start, np.s_[10:20], 0)
    )


def test_a_pixel_lit_in_too_few_images_stays_as_it_is() -> None:
    known, start = problem(4)
    np.testing.assert_array_equal(fit(known, start)[:4], start[:4])


def test_lights_in_a_plane_change_nothing() -> None:
    (X, A, *others), start = problem(5)
    A[2] = 0.3 * A[0] - A[1]
    np.testing.assert_array_equal(fit((X, A, *others), start), start)


def test_saturated_and_dark_observations_have_no_say() -> None:
    (X, A, white, powers, Ts), start = problem(6)
    over, under = np.greater_equal(X, white[:, None]), np.less(X, Ts)
    assert min(over.sum(), under.sum()) > 20
    right = fit((X, A, white, powers, Ts), start)
    other = np.where(over, np.float32(0.95), np.where(under, np.float32(0.01), X))
    np.testing.assert_array_equal(fit((other, A, white, powers, Ts), start), right)


def test_powers_decide_the_order_and_their_unit_does_not() -> None:
    (X, A, white, powers, Ts), start = problem(7)
    right = fit((X, A, white, powers, Ts), start)
    np.testing.assert_allclose(fit((X, A, white, 8 * powers, Ts), start), right, rtol=1e-9)
    assert np.abs(fit((X, A, white, np.ones(30), Ts), start) - right).max() > 1e-4
