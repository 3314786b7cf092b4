"""Weighted Laplace equations: solved as sparse ones are, by loops that do what their twins do."""

from collections.abc import Callable

import numpy as np
import pytest

from photolin.errors import Cancelled
from photolin.kernels.laplace import residual_rows, smooth_rows
from photolin.shape.multigrid import solve_laplace

Array = np.ndarray


def weights(H: int, W: int, spread: float = 1) -> tuple[Array, Array]:
    """Of all sizes, some 0, `spread` decades apart."""
    rng = np.random.default_rng([H, W])
    both = 10 ** rng.uniform(-spread, 0, (2, H, W)) * (rng.random((2, H, W)) > 0.1)
    both[0, :, -1] = both[1, -1] = 0
    return both[0], both[1]


def matrix(right: Array, down: Array) -> Array:
    """The same as a dense matrix."""
    H, W = right.shape
    n = np.arange(H * W).reshape(H, W)
    A = np.zeros((H * W, H * W))
    for a, b, w in (
        (n[:, :-1], n[:, 1:], right[:, :-1]),
        (n[:-1], n[1:], down[:-1]),
    ):
        A[a.ravel(), b.ravel()] = A[b.ravel(), a.ravel()] = -w.ravel()
    return A - np.diag(A.sum(1))


def differences(z: Array, right: Array, down: Array) -> tuple[Array, Array]:
    """Between neighbours that hang together: what is determined."""
    across = np.diff(z, axis=1)[right[:, :-1] > 0]
    return across, np.diff(z, axis=0)[down[:-1] > 0]


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (3, 4), (17, 23), (40, 33)])
def test_the_solution_is_that_of_the_dense_matrix(size: tuple[int, int]) -> None:
    right, down = weights(*size)
    truth = np.random.default_rng(1).normal(size=size)
    given = (matrix(right, down) @ truth.ravel()).reshape(size)
    z = solve_laplace(right, down, given, np.zeros(size), 1e-10)
    for found, true in zip(
        differences(z, right, down), differences(truth, right, down), strict=True
    ):
        np.testing.assert_allclose(found, true, atol=1e-7)


def test_the_start_is_left_as_it_is_and_its_constant_kept() -> None:
    right, down = weights(12, 12, 0)
    start = np.full((12, 12), 4.0)
    assert (solve_laplace(right, down, np.zeros((12, 12)), start, 1e-6) == 4).all()
    given = np.zeros((12, 12))
    given[0, 0], given[0, 1] = 1, -1
    assert solve_laplace(right, down, given, start, 1e-6) is not start
    assert (start == 4).all()


@pytest.mark.parametrize("spread", [0, 3])
def test_a_large_picture_takes_few_steps(spread: float) -> None:
    """Many more without coarser grids."""
    right, down = weights(200, 301, spread)
    truth = np.cumsum(np.random.default_rng(2).normal(size=right.shape), axis=0)
    flow, fall = np.zeros_like(truth), np.zeros_like(truth)
    flow[:, :-1], fall[:-1] = np.diff(truth, axis=1), np.diff(truth, axis=0)
    flow, fall = flow * right, fall * down
    given = -flow - fall
    given[:, 1:] += flow[:, :-1]
    given[1:] += fall[:-1]
    steps: list[int] = []
    z = solve_laplace(right, down, given, np.zeros_like(truth), 1e-8, check=lambda: steps.append(1))
    assert len(steps) < (12 if spread == 0 else 60)
    wanted, found = (differences(a, right, down)[0] for a in (truth, z))
    np.testing.assert_allclose(found, wanted, atol=1e-3)


def test_it_ends_after_most_steps_nearer_than_it_began() -> None:
    right, down = weights(50, 50, 3)
    A = matrix(right, down)
    given = (A @ np.random.default_rng(3).normal(size=2500)).reshape(50, 50)
    left = []
    for most in (0, 2, 30):
        z = solve_laplace(right, down, given, np.zeros((50, 50)), 1e-12, most)
        left.append(np.linalg.norm(given - (A @ z.ravel()).reshape(50, 50)))
    assert left[0] == np.linalg.norm(given)
    assert left[0] > 2 * left[1] > 20 * left[2]


def test_what_check_raises_ends_it() -> None:
    def check() -> None:
        raise Cancelled("enough")

    with pytest.raises(Cancelled, match="enough"):
        solve_laplace(*weights(9, 9), np.zeros((9, 9)), np.zeros((9, 9)), 1e-3, check=check)


def blocks(loop: Callable[..., None], H: int) -> Callable[..., None]:
    def run(*args: Array | np.floating) -> None:
        for start in range(0, H, 3):
            loop(*args, start, min(start + 3, H))

    return run


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("size", [(1, 1), (1, 6), (6, 1), (8, 11)])
def test_the_compiled_loops_do_what_their_twins_do(size: tuple[int, int], dtype: type) -> None:
    rng = np.random.default_rng(4)
    right, down = (w.astype(dtype) for w in weights(*size))
    inverse, given, z, step = rng.normal(size=(4, *size)).astype(dtype)
    rest = given - (matrix(right, down) @ z.ravel()).reshape(size)
    out = np.full(size, 7, dtype)
    blocks(residual_rows, size[0])(right, down, given, z, out)
    np.testing.assert_allclose(out, rest, atol=1e-5)
    expected = dtype(0.3) * step + dtype(0.7) * inverse * rest
    blocks(smooth_rows, size[0])(right, down, inverse, given, z, dtype(0.3), dtype(0.7), step, out)
    np.testing.assert_allclose(step, expected, atol=1e-5)
    np.testing.assert_allclose(out, z + expected, atol=1e-5)
