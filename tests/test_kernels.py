"""Each compiled loop against a plain twin, written to be read rather than to be fast.

Where a loop and its twin do the same single-precision operations in the same order, they must
agree bit for bit; the centre of gravity is summed in another order and agrees to rounding.
"""

from typing import Any

import numpy as np
import pytest
from test_factors import SETTINGS, plane

from photolin.consensus import stopping_table
from photolin.factors import OUTSIDE, Thresholds, classify
from photolin.kernels import (
    centre_path,
    centre_rows,
    consensus_rows,
    evidence_rows,
    label_rows,
    score_candidates,
    support_rows,
)
from photolin.kernels.consensus import UNFIT

f32, f64 = np.float32, np.float64
Array = np.ndarray


def problem(
    seed: int, rows: int, observations: int, outliers: float = 0.2
) -> tuple[Array, Array, Array]:
    """Observations X (rows,M) = V A with outliers and shadows, factors A (3,M) and V (rows,3)."""
    rng = np.random.default_rng(seed)
    A, V = rng.normal(size=(3, observations)), rng.normal(size=(rows, 3)) / 3
    X = np.abs(V @ A) * rng.normal(1, 0.01, (rows, observations))
    wrong = rng.random(X.shape)
    X[wrong < outliers] += 0.3
    X[wrong > 0.9] = 0
    return np.clip(X, 0, 1).astype(f32), A.astype(f32), V.astype(f32)


def samples(seed: int, A: Array, count: int) -> tuple[Array, Array]:
    """Triples (count,3) and the inverses of A at them."""
    rng = np.random.default_rng(seed)
    triples = np.array([rng.choice(A.shape[1], 3, replace=False) for _ in range(count)])
    return triples, np.linalg.inv(A[:, triples].transpose(1, 2, 0).astype(f64)).astype(f32)


# Labels


def label(image: Array, bases: Array, c: Array, mask: Array, T: float, Ts: float) -> Array:
    l = c[0] * bases[0] + c[1] * bases[1] + c[2] * bases[2]
    return np.where(mask, classify(image, l, Thresholds(T, Ts)), np.uint8(OUTSIDE))


@pytest.mark.parametrize(("T", "Ts"), SETTINGS)
@pytest.mark.parametrize("loop", [label_rows, label_rows.py_func])
def test_labels_are_those_of_classify_on_the_whole_plane(loop: Any, T: float, Ts: float) -> None:
    i, l = (a.ravel() for a in plane(T, Ts))
    bases = np.stack((l, np.zeros_like(l), np.zeros_like(l)))
    one, mask, labels = np.array([1, 0, 0], f32), np.ones(len(i), bool), np.empty(len(i), np.uint8)
    with np.errstate(all="ignore"):
        loop(i, bases, one, mask, f32(T), f32(Ts), labels, 0, len(i))
    np.testing.assert_array_equal(labels, classify(i, l, Thresholds(T, Ts)))


def test_labels_are_those_of_the_twin_bit_for_bit_and_only_in_their_range() -> None:
    rng = np.random.default_rng(0)
    image, bases = rng.random(5000).astype(f32), rng.normal(size=(3, 5000)).astype(f32)
    c, mask = rng.normal(size=3).astype(f32), rng.random(5000) > 0.3
    # half of them on or next to the bound of diffuse
    l = c[0] * bases[0] + c[1] * bases[1] + c[2] * bases[2]
    image[::2] = np.abs(l[::2] / f32(0.95))
    labels = np.full(5000, 77, np.uint8)
    label_rows(image, bases, c, mask, f32(0.05), f32(0.1), labels, 100, 4900)
    np.testing.assert_array_equal(
        labels[100:4900], label(image, bases, c, mask, 0.05, 0.1)[100:4900]
    )
    assert (labels[:100] == 77).all()
    assert (labels[4900:] == 77).all()


# Maximum support among shared samples


def support(
    X: Array, A: Array, triples: Array, inverses: Array, T: float, Ts: float
) -> tuple[Array, Array]:
    out, best = [], []
    for x in X:
        v = inverses[..., 0] * x[triples[:, 0], None]
        v = v + inverses[..., 1] * x[triples[:, 1], None]
        v = v + inverses[..., 2] * x[triples[:, 2], None]
        l = v[:, :1] * A[0] + v[:, 1:2] * A[1] + v[:, 2:] * A[2]
        votes = (x >= f32(Ts)) & (np.abs(x - l) <= f32(T) * x)
        winner = votes.sum(axis=1).argmax()
        out.append(v[winner])
        best.append(votes[winner].sum() + (x < f32(Ts)).sum())
    return np.array(out), np.array(best)


@pytest.mark.parametrize("Ts", [0.0, 0.02, 0.9])
def test_the_winner_by_support_is_the_twins_bit_for_bit(Ts: float) -> None:
    X, A, _ = problem(1, 40, 30)
    triples, inverses = samples(2, A, 60)
    out, votes = np.full((40, 3), 7, f32), np.full(40, 7, np.int32)
    support_rows(X, A, triples, inverses, f32(0.05), f32(Ts), out, votes, 3, 38)
    expected = support(X[3:38], A, triples, inverses, 0.05, Ts)
    np.testing.assert_array_equal(out[3:38], expected[0])
    np.testing.assert_array_equal(votes[3:38], expected[1])
    assert (out[[0, 2, 38, 39]] == 7).all()


# Centre of gravity


def centre(X: Array, triples: Array, inverses: Array, keep: int) -> Array:
    out = []
    for x in X:
        v = np.stack([inverses[:, r] for r in range(3)], 1) * x[triples][:, None, :]
        v = (v[..., 0] + v[..., 1] + v[..., 2]).astype(f64)
        while True:
            m = v.mean(axis=0)
            distance = np.linalg.norm(v - m, axis=1)
            near = distance <= distance.mean()
            if distance.mean() <= 1e-6 * np.abs(m).sum() or near.all() or near.sum() < keep:
                break
            v = v[near]
        out.append(m)
    return np.array(out)


@pytest.mark.parametrize("keep", [1, 5, 59, 60])
def test_the_centre_of_gravity_is_the_twins(keep: int) -> None:
    X, A, _ = problem(3, 40, 30)
    triples, inverses = samples(4, A, 60)
    out = np.full((40, 3), 7, f32)
    centre_rows(X, triples, inverses, keep, out, 3, 38)
    expected = centre(X[3:38], triples, inverses, keep)
    np.testing.assert_allclose(out[3:38], expected, rtol=1e-5, atol=1e-6)
    assert (out[[0, 2, 38, 39]] == 7).all()


def test_candidates_that_coincide_are_their_own_centre() -> None:
    X, A, V = problem(5, 10, 30)
    X = V @ A
    triples, inverses = samples(6, A, 60)
    out = np.empty((10, 3), f32)
    centre_rows(X.astype(f32), triples, inverses, 3, out, 0, 10)
    np.testing.assert_allclose(out, V, atol=2e-4)


def test_the_path_ends_at_the_centre_and_each_step_is_of_fewer_candidates() -> None:
    X, A, _ = problem(3, 1, 30)
    triples, inverses = samples(4, A, 60)
    v = np.einsum("nij,nj->ni", inverses, X[0][triples]).astype(f64)
    path, counts = np.full((60, 3), 7.0), np.full(60, 7)
    steps = centre_path(v.copy(), 5, path, counts)
    assert counts[0] == 60
    assert steps > 1
    for step in range(steps):
        assert len(v) == counts[step]
        np.testing.assert_allclose(path[step], v.mean(axis=0), rtol=1e-9)
        distance = np.linalg.norm(v - v.mean(axis=0), axis=1)
        v = v[distance <= distance.mean()]
    out = np.empty((1, 3), f32)
    centre_rows(X, triples, inverses, 5, out, 0, 1)
    np.testing.assert_allclose(path[steps - 1], out[0], rtol=1e-5)
    assert (path[steps:] == 7).all()


# Scores of given candidates


def test_scores_of_candidates_are_those_of_classify_and_only_in_their_range() -> None:
    X, A, V = problem(8, 1, 400)
    lit = X[0] >= f32(0.02)
    x, A = X[0, lit], np.ascontiguousarray(A[:, lit])
    v = V + np.random.default_rng(9).normal(size=(50, 3)).astype(f32) / 20
    diffuse, score = np.full(50, 7, np.int32), np.full(50, 7, np.int32)
    score_candidates(x, A, v, f32(0.05), diffuse, score, 3, 48)
    l = v[:, :1] * A[0] + v[:, 1:2] * A[1] + v[:, 2:] * A[2]
    labels = classify(x, l, Thresholds(0.05, 0.02))
    D, U = ((labels == code).sum(axis=1)[3:48] for code in (1, 0))
    np.testing.assert_array_equal(diffuse[3:48], D)
    np.testing.assert_array_equal(score[3:48], D - U)
    assert (score[[0, 2, 48, 49]] == 7).all()


# Adaptive consensus


def splitmix64(state: int) -> tuple[int, int]:
    """The next state and the upper 32 bits of its output (Steele, Lea and Flood 2014)."""
    state = (state + 0x9E3779B97F4A7C15) % 2**64
    z = state
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
    return state, (z ^ (z >> 31)) >> 32


def three_of(n: int, state: int) -> tuple[int, list[int]]:
    """Three different numbers below n: each drawn from what is left, in ascending order."""
    drawn: list[int] = []
    for left in (n, n - 1, n - 2):
        state, r = splitmix64(state)
        rest = [m for m in range(n) if m not in drawn]
        drawn.append(rest[r % left])
    return state, drawn


def solve_exactly(x: Array, a: Array, ijk: list[int]) -> Array | None:
    """v with a[ijk] v = x[ijk], by cross products; None where the three lie near a plane."""
    p, q, r = a[ijk]
    cross = np.cross([q, r, p], [r, p, q])
    det = p[0] * cross[0][0] + p[1] * cross[0][1] + p[2] * cross[0][2]
    n = [s[0] * s[0] + s[1] * s[1] + s[2] * s[2] for s in (p, q, r)]
    if not float(det * det) > 1e-4 * float(n[0] * n[1] * n[2]):
        return None
    f, g, h = x[ijk] / det
    return f * cross[0] + g * cross[1] + h * cross[2]


def judge(x: Array, a: Array, v: Array, T: Array) -> tuple[int, Array, float]:
    """D - U, which are D, and the misfit of D."""
    l = a[:, 0] * v[0] + a[:, 1] * v[1] + a[:, 2] * v[2]
    excess, slack = x - l, T * x
    d = np.abs(excess) <= slack
    u = ~d & ((excess < 0) | (l < 0))
    ratio = excess[d] / slack[d]
    return int(d.sum()) - int(u.sum()), d, float(np.sum(ratio * ratio))


def least_squares(x: Array, a: Array, w: Array | None = None) -> Array | None:
    """v nearest to a v = x, with weights w; None where it is not determined."""
    b, u = a.astype(f64), np.ones(len(a)) if w is None else np.sqrt(w.astype(f64))
    b = b * u[:, None]
    G = b.T @ b
    if len(b) < 3 or not np.linalg.det(G) > 1e-9 * np.prod(np.diagonal(G)):
        return None
    return np.linalg.lstsq(b, x * u)[0].astype(f32)


def differ(v: Array, w: Array) -> bool:
    return bool(np.sum((v - w) ** 2) > 0.01 * max(np.sum(v**2), np.sum(w**2)))


def consensus(
    x: Array, a: Array, T: Array, reach: float, tries: Array, limit: int, state: int, guess: Array
) -> tuple[int, Array, int, bool]:
    """Best score and solution for lit observations x (n,) with factors a (n,3), and the margin.

    Last whether equal scores were settled by misfits that differ by rounding alone, as those of
    exact fits to three do: the loop sums in another order.
    """
    close = False
    best, score, diffuse, misfit, second = guess.copy(), UNFIT, 0, 0.0, UNFIT
    if np.isnan(guess[0]) and (v := least_squares(x, a)) is not None:
        best = v
    if np.isfinite(best[0]):
        score, d, misfit = judge(x, a, best, T)
        diffuse = int(d.sum())
        if len(x) > 3 and (np.abs(x - a @ best) <= np.maximum(T * x, f32(reach))).all():
            limit = 0
    drawn = 0
    while drawn < min(limit, tries[diffuse * (len(tries) - 1) // len(x)]):
        drawn += 1
        state, ijk = three_of(len(x), state)
        v = solve_exactly(x, a, ijk)
        for step in range(3 if v is not None else 0):
            s, d, e = judge(x, a, v, T)
            if score > UNFIT and differ(v, best):
                second = max(second, min(s, score))
            if s < score:
                break
            even = s == score and abs(e - misfit) <= 1e-6 + 1e-5 * misfit
            close |= even and not np.allclose(v, best, atol=1e-4)
            if s > score or e < misfit:
                best, score, diffuse, misfit = v.copy(), s, int(d.sum()), e
            elif step > 0:
                break
            v = least_squares(x[d], a[d])
            if v is None:
                break
    return score, best, max(0, score - max(second, -len(x))), close


def polish(x: Array, a: Array, reach: float, v: Array) -> Array:
    """Two rounds of least squares with Tukey's biweight."""
    for _ in range(2):
        w = np.maximum(0, 1 - ((x - a @ v) / reach) ** 2) ** 2
        better = least_squares(x, a, w) if w.sum() >= 3.5 else None
        if better is None:
            break
        v = better
    return v


def fit(
    X: Array,
    A: Array,
    T: float,
    Ts: float = 0.01,
    *,
    limit: int = 500,
    stop: bool = True,
    seed: int = 0,
    white: Array | None = None,
    reach: float = 0.0,
    out: Array | None = None,
    columns: Array | None = None,
) -> tuple[Array, Array, Array]:
    """Winners, scores and margins of the columns of X (M,N) by the compiled loop.

    Without `stop`, all `limit` samples are drawn.
    """
    columns = np.arange(X.shape[1]) if columns is None else columns
    out = np.full((len(columns), 3), np.nan, f32) if out is None else out
    score, margin = np.full(len(columns), 77, np.int32), np.full(len(columns), 77, np.int32)
    white = np.full(len(X), np.inf, f32) if white is None else white
    tries = stopping_table(limit) if stop else np.full(65, limit)
    consensus_rows(
        *(np.ascontiguousarray(X, f32), columns, np.ascontiguousarray(A, f32), white),
        *(f32(T), f32(Ts), f32(reach), tries, limit, np.uint64(seed)),
        *(out, score, margin, 0, len(columns)),
    )
    return out, score, margin


@pytest.mark.parametrize("limit", [1, 5, 500])
@pytest.mark.parametrize("guessed", [False, True])
@pytest.mark.parametrize("reach", [0.0, 0.03])
def test_consensus_is_the_twins(limit: int, guessed: bool, reach: float) -> None:
    X, A, V = problem(7, 120, 40)
    A[:, 5] = np.nan
    X[:3, 2:] = 0  # lit in two
    X[3, 3:] = 0  # lit in three
    seed, tries = 123456789, stopping_table(limit)
    white = np.where(np.arange(40) % 2 == 0, f32(0.8), f32(np.inf)).astype(f32)
    columns = np.arange(119, -1, -1)
    guess = np.where(np.arange(120) % 2 == 0, V.T * f32(1.02), np.nan).T[columns]
    start = guess.astype(f32) if guessed else np.full((120, 3), np.nan, f32)
    T, Ts = f32(0.05), f32(0.02)
    out, score, margin = fit(
        *(X.T, A, T, Ts),
        **{"limit": limit, "seed": seed, "white": white, "reach": reach},
        **{"out": start.copy(), "columns": columns},
    )
    assert np.count_nonzero(white <= X) > 100
    moved = settled_by_rounding = 0
    for r, column in enumerate(columns):
        x = X[column]
        lit = (x >= Ts) & (x > 0) & (x < white) & np.isfinite(A[0])
        if lit.sum() < 3:
            assert (score[r], margin[r]) == (UNFIT, 0)
            assert np.isnan(out[r]).all()
            continue
        state = seed ^ (int(column) * 0xD1342543DE82EF95 % 2**64)
        s, v, lead, close = consensus(x[lit], A[:, lit].T, T, reach, tries, limit, state, start[r])
        assert score[r] == s
        if close:
            settled_by_rounding += 1
            continue
        assert margin[r] == lead
        w = polish(x[lit], A[:, lit].T, reach, v) if reach and s != UNFIT else v
        moved += bool(np.abs(w - v).max() > 1e-3)
        np.testing.assert_allclose(out[r], w, rtol=2e-5, atol=2e-6, equal_nan=True)
    assert (moved >= 10) == (reach > 0)
    assert settled_by_rounding <= 12


def test_the_twins_random_bits_are_those_of_the_published_generator() -> None:
    """First outputs for seed 1234567, as published with the reference code of splitmix64."""
    state, upper = 1234567, []
    for _ in range(5):
        state, bits = splitmix64(state)
        upper.append(bits)
    published = [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]
    assert upper == [p >> 32 for p in published]


def test_factors_in_a_plane_are_unfit() -> None:
    X, A, _ = problem(8, 5, 20)
    A[2] = A[0] - 2 * A[1]
    out, score, margin = fit(X.T, A, 0.05, 0.0, limit=50, reach=0.1)
    assert (score == UNFIT).all()
    assert (margin == 0).all()
    assert np.isnan(out).all()


def test_where_no_sample_is_apart_enough_all_observations_are_fitted() -> None:
    rng = np.random.default_rng(9)
    A = np.stack([np.ones(20), *rng.normal(0, 0.03, (2, 20))])
    x = np.array([0.5, 0.2, -0.3]) @ A
    out, score, _ = fit(x[:, None], A, 0.05, 0.0, limit=50)
    np.testing.assert_allclose(out[0], [0.5, 0.2, -0.3], atol=1e-5)
    assert score[0] == 20


def test_a_vote_against_physics_outweighs_a_vote_for() -> None:
    """Two planes explain as many lit observations; the one that leaves darker ones loses."""
    rng = np.random.default_rng(9)
    A = rng.uniform(0.3, 1, (3, 16))
    x = np.full(3, 0.2) @ A
    x[8:] = np.array([0.5, 0.4, 0.45]) @ A[:, 8:]
    out, score, margin = fit(x[:, None], A, 0.01, limit=2000, seed=1)
    np.testing.assert_allclose(out[0], 0.2, atol=1e-4)
    assert score[0] == 8
    assert 1 <= margin[0] <= 8


# The votes the winner is ahead


def two_solutions(first: int, second: int, seed: int) -> tuple[Array, Array]:
    """Observations (1,M) and factors (3,M): `first` of one solution, then `second` of another."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, first + second))
    one, other = np.array([0.3, 0.2, 0.4]), np.array([0.4, -0.3, 0.2])
    # each solution sees the other's observations as highlights, which have no vote
    A *= np.sign(one @ A)
    x = one @ A
    x[first:] = other @ A[:, first:]
    A[:, first:] *= np.sign(x[first:])
    x = np.abs(x)
    lower = np.where(np.arange(first + second) < first, other @ A, one @ A)
    keep = (lower > 0) & (lower < 0.9 * x)
    return x[keep][:, None], A[:, keep]


@pytest.mark.parametrize("seed", range(8))
def test_the_margin_is_the_winners_lead_over_the_best_different_solution(seed: int) -> None:
    x, A = two_solutions(60, 40, seed)
    one = (np.abs(np.array([0.3, 0.2, 0.4]) @ A - x[:, 0]) < 1e-6).sum()
    other = len(x) - one
    _, score, margin = fit(x, A, 1e-3, stop=False, seed=seed)
    assert score[0] == max(one, other)
    assert margin[0] == abs(one - other)
    assert min(one, other) >= 5


@pytest.mark.parametrize("seed", range(20))
def test_where_two_solutions_have_equal_votes_the_margin_is_nothing(seed: int) -> None:
    """Whichever is seen first."""
    x, A = two_solutions(60, 60, 3)
    one = np.flatnonzero(np.abs(np.array([0.3, 0.2, 0.4]) @ A - x[:, 0]) < 1e-6)
    other = np.setdiff1d(np.arange(len(x)), one)
    n = min(len(one), len(other))
    both = np.concatenate([one[:n], other[:n]])
    _, score, margin = fit(x[both], A[:, both], 1e-3, stop=False, seed=seed)
    assert score[0] == n
    assert margin[0] == 0


def test_the_margin_counts_from_the_lowest_score_where_nothing_else_was_tried() -> None:
    _, A, V = problem(5, 1, 12, outliers=0)
    x = np.abs(V @ A)
    A = A * np.sign(V @ A)
    _, score, margin = fit(x.T, A, 0.01, 0.0)
    assert score[0] == 12
    assert margin[0] == 24


# The last, weighted fit


def test_the_polish_is_more_accurate_than_the_equal_weights_of_D() -> None:
    """T i drops dim observations that noise has moved and keeps tails of highlights."""
    rng = np.random.default_rng(0)
    A, V = rng.uniform(0.1, 1, (3, 24)), rng.uniform(0.05, 0.4, (3, 400))
    X = A.T @ V + rng.normal(0, 0.005, (24, 400))
    X += np.where(rng.random(X.shape) < 0.2, rng.uniform(0.01, 0.05, X.shape), 0)
    error = [
        np.sqrt(np.mean((fit(X, A, 0.05, reach=reach)[0].T - V) ** 2)) for reach in (0.0, 0.02)
    ]
    assert error[1] < 0.8 * error[0]


def test_too_little_weight_leaves_the_winner_as_it_is() -> None:
    X, A, _ = problem(6, 40, 6, outliers=0)
    plain, score, _ = fit(X.T, A, 0.05, 0.02)
    tiny, same, _ = fit(X.T, A, 0.05, 0.02, reach=1e-6)
    np.testing.assert_array_equal(tiny, plain)
    np.testing.assert_array_equal(same, score)


# Saturation


def test_saturated_observations_never_vote() -> None:
    """Whatever their value: the result is that without them, bit for bit."""
    X, A, _ = problem(11, 60, 16)
    white = np.full(16, 0.5, f32)
    hidden = np.where(X >= 0.5, 0, X)
    clipped, wild = np.minimum(X, f32(0.5)), np.where(X >= 0.5, f32(0.9), X)
    assert (X >= 0.5).mean() > 0.2
    expected = fit(hidden.T, A, 0.05, 0.0, reach=0.02)
    for shown in (clipped, wild):
        for a, b in zip(fit(shown.T, A, 0.05, 0.0, white=white, reach=0.02), expected, strict=True):
            np.testing.assert_array_equal(a, b)
    assert (fit(clipped.T, A, 0.05, 0.0, reach=0.02)[0] != expected[0]).any()


# Evidence


def evidence(
    X: Array, labels: Array, columns: Array, A: Array, white: Array, Ts: float
) -> tuple[Array, Array, Array]:
    lit = ((f32(Ts) <= X) & (white[:, None] > X)).sum(axis=0)[columns]
    diffuse, spread = (labels == 1).sum(axis=0)[columns], []
    for p in columns:
        c = A[:, labels[:, p] == 1].astype(f64)
        G = c @ c.T
        spread.append(np.linalg.det(G) / (np.trace(G) / 3) ** 3 if c.shape[1] >= 3 else 0)
    return lit, diffuse, np.array(spread)


def test_evidence_is_the_twins() -> None:
    rng = np.random.default_rng(12)
    K, N = 14, 300
    X, labels = rng.random((K, N)).astype(f32), rng.integers(0, 5, (K, N)).astype(np.uint8)
    X[rng.random(X.shape) < 0.1] = 0.3  # exactly Ts
    X[rng.random(X.shape) < 0.1] = 0.9  # exactly white
    labels[:, :20] = 4
    labels[:2, :20] = 1
    labels[2, 10:20] = 1
    A = rng.normal(size=(3, K)).astype(f32)
    white = np.where(np.arange(K) < 9, f32(0.9), f32(np.inf)).astype(f32)
    lit, diffuse = np.full(N, 77, np.uint16), np.full(N, 77, np.uint16)
    spread = np.full(N, 77, f32)
    evidence_rows(X, labels, A, white, f32(0.3), lit, diffuse, spread, 3, 240)
    expected = evidence(X, labels, np.arange(N), A, white, 0.3)
    np.testing.assert_array_equal(lit[3:240], expected[0][3:240])
    np.testing.assert_array_equal(diffuse[3:240], expected[1][3:240])
    np.testing.assert_allclose(spread[3:240], expected[2][3:240], rtol=1e-5, atol=1e-6)
    for array in (lit, diffuse, spread):
        assert (array[:3] == 77).all()
        assert (array[240:] == 77).all()


@pytest.mark.parametrize(("directions", "expected"), [("even", 1), ("plane", 0), ("narrow", 0.02)])
def test_spread_is_one_for_even_lights_and_none_in_a_plane(
    directions: str, expected: float
) -> None:
    A = np.array([[1, 0, 0, -1, 0, 0], [0, 1, 0, 0, -1, 0], [0, 0, 1, 0, 0, -1]])
    if directions == "plane":
        A[2] = 0
    if directions == "narrow":
        A = A * 0.1 + np.array([[0], [0], [1]])
    X, labels = np.ones((6, 1), f32), np.ones((6, 1), np.uint8)
    counts, spread = np.empty((2, 1), np.uint16), np.empty(1, f32)
    white = np.full(6, np.inf, f32)
    evidence_rows(X, labels, A.astype(f32), white, f32(0), *counts, spread, 0, 1)
    assert spread[0] == pytest.approx(expected, abs=0.02)
    assert counts.ravel().tolist() == [6, 6]
