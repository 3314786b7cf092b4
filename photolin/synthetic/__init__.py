"""Scenes whose every pixel is known: labels, ideal images, normals, depth and lights.

A numpy ray caster: orthographic camera, one distant light for each image, Lambert plus a Phong
highlight, hard cast shadows. No interreflection and no anti-aliasing, so the truth is exact.
"""

from .files import load_truth, write_scene
from .render import Scene, Truth, render_scene
from .scenes import SCENES

__all__ = ["SCENES", "Scene", "Truth", "load_truth", "render_scene", "write_scene"]
