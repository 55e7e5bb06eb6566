"""Reading a study: what is counted, what is reported, what is refused."""

import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from autd_analysis.data.trials import read_trials

from autd_trials.cli import main
from autd_trials.errors import UsageError
from autd_trials.protocol.load import find_protocol
from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol


def test_a_clean_study_is_read_whole_and_without_remarks(chest: StudyWriter) -> None:
    trials = read_trials(chest.folder)
    assert trials.warnings == ()
    assert trials.participants == tuple(f"{number:02}" for number in range(1, 9))
    assert trials.sessions == 8
    assert len(trials.table) == 8 * 60
    assert trials.table["used"].all()
    assert trials.simulated
    assert [factor.name for factor in trials.design.factors] == ["modulation_hz", "clothing"]
    assert trials.table["felt"].sum() == sum(map(sum, CHEST_COUNTS))
    assert set(trials.table["modulation_hz"]) == {25.0, 50.0, 100.0}
    assert len(trials.inputs) == 16


def test_interrupted_trials_are_kept_apart_and_reported(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), interrupted=(3, 17))
    trials = read_trials(writer.folder)
    assert len(trials.table) == 62
    assert trials.table["used"].sum() == 60
    assert trials.table.loc[~trials.table["used"], "trial"].tolist() == [3, 17]
    told = "sub-01_ses-01_task-chest_run-1: 2 interrupted attempt(s) at a trial not counted"
    assert told in trials.warnings


def test_an_aborted_session_is_reported_with_what_it_lacks(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), trials=25)
    warnings = read_trials(writer.folder).warnings
    assert "sub-01_ses-01_task-chest_run-1 ended as aborted" in warnings
    assert "sub-01_ses-01_task-chest_run-1: 25 of 60 planned trials are complete" in warnings
    missing = [warning for warning in warnings if "no counted stimulus" in warning]
    assert len(missing) == 1
    assert "modulation_hz 100, clothing inner_outer" in missing[0]
    assert "modulation_hz 25, clothing inner;" not in missing[0]


def test_a_session_without_an_end_is_reported(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), ends=False)
    assert any("did not come to an end" in warning for warning in read_trials(writer.folder).warnings)


def test_trials_without_an_answer_are_not_counted_and_reported(writer: StudyWriter) -> None:
    writer.add("01", lambda conditions, repetition: None if repetition == 9 else True)
    trials = read_trials(writer.folder)
    assert trials.table["used"].sum() == 54
    assert any("6 complete trial(s) without an answer" in warning for warning in trials.warnings)


def test_damaged_log_lines_and_sessions_that_never_began_are_reported(chest: StudyWriter) -> None:
    log = chest.paths("02").log
    log.write_text(log.read_text() + '{"event": "no', encoding="utf-8")
    lines = len(log.read_text().splitlines())
    empty = chest.paths("09").log
    empty.parent.mkdir(parents=True)
    empty.write_text('{"event": "session-st', encoding="utf-8")
    warnings = read_trials(chest.folder).warnings
    assert any("sub-02" in warning and f"damaged in line(s) {lines}" in warning for warning in warnings)
    assert any("sub-09" in warning and "never began" in warning for warning in warnings)


def test_logs_and_tables_that_lack_each_other_are_reported(chest: StudyWriter) -> None:
    chest.paths("03").log.unlink()
    chest.paths("04").events.unlink()
    warnings = read_trials(chest.folder).warnings
    assert any("sub-03" in warning and "no raw log" in warning for warning in warnings)
    assert any("sub-04" in warning and "no trial table" in warning for warning in warnings)


def test_real_and_simulated_sessions_together_are_reported(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), simulated=True)
    writer.add("02", chest_answer(CHEST_COUNTS[1]), simulated=False)
    trials = read_trials(writer.folder)
    assert trials.simulated
    assert any("1 of 2 sessions are simulated" in warning for warning in trials.warnings)


def test_a_study_of_people_is_not_called_simulated(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]), simulated=False)
    assert not read_trials(writer.folder).simulated


def test_two_sessions_of_one_participant_are_pooled_and_reported(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]))
    writer.add("01", chest_answer(CHEST_COUNTS[1]), session="02")
    trials = read_trials(writer.folder)
    assert trials.participants == ("01",)
    assert trials.sessions == 2
    assert any("sub-01 has 2 sessions" in warning for warning in trials.warnings)


def test_a_copied_table_is_reported(writer: StudyWriter) -> None:
    for participant in ("01", "02"):
        writer.add(participant, chest_answer(CHEST_COUNTS[0]))
    shutil.copy(writer.folder / writer.paths("01").events, writer.paths("02").events)
    assert any("same byte for byte" in warning for warning in read_trials(writer.folder).warnings)


def test_the_newest_protocol_orders_the_levels_and_older_levels_follow(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(within={"modulation_hz": (25.0, 200.0)})
    writer.add("01", lambda conditions, repetition: True, start=datetime(2026, 1, 1, 10, tzinfo=UTC))
    writer.protocol = chest_protocol(within={"modulation_hz": (100.0, 25.0)})
    writer.add("02", lambda conditions, repetition: True, start=datetime(2026, 2, 1, 10, tzinfo=UTC))
    trials = read_trials(writer.folder)
    assert trials.design.factor("modulation_hz").levels == (100.0, 25.0, 200.0)
    assert any("2 versions of the protocol" in warning for warning in trials.warnings)


def test_protocols_of_different_factors_are_refused_with_their_files(writer: StudyWriter) -> None:
    writer.add("01", chest_answer(CHEST_COUNTS[0]))
    writer.protocol = chest_protocol(between={}, comparisons=())
    writer.add("02", lambda conditions, repetition: True, start=datetime(2026, 2, 1, 10, tzinfo=UTC))
    with pytest.raises(UsageError) as refused:
        read_trials(writer.folder)
    assert str(writer.paths("01").log) in str(refused.value)
    assert str(writer.paths("02").log) in str(refused.value)
    assert "clothing" in str(refused.value)


def test_protocols_of_different_methods_are_refused(tmp_path: Path) -> None:
    """Staircases down after 2 and after 3 "felt" tell thresholds for different rates of it: no one thing."""
    text = find_protocol("chest-threshold").read_text()
    start = text.index("\nmethod:") + 1
    end = text.index("\n\n", start)
    for down in (2, 3):
        method = (
            "method:\n  kind: staircase\n  varies: drive\n"
            "  range: {smallest: 0.1, largest: 1.0, levels: 21}\n"
            f"  start: 1.0\n  felt_to_go_down: {down}"
        )
        path = tmp_path / f"{down}.yaml"
        path.write_text(text[:start] + method + text[end:])
        assert main(["run", str(path), "--simulate", "1", "--seed", "1", "--data", str(tmp_path)]) == 0
    with pytest.raises(UsageError, match="different factors or methods"):
        read_trials(tmp_path / "chest-threshold")


def test_a_trial_that_is_complete_twice_is_refused_with_its_lines(chest: StudyWriter) -> None:
    table = chest.paths("05").events
    lines = table.read_text().splitlines()
    table.write_text("\n".join([*lines, lines[7]]) + "\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"trial 7 is complete twice, here and in .*:8") as refused:
        read_trials(chest.folder)
    assert refused.value.where == f"{table}:62"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: text.replace("\tfelt\t", "\tyes\t", 1), "response is 'yes', expected felt or not_felt"),
        (lambda text: text.replace("\tinner\t", "\tinnr\t", 1), "clothing is 'innr', expected a level"),
        (lambda text: text.replace("\t25\t", "\tabc\t", 1), "modulation_hz is 'abc', expected a level"),
        (lambda text: text.replace("\tstimulus\t", "\tsham\t", 1), "trial_type is 'sham'"),
        (lambda text: text.replace("\tcomplete\t", "\tdone\t", 1), "trial_status is 'done'"),
        (lambda text: text.replace("\tstimulus\t1\t", "\tstimulus\tone\t", 1), "trial is 'one'"),
        (lambda text: text.replace("\t0.401\t", "\tnan\t", 1), "response_time is 'nan'"),
        (lambda text: text.replace("\tclothing", "\tclothes", 1), "the columns clothing are missing"),
        (lambda text: text.replace("\tinner\t", "\tinner ", 1), "23 cells under 24 column names"),
        (
            lambda text: text.replace("\tattempt", "\tclothing", 1),
            "more than once: clothing",
        ),
        (lambda text: "", "the trial table is empty"),
        (lambda text: "onset\x00", "control character"),
    ],
)
def test_a_damaged_table_is_refused_with_its_place(
    chest: StudyWriter, change: Callable[[str], str], says: str
) -> None:
    table = chest.paths("01").events
    table.write_text(change(table.read_text()), encoding="utf-8")
    with pytest.raises(UsageError) as refused:
        read_trials(chest.folder)
    assert says in refused.value.what
    assert refused.value.where is not None
    assert refused.value.where.startswith(f"{table}:")


def test_a_table_that_is_no_text_is_refused(chest: StudyWriter) -> None:
    table = chest.paths("01").events
    table.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="cannot be read"):
        read_trials(chest.folder)


def test_a_table_in_another_participants_folder_is_refused(chest: StudyWriter) -> None:
    table = chest.paths("01").events
    table.rename(table.with_name(table.name.replace("sub-01", "sub-77")))
    with pytest.raises(UsageError, match="does not fit its folder"):
        read_trials(chest.folder)


def test_nothing_to_analyse_is_said(tmp_path: Path, writer: StudyWriter) -> None:
    with pytest.raises(UsageError, match="no such folder"):
        read_trials(tmp_path / "nowhere")
    with pytest.raises(UsageError, match="no trial tables"):
        read_trials(tmp_path)
    stopped = writer.add("01", lambda conditions, repetition: True, trials=1, ends=False)
    lines = stopped.read_text().splitlines(keepends=True)
    stopped.write_text("".join(lines[: next(n for n, line in enumerate(lines) if "trial-end" in line)]))
    with pytest.raises(UsageError, match="no complete trial"):
        read_trials(writer.folder)
    with pytest.raises(UsageError, match="no trial tables") as refused:
        read_trials(writer.folder.parent)
    assert refused.value.do == "give one of the studies in it: chest"


def test_tables_without_any_log_are_refused(writer: StudyWriter) -> None:
    writer.add("01", lambda conditions, repetition: True)
    (writer.folder / writer.paths("01").log).unlink()
    with pytest.raises(UsageError, match="whether it is simulated are not known"):
        read_trials(writer.folder)
