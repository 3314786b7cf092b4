"""The verb that compares with ground truth."""

from collections.abc import Mapping
from pathlib import Path

from tyro.conf import Positional

from ..analysis import METHODS, Analysis, Method, Options
from ..console import explain_measures, progress_bar, stop_at_ctrl_c, thresholds
from ..errors import DegenerateError, InputError
from ..evaluate import Evaluation, format_evaluation, light_error, measure_surface
from ..evaluate import evaluate as measure
from ..export import is_result, load_result, load_result_stack, load_shape
from ..load import LoadOptions
from ..paper import compare_surfaces_with_paper, compare_with_paper
from ..pipeline import analyze
from ..shape.compare_methods import compare_methods
from ..shape.compare_surface import describe_errors
from ..shape.recover import Shape
from ..shape.true_surface import TrueSurface, is_benchmark, read_benchmark, surface_of
from ..stack import ImageStack
from ..synthetic import Truth, load_truth
from . import read_stack


def evaluate(
    path: Positional[Path],
    truth: Positional[Path | None] = None,
    reading: LoadOptions = LoadOptions(),
    *,
    T: float | None = None,
    Ts: float | None = None,
    seed: int = 0,
    threads: int | None = None,
) -> None:
    """Compare with ground truth: one result, or all three methods on a stack.

    Labels, linearized images and, of a stack or a result of shape, normals and depth. Without known
    lights, five points of the truth's normals stand for the user's knowledge of a stack.

    Args:
        path: Folder that run or shape wrote, or a stack. A stack is analyzed by each method in
            turn.
        truth: gt.npz, the folder that holds it, or a folder of DiLiGenT (normals and lights
            alone); the stack's own when left out.
        T: Relative tolerance for a stack, above 0 up to 1; suggested when left out.
        Ts: Shadow level for a stack, fraction of full scale; suggested when left out.
        seed: Seed for a stack.
        threads: Processors to use; all when left out.
    """
    if is_result(path):
        if truth is None:
            raise InputError(
                f"{path}: is a result; name its ground truth after it: gt.npz, "
                "the folder that holds it, or a folder of DiLiGenT"
            )
        measured = evaluate_result(path, truth)
        print(f"{measured}\n{explain_measures(measured)}")
        return
    answer, surface = read_truth(path if truth is None else truth)
    with progress_bar() as progress, stop_at_ctrl_c() as cancel:
        images, _ = read_stack(path, reading, progress)
        each = [Options(method, T, Ts, seed=seed) for method in METHODS]
        results: dict[Method, Analysis] = {
            o.method: analyze(images, o, threads=threads, progress=progress, cancel=cancel)
            for o in each
        }
        labels = "" if answer is None else compare_labels(results, answer, images)
        try:
            found = compare_methods(
                images, results, surface, threads=threads, progress=progress, cancel=cancel
            )
            surfaces = compare_surfaces_with_paper(found)
        except DegenerateError as error:
            surfaces = f"Table 3 is left out: {error}"
    for method, result in results.items():
        print(f"{method}: {thresholds(result)}, {result.seconds['total']:.2f} s")
    print(f"{labels}{surfaces}\n{explain_measures(labels + surfaces)}")


def evaluate_result(path: Path, truth: Path) -> str:
    """What there is to say of one result: of its surface alone where the truth has no labels."""
    result, shape = load_result(path), load_shape(path)
    title = f"{result.title}, {result.options.method}, {thresholds(result)}"
    answer, surface = read_truth(truth)
    if answer is not None:
        return format_evaluation(_measure(result, answer, _stack_of(path), shape), title)
    lines = [title]
    if surface.lights is not None and surface.lights.shape == result.coefficients.shape:
        error = light_error(result.coefficients, surface.lights)
        lines.append(f"light error         {error:.3f} degrees")
    if shape is None:
        lines.append("no normals: photolin shape adds them to a result")
    else:
        lines += describe_errors(measure_surface(shape, surface))
    return "\n".join(lines)


def read_truth(path: Path) -> tuple[Truth | None, TrueSurface]:
    """The truth of a stack, None where only its surface is known, and that surface."""
    if is_benchmark(path):
        return None, read_benchmark(path)
    truth = load_truth(path)
    return truth, surface_of(truth, path)


def compare_labels(results: Mapping[Method, Analysis], truth: Truth, images: ImageStack) -> str:
    """Tables 1 and 2 and an empty line."""
    measured: dict[Method, Evaluation] = {
        method: _measure(result, truth, images) for method, result in results.items()
    }
    return compare_with_paper(measured) + "\n\n"


def _measure(
    result: Analysis, truth: Truth, stack: ImageStack | None, shape: Shape | None = None
) -> Evaluation:
    images = None if stack is None else stack.images
    return measure(
        result.labels, result.coefficients, result.linearized_bases, truth, images, shape
    )


def _stack_of(result: Path) -> ImageStack | None:
    """The stack of a result, None where it is not there any more."""
    try:
        return load_result_stack(result)
    except InputError:
        return None
