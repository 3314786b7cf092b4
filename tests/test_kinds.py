"""Options of kinds that tyro would read or show badly, through the command line's parser."""

from functools import partial

import pytest

from photolin.cli import VERBS, main
from photolin.console import parse
from photolin.errors import OptionError


def exclude(*words: str) -> tuple[int, ...]:
    call = parse(VERBS, ["info", "s", *words])
    assert isinstance(call, partial)
    return call.keywords["reading"].exclude


def test_any_number_of_integers_is_read() -> None:
    assert exclude() == ()
    assert exclude("--exclude") == ()
    assert exclude("--exclude", "3") == (3,)
    assert exclude("--exclude", "3", "17", "5", "--channel", "max") == (3, 5, 17)


def test_the_default_none_is_called_unset(capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert main(["info", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.replace("│", "").split())
    assert "--exclude INT INT ... Images to leave out" in said
    assert "what is left counts anew. (default: unset)" in said


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--exclude", "3", "x"], "--exclude is 3 x; INT INT ... is accepted"),
        (["--exclude", "1.5"], "--exclude is 1.5; INT INT ... is accepted"),
        (["--roi", "1", "2", "3", "y"], "--roi is 1 2 3 y; INT INT INT INT is accepted"),
    ],
)
def test_what_is_no_integer_is_refused_in_words(words: list[str], told: str) -> None:
    with pytest.raises(OptionError, match=told):
        exclude(*words)
