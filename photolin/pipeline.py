"""analyze(): from a stack to its linearization and labels. The only place where stages meet."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from .analysis import Analysis, Cancel, Options, Progress
from .coefficients import estimate_coefficients
from .errors import DegenerateError, OptionError
from .factorize import search_coefficients
from .label import label_images
from .linearize import linearize
from .refine import refine_coefficients
from .sample import Sample, draw_sample
from .stack import ImageStack
from .thresholds import Suggestion, suggest_thresholds


def analyze(
    stack: ImageStack,
    options: Options | None = None,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Analysis:
    """Linearize a stack and label every pixel of every image.

    Args:
        stack: the input; its lights, where known, take the place of step 1.
        options: method, thresholds, base images, samples and seed.
        threads: processors to use, all when left out; the result does not depend on it.
        progress: told the stage and the fraction of it that is done, from 0 to 1 in each.
        cancel: asked between blocks of work.

    Raises:
        OptionError: base images that the stack does not have, or fewer than one thread.
        DegenerateError: the images do not determine a solution.
        Cancelled: `cancel` returned true.
    """
    options = options or Options()
    check_base_images(options, stack)
    if threads is not None and threads < 1:
        raise OptionError(f"threads is {threads}; accepted is 1 or more")
    seconds: dict[str, float] = {}

    with timed("thresholds", seconds, progress):
        sample = draw_sample(stack, options.seed)
        suggestion = suggest_thresholds(sample, options, stack.lights, cancel)
    thresholds, base_images = suggestion.thresholds, suggestion.starts[0]

    with timed("coefficients", seconds, progress):
        if stack.lights is not None:
            coefficients = stack.lights
        elif options.method == "robust":
            coefficients = robust_coefficients(sample, suggestion, options, cancel)
        else:
            coefficients = estimate_coefficients(
                stack, base_images, thresholds, options, threads, progress, cancel
            )
        coefficients = relate_to_bases(coefficients, base_images)

    with timed("linearize", seconds, progress):
        bases = linearize(
            stack, coefficients, base_images, thresholds, options, threads, progress, cancel
        )

    with timed("classify", seconds, progress):
        labels = label_images(
            stack.images, bases, coefficients, stack.mask, thresholds, threads=threads
        )

    return Analysis(
        options=options,
        thresholds=thresholds,
        base_images=base_images,
        coefficients=coefficients,
        linearized_bases=bases,
        labels=labels,
        mask=stack.mask,
        names=stack.names,
        seconds=seconds | {"total": sum(seconds.values())},
        title=stack.title,
        lights=stack.lights,
        files=stack.files,
        notes=(*stack.notes, *describe_choices(options, suggestion)),
        warnings=(*stack.warnings, *find_doubts(bases, stack)),
    )


@contextmanager
def timed(stage: str, seconds: dict[str, float], progress: Progress | None) -> Iterator[None]:
    """Book the wall-clock time of the block under `stage`; tell of its start and its end."""
    tell = progress or (lambda stage, fraction: None)
    tell(stage, 0.0)
    start = perf_counter()
    yield
    seconds[stage] = perf_counter() - start
    tell(stage, 1.0)


def check_base_images(options: Options, stack: ImageStack) -> None:
    """Raise OptionError when a base image is not in the stack."""
    if options.base_images is not None and max(options.base_images) >= len(stack.images):
        raise OptionError(
            f"base_images is {options.base_images}; {stack.title} has images 0 to "
            f"{len(stack.images) - 1}"
        )


def robust_coefficients(
    sample: Sample, suggestion: Suggestion, options: Options, cancel: Cancel | None
) -> NDArray[np.float64]:
    """(K,3) on the sample; suggesting T has found them already."""
    if suggestion.coefficients is not None:
        return suggestion.coefficients
    t, seed, limit = suggestion.thresholds, options.seed, options.samples
    rough = search_coefficients(sample, suggestion.starts, t, seed, limit, cancel)
    return refine_coefficients(sample, rough, t.T, t.Ts, seed, limit, cancel).coefficients


def relate_to_bases(
    coefficients: NDArray[np.float64], base_images: tuple[int, int, int]
) -> NDArray[np.float64]:
    """The same coefficients with unit vectors in the rows of the base images.

    Raises:
        DegenerateError: the lights of the base images lie in one plane.
    """
    rows = coefficients[list(base_images)]
    if not np.linalg.cond(rows) < 1e6:
        raise DegenerateError(
            f"the lights of base images {base_images} lie in one plane; choose other base images"
        )
    related = coefficients @ np.linalg.inv(rows)
    related[list(base_images)] = np.eye(3)
    return related


def describe_choices(options: Options, suggestion: Suggestion) -> list[str]:
    """Sentences on what was chosen because it was not given."""
    t = suggestion.thresholds
    notes = []
    if options.T is None:
        notes.append(
            f"T = {t.T:g} suggested: from the noise below the fit, {suggestion.noise:.4f} of i"
        )
    if options.Ts is None:
        notes.append(f"Ts = {t.Ts:g} suggested: the upper end of the shadows' gray levels")
    if options.base_images is None:
        notes.append(
            f"base images {suggestion.starts[0]} chosen: large common lit region, spread lights"
        )
    return notes


def find_doubts(bases: NDArray[np.float32], stack: ImageStack) -> list[str]:
    """Sentences on what the result cannot tell."""
    undetermined = int(np.isnan(bases[0]).sum())
    if undetermined == 0:
        return []
    return [
        f"{undetermined} of {len(stack.pixels)} pixels are lit in fewer than three images "
        "and stay undetermined"
    ]
