"""A result as one web page to send to a colleague: no scripts, nothing fetched, light and dark.

Everything that is not the program's own goes through `escape`, as file names are anybody's.
"""

import html
import re
from collections.abc import Iterable, Sequence

import numpy as np

from ..analysis import Analysis
from ..errors import InputError
from ..factors import LETTERS, TITLES, css_colour
from ..sample import draw_sample
from ..saturation import find_white
from ..shadow_level import dark_histogram
from ..shape.recover import Shape
from ..stack import ImageStack
from .html_pictures import albedo_picture, choose_gain, normals_picture, thumbnails
from .html_plots import plot_histogram, plot_shares
from .html_style import STYLE
from .report import describe_analysis, program_version

MISLEADING = re.compile(r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
"""Control characters, and those that turn the direction of text around."""
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Content security policy: whatever the page holds, it runs and fetches nothing."""
BINS = 81


def report_html(
    analysis: Analysis,
    *,
    stack: ImageStack | None = None,
    shape: Shape | None = None,
    command: str | None = None,
    notes: str = "",
) -> bytes:
    """Encode a result as a single HTML file; equal arguments give equal bytes.

    Args:
        analysis: what to report.
        stack: its images, for thumbnails and the histograms of grays and residuals.
        shape: its normals and albedo, for pictures.
        command: the command line that makes it again.
        notes: the user's own words.

    Raises:
        InputError: a stack of another size.
    """
    if stack is not None and stack.shape != analysis.labels.shape:
        raise InputError(
            f"the stack is of shape {stack.shape}, the result of {analysis.labels.shape}; "
            "the result's own stack is accepted"
        )
    told = describe_analysis(analysis)
    title = escape(analysis.title)
    parts = [
        f"<h1>{title}</h1>",
        _settings(analysis, command),
        _notes(notes),
        _remarks(analysis),
        _legend(),
        _pictures(analysis, stack),
        _images(told["images"]),
        _confidence(told),
        _thresholds(analysis, stack),
        "" if shape is None else _surface(shape),
        _files(analysis),
        f"<p><small>Written by photolin {escape(program_version())}.</small></p>",
    ]
    page = (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title} - photolin</title><style>{STYLE}</style></head><body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n"
    )
    return page.encode(errors="backslashreplace")


def escape(text: str) -> str:
    """`text` between tags or in quotes of a page; what could mislead the reader becomes \ufffd."""
    return html.escape(MISLEADING.sub("\ufffd", text))


def _settings(analysis: Analysis, command: str | None) -> str:
    options, used = analysis.options, analysis.thresholds
    K, H, W = analysis.labels.shape
    bases = ", ".join(f"{k} ({escape(analysis.names[k])})" for k in analysis.base_images)
    rows = [
        ("Images", f"{K} of {H} rows × {W} columns; {np.count_nonzero(analysis.mask)} pixels used"),
        ("Method", escape(options.method)),
        ("T", f"{used.T:g} ({'suggested' if options.T is None else 'given'})"),
        (
            "Ts",
            f"{used.Ts:g} of full scale ({'suggested' if options.Ts is None else 'given'})",
        ),
        ("Base images", f"{bases} ({'chosen' if options.base_images is None else 'given'})"),
        ("Lights", "unknown" if analysis.lights is None else "known"),
        ("Samples, seed", f"{options.samples}, {options.seed}"),
        ("Seconds", f"{analysis.seconds.get('total', 0):.2f}"),
    ]
    again = f"<p>To make it again:</p><code>{escape(command)}</code>" if command else ""
    return f"<h2>Settings</h2>{_table((), rows)}{again}"


def _notes(notes: str) -> str:
    lines = "<br>".join(map(escape, notes.strip().splitlines()))
    return f"<h2>In the author's words</h2><p>{lines}</p>" if lines else ""


def _remarks(analysis: Analysis) -> str:
    warnings = "".join(f'<p class="warning">{escape(text)}</p>' for text in analysis.warnings)
    notes = "".join(f"<li>{escape(text)}</li>" for text in analysis.notes)
    return f"<h2>Warnings and notes</h2>{warnings or '<p>No warnings.</p>'}<ul>{notes}</ul>"


def _legend() -> str:
    items = " &nbsp; ".join(
        f'<span class="swatch" style="background:{css_colour(factor)}"></span> {letter} '
        f"{TITLES[factor]}"
        for factor, letter in LETTERS.items()
    )
    return f"<h2>Classes</h2><p>{items}</p>"


def _pictures(analysis: Analysis, stack: ImageStack | None) -> str:
    said = "The labels alone, as the images were not at hand."
    if stack is not None:
        said = (
            f"Images, linear values × {choose_gain(stack):.3g} shown with gamma 2.2, and the "
            "classes over them; dark outside the mask."
        )
    figures = "".join(
        f'<figure><img src="{uri}" alt="image {k} with its labels">'
        f"<figcaption>{k}: {escape(name)}</figcaption></figure>"
        for k, (name, uri) in enumerate(
            zip(analysis.names, thumbnails(analysis, stack), strict=True)
        )
    )
    return f'<h2>Images</h2><p>{said}</p><div class="grid">{figures}</div>'


def _images(images: Sequence[dict]) -> str:
    """Class shares and confidence, a line for each image; columns as the result has them."""
    measured = "possible" in images[0]
    more = ["possible %", "residual %", "i/l", "saturated %"] if measured else []
    rows = []
    for k, image in enumerate(images):
        inside = max(sum(image["counts"].values()), 1)
        percents = [100 * image["counts"][TITLES[factor]] / inside for factor in LETTERS]
        numbers = [f"{p:.1f}" for p in percents]
        if measured:
            numbers += [f"{100 * image[key]:.2f}" for key in ("possible", "residual")]
            numbers += [f"{image['gain']:.3f}", f"{100 * image['saturated']:.2f}"]
        rows.append((str(k), escape(image["name"]), plot_shares(percents), *numbers))
    letters = [f"{letter} %" for letter in LETTERS.values()]
    legend = (
        "<p>Possible: lit pixels that are not darker than the fit allows. Residual: median of "
        "|i − l| / i of lit pixels. i/l: median there.</p>"
        if measured
        else ""
    )
    table = _table(("", "image", "classes", *letters, *more), rows)
    return f'<h2>Shares of the classes</h2><div class="wide">{table}</div>{legend}'


def _confidence(told: dict) -> str:
    support = told["support"]
    rows = [
        ("Pixels", str(support["pixels"])),
        ("Undetermined pixels", str(told["undetermined"])),
        ("Images in which a pixel is D, A or C, mean", f"{100 * support['mean']:.1f} %"),
        *(
            (f"the same, percentile {q}", f"{100 * support[f'p{q:02d}']:.1f} %")
            for q in (5, 25, 50, 75, 95)
        ),
    ]
    return f"<h2>Confidence</h2>{_table((), rows)}"


def _thresholds(analysis: Analysis, stack: ImageStack | None) -> str:
    used = analysis.thresholds
    rule = (
        f"<h2>Thresholds</h2><p>A pixel is lit where i ≥ Ts = {used.Ts:g} of full scale, and "
        f"diffuse where it is lit and |i − l| ≤ T i with T = {used.T:g}.</p>"
    )
    if stack is None:
        return f"{rule}<p>Histograms need the images, which were not at hand.</p>"
    sample = draw_sample(stack, analysis.options.seed, find_white(stack))
    counts, width = dark_histogram(sample.images)
    dark = plot_histogram(
        counts, 0.0, len(counts) * width, {"Ts": used.Ts}, "input i, fraction of full scale"
    )
    bases = analysis.linearized_bases.reshape(3, -1)[:, sample.places]
    l = analysis.coefficients.astype(np.float32) @ bases
    # white is set to 0 in the sample, and is not lit then
    lit = np.isfinite(l) & (sample.images >= used.Ts) & (sample.images > 0)
    relative = (sample.images[lit] - l[lit]) / sample.images[lit]
    reach = min(max(4 * used.T, 0.02), 2.0)
    spread, _ = np.histogram(relative, BINS, (-reach, reach))
    within = 100 * float((np.abs(relative) <= used.T).mean()) if relative.size else 0.0
    residuals = plot_histogram(
        spread.astype(float),
        -reach,
        reach,
        {"−T": -used.T, "T": used.T},
        "residual (i − l) / i of lit pixels",
        band=(-used.T, used.T),
    )
    few = f"{sample.images.shape[1]} sampled pixels, square-root scale"
    return (
        f'{rule}<div class="plots"><figure>{dark}<figcaption>Dark grays of {few}; shadows are '
        f"below Ts. Black, and the two fullest images of each bin, are left out.</figcaption>"
        f"</figure><figure>{residuals}<figcaption>Residuals of {few}; {within:.1f} % are within "
        "T.</figcaption></figure></div>"
    )


def _surface(shape: Shape) -> str:
    found = shape.resolved
    scale = "" if found.scaled else " Albedo has no absolute scale."
    doubts = "".join(f"<p>Warning: {escape(doubt)}.</p>" for doubt in found.doubts)
    return (
        f"<h2>Surface</h2><p>Normals {escape(found.note)}. Residual {found.residual:.3g}, "
        f"{escape(found.residual_means)}.{scale}</p>{doubts}"
        '<div class="plots">'
        f'<figure><img src="{normals_picture(shape.normals)}" alt="normals"><figcaption>Normals: '
        "red x right, green y up, blue z to the camera; gray where undetermined.</figcaption>"
        f'</figure><figure><img src="{albedo_picture(shape.albedo)}" alt="albedo"><figcaption>'
        "Albedo, its 99.5th percentile white, shown with gamma 2.2.</figcaption></figure></div>"
    )


def _files(analysis: Analysis) -> str:
    if not analysis.files:
        return ""
    table = _table(
        ("file", "SHA-256"), [(escape(path), digest) for path, digest in analysis.files], words=2
    )
    return f"<details><summary>Files that were read</summary>{table}</details>"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], words: int = 3) -> str:
    """Rows of markup; from the column `words` on, they are numbers."""

    def line(cells: Sequence[str], tag: str) -> str:
        kinds = ("" if n < words else ' class="n"' for n in range(len(cells)))
        inner = (f"<{tag}{kind}>{c}</{tag}>" for kind, c in zip(kinds, cells, strict=True))
        return f"<tr>{''.join(inner)}</tr>"

    heading = f"<thead>{line(head, 'th')}</thead>" if head else ""
    return f"<table>{heading}<tbody>{''.join(line(row, 'td') for row in rows)}</tbody></table>"
