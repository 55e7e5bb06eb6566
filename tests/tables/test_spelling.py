"""Numbers and levels in plain notation: nothing is lost, and there is one way to write each."""

import math
import re
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.tables import Value, cell_text, level_text, number, spelled_levels

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(FINITE)
def test_a_level_reads_back_as_the_same_number(level: float) -> None:
    assert float(level_text(level)) == level
    assert number(level_text(level)) == level


@given(FINITE)
def test_a_level_is_written_in_plain_notation_without_anything_that_could_be_left_out(level: float) -> None:
    assert re.fullmatch(r"0|-?(0|[1-9][0-9]*)(\.[0-9]*[1-9])?", level_text(level))


@given(st.integers())
def test_a_whole_number_is_written_exactly(value: int) -> None:
    assert level_text(value) == str(value)


@given(FINITE, st.sampled_from(["", "+", " "]), st.sampled_from([repr, "{:.17e}".format, level_text]))
def test_all_spellings_of_a_level_are_one_key(
    level: float, before: str, spell: Callable[[float], str]
) -> None:
    text = spell(level)
    written = text if text.startswith("-") else before + text
    assert spelled_levels({written: "about it"}) == {level_text(level): "about it"}


def test_a_level_that_is_described_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="the level 25 is described twice"):
        spelled_levels({"25": "a", "25.0": "b"})


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_not_written(value: float) -> None:
    with pytest.raises(ValueError, match="no place in a table"):
        cell_text(value)


@pytest.mark.parametrize(
    "text", ["", "nan", "inf", "-Infinity", "1e999", "1_000", "1,5", "0x10", "\u0661", "1 2", "1.2.3", "--1"]
)
def test_what_is_no_number_is_not_read_as_one(text: str) -> None:
    assert number(text) is None


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "n/a"),
        (True, "yes"),
        (False, "no"),
        (0, "0"),
        (-0.0, "0"),
        (25.0, "25"),
        (0.1, "0.1"),
        (1e-6, "0.000001"),
        (-2.5e-5, "-0.000025"),
        (1e16, "10000000000000000"),
        ("a\tb\nc", "a b c"),
        ("", "n/a"),
        ("a\x00b\x1b[2J\ud800", "a\ufffdb\ufffd[2J\ufffd"),
    ],
)
def test_values_are_written_plainly(value: Value, text: str) -> None:
    assert cell_text(value) == text
