"""Verbs that make a stack or say what one is."""

from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from ..console import progress_bar, stack_summary
from ..load import LoadOptions
from ..synthetic import render_scene, write_scene
from . import read_stack


def synth(
    name: Positional[str],
    out: Positional[Path],
    *,
    size: tuple[int, int] | None = None,
    images: int | None = None,
    noise: float = 0.0,
    bits: Literal[8, 16] = 16,
    ambient: float = 0.0,
    seed: int = 0,
    lights: bool = False,
) -> None:
    """Render a scene with exact ground truth: images and gt.npz.

    Args:
        name: sphere_cone, cup, pot or sphere_obstacles.
        out: New folder for the images and their truth.
        size: Rows and columns, 16 to 4096; the scene's own when left out.
        images: Number of images, one light each, 6 to 1000; the scene's own when left out.
        noise: Standard deviation of Gaussian noise, fraction of full scale.
        bits: Bits of a pixel.
        ambient: Constant light added everywhere, fraction of full scale.
        seed: Seed of the noise.
        lights: Write lights.txt too, so that the lights are known: a line of name x y z for each
            image, of the length of its power; x right, y up, z to the camera.
    """
    scene = render_scene(
        name, size=size, images=images, seed=seed, noise=noise, bits=bits, ambient=ambient
    )
    write_scene(scene, out, lights=lights)
    K, H, W = scene.stack.shape
    also = ", gt.npz and lights.txt" if lights else " and gt.npz"
    print(f"written {K} images of {H} rows x {W} columns{also} to {out}")


def info(stack: Positional[Path], reading: LoadOptions = LoadOptions()) -> None:
    """Say what is read from a stack: size, transfer, mask, lights, brightness of each image.

    Args:
        stack: What run accepts.
    """
    with progress_bar() as progress:
        images, seconds = read_stack(stack, reading, progress)
    print(stack_summary(images))
    print(f"read in {seconds:.2f} s")
