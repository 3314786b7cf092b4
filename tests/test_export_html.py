"""The page of a result: what it holds, whatever files are called, and that it fetches nothing."""

import base64
import io
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from lambert import wrap
from PIL import Image

from photolin import analyze, render_scene
from photolin.analysis import Analysis, Options
from photolin.cli import main
from photolin.errors import InputError
from photolin.export import load_result
from photolin.export.html import escape, report_html
from photolin.export.html_pictures import BUDGET, overlay, thumbnails
from photolin.export.html_plots import plot_histogram, plot_shares, ticks
from photolin.factors import OUTSIDE, PALETTE, Factor, css_colour
from photolin.shape.recover import Shape, recover_shape
from photolin.shape.resolve import resolve_ambiguity
from photolin.shape.resolved import Resolved
from photolin.stack import ImageStack

LIMIT = 3_000_000
HOSTILE = (
    "</td><script>alert(1)</script><img src=x onerror=alert(1)>&amp;\"' onload='x\x00\u202egnp"
)
VOID = {"meta", "img", "br"}


class Page(HTMLParser):
    """Tags with their attributes, and text; fails on tags that do not close each other."""

    def __init__(self, data: bytes) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(data.decode())
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data

    def pictures(self) -> list[np.ndarray]:
        uris = [attributes["src"] or "" for tag, attributes in self.tags if tag == "img"]
        assert all(uri.startswith("data:image/jpeg;base64,") for uri in uris)
        data = [base64.b64decode(uri.split(",", 1)[1], validate=True) for uri in uris]
        return [np.asarray(Image.open(io.BytesIO(jpeg))) for jpeg in data]


@pytest.fixture(scope="module")
def stack() -> ImageStack:
    return render_scene("sphere_cone", size=(60, 80), images=8).stack


@pytest.fixture(scope="module")
def analysis(stack: ImageStack) -> Analysis:
    return analyze(stack)


def assert_harmless(page: Page) -> None:
    """No scripts, no handlers, no addresses but data."""
    allowed = {"html", "head", "meta", "title", "style", "body", "h1", "h2", "p", "ul", "li"}
    allowed |= {"table", "thead", "tbody", "tr", "th", "td", "div", "figure", "figcaption", "img"}
    allowed |= {"code", "span", "small", "details", "summary"}
    allowed |= {"svg", "rect", "path", "line", "text"}
    assert {tag for tag, _ in page.tags} <= allowed
    for tag, attributes in page.tags:
        assert not [name for name in attributes if name.startswith("on")]
        assert not {"href", "srcset", "action", "data"} & set(attributes)
        assert tag == "img" or "src" not in attributes
        assert not any("url(" in (value or "") for value in attributes.values())


def test_equal_arguments_give_equal_bytes(analysis: Analysis, stack: ImageStack) -> None:
    page = report_html(analysis, stack=stack, command="x")
    assert report_html(analysis, stack=stack, command="x") == page
    assert report_html(analysis, stack=stack, command="y") != page


def test_a_page_fetches_and_runs_nothing(analysis: Analysis, stack: ImageStack) -> None:
    data = report_html(analysis, stack=stack)
    page = Page(data)
    assert_harmless(page)
    policies = [a["content"] for t, a in page.tags if t == "meta" and "http-equiv" in a]
    assert policies == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]
    assert set(re.findall(rb"https?://[^\"' ]*", data)) == {b"http://www.w3.org/2000/svg"}
    assert b"@import" not in data
    assert b"url(" not in data


def test_hostile_names_words_and_notes_are_only_text(stack: ImageStack) -> None:
    named = replace(
        stack,
        names=(HOSTILE, *stack.names[1:]),
        title=HOSTILE,
        files=((HOSTILE, "0" * 64),),
        notes=(HOSTILE,),
        warnings=(HOSTILE, "\ud800"),
    )
    found = analyze(named, Options(T=0.02, Ts=0.01, base_images=(0, 1, 4)))
    shape = recover_shape(named, found, resolve_ambiguity(found), depth=False)
    shape = replace(shape, resolved=replace(shape.resolved, note=HOSTILE))
    page = Page(report_html(found, stack=named, shape=shape, command=f"photolin {HOSTILE}"))
    assert_harmless(page)
    shown = HOSTILE.replace("\x00", "\ufffd").replace("\u202e", "\ufffd")
    # title twice, base image, figure, row, note, warning, command, shape and file
    assert page.text.count(shown) == 10
    assert "\x00" not in page.text
    assert "\u202e" not in page.text
    assert "\\ud800" in page.text


def test_the_page_has_the_shares_and_confidence_of_each_image(
    analysis: Analysis, stack: ImageStack
) -> None:
    data = report_html(analysis, stack=stack).decode()
    (table,) = re.findall(r'<div class="wide">(<table>.*?</table>)', data, re.DOTALL)
    heads = re.findall(r"<th[^>]*>(.*?)</th>", table)
    assert heads[3:] == (
        "D % S % A % C % U %|possible %|residual %|i/l|saturated %".replace(" % ", " %|").split("|")
    )
    rows = re.findall(r"<tr>(<td.*?)</tr>", table)
    assert len(rows) == 8
    confidence = analysis.confidence
    assert confidence is not None
    for k, row in enumerate(rows):
        cells = re.findall(r"<td[^>]*>(.*?)</td>", row)
        assert cells[:2] == [str(k), stack.names[k]]
        inside = analysis.labels[k][analysis.mask]
        order = (
            Factor.DIFFUSE,
            Factor.SPECULAR,
            Factor.ATTACHED,
            Factor.CAST,
            Factor.UNDEFINED,
        )
        assert cells[3:8] == [f"{100 * (inside == f).mean():.1f}" for f in order]
        assert cells[8] == f"{100 * confidence.support[k]:.2f}"
        assert cells[9] == f"{100 * confidence.residual[k]:.2f}"
        assert cells[10] == f"{confidence.gain[k]:.3f}"
        assert cells[11] == f"{100 * confidence.saturated[k]:.2f}"


def test_settings_remarks_legend_and_command_are_there(
    analysis: Analysis, stack: ImageStack
) -> None:
    warned = replace(analysis, warnings=("the lamp flickers",))
    page = Page(report_html(warned, stack=stack, command="photolin run 'a b' c"))
    for word in (
        "sphere_cone",
        "8 of 60 rows × 80 columns",
        f"{analysis.thresholds.T:g} (suggested)",
        f"{analysis.thresholds.Ts:g} of full scale (suggested)",
        "photolin run 'a b' c",
        "the lamp flickers",
        *analysis.notes,
        *("D diffuse", "S specular", "A attached shadow", "C cast shadow", "U undefined"),
    ):
        assert word in page.text
    data = report_html(analysis).decode()
    assert all(f"background:{css_colour(factor)}" in data for factor in PALETTE)
    calm = report_html(replace(analysis, warnings=())).decode()
    assert ("No warnings." in calm, "No warnings." in page.text) == (True, False)
    assert "To make it again" not in data


def test_thumbnails_show_images_with_their_labels(analysis: Analysis, stack: ImageStack) -> None:
    pictures = Page(report_html(analysis, stack=stack)).pictures()
    assert [p.shape for p in pictures] == [(60, 80, 3)] * 8
    cast = (analysis.labels[3] == Factor.CAST) | (analysis.labels[3] == Factor.ATTACHED)
    lit = analysis.labels[3] == Factor.DIFFUSE
    assert pictures[3][lit].mean() > pictures[3][cast].mean() + 20
    labels = Page(report_html(analysis)).pictures()
    for factor in (Factor.DIFFUSE, Factor.CAST):
        middle = np.median(labels[3][analysis.labels[3] == factor], axis=0)
        assert np.abs(middle - PALETTE[factor]).max() < 25


def test_an_overlay_blends_by_class_and_dims_outside() -> None:
    labels = np.array([[OUTSIDE, Factor.DIFFUSE, Factor.SPECULAR]], np.uint8)
    image = np.full((1, 3), 0.25, np.float32)
    (outside, diffuse, specular), gray = overlay(image, labels, 4.0, 100)[0], 255.0
    np.testing.assert_array_equal(outside, round(0.4 * gray))
    expected = 0.85 * gray + 0.15 * np.array(PALETTE[Factor.DIFFUSE])
    np.testing.assert_allclose(diffuse, expected, atol=0.51)
    expected = 0.45 * gray + 0.55 * np.array(PALETTE[Factor.SPECULAR])
    np.testing.assert_allclose(specular, expected, atol=0.51)
    alone = overlay(None, labels, 1.0, 100)[0]
    np.testing.assert_array_equal(alone[1:], [PALETTE[Factor.DIFFUSE], PALETTE[Factor.SPECULAR]])


def test_96_images_of_noise_with_a_surface_stay_under_3_megabytes() -> None:
    """Noise in every pixel and label is what JPEG packs worst; all of them are shown still."""
    rng = np.random.default_rng(0)
    noise = rng.uniform(0.1, 1, (8, 600, 600)).astype(np.float32)
    small = analyze(wrap(noise[:, :20, :20]), Options(T=0.5, Ts=0.2, base_images=(0, 1, 2)))
    images = np.tile(noise, (12, 1, 1))
    labels = np.tile(rng.integers(0, 5, (8, 600, 600), np.uint8), (12, 1, 1))
    large = replace(
        small,
        labels=labels,
        mask=np.ones((600, 600), bool),
        names=tuple(f"{'n' * 200}{k}" for k in range(96)),
        files=tuple((f"/{'d' * 200}/{k}", "f" * 64) for k in range(96)),
        linearized_bases=noise[:3],
        coefficients=np.tile(np.eye(3), (32, 1)),
        confidence=None,
    )
    stack = ImageStack(images, large.mask, large.names)
    normals = rng.normal(size=(600, 600, 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    resolved = Resolved(np.eye(3), "integrability", 0.1, False, "found")
    shape = Shape(normals, noise[0], None, rng.normal(size=(96, 3)), resolved)
    data = report_html(large, stack=stack, shape=shape)
    assert len(data) < LIMIT
    pictures = Page(data).pictures()
    assert len(pictures) == 98
    assert min(max(p.shape) for p in pictures) >= 64


def test_thumbnails_stay_small_where_the_first_looked_at_are_plain(analysis: Analysis) -> None:
    rng = np.random.default_rng(0)
    labels = np.tile(rng.integers(0, 5, (8, 300, 300), np.uint8), (12, 1, 1))
    labels[::12] = 1
    names = tuple(map(str, range(96)))
    made = thumbnails(replace(analysis, labels=labels, names=names))
    assert len(made) == 96
    assert 400_000 < sum(map(len, made)) <= BUDGET


def test_a_page_without_the_stack_says_what_is_missing(analysis: Analysis) -> None:
    page = Page(report_html(analysis))
    assert_harmless(page)
    assert "The labels alone, as the images were not at hand." in page.text
    assert "Histograms need the images, which were not at hand." in page.text


def test_a_result_without_confidence_has_a_page(analysis: Analysis) -> None:
    page = Page(report_html(replace(analysis, confidence=None)))
    assert "possible" not in page.text
    assert "i/l" not in page.text


def test_a_stack_of_another_size_is_refused(analysis: Analysis) -> None:
    other = render_scene("sphere_cone", size=(60, 81), images=8).stack
    with pytest.raises(InputError, match=r"stack is of shape \(8, 60, 81\).*own stack is acc"):
        report_html(analysis, stack=other)


@pytest.mark.parametrize("size", [(1, 40), (40, 1)])
def test_slender_images_have_a_page(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    stack = wrap(rng.uniform(0.3, 1, (8, *size)))
    normal = Options(T=0.5, Ts=0.01, base_images=(0, 1, 2))
    pictures = Page(report_html(analyze(stack, normal), stack=stack)).pictures()
    assert [p.shape for p in pictures] == [(*size, 3)] * 8


# Plots


def test_a_histogram_is_well_formed_and_its_lines_stand_where_they_belong() -> None:
    svg = plot_histogram(np.array([0.0, 4, 16]), 0, 3, {"a": 1.5, "b": 9, "c": -9}, "x", (1, 2))
    root = ElementTree.fromstring(svg)
    space = "{http://www.w3.org/2000/svg}"
    lines = [line for line in root.iter(f"{space}line") if "stroke-dasharray" in line.attrib]
    assert [float(line.attrib["x1"]) for line in lines] == [234, 454, 14]
    (band,) = root.iter(f"{space}rect")
    assert float(band.attrib["x"]) == pytest.approx(14 + 440 / 3, abs=0.01)
    assert float(band.attrib["width"]) == pytest.approx(440 / 3, abs=0.02)
    (path,) = root.iter(f"{space}path")
    heights = [float(y) for y in re.findall(r"V([\d.]+)H", path.attrib["d"])]
    assert heights == [150, 83, 16]  # square roots: half of the tallest is a quarter of the count


def test_an_empty_histogram_is_flat() -> None:
    svg = plot_histogram(np.zeros(5), -1, 1, {}, "x")
    assert set(re.findall(r"V([\d.]+)H", svg)) == {"150.0"}


def test_the_bar_of_shares_is_divided_as_the_classes_are() -> None:
    root = ElementTree.fromstring(plot_shares([50, 20, 15, 10, 5]))
    bars = [(b.attrib["x"], b.attrib["width"], b.attrib["fill"]) for b in root]
    starts, widths, fills = zip(*bars, strict=True)
    assert [float(x) for x in starts] == [0, 50, 70, 85, 95]
    assert [float(w) for w in widths] == [50, 20, 15, 10, 5]
    assert fills[0] == css_colour(Factor.DIFFUSE)
    assert fills[4] == css_colour(Factor.UNDEFINED)
    assert root.attrib["aria-label"].startswith("D 50.0 %, S 20.0 %")


@pytest.mark.parametrize("reach", [1e-6, 0.0031, 0.25, 1.0, 7.0])
def test_ticks_are_few_round_and_inside(reach: float) -> None:
    for low in (0.0, -reach):
        found = ticks(low, reach)
        assert 3 <= len(found) <= 8
        assert all(low <= t <= reach * (1 + 1e-6) for t in found)
        step = f"{found[1] - found[0]:.3e}"
        assert step[:5] in ("1.000", "2.000", "5.000")
        np.testing.assert_allclose(np.diff(found), found[1] - found[0], rtol=1e-5)
        assert any(abs(t) < 1e-9 * reach for t in found)


def test_escape_leaves_plain_words_and_no_markup() -> None:
    assert escape("vase 07 – größe 日本.png") == "vase 07 – größe 日本.png"
    assert escape("<a b='c' d=\"e\">&") == "&lt;a b=&#x27;c&#x27; d=&quot;e&quot;&gt;&amp;"


# The verb


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A stack and its result on disk."""
    folder = tmp_path_factory.mktemp("scene")
    scene = render_scene("sphere_cone", size=(40, 50), images=8).stack
    np.savez(folder / "s.npz", images=scene.images, mask=scene.mask)
    assert main(["run", str(folder / "s.npz"), str(folder / "out"), "--exclude", "2"]) == 0
    return folder / "s.npz", folder / "out"


def test_the_verb_writes_the_page_of_a_result(
    written: tuple[Path, Path], tmp_path: Path, capsys
) -> None:
    stack, result = written
    page = tmp_path / "new" / "page.html"
    assert main(["report", str(result), str(page)]) == 0
    assert re.search(r"written .*page\.html \(0\.\d MB\)", capsys.readouterr().out)
    text = Page(page.read_bytes()).text
    used = load_result(result).thresholds
    assert f"photolin run {stack} {result} --T {used.T!r} --Ts {used.Ts!r} --exclude 2" in text
    assert "sampled pixels" in text
    assert "excluded: image 002 (as asked)" in text


def test_the_verb_does_without_images_that_have_moved_unless_told_where(
    written: tuple[Path, Path], tmp_path: Path, capsys
) -> None:
    stack, result = written
    page, moved = tmp_path / "page.html", tmp_path / "moved.npz"
    moved.write_bytes(stack.read_bytes())
    stack.rename(stack.with_suffix(".gone"))
    try:
        assert main(["report", str(result / "result.npz"), str(page)]) == 0
        assert "warning: " in (said := capsys.readouterr().out)
        assert "its images are not found" in said
        assert "not at hand" in page.read_text()
        assert main(["report", str(result), str(page), "--stack", str(moved)]) == 0
        assert f"photolin run {moved} {result} " in Page(page.read_bytes()).text
        assert main(["report", str(result), str(page), "--stack", str(tmp_path / "no.npz")]) == 2
        assert "its images are not found" in capsys.readouterr().err
    finally:
        stack.with_suffix(".gone").rename(stack)


def test_the_verb_refuses_other_names_and_other_results(
    written: tuple[Path, Path], tmp_path: Path, capsys
) -> None:
    stack, result = written
    assert main(["report", str(result), str(tmp_path / "page.png")]) == 2
    assert "a file name that ends in .html is accepted" in capsys.readouterr().err
    assert main(["report", str(stack), str(tmp_path / "page.html")]) == 2
    assert capsys.readouterr().err.startswith("photolin: ")
    (tmp_path / "folder.html").mkdir()
    assert main(["report", str(result), str(tmp_path / "folder.html")]) == 2
    assert "cannot be written (Is a directory)" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["folder.html"]
