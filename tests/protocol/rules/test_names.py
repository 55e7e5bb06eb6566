"""Names, levels and texts that tables, figures and other programs could not take as they are."""

import io
from typing import Any

import pandas as pd
import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.rules import faults
from autd_trials.protocol.rules.names import name_faults
from autd_trials.protocol.schema import Factor, Factors, Protocol
from autd_trials.tables import RESERVED_NAMES, level_text
from tests.protocol.conftest import Refuse
from tests.protocol.test_schema import set_in

CHEST = load_protocol(find_protocol("chest"))
ROOMY = {"session_exposure_s": 36000.0, "daily_exposure_s": 36000.0}
CLOTHING = ("factors", "between_blocks", "clothing")
WORDS = st.from_regex(r"[A-Za-z][A-Za-z0-9_.+-]{0,9}", fullmatch=True) | st.sampled_from(
    [*"TFyn", "yes", "No", "ON", "off", "True", "FALSE", "nan", "NA", "Null", "none", "Inf", "infinity"]
)


def arranged(**factors: tuple[Any, ...]) -> Protocol:
    """Return the chest study with other factors that a person arranges."""
    between = {name: Factor(levels=levels) for name, levels in factors.items()}
    return CHEST.model_copy(
        update={
            "comparisons": (),
            "safety": CHEST.safety.model_copy(update=ROOMY),
            "factors": Factors(within_block=CHEST.factors.within_block, between_blocks=between),
        }
    )


def accepted(protocol: Protocol) -> bool:
    return not list(faults(protocol))


def well_named(**factors: tuple[Any, ...]) -> bool:
    return not list(name_faults(arranged(**factors)))


@pytest.mark.parametrize("name", sorted(RESERVED_NAMES))
def test_no_factor_has_the_name_of_a_column(name: str) -> None:
    assert not accepted(arranged(**{name: ("a", "b")}))


@given(st.lists(WORDS, min_size=1, max_size=4, unique=True))
def test_words_that_are_accepted_stay_apart_and_words_in_tables_and_yaml(words: list[str]) -> None:
    assume(well_named(glove=tuple(words)))
    read = pd.read_csv(io.StringIO("\n".join(["glove", *words])))["glove"]
    assert list(read) == words
    assert yaml.safe_load(yaml.safe_dump(words)) == words
    assert [yaml.safe_load(word) for word in words] == words  # as a person types them, without quotes
    assert len({word.casefold() for word in words}) == len(words)


@given(st.lists(st.floats(-1e9, 1e9) | st.floats(1, 1.00001), min_size=1, max_size=5, unique=True))
def test_numbers_that_are_accepted_stay_apart_in_every_spelling(numbers: list[float]) -> None:
    assume(well_named(weight_g=tuple(numbers)))
    assert len({f"{number:.6g}" for number in numbers}) == len(numbers)
    assert [float(level_text(number)) for number in numbers] == numbers
    assert all(len(level_text(number)) < 40 for number in numbers)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=5))
def test_drives_that_are_accepted_are_different_bytes_and_none_is_silent(drives: list[float]) -> None:
    assume(accepted(arranged(drive=tuple(drives))))
    assert len({round(255 * drive) for drive in drives} - {0}) == len(drives)


MISTAKES = [
    (set_in(*CLOTHING, "levels")(["inner", "Inner"]), "the levels inner and Inner differ only in capitals"),
    (set_in(*CLOTHING, "levels")(["inner", "off"]), "levels[1]: 'off' would be read as true or false"),
    (set_in(*CLOTHING, "levels")(["inner", "Infinity"]), "'Infinity' would be read as a number"),
    (set_in(*CLOTHING, "levels")(["inner", "null"]), "'null' would be read as a missing value"),
    (set_in(*CLOTHING, "levels")([1.00000001, 1]), "the levels 1.00000001 and 1 differ only in the seventh"),
    (set_in(*CLOTHING, "levels")([1e300, 1]), "levels[0]: the level 1e+300 is not within 1e-06 to 1e+09"),
    (set_in("factors", "between_blocks", "none")({"levels": ["a"]}), "'none' would be read as a missing"),
    (set_in("targets", "nan")({"x_mm": 0, "y_mm": 0, "z_mm": 900}), "targets.nan: 'nan' would be read as"),
    (set_in("factors", "between_blocks", "drive")({"levels": [0.5, 0.501]}), "are one level to the devices"),
    (
        set_in("factors", "between_blocks", "drive")({"levels": [0.001]}),
        "a drive of 0.001 is 0 to the devices",
    ),
    (
        set_in("factors", "between_blocks", "duration_s")({"levels": [0.5, 0.4999]}),
        "0.4999 and 0.5 are one level to the devices",
    ),
    (
        set_in("stimulus")(
            {
                "target": "chest",
                "waveform": "constant",
                "ramp_s": 0,
                "duration_s": 0.0003,
                "modulation_hz": 50,
            }
        ),
        "stimulus.duration_s: a burst of 0.0003 s is too short",
    ),
    (set_in("study", "title")("one\ntwo"), "study.title: this text has several lines"),
    (set_in("study", "authors", 0)("\u202eone"), "contains U+202E, which turns the text around it"),
    (set_in("response", "question")("\u200b"), "response.question: nothing of this text can be seen"),
    (set_in("name")("nul"), "no name of a folder on Windows"),
]


@pytest.mark.parametrize(("change", "message"), MISTAKES, ids=[message for _, message in MISTAKES])
def test_what_would_be_misread_later_is_refused_at_its_place(
    refuse: Refuse, change: Any, message: str
) -> None:
    assert message in refuse(change)


def test_a_level_is_described_however_its_number_is_written(refuse: Refuse) -> None:
    sentences = {"5e-05": "barely anything", "0.50": "half"}
    factor = {"levels": [0.00005, 0.5], "describe": sentences}
    change = set_in("factors", "between_blocks")({"load_kg": factor})
    text = refuse(change)
    assert "comparisons[0].factor: there is no factor 'clothing'" in text
    assert ".describe" not in text
    assert Factor(levels=(0.00005, 0.5), describe=sentences).describe == {
        "0.00005": "barely anything",
        "0.5": "half",
    }
    factor["levels"] = [0.00005, 0.5, 1]
    sentences["0.5"] = "half again"
    assert "the level 0.5 is described twice" in refuse(change)


def test_levels_of_a_method_that_are_one_byte_are_refused(refuse: Refuse) -> None:
    change = set_in("method", "range")({"smallest": 0.004, "largest": 1, "levels": 41})
    assert "41 levels from 0.004 to 1 are only " in refuse(change, "chest-threshold")
