"""How much each pixel's linearized bases rest on."""

from numba import njit


@njit(nogil=True, cache=True)
def evidence_rows(
    X, labels, columns, A, white, Ts, lit, diffuse, spread, start, stop
):  # pragma: no cover
    """Count lit and D observations of pixels start..stop, and how far apart their lights are.

    Args:
        X: (K,N) float32 observations.
        labels: (K,N) uint8 Factor codes.
        columns: (P,) int64, the pixels.
        A: (3,K) float32 coefficients in an orthogonal frame.
        white: (K,) float32, saturated from there on.
        Ts: float32 shadow level.
        lit, diffuse: (P,) uint16, written.
        spread: (P,) float32, written: determinant of the D observations' mean c c^T over the cube
            of a third of its trace; 1 for lights evenly spread, 0 for lights in a plane.
    """
    K = X.shape[0]
    for r in range(start, stop):
        p = columns[r]
        n = d = 0
        g00 = g01 = g02 = g11 = g12 = g22 = 0.0
        for k in range(K):
            n += Ts <= X[k, p] < white[k]
            if labels[k, p] != 1:
                continue
            d += 1
            a0, a1, a2 = A[0, k], A[1, k], A[2, k]
            g00 += a0 * a0
            g01 += a0 * a1
            g02 += a0 * a2
            g11 += a1 * a1
            g12 += a1 * a2
            g22 += a2 * a2
        lit[r], diffuse[r] = n, d
        det = (
            g00 * (g11 * g22 - g12 * g12)
            - g01 * (g01 * g22 - g12 * g02)
            + g02 * (g01 * g12 - g11 * g02)
        )
        third = (g00 + g11 + g22) / 3
        spread[r] = max(det, 0.0) / third**3 if d >= 3 else 0.0
