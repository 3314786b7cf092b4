"""Albedo in colour, read again from the files of a stack."""

from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from photolin.analysis import Analysis, Options
from photolin.load import LoadOptions, load_stack
from photolin.pipeline import analyze
from photolin.shape.channels import measure_colour
from photolin.shape.recover import Shape, recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.synthetic import render_scene

STACK = render_scene("sphere_obstacles", size=(36, 48), images=9).stack
SHARES = (1.0, 0.5, 0.25)
"""Of the gray in red, green and blue."""


def write(folder: Path, shares: tuple[float, ...]) -> Path:
    folder.mkdir()
    for k, image in enumerate(STACK.images):
        planes = [np.round(share * image * 65535) for share in shares]
        pixels = np.stack(planes, axis=-1).astype(np.uint16).squeeze()
        (folder / f"{k}.png").write_bytes(imagecodecs.png_encode(pixels))
    return folder


def shape_of(folder: Path, reading: LoadOptions) -> tuple[Analysis, Shape]:
    stack = load_stack(folder, reading)
    result = analyze(stack, Options(T=0.05, Ts=0.02, samples=50))
    return result, recover_shape(stack, result, resolve_ambiguity(result), depth=False)


def ignore(stage: str, fraction: float) -> None:
    """Nobody is told."""


@pytest.mark.parametrize("exclude", [(), (2, 5)])
def test_channels_have_their_shares_of_albedo(tmp_path: Path, exclude: tuple[int, ...]) -> None:
    folder, reading = write(tmp_path / "stack", SHARES), LoadOptions(exclude=exclude)
    result, found = shape_of(folder, reading)
    assert len(result.labels) == 9 - len(exclude)
    colour = measure_colour(folder, reading, result, found, ignore)
    assert colour is not None
    lit = np.isfinite(colour).all(axis=2) & (colour[..., 0] > 0.05)
    assert lit.sum() > 300
    for channel, share in enumerate(SHARES):
        ratios = colour[..., channel][lit] / colour[..., 0][lit]
        assert np.median(ratios) == pytest.approx(share, rel=1e-3)


def test_gray_images_have_no_colour(tmp_path: Path) -> None:
    folder = write(tmp_path / "stack", (1.0,))
    assert measure_colour(folder, LoadOptions(), *shape_of(folder, LoadOptions()), ignore) is None


def test_arrays_have_no_colour(tmp_path: Path) -> None:
    path = tmp_path / "stack.npz"
    np.savez(path, images=STACK.images, mask=STACK.mask)
    assert measure_colour(path, LoadOptions(), *shape_of(path, LoadOptions()), ignore) is None
