"""Figures of the paper for the browser to save: of what is on screen, by T and Ts on screen."""

from dataclasses import replace

from photolin.analysis import METHODS, Analysis, Cancel, Method, Progress
from photolin.errors import Cancelled
from photolin.export import safe_name
from photolin.figures import FIGURES, OF_ALL_METHODS, OF_ONE_IMAGE, Figure, draw_figure

from .runs import Runs
from .state import ViewState

KINDS: dict[str, Figure] = {f"figure {figure}": figure for figure in FIGURES}
"""Kinds of downloads, and which figure each is."""


def make_figure(
    runs: Runs, kind: str, progress: Progress, cancel: Cancel, shown: Analysis, state: ViewState
) -> tuple[str, bytes]:
    """Name and bytes of a figure; where it sets methods side by side, the others are run first.

    Args:
        kind: one of KINDS.
        shown: the result of the method on screen, labelled by the thresholds of `state`.

    Raises:
        Cancelled: `cancel` returned true.
    """
    figure = KINDS[kind]
    results: dict[Method, Analysis] = {state.method: shown}
    for method in METHODS if figure in OF_ALL_METHODS else ():
        if method not in results:
            options = replace(runs.options, method=method, T=state.T, Ts=state.Ts)
            try:
                results[method] = runs.run(options, progress, cancel)
            except Cancelled as error:
                raise Cancelled(f"{kind} cancelled; nothing is saved") from error
    progress("drawing", 0.9)
    stem = safe_name(runs.stack.title) or "stack"
    image = f"_{state.image:03d}" if figure in OF_ONE_IMAGE else ""
    picture = draw_figure(figure, runs.stack, results, state.image, runs.truth)
    return f"{stem}{image}_{kind.replace(' ', '_')}.png", picture
