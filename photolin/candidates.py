"""The cloud of coefficient candidates of one image, its winner and its centre of gravity (Fig. 3).

Each candidate is solved from three pixels (Eq. 2). The published method takes the one with the most
support (Eq. 5), its predecessor the centre of gravity of what is left when the farthest go.
"""

from dataclasses import dataclass
from math import ceil
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .analysis import Analysis, Cancel, Progress
from .blocks import Talk, run_blocks
from .coefficients import KEEP, draw_pixels
from .errors import DegenerateError, InputError, OptionError
from .factors import Thresholds
from .kernels import centre_path, score_candidates
from .sample import choose_pixels
from .stack import ImageStack

Source = Literal["base images", "linearized bases"]
"""What candidates are solved from. base images: the photographs, as published; of any pixels, and
support is D + A + C (Eq. 5). linearized bases: those of the result, as `robust` does in its later
rounds; of pixels lit in the image, and each U takes one off the support."""
SOURCES: tuple[Source, ...] = get_args(Source)

LEAST, MOST = 10, 100_000
"""Candidates that may be asked for."""
MOST_PIXELS = 1 << 19
"""Pixels that support is counted on at the most; of more, a random choice stands for all."""
BLOCK = 64
"""Candidates whose support is counted at once."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Candidates for the coefficients of one image; read-only.

    All are in the coordinates of `Analysis.coefficients`: the base images are the unit vectors.
    """

    image: int
    """Image number, from 0."""
    source: Source
    """What they were solved from."""
    thresholds: Thresholds
    """T and Ts that support was counted with."""
    candidates: NDArray[np.float32]
    """(N,3) finite; N is what was asked for, or less where few samples determine one."""
    support: NDArray[np.int32]
    """(N,) pixels for each candidate, less those against it; see `Source`."""
    winner: int
    """Which has the most support; the first one of equals."""
    inliers: NDArray[np.bool_]
    """(N,) whether a candidate says the same as the winner: `distances` up to T."""
    path: NDArray[np.float64]
    """(S,3) centres of gravity, of all candidates first, then of those left each time the farthest
    were dropped; the last is what the method `statistical` would take of these candidates."""
    left: NDArray[np.int64]
    """(S,) of how many candidates each is the centre; falling."""
    pixels: int
    """How many pixels support was counted on, at least `lit`."""
    lit: int
    """How many of them are lit in the image, at least 3."""
    gram: NDArray[np.float64]
    """(3,3) mean outer product of the bases of lit pixels, fraction of full scale squared."""

    def __post_init__(self) -> None:
        for array in vars(self).values():
            if isinstance(array, np.ndarray):
                array.setflags(write=False)

    @property
    def best(self) -> NDArray[np.float32]:
        """(3,) the winner."""
        return self.candidates[self.winner]

    def distances(self, coefficients: ArrayLike) -> NDArray[np.float64]:
        """How far linearized images differ from the winner's, of coefficients (...,3).

        Root mean square over the lit pixels, relative to that of the winner's image; 0 for the
        winner itself, infinite where the winner's image is black.
        """
        return _measure(coefficients, self.best, self.gram)


class _Drawn(NamedTuple):
    """The pixels of one image that candidates are drawn from and judged by."""

    x: NDArray[np.float32]
    """(M,) input."""
    A: NDArray[np.float32]
    """(3,M) bases."""
    lit: NDArray[np.bool_]
    """(M,) i >= Ts."""


def draw_candidates(
    stack: ImageStack,
    analysis: Analysis,
    image: int,
    *,
    source: Source = "base images",
    count: int = 2000,
    seed: int | None = None,
    thresholds: Thresholds | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Cloud:
    """Draw random samples of three pixels and solve each for coefficients of one image (Eq. 2).

    From base images, with as many candidates as a published method draws, its seed and its
    thresholds, they are that method's own, and so are the winner and the end of the path (up to
    MOST_PIXELS pixels).

    Args:
        stack: what was analyzed.
        image: image number, from 0.
        source: see `Source`.
        count: candidates, LEAST to MOST.
        seed: of the samples; that of the analysis when left out. Each gives the same cloud again.
        thresholds: for support; those of the analysis when left out.
        threads: processors to use; the result does not depend on it.

    Raises:
        OptionError: an image, a source or a count out of range.
        InputError: stack and analysis do not belong together.
        DegenerateError: the image is too dark, or no sample determines a candidate.
        Cancelled: `cancel` said so.
    """
    check_question(stack, analysis, image, source, count)
    thresholds = analysis.thresholds if thresholds is None else thresholds
    seed = analysis.options.seed if seed is None else seed
    drawn = _observe(stack, analysis, image, source, thresholds.Ts, seed)
    some = drawn.lit if source == "linearized bases" else np.ones(len(drawn.x), bool)
    candidates = _solve(drawn.x[some], drawn.A[:, some], analysis.base_images, count, seed)
    support = _count(drawn, candidates, thresholds.T, source, Talk(threads, progress, cancel))
    winner = int(support.argmax())
    A = drawn.A[:, drawn.lit].astype(np.float64)
    # einsum: the last digits of a product by BLAS depend on its threads
    gram = np.einsum("im,jm->ij", A, A) / A.shape[1]
    path, left = _follow_centre(candidates)
    return Cloud(
        image=image,
        source=source,
        thresholds=thresholds,
        candidates=candidates,
        support=support,
        winner=winner,
        inliers=_measure(candidates, candidates[winner], gram) <= thresholds.T,
        path=path,
        left=left,
        pixels=len(drawn.x),
        lit=A.shape[1],
        gram=gram,
    )


def check_question(
    stack: ImageStack, analysis: Analysis, image: int, source: str, count: int
) -> None:
    """Raise InputError or OptionError unless such a cloud can be asked for."""
    if analysis.labels.shape != stack.shape or not np.array_equal(analysis.mask, stack.mask):
        raise InputError(
            f"the analysis is of {analysis.labels.shape} images x rows x columns or has another "
            f"mask, the stack is {stack.shape}; the analysis of this stack is accepted"
        )
    if not 0 <= image < len(stack.images):
        raise OptionError(f"image is {image}; accepted is 0 to {len(stack.images) - 1}")
    if source not in SOURCES:
        raise OptionError(f"source is {source!r}; accepted are {', '.join(SOURCES)}")
    if not LEAST <= count <= MOST:
        raise OptionError(f"candidates are {count}; accepted is {LEAST} to {MOST}")


def _observe(
    stack: ImageStack, analysis: Analysis, image: int, source: Source, Ts: float, seed: int
) -> _Drawn:
    pixels = choose_pixels(stack, seed, MOST_PIXELS)
    flat = stack.images.reshape(len(stack.images), -1)
    if source == "base images":
        A = np.stack([flat[base, pixels] for base in analysis.base_images])
    else:
        A = analysis.linearized_bases.reshape(3, -1)[:, pixels]
        known = np.isfinite(A).all(axis=0)
        A, pixels = np.ascontiguousarray(A[:, known]), pixels[known]
    x = flat[image, pixels]
    lit = x >= np.float32(Ts)
    if np.count_nonzero(lit & (x > 0)) < 3:
        raise DegenerateError(
            f"image {image} is lit in fewer than three of the object's pixels (i >= Ts = {Ts:g}), "
            "so that no candidate tells of its light; lower Ts or choose another image"
        )
    return _Drawn(x, A, lit)


def _solve(
    x: NDArray[np.float32],
    A: NDArray[np.float32],
    base_images: tuple[int, int, int],
    count: int,
    seed: int,
) -> NDArray[np.float32]:
    """(N,3) finite candidates, in the precision and order of the published methods' loops."""
    triples, inverses = draw_pixels(A, base_images, count, seed)
    y = x[triples]
    with np.errstate(over="ignore", invalid="ignore"):
        v = inverses[:, :, 0] * y[:, :1] + inverses[:, :, 1] * y[:, 1:2]
        v += inverses[:, :, 2] * y[:, 2:]
    v = v[np.isfinite(v).all(axis=1)].astype(np.float32)
    if len(v) == 0:
        raise DegenerateError(
            f"base images {base_images}: no three pixels give finite coefficients; choose others"
        )
    return v


def _count(
    drawn: _Drawn, candidates: NDArray[np.float32], T: float, source: Source, talk: Talk
) -> NDArray[np.int32]:
    """(N,) support of each candidate. A dark pixel is A or C whatever a candidate says."""
    diffuse, score = (np.empty(len(candidates), np.int32) for _ in range(2))
    x, A = drawn.x[drawn.lit], np.ascontiguousarray(drawn.A[:, drawn.lit])

    def work(start: int, stop: int) -> None:
        score_candidates(x, A, candidates, np.float32(T), diffuse, score, start, stop)

    run_blocks(work, len(candidates), BLOCK, stage="candidates", **talk._asdict())
    dark = len(drawn.x) - len(x)
    return (diffuse if source == "base images" else score) + np.int32(dark)


def _follow_centre(v: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(S,3) centres of gravity and (S,) of how many candidates each is."""
    n = len(v)
    path, left = np.empty((n, 3)), np.empty(n, np.int64)
    steps = centre_path(v.astype(np.float64), ceil(KEEP * n), path, left)
    return path[:steps].copy(), left[:steps].copy()


def _measure(
    coefficients: ArrayLike, best: NDArray[np.float32], gram: NDArray[np.float64]
) -> NDArray[np.float64]:
    """`Cloud.distances` of coefficients (...,3) from `best`."""
    whole = best.astype(np.float64)
    away = np.asarray(coefficients, np.float64) - whole
    squares = [np.einsum("...i,ij,...j", v, gram, v) for v in (away, whole)]
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.sqrt(np.maximum(squares[0], 0) / squares[1])
    return np.where(squares[0] > 0, relative, 0.0)
