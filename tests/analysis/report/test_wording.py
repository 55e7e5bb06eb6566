"""Names and numbers are written one way, whatever the script, and no two levels are called the same."""

import unicodedata
from unittest import mock

import pytest
from autd_analysis.basics.intervals import Interval
from autd_analysis.data.contrasts import Contrast
from autd_analysis.data.design import Design, StudyFactor
from autd_analysis.report import lettering
from autd_analysis.report.lettering import broken
from autd_analysis.report.wording import (
    direction,
    format_interval,
    format_level,
    format_number,
    format_p,
    format_rate,
    isolated,
    lines_isolated,
    p_equals,
    study_labels,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.protocol.schema import Level

SCRIPTS = st.text(st.sampled_from("ab _-綿絹قطن12\u0301\u2067\u200f"), min_size=1, max_size=30)


def design(levels: tuple[Level, ...], describe: dict[str, str], name: str = "clothing") -> Design:
    return Design("study", None, (StudyFactor(name, levels, describe, within_block=True),), ())


def letters(text: str) -> str:
    return "".join(each for each in text if not each.isspace() and unicodedata.category(each) != "Cf")


def test_short_descriptions_are_labels_and_sentences_are_not() -> None:
    short = {"inner": "inner wear only", "both": "outerwear over it."}
    labels = study_labels(design(("inner", "both"), short))
    assert labels.level("clothing", "inner") == "inner wear only"
    assert labels.level("clothing", "both") == "outerwear over it"
    sentence = {**short, "both": "The participant wears a thick coat over the inner wear."}
    kept = study_labels(design(("inner", "both"), sentence))
    assert [kept.level("clothing", level) for level in ("inner", "both")] == ["inner", "both"]
    assert study_labels(design(("a", "b"), {"a": "same", "b": "same"})).level("clothing", "b") == "b"


def test_underscores_of_levels_stay() -> None:
    labels = study_labels(design(("inner_outer", "inner outer"), {}))
    assert labels.level("clothing", "inner_outer") == "inner_outer"


def test_a_bare_number_comes_with_what_it_is() -> None:
    labels = study_labels(design((25.0, 100.0), {}, "modulation_hz"))
    assert labels.stated("modulation_hz", 25.0) == "25\N{NARROW NO-BREAK SPACE}Hz"
    assert labels.title("modulation_hz") == "Modulation frequency (Hz)"
    assert study_labels(design((1.0, 2.0), {}, "load")).stated("load", 2.0) == "load 2"
    sides = (StudyFactor(name, ("no", "yes"), {}, within_block=True) for name in ("left", "right"))
    twice = Design("s", None, tuple(sides), ())
    assert study_labels(twice).condition((("left", "no"), ("right", "yes"))) == "left no, right yes"


def test_names_from_right_to_left_turn_no_number_round() -> None:
    labels = study_labels(design(("قطن 25", "صوف"), {}))
    difference = labels.difference(Contrast("clothing", "قطن 25", "صوف"))
    assert difference == "\u2068قطن 25\u2069 \N{MINUS SIGN} \u2068صوف\u2069"
    assert isolated("cotton") == "cotton"


@settings(max_examples=60, deadline=None)
@given(SCRIPTS, st.floats(0.2, 3))
def test_broken_lines_keep_every_letter_and_close_what_they_open(text: str, room_in: float) -> None:
    label = study_labels(design((text, "other"), {})).level("clothing", text)
    with mock.patch.object(lettering, "_width_em", lambda line, families, bold: 0.6 * len(line)):
        lines = broken(label, room_in, 8)
    assert letters("".join(lines)) == letters(label)
    assert all(line.count("\u2068") == line.count("\u2069") for line in lines)


@settings(max_examples=100, deadline=None)
@given(st.lists(SCRIPTS, min_size=2, max_size=5, unique=True))
def test_no_two_levels_share_a_label(levels: list[str]) -> None:
    shown = study_labels(design(tuple(levels), {}))
    # Levels that differ in characters that show nothing cannot be told apart by anybody.
    visible = {" ".join("".join(c for c in level if c not in "\u2067\u200f").split()) for level in levels}
    assert len({shown.level("clothing", level) for level in levels}) >= len(visible)


@pytest.mark.parametrize(
    ("p", "text"),
    [(None, "n/a"), (0.0042, ".004"), (0.00099, "< .001"), (0.0625, ".063"), (0.05, ".050"), (1, "1")],
)
def test_p_values(p: float | None, text: str) -> None:
    assert format_p(p) == text


def test_numbers() -> None:
    minus = "\N{MINUS SIGN}"
    assert [format_rate(rate) for rate in (0.354, -0.2, 1.0, -0.001, 0.996, None)] == [
        ".35",
        f"{minus}.20",
        "1.00",
        ".00",
        "1.00",
        "n/a",
    ]
    assert format_number(-0.5) == f"{minus}0.50"
    assert format_level(0.01112) == "0.0111"
    assert format_interval(Interval(-0.1, 1.0)) == f"[{minus}.10, 1.00]"
    assert p_equals(0.00002) == "p < .001"
    assert p_equals(0.99999) == "p > .999"
    assert [direction(each) for each in (0.004, -0.004, 0.006, -0.006)] == [0, 0, 1, -1]


def test_isolates_are_closed_in_every_line() -> None:
    assert lines_isolated(["a \u2068ب", "ج\u2069 b"]) == ["a \u2068ب\u2069", "\u2068ج\u2069 b"]
