"""Cards: numbers of the whole stack, words of the review, light and free of what names hold."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

from photolin.analysis import Options
from photolin.factors import Factor, css_colour
from photolin.load.exclude import exclude_images
from photolin.overview import ImageReview, review_images
from photolin.pipeline import analyze
from photolin.stack import ImageStack
from photolin.synthetic import render_scene
from webapp.strip import (
    Card,
    Health,
    deal_cards,
    draw_status,
    draw_strip,
    judge,
    style_strip,
    summarize_strip,
)
from webapp.thumbnails import make_sheet

STACK = render_scene("pot", size=(96, 128), images=16, noise=0.002).stack
RESULT = analyze(STACK, Options(T=0.03, Ts=0.01))


class Elements(HTMLParser):
    """All elements with their attributes, and the text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.depth, self.text = 0, ""
        self.feed(html)
        assert self.depth == 0, "every element is closed"

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.depth += 1
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        self.depth -= 1

    def handle_data(self, data: str) -> None:
        self.text += data

    def of(self, look: str) -> list[dict[str, str | None]]:
        return [a for _, a in self.found if look in (a.get("class") or "").split()]


def changed() -> ImageStack:
    """Image 5 is a copy of 2, 9 is saturated, 12 has moved."""
    images = STACK.images.copy()
    images[5] = images[2]
    images[9] = np.minimum(8 * images[9], 1)
    images[12] = np.roll(images[12], (2, -1), (0, 1))
    return replace(STACK, images=images)


def review(name: str, *findings: str) -> ImageReview:
    nothing = float("nan")
    return ImageReview(
        name, np.zeros(5), nothing, nothing, nothing, nothing, None, None, tuple(findings)
    )


def draw(cards: list[Card], now: int | None = None, **given: Any) -> Elements:
    options = {"sheet": None, "gain": None, **given}
    return Elements(draw_strip(cards, now, **options, element_id="photolin-strip"))


def test_every_finding_of_a_real_review_has_a_word_of_its_own() -> None:
    stack = changed()
    result = analyze(stack, Options(T=0.03, Ts=0.01))
    health = judge(review_images(stack, result), range(16))
    words = {k: {word for word, _ in h.badges} for k, h in health.items() if h.badges}
    assert "copy" in words[5]
    assert "saturated" in words[9]
    assert "moved" in words[12]
    assert not any("doubt" in found for found in words.values())
    assert set(words) <= {5, 9, 12}
    assert "of its lit pixels possible" in health[0].facts


@pytest.mark.parametrize(
    ("finding", "word"),
    [
        ("{} is the same as image 0 (a); take one of them out", "copy"),
        ("{} shows nearly the light of image 0 (a), 0.80 times as bright; it adds little", "copy"),
        ("31 % of {} is saturated", "saturated"),
        ("{} lies 2.0 px below and 1.0 px left of the others; the camera has moved", "moved"),
        ("{} is 1.30 times as bright as its light power says; another exposure", "exposure"),
        ("{} is 0.70 times as bright as its linearization", "exposure"),
        ("{} does not fit the others: 50 % of its lit pixels are darker than possible", "misfit"),
        ("{} is 40 % of i from its linearization, the median image 2 %", "misfit"),
        ("{} is strange", "doubt"),
    ],
)
def test_names_of_images_do_not_decide_the_word(finding: str, word: str) -> None:
    for name in ("b", "saturated", "is the same as", " px ", "image 0 (a)", "(.*)[", "\\1"):
        reviews = [review("a"), review(name, finding.format(f"image 1 ({name})"))]
        ((found, sentence),) = judge(reviews, (3, 7))[7].badges
        assert found == word
        assert f"mage 7 ({name})" in sentence  # a capital where it begins the sentence
        assert ("image 3 (a)" in sentence) == (word == "copy")


def test_findings_of_one_word_share_a_badge() -> None:
    told = [
        f"image 0 (a) {what}" for what in ("does not fit", "is 9 % of i from its linearization")
    ]
    ((word, sentences),) = judge([review("a", *told)], (4,))[4].badges
    assert word == "misfit"
    assert sentences == (
        "Image 4 (a) does not fit. Image 4 (a) is 9 % of i from its linearization."
    )


def test_numbers_are_those_of_the_whole_stack_after_images_were_left_out() -> None:
    stack = exclude_images(changed(), (0, 1, 9))
    result = analyze(stack, Options(T=0.03, Ts=0.01))
    kept = [k for k in range(16) if k not in (0, 1, 9)]
    health = judge(review_images(stack, result), kept)
    assert set(health) == set(kept)
    (copy,) = (sentence for word, sentence in health[5].badges if word == "copy")
    assert f"Image 5 ({STACK.names[5]}) is the same as image 2 ({STACK.names[2]})" in copy
    assert "moved" in dict(health[12].badges)


def test_the_bar_has_the_classes_in_their_colours_and_says_them() -> None:
    shares = np.array([0.05, 0.6, 0.1, 0.2, 0.05])
    (bar,) = draw([Card(0, "a", shares, None, False)]).of("photolin-bar")
    style, title = bar["style"] or "", bar["title"] or ""
    ends = {colour: (a, b) for colour, a, b in re.findall(r"(#\w+) ([\d.]+)% ([\d.]+)%", style)}
    for factor in Factor:
        start, end = map(float, ends[css_colour(factor)])
        assert end - start == pytest.approx(100 * shares[factor], abs=0.01)
    assert title.startswith("diffuse 60.0 %, specular 10.0 %")
    (bar,) = draw([Card(0, "a", None, None, False)]).of("photolin-bar")
    assert "style" not in bar


def test_worst_first_puts_most_findings_first_and_what_is_left_out_last() -> None:
    bad = {3: 1, 1: 2, 4: 2, 0: 3}
    health = {k: Health((("moved", "It moved."),) * n, "") for k, n in bad.items()}
    names = [f"{k}.png" for k in range(6)]
    by_number = deal_cards(names, (0,), {}, health, "by number")
    assert [card.number for card in by_number] == list(range(6))
    worst = deal_cards(names, (0,), {}, health, "worst first")
    assert [card.number for card in worst] == [1, 4, 3, 2, 5, 0]
    assert summarize_strip(worst) == "6 images, 1 left out, 3 of the others stand out."
    one = deal_cards(names, (), {}, {2: health[3], 3: Health((), "")}, "by number")
    assert summarize_strip(one) == "6 images, 1 stands out."
    assert summarize_strip(deal_cards(names, (), {}, {}, "by number")) == "6 images."


def test_the_image_shown_is_framed_and_what_is_left_out_is_said_to_be() -> None:
    cards = deal_cards(["a", "b", "c"], (1,), {}, {}, "by number")
    drawn = draw(cards, now=2)
    (now,) = drawn.of("now")
    (out,) = drawn.of("out")
    assert (now["data-part"], out["data-part"]) == ("image-2", "image-1")
    assert [c["data-part"] for c in drawn.of("photolin-corner")] == [
        f"toggle-{k}" for k in range(3)
    ]
    assert [c["title"] for c in drawn.of("photolin-corner")][1] == "Take it in again"
    assert drawn.text.count("left out") == 1


@pytest.mark.parametrize(("fraction", "done"), [(0.0, "0"), (0.456, "46"), (7, "100")])
def test_the_status_has_progress_and_a_way_to_cancel_it(fraction: float, done: str) -> None:
    going = Elements(draw_status("<24>", "<Looking>", fraction))
    assert going.text == "<24><Looking>cancel"
    (bar,) = going.of("photolin-bar")
    assert bar["aria-valuenow"] == done
    assert [c["data-part"] for c in going.of("photolin-cancel")] == ["cancel-0"]
    assert Elements(draw_status("<24>", "<Looking>", None)).text == "<24><Looking>"


@pytest.mark.parametrize("name", ['"><script>x</script>', "' onclick='x", "</style>", "a" * 4000])
def test_names_of_files_are_only_text(name: str) -> None:
    health = judge([review(name, f"image 0 ({name}) does not fit")], (0,))
    drawn = draw(deal_cards([name], (), {}, health, "by number"))
    assert {tag for tag, _ in drawn.found} == {"div", "span", "b"}
    assert not any(key.startswith("on") for _, attrs in drawn.found for key in attrs)
    assert f"Image 0: {name}." in (drawn.of("photolin-name")[0]["title"] or "")


def test_96_images_weigh_little_and_thumbnails_are_sent_apart() -> None:
    stack = render_scene("pot", size=(120, 140), images=96).stack
    sheet, share = make_sheet(stack), np.full(5, 0.2)
    health = {k: Health((("moved", "It moved by some pixels." * 5),), "facts") for k in range(96)}
    cards = deal_cards(stack.names, (3,), dict.fromkeys(range(96), share), health, "by number")
    html = draw_strip(cards, 7, sheet, 2 * sheet.gain, "photolin-strip")
    assert len(html) < 100_000
    assert len(html) + len(style_strip(sheet)) < 600_000
    assert "base64" not in html
    assert "--photolin-gain:2" in html
    assert sheet.url in style_strip(sheet)
    places = [card["style"] for card in Elements(html).of("photolin-thumb")]
    assert len(set(places)) == 96
