"""Options refuse what is out of range; an Analysis is read-only and linearizes on demand."""

from dataclasses import FrozenInstanceError, asdict, replace
from typing import Any

import numpy as np
import pytest

from photolin.analysis import METHODS, Analysis, Options
from photolin.errors import OptionError
from photolin.factors import Thresholds


def analysis() -> Analysis:
    rng = np.random.default_rng(0)
    return Analysis(
        options=Options(),
        thresholds=Thresholds(0.05, 0.02),
        base_images=(0, 1, 2),
        coefficients=np.vstack([np.eye(3), rng.normal(size=(3, 3))]),
        linearized_bases=rng.normal(size=(3, 4, 5)).astype(np.float32),
        labels=np.ones((6, 4, 5), np.uint8),
        mask=np.ones((4, 5), bool),
        names=tuple("abcdef"),
        seconds={"total": 1.0},
        lights=rng.normal(size=(6, 3)),
    )


def test_a_linearized_base_image_is_the_base_itself() -> None:
    a = analysis()
    for k in range(3):
        np.testing.assert_array_equal(a.linearized(k), a.linearized_bases[k])


def test_a_linearized_image_combines_the_bases_and_keeps_its_sign() -> None:
    a = analysis()
    expected = np.tensordot(a.coefficients[4], a.linearized_bases, 1)
    np.testing.assert_allclose(a.linearized(4), expected, atol=1e-6)
    assert a.linearized(4).dtype == np.float32
    assert a.linearized(4).min() < 0


def test_an_undetermined_pixel_stays_undetermined() -> None:
    bases = np.array(analysis().linearized_bases)
    bases[:, 1, 2] = np.nan
    linearized = replace(analysis(), linearized_bases=bases).linearized(5)
    assert np.argwhere(np.isnan(linearized)).tolist() == [[1, 2]]


def test_no_array_of_an_analysis_can_be_changed() -> None:
    a = analysis()
    for array in (a.coefficients, a.linearized_bases, a.labels, a.mask, a.lights):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(FrozenInstanceError):
        a.title = "other"  # pyright: ignore[reportAttributeAccessIssue]


def test_options_left_out_are_the_documented_ones() -> None:
    assert asdict(Options()) == {
        "method": "robust",
        "T": None,
        "Ts": None,
        "base_images": None,
        "samples": 500,
        "seed": 0,
    }
    assert METHODS == ("robust", "classification", "statistical")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"method": "median"}, "method is 'median'; accepted are robust, classification, stat"),
        ({"method": ""}, "method is ''"),
        ({"T": 0}, "T is 0; accepted is a number above 0 and up to 1"),
        ({"T": float("nan")}, "T is nan"),
        ({"T": 1.5, "Ts": 0.02}, "T is 1.5"),
        ({"Ts": 1}, "Ts is 1; accepted is a number from 0 to below 1"),
        ({"Ts": float("-inf")}, "Ts is -inf"),
        ({"samples": 9}, "samples is 9; accepted is 10 to 100000"),
        ({"samples": 100_001}, "samples is 100001"),
        ({"samples": float("nan")}, "samples is nan"),
        ({"seed": -1}, "seed is -1; accepted is 0 to 4294967295"),
        ({"seed": 2**32}, "seed is 4294967296"),
        ({"base_images": (0, 1, 1)}, r"base_images is \(0, 1, 1\); accepted are three different"),
        ({"base_images": (0, 1, -1)}, r"base_images is \(0, 1, -1\)"),
        ({"base_images": (0, 1)}, "three different image numbers from 0"),
        ({"base_images": (0, 1, 2, 2)}, "three different image numbers from 0"),
        ({"base_images": (0, 1, 2, 3)}, "three different image numbers from 0"),
        ({"base_images": ()}, "three different image numbers from 0"),
    ],
)
def test_an_option_out_of_range_is_refused_with_the_range(
    given: dict[str, Any], words: str
) -> None:
    with pytest.raises(OptionError, match=words):
        Options(**given)


def test_the_ends_of_the_ranges_are_accepted() -> None:
    Options(T=1, Ts=0, samples=10, seed=2**32 - 1)
    Options(T=1e-9, Ts=0.999, samples=100_000, seed=0, base_images=(2, 1, 0))
