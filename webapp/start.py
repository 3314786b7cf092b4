"""How a new tab begins: as the last one was kept, and as the command line asks. Pure."""

from dataclasses import replace

from photolin.factors import Thresholds

from .saved import Saved
from .selections import follow_image
from .source import Source
from .state import ViewState

FIRST = Thresholds(0.05, 0.02)
"""Where the sliders stand until thresholds are given or suggested."""


def start_from(source: Source, kept: Saved | None) -> Saved:
    """What a new tab shows.

    What the command line says of a stack goes before what was kept; a result comes with
    thresholds and exclusions of its own, and what was kept goes before them.

    Args:
        kept: the session, where there is one.
    """
    options, result = source.options, source.result
    if kept is None:
        T, Ts = options.T, options.Ts
        first = Thresholds(FIRST.T if T is None else T, FIRST.Ts if Ts is None else Ts)
        if result is not None:
            first = result.thresholds
        state = ViewState(method=options.method, T=first.T, Ts=first.Ts)
        return Saved(state, source.reading.exclude)
    if result is not None:
        return kept
    given = {name: value for name in ("T", "Ts") if (value := getattr(options, name)) is not None}
    if options.method != type(options)().method:
        given["method"] = options.method
    kept = replace(kept, state=replace(kept.state, **given))
    if exclude := source.reading.exclude:
        kept = leave_out(source, kept, exclude)
    return kept


def leave_out(source: Source, kept: Saved, exclude: tuple[int, ...]) -> Saved:
    """What was kept with other images left out, at the same image or the next one."""
    count = len(source.stack.images)
    image = follow_image(count, kept.state.image, kept.exclusions, exclude)
    return replace(kept, state=replace(kept.state, image=image), exclusions=exclude)
