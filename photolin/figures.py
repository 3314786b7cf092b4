"""Figures 6, 8, 10, 11 and 15 of Mukaigawa et al. (2007), made of one's own results.

Each is a PNG of panels with captions under them. Equal arguments give equal bytes.
"""

from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from .analysis import Analysis, Method
from .errors import OptionError
from .evaluate import tabulate
from .factors import OUTSIDE, PALETTE, TITLES, Factor
from .panels import Panel, Picture, compose_sheet
from .stack import ImageStack

Figure = Literal["6", "8", "10", "11", "15"]
FIGURES: tuple[Figure, ...] = get_args(Figure)
OF_ONE_IMAGE: tuple[Figure, ...] = ("6", "10")
"""Figures of the image that is named; the others are of all or of the base images."""
OF_ALL_METHODS: tuple[Figure, ...] = ("6", "8", "15")
"""Figures that set methods side by side; the others are of one."""
ROLES: Mapping[Method, str] = {
    "statistical": "previous method",
    "classification": "method of 2007",
    "robust": "photolin",
}
"""What the panels call methods."""

ORDER: tuple[Method, ...] = ("statistical", "classification", "robust")
"""Of the panels: that of the paper, then our own."""

SMALLEST, SHEET = 200, 480
"""Longer side of a panel at least, and about that of all images on one sheet, pixels."""
BETWEEN = 200
"""Gray between the images of a sheet, which may be white or black themselves."""
ZERO = 128
"""Gray of zero in a signed picture."""


def draw_figure(
    figure: Figure,
    stack: ImageStack,
    results: Mapping[Method, Analysis],
    image: int = 0,
    truth: NDArray[np.uint8] | None = None,
) -> bytes:
    """A figure of the paper as PNG; its text is in the chunk Description too.

    6: label maps of one image by each method, and the truth. 8: the base images, and linearized by
    each method. 10: one image, linearized, and where each of D, S, A and C is, black. 11: the same
    of all images. 15: the linearized base images by each method.

    Args:
        results: of this stack, by the methods that are shown; figures 10 and 11 are of the first.
        image: number of the image of figures 6 and 10.
        truth: (K,H,W) true Factor codes, for figure 6.

    Raises:
        OptionError: no such figure or image, no result, or one of another stack.
    """
    if figure not in FIGURES:
        raise OptionError(f"figure is {figure!r}; accepted are {', '.join(FIGURES)}")
    _check(stack, results, image, truth)
    first = next(iter(results.values()))
    match figure:
        case "6":
            rows, what = [_classifications(results, image, truth)], f"image {image}"
        case "8":
            rows, what = [_inputs(stack, first), *_bases(stack, results)], "base images"
        case "15":
            rows, what = _bases(stack, results), "linearized base images"
        case "10":
            rows, what = _factors(stack, first, [image]), f"image {image}"
        case "11":
            count = len(stack.images)
            rows, what = _factors(stack, first, range(count)), f"all {count} images"
    used = first.thresholds
    text = f"As Fig. {figure}: {stack.title}, {what}. T {used.T:.4f}, Ts {used.Ts:.4f}."
    if figure not in OF_ALL_METHODS:
        text += f" Method {first.options.method}."
    return compose_sheet(_lettered(rows), text, legend=figure == "6")


def _check(
    stack: ImageStack,
    results: Mapping[Method, Analysis],
    image: int,
    truth: NDArray[np.uint8] | None,
) -> None:
    if not results:
        raise OptionError("there is no result to draw; accepted is one by any method, or more")
    shapes = {analysis.labels.shape for analysis in results.values()}
    if truth is not None:
        shapes.add(truth.shape)
    if shapes != {stack.shape}:
        others = ", ".join(str(shape) for shape in sorted(shapes - {stack.shape}))
        raise OptionError(
            f"results or truth are of shape {others}; accepted is that of the stack, {stack.shape}"
        )
    if len({analysis.thresholds for analysis in results.values()}) > 1:
        raise OptionError("results are of different T and Ts; accepted are those of the same")
    if not 0 <= image < len(stack.images):
        raise OptionError(f"image is {image}; accepted is 0 to {len(stack.images) - 1}")


def _classifications(
    results: Mapping[Method, Analysis], image: int, truth: NDArray[np.uint8] | None
) -> list[Panel]:
    panels = []
    for method, analysis in _ordered(results):
        labels = analysis.labels[image]
        caption = f"{ROLES[method]} ({method})"
        if truth is not None:
            inside = labels != OUTSIDE
            _, confusion = tabulate(labels[inside], truth[image][inside])
            caption += f", macro accuracy {np.nanmean(confusion.diagonal()):.2f} %"
        panels.append(Panel(_coloured(labels), caption))
    if truth is not None:
        panels.append(Panel(_coloured(truth[image]), "ground truth"))
    return panels


def _inputs(stack: ImageStack, analysis: Analysis) -> list[Panel]:
    bases = analysis.base_images
    white = max(float(stack.images[list(bases)][:, stack.mask].max()), 1e-6)
    return [Panel(_grey(stack.images[k] / white), f"image {k}") for k in bases]


def _bases(stack: ImageStack, results: Mapping[Method, Analysis]) -> list[list[Panel]]:
    """The base images of the first result, linearized by each, all to one scale."""
    bases = next(iter(results.values())).base_images
    made: list[tuple[Method, list[NDArray[np.float32]]]] = [
        (m, [a.linearized(k) for k in bases]) for m, a in _ordered(results)
    ]
    scale = _scale([one for _, images in made for one in images], stack.mask)
    return [
        [
            Panel(
                _signed(one, scale),
                f"image {k}, {ROLES[m]} ({m}), ±{scale:.3f} of full scale, zero gray",
            )
            for k, one in zip(bases, images, strict=True)
        ]
        for m, images in made
    ]


def _factors(stack: ImageStack, analysis: Analysis, images: Sequence[int]) -> list[list[Panel]]:
    """Input, linearized, and black where D, S, A and C are; many images as sheets of small ones."""
    signed = [analysis.linearized(k) for k in images]
    scale = _scale(signed, stack.mask)
    white = max(float(stack.images[list(images)][:, stack.mask].max()), 1e-6)

    def sheet(pictures: Sequence[Picture], caption: str) -> Panel:
        return Panel(_tile(pictures), caption)

    panels = [
        sheet([_grey(stack.images[k] / white) for k in images], "input"),
        sheet(
            [_signed(one, scale) for one in signed],
            f"linearized, ±{scale:.3f} of full scale, zero gray",
        ),
    ]
    labels = analysis.labels[list(images)]
    inside = max(int((labels != OUTSIDE).sum()), 1)
    for factor in (Factor.DIFFUSE, Factor.SPECULAR, Factor.ATTACHED, Factor.CAST):
        share = 100 * int((labels == factor).sum()) / inside
        masks = [_grey((one != factor).astype(np.float32)) for one in labels]
        panels.append(sheet(masks, f"{TITLES[factor]}, {share:.2f} % (black)"))
    return [panels[:2], panels[2:4], panels[4:]] if len(images) == 1 else [panels[:3], panels[3:]]


def _ordered(results: Mapping[Method, Analysis]) -> list[tuple[Method, Analysis]]:
    return [(method, results[method]) for method in ORDER if method in results]


def _scale(signed: Sequence[NDArray[np.float32]], mask: NDArray[np.bool_]) -> float:
    """Symmetric range of pictures: the 99.5th percentile of |values|, above 0."""
    values = np.abs(np.concatenate([one[mask] for one in signed]))
    values = values[np.isfinite(values)]
    return max(float(np.percentile(values, 99.5)), 1e-6) if values.size else 1.0


def _grey(share: NDArray[np.float32]) -> Picture:
    """(H,W,3) of 0 black to 1 white."""
    grey = np.round(255 * np.clip(share, 0, 1)).astype(np.uint8)
    return np.repeat(grey[:, :, None], 3, axis=2)


def _signed(values: NDArray[np.float32], scale: float) -> Picture:
    """(H,W,3): zero, and what is not known, is ZERO; ±scale is 255 and 1."""
    steps = np.nan_to_num(np.clip(values / np.float32(scale), -1, 1), nan=0.0)
    grey = np.round(ZERO + 127 * steps).astype(np.uint8)
    return np.repeat(grey[:, :, None], 3, axis=2)


def _coloured(labels: NDArray[np.uint8]) -> Picture:
    """(H,W,3) in the colours of the classes; black outside the mask."""
    colours = np.zeros((256, 3), np.uint8)
    for factor, colour in PALETTE.items():
        colours[factor] = colour
    return colours[labels]


def _tile(pictures: Sequence[Picture]) -> Picture:
    """Pictures on one sheet, row by row, small ones made by leaving out rows and columns."""
    H, W, _ = pictures[0].shape
    if len(pictures) == 1:
        return pictures[0]
    across = int(np.ceil(np.sqrt(len(pictures) * H / W)))
    step = max(1, round(across * W / SHEET))
    small = [picture[::step, ::step] for picture in pictures]
    h, w, _ = small[0].shape
    down = -(-len(small) // across)
    sheet = np.full((down * (h + 2) - 2, across * (w + 2) - 2, 3), BETWEEN, np.uint8)
    for n, one in enumerate(small):
        top, left = n // across * (h + 2), n % across * (w + 2)
        sheet[top : top + h, left : left + w] = one
    return sheet


def _enlarge(picture: Picture) -> Picture:
    """By a whole number, until it is large enough to be seen."""
    times = -(-SMALLEST // max(picture.shape[:2]))
    return picture.repeat(times, axis=0).repeat(times, axis=1)


def _lettered(rows: list[list[Panel]]) -> list[list[Panel]]:
    """With (a), (b), … before the captions, as in the paper."""
    letters = iter("abcdefghijklmnopqrstuvwxyz")
    return [[Panel(_enlarge(p.picture), f"({next(letters)}) {p.caption}") for p in r] for r in rows]
