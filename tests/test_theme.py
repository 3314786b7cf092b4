"""Dark and light."""

from unittest.mock import MagicMock

import pytest

from photolin.errors import OptionError
from webapp.state import THEMES, Theme, ViewState
from webapp.theme import set_theme


@pytest.mark.parametrize("theme", THEMES)
def test_the_page_is_dark_only_in_the_dark_theme(theme: Theme) -> None:
    gui = MagicMock()
    set_theme(gui, theme)
    assert gui.configure_theme.call_args.kwargs["dark_mode"] is (theme == "dark")
    assert gui.configure_theme.call_args.kwargs["show_share_button"] is False


def test_a_theme_that_is_none_is_refused_with_those_that_are() -> None:
    with pytest.raises(OptionError, match="theme is 'pink'; accepted are dark, light"):
        ViewState(theme="pink")  # pyright: ignore[reportArgumentType]
