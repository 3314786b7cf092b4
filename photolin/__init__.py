"""Photometric linearization and classification of image stacks with unknown lights.

    stack = load_stack("folder")
    analysis = analyze(stack)
    analysis.labels        # (K,H,W): diffuse, specular, attached shadow, cast shadow, undefined
    analysis.linearized(0) # (H,W): image 0 with nothing but diffuse reflection, signed

After Mukaigawa, Ishii and Shakunaga, "Analysis of photometric factors based on photometric
linearization", JOSA A 24(10), 2007. Pixels are (row, column); in space x is right, y up, z to the
camera.
"""

from .analysis import Analysis, Options
from .errors import PhotolinError
from .evaluate import evaluate
from .export import load_result, save_result
from .factors import OUTSIDE, Factor, Thresholds, classifiable, classify
from .load import LoadOptions, load_stack
from .pipeline import analyze
from .stack import ImageStack
from .synthetic import load_truth, render_scene
from .thresholds import suggest_thresholds

__all__ = [
    "OUTSIDE",
    "Analysis",
    "Factor",
    "ImageStack",
    "LoadOptions",
    "Options",
    "PhotolinError",
    "Thresholds",
    "analyze",
    "classifiable",
    "classify",
    "evaluate",
    "load_result",
    "load_stack",
    "load_truth",
    "render_scene",
    "save_result",
    "suggest_thresholds",
]
