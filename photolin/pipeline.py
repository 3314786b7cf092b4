"""analyze(): from a stack to its linearization and labels. The only place where stages meet."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from .analysis import Analysis, Cancel, Confidence, Options, Progress
from .blocks import Talk
from .coefficients import estimate_coefficients, relate_to_bases
from .confidence import doubt_dimensions, doubt_distance, find_doubts, measure_confidence
from .dimensions import fit_plane
from .errors import DegenerateError, OptionError
from .factorize import Factorization
from .factors import Thresholds
from .label import label_images
from .light_powers import doubt_powers, is_uneven
from .linearize import Quality, linearize
from .near_light import compare_regions
from .sample import Sample, draw_sample
from .saturation import find_white
from .stack import ImageStack
from .thresholds import Suggestion, linearize_sample, suggest_from_sample

DOUBTED_PIXELS = 2000
"""Sampled pixels that tell whether the stack is one of three dimensions and distant lights."""


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
    # a sum's last digits depend on how many threads of BLAS share it; our own do not
    with threadpool_limits(1, "blas"):
        return run_stages(stack, options, Talk(threads, progress, cancel))


def run_stages(stack: ImageStack, options: Options, talk: Talk) -> Analysis:
    """All stages in order, each from the results of those before."""
    seconds: dict[str, float] = {}
    with timed("thresholds", seconds, talk.progress):
        white = find_white(stack)
        sample = draw_sample(stack, options.seed, white)
        suggestion = suggest_from_sample(sample, options, stack.lights, talk.cancel)
    thresholds, base_images = suggestion.thresholds, suggestion.starts[0]
    found = suggestion.found
    quality = Quality(white, 0.0 if found is None else found.noise.absolute)
    with timed("coefficients", seconds, talk.progress):
        coefficients = find_coefficients(stack, suggestion, options, talk)
    with timed("linearize", seconds, talk.progress):
        bases, margin = linearize(
            stack, coefficients, base_images, thresholds, options, quality, *talk
        )
    with timed("classify", seconds, talk.progress):
        labels = label_images(
            *(stack.images, bases, coefficients, stack.mask, thresholds),
            threads=talk.threads,
            cancel=talk.cancel,
        )
    with timed("confidence", seconds, talk.progress):
        confidence = measure_confidence(
            *(stack, coefficients, bases, labels, margin, thresholds, quality),
            talk.threads,
            talk.cancel,
        )
        doubts = (
            *doubt_blackness(suggestion),
            *find_doubts(stack, confidence, thresholds),
            *doubt_lights(stack, sample, found, options, thresholds),
            *doubt_strength(stack, sample, confidence, suggestion, options, talk.cancel),
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
        confidence=confidence,
        warnings=(*stack.warnings, *doubts),
    )


def find_coefficients(
    stack: ImageStack, suggestion: Suggestion, options: Options, talk: Talk
) -> NDArray[np.float64]:
    """Step 1, (K,3): from known lights, as found on the sample, or as published."""
    base_images = suggestion.starts[0]
    if stack.lights is not None:
        coefficients = stack.lights
    elif options.method == "robust" and suggestion.found is not None:
        coefficients = suggestion.found.coefficients
    else:
        coefficients = estimate_coefficients(
            stack, base_images, suggestion.thresholds, options, *talk
        )
    return relate_to_bases(coefficients, base_images)


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


def doubt_lights(
    stack: ImageStack,
    sample: Sample,
    found: Factorization | None,
    options: Options,
    thresholds: Thresholds,
) -> list[str]:
    """Whether lights found in the sample lie in a plane, or any are near."""
    if found is None:
        return []
    few, known = sample.thin(DOUBTED_PIXELS), found.thin(DOUBTED_PIXELS)
    plane = fit_plane(few, known, thresholds) if stack.lights is None else None
    rows, columns = np.divmod(few.places, stack.shape[2])
    regions = compare_regions(few, rows, columns, known, thresholds)
    # where one dimension is noise, it differs between parts of the picture too
    return doubt_dimensions(plane) or doubt_distance(regions)


def doubt_strength(
    stack: ImageStack,
    sample: Sample,
    confidence: Confidence,
    suggestion: Suggestion,
    options: Options,
    cancel: Cancel | None,
) -> list[str]:
    """Whether known lights have other powers; finding those takes as long as unknown lights do."""
    if stack.lights is None or not is_uneven(confidence.gain):
        return []
    Ts, starts = suggestion.thresholds.Ts, list(suggestion.starts)
    try:
        free = linearize_sample(sample, starts, Ts, options, None, cancel)
    except DegenerateError:
        return []
    return doubt_powers(stack.lights, stack.names, free.coefficients)


def describe_choices(options: Options, suggestion: Suggestion) -> list[str]:
    """Sentences on what was chosen because it was not given."""
    t = suggestion.thresholds
    notes = []
    if options.T is None and suggestion.found is not None:
        noise = 100 * suggestion.found.noise.relative
        notes.append(
            f"T = {t.T:g} suggested: lets pass nearly all noise, whose standard deviation is "
            f"{noise:.2f} % of the intensity; raise T if diffuse areas are speckled"
        )
    if options.Ts is None:
        notes.append(f"Ts = {t.Ts:g} suggested: the upper end of the shadows' gray levels")
    if options.base_images is None:
        notes.append(
            f"base images {suggestion.starts[0]} chosen: large common lit region, spread lights"
        )
    return notes


def doubt_blackness(suggestion: Suggestion) -> list[str]:
    """Whether a constant lies on all images, as of ambient light or a camera's black level."""
    if suggestion.offset == 0:
        return []
    return [
        f"shadows are not black but {suggestion.offset:.4f} of full scale: ambient light or a "
        f"black level; subtract it with the option offset ({suggestion.offset:.4f}) or a dark frame"
    ]
