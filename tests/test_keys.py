"""The table of keys: what is bound is listed, and what is listed is bound."""

import re
from pathlib import Path
from unittest.mock import MagicMock

import webapp
from webapp.keys import KEYS, Key, tabulate_keys
from webapp.panels import Panels
from webapp.views.help import TEXT

PAGE = Path(webapp.__file__).parent / "page" / "input.js"


def names(in_page: bool) -> list[str]:
    return [name for key in KEYS if key.in_page is in_page for name in key.names]


def test_every_key_that_the_panels_bind_is_listed_and_every_listed_one_is_bound() -> None:
    bound = Panels._bind(MagicMock(), MagicMock())
    assert set(names(in_page=False)) == set(bound)


def test_every_key_that_acts_in_the_page_is_listed_and_every_listed_one_acts() -> None:
    (local,) = re.findall(r"const local = \{(.*?)\n  \};", PAGE.read_text("utf-8"), re.DOTALL)
    acting = re.findall(r"(?:^|[,\n])\s*(?:\"(.)\"|(\w)):", local)
    assert set(names(in_page=True)) == {quoted or bare for quoted, bare in acting}


def test_no_key_does_two_things() -> None:
    listed = names(in_page=False) + names(in_page=True)
    assert len(set(listed)) == len(listed)


def test_the_help_holds_each_key_in_a_row_of_its_table() -> None:
    table = tabulate_keys()
    assert table in TEXT
    head, line, *rows = table.splitlines()
    assert (head, line) == ("| key | does |", "|---|---|")
    assert rows == [f"| {key.shown} | {key.does} |" for key in KEYS]
    assert all(row.count("|") == 3 for row in rows)


def test_a_table_is_of_the_keys_it_is_given() -> None:
    assert tabulate_keys([Key("Q", "quits", ("q",))]).endswith("|---|---|\n| Q | quits |")
