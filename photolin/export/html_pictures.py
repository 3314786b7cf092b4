"""Small pictures inside a page: images with their labels over them, normals, albedo."""

import base64
import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..analysis import Analysis
from ..factors import OUTSIDE, PALETTE, Factor
from ..sample import choose_pixels
from ..stack import ImageStack

EDGES = (256, 208, 160, 128, 96, 64, 48)
"""Longer sides of thumbnails, pixels; the first that BUDGET allows is taken."""
BUDGET = 2_000_000
"""Bytes of all thumbnails in the page, about."""
PROBES = 8
"""Images whose thumbnails tell how large all will be."""
LARGE = 512
"""Longer side of the pictures of a surface, pixels."""
OPACITY, DIFFUSE_OPACITY = 0.55, 0.15
"""Of the classes, and of diffuse, which is everywhere: the eye should go to the rest."""
DIM = 0.4
"""Brightness outside the mask."""
GRAY = 128
GAMMA = 1 / 2.2
"""Exponent that shows linear values to the eye."""


def thumbnails(analysis: Analysis, stack: ImageStack | None = None) -> list[str]:
    """A data URI for each image: brightened, with the classes over it in their colours.

    Without the stack, the label maps alone. Their size is the largest of EDGES that keeps all of
    them within BUDGET, and never larger than the images.
    """
    gain = 1.0 if stack is None else choose_gain(stack)
    K = len(analysis.names)

    def make(k: int, edge: int) -> str:
        image = None if stack is None else stack.images[k]
        return _jpeg(shrink(overlay(image, analysis.labels[k], gain, edge), edge), 75)

    made: list[str] = []
    for edge in EDGES:
        probes = [len(make(k, edge)) for k in range(0, K, max(1, K // PROBES))]
        if np.mean(probes) * K <= BUDGET or edge == EDGES[-1]:
            made = [make(k, edge) for k in range(K)]
            if sum(map(len, made)) <= BUDGET:
                break
    return made


def overlay(
    image: NDArray[np.float32] | None, labels: NDArray[np.uint8], gain: float, edge: int
) -> NDArray[np.uint8]:
    """Colour picture (h,w,3) of an image with its labels over it, dimmed outside the mask.

    Args:
        image: (H,W), fraction of full scale; None for labels on gray.
        labels: (H,W) Factor codes.
        gain: display factor of the image.
        edge: rows and columns are left out evenly until about four times this is left.
    """
    step = max(1, max(labels.shape) // (4 * edge))
    labels = labels[::step, ::step]
    gray = np.full(labels.shape, GRAY, np.float32)
    opacity = dict.fromkeys(Factor, 1.0)
    if image is not None:
        gray = 255 * (gain * image[::step, ::step]).clip(0, 1) ** np.float32(GAMMA)
        opacity = {f: DIFFUSE_OPACITY if f is Factor.DIFFUSE else OPACITY for f in Factor}
    gray = np.where(labels == OUTSIDE, np.float32(DIM) * gray, gray)
    colours, alpha = np.zeros((256, 3), np.float32), np.zeros(256, np.float32)
    for factor, colour in PALETTE.items():
        colours[factor], alpha[factor] = colour, opacity[factor]
    a = alpha[labels][:, :, None]
    return np.round((1 - a) * gray[:, :, None] + a * colours[labels]).astype(np.uint8)


def choose_gain(stack: ImageStack) -> float:
    """One factor for all images, so that they can be compared: the 99.5th percentile is white."""
    few = stack.images.reshape(len(stack.images), -1)[:, choose_pixels(stack, 0)]
    high = float(np.quantile(few, 0.995))
    return 1 / high if high > 0 else 1.0


def normals_picture(normals: NDArray[np.float32]) -> str:
    """A data URI of (H,W,3) unit normals: red x right, green y up, blue z to the camera; gray
    outside the mask and where undetermined."""
    return _jpeg(shrink(np.round(127.5 * np.nan_to_num(normals) + 127.5).astype(np.uint8), LARGE))


def albedo_picture(albedo: NDArray[np.float32]) -> str:
    """A data URI of (H,W) albedo, its 99.5th percentile white, black where undetermined."""
    known = np.nan_to_num(albedo)
    there = known[known > 0]
    white = float(np.quantile(there, 0.995)) if there.size else 1.0
    return _jpeg(
        shrink(np.round(255 * (known / white).clip(0, 1) ** GAMMA).astype(np.uint8), LARGE)
    )


def shrink(picture: NDArray[np.uint8], edge: int) -> Image.Image:
    """The picture with a longer side of at most `edge` pixels, by averages."""
    image = Image.fromarray(picture)
    scale = min(1.0, edge / max(image.size))
    width, height = (max(1, round(scale * side)) for side in image.size)
    return image.resize((width, height), Image.Resampling.BOX)


def _jpeg(image: Image.Image, quality: int = 85) -> str:
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=quality)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode()
