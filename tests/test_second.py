"""What the page may say about the line between two pictures."""

import pytest

from webapp.second import divider_in_text


@pytest.mark.parametrize("share", [0.0, 0.1234, 0.5, 1.0])
def test_a_share_is_read_as_it_was_written(share: float) -> None:
    assert divider_in_text(f"{share:.4f}") == pytest.approx(share)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1.0001",
        "-0.5",
        "2.0",
        "nan",
        "0.5\n",
        " 0.5",
        "1",
        "0.",
        "1e-3",
        "0.٣",
        "0." + "1" * 4000,
    ],
)
def test_a_text_that_is_no_share_is_none(text: str) -> None:
    assert divider_in_text(text) is None
