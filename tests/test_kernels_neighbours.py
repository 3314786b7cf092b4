"""The loops that settle ties by neighbours, each against a plain twin, and what they leave out.

The twins compute in double precision. Decisions that rounding could turn are not compared.
"""

import numpy as np
import pytest

from photolin.kernels import settle_rows, trust_rows

f32 = np.float32
Array = np.ndarray
H, W, K = 13, 17, 14
N = H * W
NOISE, CERTAIN = f32(0.01), f32(0.03)


def frame(rng: np.random.Generator) -> Array:
    """Factors (3,K) with orthogonal rows of length sqrt(K/3), all lighting +z."""
    lights = np.column_stack([rng.uniform(-1, 1, (K, 2)), rng.uniform(0.4, 1, K)])
    return (np.linalg.qr(lights)[0] * np.sqrt(K / 3)).T.astype(f32)


def surface(A: Array) -> Array:
    """Solutions (3,N) of a smooth relief in the frame of A, lit on the whole."""
    y, x = np.divmod(np.arange(N), W)
    turn = 0.3 * np.stack([np.sin(x / 5), np.cos(y / 4), np.sin((x + y) / 6)])
    v = A.mean(axis=1)[:, None] / np.linalg.norm(A.mean(axis=1)) + turn
    return v * (0.45 + 0.15 * np.sin(x / 3) * np.cos(y / 2)) / np.linalg.norm(v, axis=0)


def problem(seed: int) -> tuple[Array, Array, Array, Array]:
    """X (K,N) with highlights and shadows, A (3,K), bases (3,N) of which many are wrong, trust."""
    rng = np.random.default_rng(seed)
    A = frame(rng)
    V = surface(A)
    X = np.maximum(A.T @ V, 0) + rng.normal(0, NOISE, (K, N))
    X += np.where(rng.random(X.shape) < 0.3, rng.uniform(0, 0.4, X.shape), 0)
    X[rng.random(X.shape) < 0.4] = 0
    X[rng.random(X.shape) < 0.05] = 0.05  # the shadow level of some tests
    bases, wrong = V + rng.normal(0, 0.01, V.shape), rng.random(N) < 0.5
    bases[:, wrong] += rng.normal(0, 0.3, (3, wrong.sum()))
    trust = 10 ** rng.uniform(-2.5, 0, N) * np.where(wrong, 0.1, 1) * (rng.random(N) > 0.1)
    trust.reshape(H, W)[:, -5:] *= 1e-3
    trust.reshape(H, W)[6:8, 6:8] = 0
    bases[:, rng.random(N) < 0.05] = np.nan
    return X.clip(0, 1).astype(f32), A, bases.astype(f32), trust.astype(f32)


# Trust


def trust_of(x: Array, a: Array, white: Array, Ts: float, v: Array, lead: int) -> float:
    fits = (x >= Ts) & (x < white) & (np.abs(x - a @ v) <= 4 * NOISE)
    G = a[fits].T.astype(float) @ a[fits]
    if np.isnan(v[0]):
        return 0
    if fits.sum() < 4 or not np.linalg.det(G) > 0:
        return 1e-5
    uncertainty = NOISE * np.sqrt(np.trace(np.linalg.inv(G))) / np.linalg.norm(v)
    return (1 if lead > 1 else 0.1) / (1 + (uncertainty / CERTAIN) ** 2)


def test_trust_is_the_twins_and_only_in_its_range() -> None:
    X, A, bases, _ = problem(0)
    rng = np.random.default_rng(1)
    bases[:, ::2] = surface(A)[:, ::2]
    X[:4, ::4] = (A.T @ bases).astype(f32)[:4, ::4]
    X[4:, ::8] = 0  # four observations alone
    X[3, ::16] = 0  # three
    pixels, lead = np.arange(N)[::-1].copy(), rng.integers(0, 4, N).astype(np.int32)
    Ts, white = X[1, 20], np.full(K, 0.8, f32)  # both of observations that fit
    white[2] = X[2, 12]
    trust = np.full(N, 77, f32)
    trust_rows(X, pixels, A, white, Ts, NOISE, CERTAIN, bases, lead, trust, 3, N - 5)
    expected = np.full(N, 77.0)
    for p, votes in zip(pixels[3:-5], lead[3:-5], strict=True):
        expected[p] = trust_of(X[:, p], A.T, white, float(Ts), bases[:, p].astype(float), votes)
    assert min(np.sum(expected == 0), np.sum(expected == 1e-5), np.sum(expected > 0.3)) > 2
    np.testing.assert_allclose(trust, expected, rtol=1e-4)


def test_lights_in_a_plane_and_three_observations_are_hardly_trusted() -> None:
    _, A, bases, _ = problem(2)
    bases = np.where(np.isnan(bases), f32(0.3), bases)
    flat = A.copy()
    flat[2] = 0
    for a, shown in ((flat, K), (A, 3)):
        X, trust = np.zeros((K, N), f32), np.empty(N, f32)
        X[:shown] = (a.T @ bases)[:shown]
        lead, white = np.full(N, 9, np.int32), np.full(K, np.inf, f32)
        known = (a, white, f32(0.001), NOISE, CERTAIN)
        trust_rows(X, np.arange(N), *known, bases, lead, trust, 0, N)
        np.testing.assert_array_equal(trust, f32(1e-5))


# The choice between solutions


def against(x: Array, a: Array, v: Array) -> float:
    u = (x - a @ v) / NOISE
    return float(np.minimum(u * u / 2, np.where(u > 0, 3, 8)).sum())


def apart(units: Array, v: Array) -> Array:
    """Squared distance of directions, in units of the turn that is usual, halved."""
    return np.sum((units - v / np.linalg.norm(v)) ** 2, axis=1) / (2 * 0.3**2)


def stranger(units: Array, say: Array, v: Array) -> float:
    return float(np.sum(say * np.minimum(apart(units, v), 2)))


def scale(x: Array, a: Array, unit: Array) -> float:
    g = a @ unit
    ratios = np.sort(x[g > 1e-3] / g[g > 1e-3])
    return ratios[len(ratios) // 3] if len(ratios) else 0


def lean(x: Array, a: Array, units: Array, say: Array, v: Array) -> Array | None:
    near = say * np.exp(-apart(units, v))
    mean = near @ units
    mean = mean / (np.linalg.norm(mean) + 1e-12)
    hold = (NOISE / (np.linalg.norm(v) * 0.3)) ** 2 * max(near.sum(), 0.2) + 1e-9
    u = (x - a @ v) / NOISE
    p = np.where(u > 0, np.maximum(0, 1 - (u / 4) ** 2), np.maximum(0.1, 1 - (u / 6) ** 2)) ** 2
    G = hold * (np.eye(3) - np.outer(mean, mean)) + (a.T * p) @ a
    singular = not np.linalg.det(G) > 1e-9 * np.prod(np.diagonal(G))
    return None if singular else np.linalg.solve(G, a.T @ (p * x))


def meet(p: int, bases: Array, trust: Array) -> tuple[Array, Array]:
    """Directions of the trusted neighbours (n,3), and their trust, by rows of the picture."""
    row, column = divmod(p, W)
    rows, columns = range(max(row - 2, 0), row + 3), range(max(column - 2, 0), column + 3)
    window = [i * W + j for i in rows for j in columns if i < H and j < W]
    met = [q for q in window if q != p and trust[q] > 0 and np.linalg.norm(bases[:, q]) > 0]
    v = bases[:, met].T.astype(float)
    return v / np.linalg.norm(v, axis=1)[:, None], trust[met].astype(float)


def settle(
    p: int, X: Array, A: Array, white: Array, Ts: f32, bases: Array, trust: Array
) -> tuple[Array, float, bool]:
    """The solution of pixel p, what trust it gained, and whether rounding could turn a decision."""
    best = bases[:, p].astype(float)
    units, said = meet(p, bases, trust)
    say = said * 3 / max(said.sum(), 1)
    strange = stranger(units, say, best)
    lit = (X[:, p] >= Ts) & (X[:, p] < white)
    x, a = X[lit, p].astype(float), A[:, lit].T.astype(float)
    cost, gained = strange + against(x, a, best), -1.0
    close = abs(strange - 0.5) < 1e-4
    if strange < 0.5:
        return best, gained, close
    tried: list[Array] = []
    for q in np.argsort(-said):
        turns = np.array([((units[q] - unit) ** 2).sum() for unit in tried])
        close |= bool((abs(turns - 0.01) < 1e-6).any())
        if (turns < 0.01).any():
            continue
        if len(tried) == 6:
            break
        tried.append(units[q])
        size = scale(x, a, units[q])
        if size <= 0:
            continue
        v = size * units[q]
        for _ in range(4):
            better = lean(x, a, units, say, v)
            if better is None:
                break
            v = better
        other = against(x, a, v) + stranger(units, say, v)
        close |= abs(other - cost + 1e-3) < 1e-4
        if other < cost - 1e-3:
            best, cost, gained = v, other, 0.3 * min(said.sum(), 1)
    return best, gained, close


def run(
    X: Array, A: Array, white: Array, Ts: float, bases: Array, trust: Array, pixels: Array
) -> tuple[Array, Array]:
    """What `settle_rows` writes for all but the first four and last five pixels."""
    out, gained = np.full((len(pixels), 3), 77, f32), np.full(len(pixels), 77, f32)
    known = (A, white, f32(Ts), NOISE)
    settle_rows(X, W, pixels, *known, bases, trust, out, gained, 4, len(pixels) - 5)
    for array in (out, gained):
        assert (array[:4] == 77).all()
        assert (array[-5:] == 77).all()
    return out[4:-5], gained[4:-5]


@pytest.mark.parametrize("seed", [1, 2, 4, 5])
def test_settled_solutions_are_the_twins_and_only_in_their_range(seed: int) -> None:
    X, A, bases, trust = problem(seed)
    white, Ts = np.full(K, 0.8, f32), f32(0.05)
    pixels = np.random.default_rng(seed).permutation(np.flatnonzero(np.isfinite(bases[0])))
    out, gained = run(X, A, white, Ts, bases, trust, pixels)
    by_rounding = 0
    for p, v, g in zip(pixels[4:-5], out, gained, strict=True):
        expected, gain, close = settle(p, X, A, white, Ts, bases, trust)
        by_rounding += close
        if not close:
            np.testing.assert_allclose(v, expected, atol=1e-5)
            assert g == pytest.approx(gain, rel=1e-5)
    assert by_rounding <= 8
    assert 40 < np.sum(gained >= 0) < len(gained) - 40
    np.testing.assert_array_equal(out[gained < 0], bases[:, pixels[4:-5][gained < 0]].T)


def test_saturated_and_dark_observations_have_no_say() -> None:
    """Whatever their value: the result is that with others in their place, bit for bit."""
    X, A, bases, trust = problem(5)
    white, dark = np.full(K, 0.5, f32), 0.25
    X[:, ::5] = np.where(np.arange(K) % 2 == 0, f32(0.5), f32(0.25))[:, None]  # the bounds
    assert min(np.mean(X >= 0.5), np.mean(X < 0.25)) > 0.1
    wild = np.where(X >= 0.5, f32(0.9), np.where(X < 0.25, f32(0.2), X))
    pixels = np.flatnonzero(np.isfinite(bases[0]))
    lead = np.full(len(pixels), 9, np.int32)
    results = []
    cases = ((X, white, dark), (wild, white, dark), (X, white + 1, dark), (X, white, 0))
    for shown, top, Ts in cases:
        sure = np.zeros(N, f32)
        known = (A, top, f32(Ts), NOISE, CERTAIN)
        trust_rows(shown, pixels, *known, bases, lead, sure, 0, len(pixels))
        results.append((sure, *run(shown, A, top, Ts, bases, trust, pixels)))
    first, same, *others = results
    for one, other in zip(first, same, strict=True):
        np.testing.assert_array_equal(one, other)
    for sure, out, _ in others:
        assert (sure != first[0]).any()
        assert (out != first[1]).any()


def test_a_pixel_at_the_pictures_corner_meets_its_own_corner_alone() -> None:
    """Not the other end of the rows beside it, nor what lies before the first pixel."""
    A = frame(np.random.default_rng(6))
    V = surface(A).astype(f32)
    bases, trust = np.tile(np.array([[1], [0], [0]], f32), N), np.full(N, 0.1, f32)
    for row in (0, H - 1):
        for column in (0, W - 1):
            near = np.s_[:, max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3]
            bases.reshape(3, H, W)[near] = V.reshape(3, H, W)[near]
    corners = np.array([0, W - 1, N - W, N - 1])
    bases[:, corners] = [[1], [0], [0]]
    pixels = np.concatenate([[5] * 4, corners, [5] * 5])
    out, gained = run(A.T @ V, A, np.full(K, 9, f32), 0.01, bases, trust, pixels)
    np.testing.assert_allclose(out, V[:, corners].T, atol=1e-3)
    np.testing.assert_allclose(gained, 0.3 * 8 * 0.1, rtol=1e-6)
