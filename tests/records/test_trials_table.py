from pathlib import Path

import pytest

from autd_trials.protocol.schema import Factor, Factors
from autd_trials.records.log import LogContents
from autd_trials.records.trials_table import trial_columns, trial_rows
from autd_trials.tables import RESERVED_NAMES, Value, cells, describe
from autd_trials.testing.script import SessionScript
from autd_trials.testing.studies import make_protocol


def rows(script: SessionScript) -> list[dict[str, Value]]:
    log = LogContents(Path("log.jsonl"), tuple(script.events))
    columns = trial_columns([log.start.protocol])
    return [cells(columns, attempt) for attempt in trial_rows(log)]


def test_a_complete_trial_has_its_conditions_its_answer_and_its_timing() -> None:
    script = SessionScript().begin(2).stimulate(2).press(2, phase="before_onset").press(2).press(2).finish(2)
    (row,) = rows(script)
    begin_t_s = script.events[1].t_s
    assert row == {
        "onset": begin_t_s + 0.75 + 0.035,
        "duration": 1.0,
        "trial_type": "stimulus",
        "trial": 2,
        "block": 1,
        "attempt": 1,
        "trial_status": "complete",
        "modulation_hz": 50.0,
        "clothing": "inner",
        "drive": 1.0,
        "response": "felt",
        "response_time": 0.4,
        "button": "space",
        "onset_lateness": 0.0002,
        "start_margin": 0.0231,
        "silent_before": 0.002,
        "emitting_after": 0.003,
        "presses_before_onset": 1,
        "presses_in_window": 2,
        "presses_late": 0,
        "exposure_s": 1.0,
        "ear_level": 98.5,
        "underruns": 0,
        "simulated": True,
    }


def test_a_late_press_belongs_to_its_trial() -> None:
    script = SessionScript().trial(1, felt=False).begin(2).press(1, phase="late").stimulate(2).finish(2)
    first, second = rows(script)
    assert (first["trial"], first["response"], first["presses_late"]) == (1, "not_felt", 1)
    assert (second["trial"], second["presses_late"]) == (2, 0)


def test_a_catch_trial_emits_nothing_and_has_no_within_block_condition() -> None:
    script = SessionScript()
    catch = next(trial.trial for trial in script.plan.trials if trial.trial_type == "catch")
    (row,) = rows(script.trial(catch))
    assert (row["duration"], row["drive"], row["exposure_s"]) == (0, 0, 0)
    assert row["modulation_hz"] is None
    assert row["clothing"] == "inner"
    assert row["response"] == "felt"


def test_a_trial_interrupted_before_its_stimulus_is_at_its_beginning() -> None:
    script = SessionScript().begin(1)
    (row,) = rows(script)
    assert (row["onset"], row["duration"], row["trial_status"]) == (script.events[-1].t_s, 0, "interrupted")
    assert row["response"] is None
    assert row["onset_lateness"] is None


def test_a_crash_after_the_start_command_cannot_stop_the_burst() -> None:
    (row,) = rows(SessionScript().begin(1).stimulate(1))
    assert (row["duration"], row["trial_status"]) == (1.0, "interrupted")


def test_an_interrupted_burst_lasts_until_it_was_cut_off() -> None:
    script = SessionScript().begin(1).stimulate(1).interrupt(1)
    (row,) = rows(script)
    assert row["duration"] == pytest.approx(script.events[-1].t_s - (script.events[-2].t_s + 0.035))


def test_every_attempt_has_a_row_in_the_order_of_the_onsets() -> None:
    script = SessionScript().trial(1).begin(2).stimulate(2).interrupt(2).begin(2, 2).resume().trial(2, 3)
    table = rows(script)
    assert [(row["trial"], row["attempt"], row["trial_status"]) for row in table] == [
        (1, 1, "complete"),
        (2, 1, "interrupted"),
        (2, 2, "interrupted"),
        (2, 3, "complete"),
    ]
    onsets = [row["onset"] for row in table]
    assert onsets == sorted(onsets, key=lambda onset: float(str(onset)))


@pytest.mark.parametrize("lost", range(1, 5))
def test_a_trial_with_a_lost_line_keeps_its_row(lost: int) -> None:
    script = SessionScript().trial(2)
    del script.events[lost]
    (row,) = rows(script)
    assert (row["trial"], row["modulation_hz"]) == (2, 50.0)
    assert row["trial_status"] == ("interrupted" if lost == 4 else "complete")


def test_no_factor_can_take_the_name_of_a_column() -> None:
    factors = Factors()
    columns = {column.name for column in trial_columns([make_protocol(factors=factors)])}
    assert columns - {"drive"} <= RESERVED_NAMES


def test_levels_of_all_protocols_of_a_study_are_described() -> None:
    later = make_protocol(
        factors=Factors(
            between_blocks={"clothing": Factor(levels=("inner", "coat"), describe={"coat": "A winter coat."})}
        )
    )
    sidecar = describe(trial_columns([make_protocol(), later]))
    assert sidecar["clothing"]["Levels"] == {
        "inner": "inner",
        "inner_outer": "inner_outer",
        "coat": "A winter coat.",
    }
    assert sidecar["modulation_hz"]["Units"] == "Hz"
    assert "Levels" not in sidecar["modulation_hz"]


def test_a_varied_drive_has_one_column() -> None:
    protocol = make_protocol(factors=Factors(within_block={"drive": Factor(levels=(0.5, 1.0))}))
    names = [column.name for column in trial_columns([protocol])]
    assert names.count("drive") == 1
