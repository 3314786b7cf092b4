"""Near lights: coefficients that depend on where in the picture they are estimated."""

import numpy as np

from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.synthetic import render_scene


def relief(distance: float) -> ImageStack:
    """A relief two units wide under 16 point lights at `distance`, with a little noise."""
    rng = np.random.default_rng(0)
    H, W = 80, 100
    rows, columns = np.mgrid[0:H, 0:W]
    x, y = (columns - W / 2) / W * 2, (H / 2 - rows) / W * 2
    z = 0.12 * np.sin(3 * x + 1) * np.cos(4 * y) + 0.08 * np.cos(7 * x * y + 2)
    dy, dx = np.gradient(z, y[:, 0], x[0])
    normals = np.stack([-dx, -dy, np.ones_like(z)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    albedo = rng.uniform(0.5, 0.9, (H, W))
    images = []
    for _ in range(16):
        direction = rng.normal(size=3)
        direction[2] = abs(direction[2]) + 1
        direction /= np.linalg.norm(direction)
        to_light = direction * distance - np.stack([x, y, z], axis=-1)
        far = np.linalg.norm(to_light, axis=-1)
        cosine = np.maximum(0, (normals * to_light).sum(axis=-1) / far)
        images.append(albedo * cosine * (distance / far) ** 2)
    noisy = np.clip(np.array(images) * 0.8 + rng.normal(0, 0.002, (16, H, W)), 0, None)
    scaled = (noisy / (noisy.max() * 1.001)).astype(np.float32)
    return ImageStack(scaled, np.ones((H, W), bool), tuple(f"{k}.png" for k in range(16)))


def told(stack: ImageStack) -> list[str]:
    return [text for text in analyze(stack).warnings if "quarters of the picture" in text]


def test_near_lights_are_told_with_their_angle_and_that_of_noise() -> None:
    (text,) = told(relief(5))
    assert "degrees" in text and "from noise" in text and "near the object" in text


def test_distant_lights_are_not_taken_for_near_ones() -> None:
    assert told(relief(1000)) == []
    assert told(render_scene("pot", size=(80, 80), noise=0.01, bits=8).stack) == []
