"""Least squares on D observations, against a plain twin."""

import numpy as np
import pytest

from photolin.kernels import diffuse_rows


def problem(seed: int, N: int = 200, K: int = 9) -> tuple[np.ndarray, ...]:
    """Observations, labels of all kinds, factors, white levels."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, K))
    X = rng.uniform(0, 1, (K, N)).astype(np.float32)
    labels = rng.choice([0, 1, 1, 1, 2, 3, 4, 255], (K, N)).astype(np.uint8)
    labels[2:, : N // 4] = 4  # two D at the most
    labels[3:, N // 4 : N // 3] = 4  # three at the most
    return X, labels, A, np.where(np.arange(K) % 2, np.inf, 0.9).astype(np.float32)


def fit(known: tuple[np.ndarray, ...], *spans: tuple[int, int]) -> np.ndarray:
    out = np.full((3, known[0].shape[1]), 7.0)
    for span in spans or ((0, out.shape[1]),):
        diffuse_rows(*known, out, *span)
    return out


def twin(known: tuple[np.ndarray, ...]) -> np.ndarray:
    X, labels, A, white = known
    out = np.full((3, X.shape[1]), np.nan)
    for p in range(X.shape[1]):
        used = (labels[:, p] == 1) & (X[:, p] < white)
        if used.sum() >= 3:
            out[:, p] = np.linalg.lstsq(A[:, used].T, X[used, p].astype(float))[0]
    return out


@pytest.mark.parametrize("seed", [0, 1])
def test_the_fit_is_the_twins(seed: int) -> None:
    known = problem(seed)
    right = twin(known)
    np.testing.assert_allclose(fit(known), right, rtol=1e-6, atol=1e-8)
    assert 20 < np.isnan(right[0]).sum() < 180


def test_only_the_rows_asked_for_are_written_and_cuts_do_not_change_a_bit() -> None:
    known = problem(2)
    whole = fit(known)
    np.testing.assert_array_equal(fit(known, (0, 1), (1, 77), (77, 200)), whole)
    part = fit(known, (30, 50))
    np.testing.assert_array_equal(part[:, 30:50], whole[:, 30:50])
    assert (np.delete(part, np.s_[30:50], axis=1) == 7).all()


def test_factors_in_a_plane_determine_nothing() -> None:
    X, labels, A, white = problem(3)
    A[2] = A[0] + 2 * A[1]
    assert np.isnan(fit((X, labels, A, white))).all()


def test_saturated_and_other_observations_have_no_say() -> None:
    X, labels, A, white = problem(4)
    right = fit((X, labels, A, white))
    other = np.where((labels == 1) & (white[:, None] > X), X, np.float32(5))
    np.testing.assert_array_equal(fit((other, labels, A, white)), right)
