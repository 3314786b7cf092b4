"""The grid of all images: what each is made of, and what is wrong with it. Pure."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photolin.factors import LETTERS, TITLES, css_colour
from photolin.overview import ImageReview

from .readout import escape
from .thumbnails import Sheet

Order = Literal["by number", "worst first"]
ORDERS: tuple[Order, ...] = get_args(Order)

BADGES = (
    ("is the same as", "copy"),
    ("nearly the light of", "copy"),
    ("saturated", "saturated"),
    (" px ", "moved"),
    ("times as bright", "exposure"),
    ("does not fit", "misfit"),
    ("from its linearization", "misfit"),
)
"""Words that a finding has, without the names of images, and what it is called in short; the first
that fits counts."""
STYLE = """
.photolin-cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(5.4rem,1fr));gap:.4rem}
.photolin-card{position:relative;cursor:pointer;border-radius:4px;padding:2px;min-width:0;
font-size:.72rem;line-height:1.3;box-shadow:0 0 0 1px rgba(128,128,128,.35)!important}
.photolin-card.now{box-shadow:0 0 0 2px var(--mantine-primary-color-filled,#228be6)!important}
.photolin-card.out{opacity:.55;cursor:default}
.photolin-thumb{background-color:#000;border-radius:3px;filter:brightness(var(--photolin-gain,1))}
.out .photolin-thumb{opacity:.45}
.photolin-corner{position:absolute;top:3px;right:3px;width:1.4em;height:1.4em;line-height:1.35em;
text-align:center;border-radius:3px;background:rgba(0,0,0,.6);color:#fff;cursor:pointer;opacity:.75}
.photolin-corner:hover{opacity:1;background:#000}
.photolin-name{overflow:hidden;text-overflow:ellipsis;white-space:nowrap}
.photolin-bar{height:.45em;border-radius:2px;background-color:rgba(128,128,128,.25)}
.photolin-status{font-size:.85em;line-height:1.35;white-space:nowrap}
.photolin-line{display:flex;align-items:center;gap:.6rem;height:1.35em}
.photolin-line .photolin-bar{flex:1}
.photolin-cancel{cursor:pointer;text-decoration:underline}
.photolin-badges{position:absolute;top:3px;left:3px;right:1.9em;bottom:2.2em;display:flex;
flex-wrap:wrap;align-content:flex-start;gap:2px;overflow:hidden;pointer-events:none}
.photolin-badge{pointer-events:auto;padding:0 .35em;border-radius:3px;background:#F0E442;color:#000}
.photolin-badge.gone{background:#555;color:#fff}
"""
"""Of the cards; one rule for all keeps each small."""


@dataclass(frozen=True)
class Health:
    """What a review says of one image, by its number in the whole stack."""

    badges: tuple[tuple[str, str], ...]
    """(short word, its sentences) of what stands out."""
    facts: str
    """Its numbers, in a sentence."""


@dataclass(frozen=True, eq=False)
class Card:
    """One image of the whole stack."""

    number: int
    """In the whole stack, from 0."""
    name: str
    shares: NDArray[np.float64] | None
    """(5,) share of each Factor code among the mask pixels, 0 to 1; None where unknown."""
    health: Health | None
    """None where no result tells."""
    excluded: bool


def judge(reviews: Sequence[ImageReview], kept: Sequence[int]) -> dict[int, Health]:
    """What reviews of the images that are left say, by numbers of the whole stack.

    Args:
        reviews: of all images that are left.
        kept: their numbers in the whole stack.
    """
    told = {f"image {k} ({r.name})": f"image {kept[k]} ({r.name})" for k, r in enumerate(reviews)}
    mentions = re.compile("|".join(map(re.escape, told)))

    def gather(findings: Sequence[str]) -> tuple[tuple[str, str], ...]:
        found: dict[str, list[str]] = {}
        for sentence in findings:
            plain = mentions.sub("it", sentence)
            word = next((word for words, word in BADGES if words in plain), "doubt")
            whole = mentions.sub(lambda match: told[match[0]], sentence)
            found.setdefault(word, []).append(f"{whole[0].upper()}{whole[1:]}.")
        return tuple((word, " ".join(sentences)) for word, sentences in found.items())

    return {
        kept[k]: Health(gather(review.findings), _tell_facts(review))
        for k, review in enumerate(reviews)
    }


def deal_cards(
    names: Sequence[str],
    excluded: Sequence[int],
    shares: Mapping[int, NDArray[np.float64]],
    health: Mapping[int, Health],
    order: Order,
) -> list[Card]:
    """Cards in order; worst first: those with most findings, those left out last.

    Args:
        names: of all images of the whole stack.
    """
    gone = set(excluded)
    cards = [Card(k, n, shares.get(k), health.get(k), k in gone) for k, n in enumerate(names)]
    if order == "worst first":
        cards.sort(key=lambda card: (card.excluded, -_count_findings(card), card.number))
    return cards


def draw_strip(
    cards: Sequence[Card],
    now: int | None,
    sheet: Sheet | None,
    gain: float | None,
    element_id: str,
) -> str:
    """HTML of the cards, without thumbnails until there is a sheet; `style_strip` goes with it.

    Args:
        now: number of the image shown.
        gain: how many times brighter than stored thumbnails are shown; None as the sheet is.
        element_id: of the whole, for clicks on the parts "image" and "toggle".
    """
    drawn = "".join(_draw(card, card.number == now, sheet) for card in cards)
    brighter = 1 if sheet is None or gain is None else gain / sheet.gain
    return (
        f'<div id="{escape(element_id)}" class="photolin-cards" '
        f'style="--photolin-gain:{brighter:.4g}">{drawn}</div>'
    )


def style_strip(sheet: Sheet | None) -> str:
    """The style element that all cards share: their look and all thumbnails."""
    picture = "aspect-ratio:4/3" if sheet is None else sheet.css
    return f"<style>{STYLE}.photolin-thumb{{{picture}}}</style>"


def summarize_strip(cards: Sequence[Card]) -> str:
    """How many images there are, are left out and stand out."""
    out = sum(card.excluded for card in cards)
    known = [card for card in cards if card.health is not None and not card.excluded]
    odd = sum(_count_findings(card) > 0 for card in known)
    parts = [f"{len(cards)} images"]
    if out:
        parts.append(f"{out} left out")
    if known:
        parts.append(
            f"{odd or 'none'} of the others stand{'s' * (odd == 1)} out"
            if out
            else f"{odd or 'none'} stand{'s' * (odd == 1)} out"
        )
    return ", ".join(parts) + "."


def draw_status(text: str, note: str, fraction: float | None) -> str:
    """HTML of two lines: a sentence; a note, beside it how far work is, and the part "cancel".

    Always as high: what is below stays under the pointer.
    """
    bar = ""
    if fraction is not None:
        done = round(100 * min(max(fraction, 0.0), 1.0))
        bar = (
            f'<div class="photolin-bar" role="progressbar" '
            f'aria-valuenow="{done}" style="background-image:linear-gradient(90deg,'
            f'currentColor {done}%,transparent 0)"></div><div class="photolin-cancel" '
            'data-part="cancel-0" title="Stop looking at the images">cancel</div>'
        )
    return (
        f'<div class="photolin-status"><div>{escape(text)}</div>'
        f'<div class="photolin-line"><div>{escape(note)}</div>{bar}</div></div>'
    )


def _draw(card: Card, now: bool, sheet: Sheet | None) -> str:
    k = card.number
    look = "photolin-card" + " now" * now + " out" * card.excluded
    place = "" if sheet is None else f' style="background-position:{sheet.place(k)}"'
    facts = "" if card.health is None else f" {card.health.facts}"
    verb, sign = ("Take it in again", "+") if card.excluded else ("Leave it out", "×")
    badges = [_badge("left out", "The result is without this image.", " gone")] * card.excluded
    if card.health is not None:
        badges += [_badge(word, sentence) for word, sentence in card.health.badges]
    short = escape(Path(card.name).stem)
    return (
        f'<div class="{look}" data-part="image-{k}">'
        f'<div class="photolin-thumb"{place}></div>'
        f'<div class="photolin-corner" data-part="toggle-{k}" title="{verb}">{sign}</div>'
        f'<div class="photolin-name" title="{escape(f"Image {k}: {card.name}.{facts}")}">'
        f"<b>{k}</b> {short}</div>{_draw_bar(card.shares)}"
        f'<div class="photolin-badges">{"".join(badges)}</div></div>'
    )


def _badge(word: str, sentence: str, look: str = "") -> str:
    return f'<span class="photolin-badge{look}" title="{escape(sentence)}">{escape(word)}</span>'


def _draw_bar(shares: NDArray[np.float64] | None) -> str:
    """Shares side by side, in the legend's order."""
    if shares is None:
        return '<div class="photolin-bar"></div>'
    stops, title, at = [], [], 0.0
    for factor in LETTERS:
        share = float(100 * shares[factor])
        title.append(f"{TITLES[factor]} {share:.1f} %")
        stops.append(f"{css_colour(factor)} {at:.4g}% {at + share:.4g}%")
        at += share
    return (
        f'<div class="photolin-bar" title="{escape(", ".join(title))}" '
        f'style="background-image:linear-gradient(90deg,{",".join(stops)})"></div>'
    )


def _tell_facts(review: ImageReview) -> str:
    facts = (
        (review.saturated, "{:.1f} % saturated"),
        (review.support, "{:.1f} % of its lit pixels possible"),
        (review.residual, "{:.1f} % of i from its linearization"),
    )
    known = [text.format(100 * value) for value, text in facts if isfinite(value)]
    return f"{', '.join(known)}." if known else ""


def _count_findings(card: Card) -> int:
    return 0 if card.health is None else len(card.health.badges)
