"""Tables of whoever recorded them: read right, and refused with their place."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.data.foreign.request import TableRequest
from autd_analysis.data.foreign.tables import read_tables
from autd_analysis.data.trials import Trials
from autd_analysis.detectability import DETECTABILITY
from autd_analysis.order import ORDER
from autd_analysis.rates import RATES
from autd_analysis.report.summary import plain_words
from autd_analysis.study import analyse

from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison
from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import CHEST_COUNTS

COLUMNS = {"participant": "pid", "response": "felt", "clothing": "cloth", "modulation_hz": "freq"}
COMPARISON = Comparison(factor="clothing", first="inner", second="both", at_each="modulation_hz")


def lines(inner: int = 8, both: int = 3, people: int = 4) -> list[str]:
    """Ten trials a cell, of which so many were felt."""
    return [
        f"p{person},{int(trial < felt)},{cloth},{hertz}"
        for person in range(people)
        for hertz in (25, 100)
        for cloth, felt in (("inner", inner), ("both", both))
        for trial in range(10)
    ]


def read(
    tmp_path: Path,
    rows: Sequence[str],
    *,
    header: str = "pid,felt,cloth,freq",
    name: str = "trials.csv",
    columns: Mapping[str, str] = COLUMNS,
    levels: Mapping[str, Sequence[str]] | None = None,
    comparisons: tuple[Comparison, ...] = (COMPARISON,),
) -> Trials:
    path = tmp_path / name
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_tables([path], TableRequest(columns, levels or {}, comparisons))


def test_rates_and_comparisons_are_those_of_the_table(tmp_path: Path) -> None:
    results = analyse(read(tmp_path, lines(), levels={"clothing": ["inner", "both"]}))
    assert [float(rate.mean or 0) for rate in results[RATES].conditions] == pytest.approx(
        [0.8, 0.8, 0.3, 0.3]
    )
    assert [comparison.mean for comparison in results[COMPARISONS]] == pytest.approx([0.5, 0.5])
    assert results[COMPARISONS][0].contrast.at == (("modulation_hz", 25.0),)
    assert not results.trials.simulated


def test_levels_are_ordered_by_size_or_as_they_are_named(tmp_path: Path) -> None:
    factors = read(tmp_path, lines()).design.factors
    assert factors[0].levels == ("both", "inner")
    assert factors[1].levels == (25.0, 100.0)
    named = read(tmp_path, lines(), levels={"clothing": ["inner", "both", "coat"]}).design.factors[0]
    assert named.levels == ("inner", "both", "coat")


@pytest.mark.parametrize(("yes", "no"), [("felt", "not_felt"), ("TRUE", "False"), ("yes", "no"), ("1", "0")])
def test_answers_in_words_and_numbers(tmp_path: Path, yes: str, no: str) -> None:
    rows = [f"p1,{answer},inner,25" for answer in (yes, yes, no)]
    trials = read(tmp_path, rows, comparisons=())
    assert list(trials.table["felt"]) == [True, True, False]


def test_without_a_column_of_trials_their_order_is_not_looked_at(tmp_path: Path) -> None:
    results = analyse(read(tmp_path, lines()))
    assert {effect.note for effect in results[ORDER]} == {
        "the table has no column of trials, so their order is not known"
    }
    assert "Order effects" not in plain_words(results)
    numbered = [f"{row},{number}" for number, row in enumerate(lines())]
    columns = {**COLUMNS, "trial": "number"}
    known = analyse(read(tmp_path, numbered, header="pid,felt,cloth,freq,number", columns=columns))
    assert "Order effects" in plain_words(known)


def test_a_tsv_with_catch_trials_sessions_and_interrupted_trials(tmp_path: Path) -> None:
    names = ("participant", "session", "trial", "trial_type", "trial_status", "response", "clothing")
    rows = [
        "a\t1\t1\tstimulus\tcomplete\tfelt\tinner",
        "a\t1\t2\tstimulus\tinterrupted\tn/a\tinner",
        "a\t1\t2\tstimulus\tcomplete\tnot_felt\tboth",
        "a\t1\t3\tcatch\tcomplete\tnot_felt\tn/a",
        "a\t2\t1\tstimulus\tcomplete\tn/a\tinner",
    ]
    trials = read(
        tmp_path, rows, header="\t".join(names), name="t.tsv", columns={n: n for n in names}, comparisons=()
    )
    assert trials.table["used"].tolist() == [True, False, True, True, False]
    assert any("1 interrupted" in warning for warning in trials.warnings)
    assert any("without an answer" in warning for warning in trials.warnings)
    results = analyse(trials)
    assert results[RATES].false_alarms is not None
    assert results[DETECTABILITY].participants is not None


def test_practice_is_kept_apart_and_said_to_be(tmp_path: Path) -> None:
    practice = [f"p{person},1,inner,25,practice" for person in range(4)]
    rows = [f"{line},stimulus" for line in lines()] + practice + ["p0,0,n/a,n/a,practice"]
    columns = {**COLUMNS, "trial_type": "kind"}
    trials = read(tmp_path, rows, header="pid,felt,cloth,freq,kind", columns=columns)
    assert int(trials.table["used"].sum()) == len(lines())
    assert "trials.csv: 5 practice trial(s) not counted" in trials.warnings


def test_missing_cells_are_told(tmp_path: Path) -> None:
    trials = read(tmp_path, [row for row in lines() if row[:2] != "p2" or "both" not in row])
    assert any("p2 has no counted stimulus in: clothing both" in warning for warning in trials.warnings)


@pytest.mark.parametrize(
    ("rows", "changes", "message"),
    [
        ([], {}, "the table has no trials"),
        (["p1,2,inner,25"], {"comparisons": ()}, r"trials\.csv:2: response is '2', which is no yes or no"),
        (["p1,0.5,inner,25"], {"comparisons": ()}, "which is no yes or no"),
        (["p1,1,inner,25", "p1,1,,25"], {"comparisons": ()}, r"trials\.csv:3: clothing is missing"),
        ([",1,inner,25"], {"comparisons": ()}, "the participant is missing"),
        (["p1,n/a,inner,25"], {"comparisons": ()}, "no trial is complete and answered"),
        (
            lines(),
            {"columns": COLUMNS | {"clothing": "clothes"}},
            r"trials\.csv:1: there is no column 'clothes'",
        ),
        (
            lines(),
            {"columns": {"participant": "pid", "clothing": "cloth"}, "comparisons": ()},
            "no column is named for response",
        ),
        (lines(), {"columns": {"participant": "pid", "response": "felt"}}, "no factor is named"),
        (lines(), {"levels": {"clothing": ["inner", "coat"]}}, "levels that --levels does not name: both"),
        (lines(), {"levels": {"cloth": ["inner", "both"]}}, "--levels names cloth, which is no factor"),
        (["p1,1,inner,25"], {}, "there is one level of clothing only"),
        (
            lines(),
            {"comparisons": (COMPARISON.model_copy(update={"factor": "drive"}),)},
            "drive is compared but",
        ),
        (
            lines(),
            {"comparisons": (COMPARISON.model_copy(update={"second": "inner"}),)},
            "are not two levels",
        ),
    ],
)
def test_a_bad_table_is_told(
    tmp_path: Path, rows: list[str], changes: dict[str, object], message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        read(tmp_path, rows, **changes)  # type: ignore[arg-type]


def test_trials_that_are_there_twice_are_told(tmp_path: Path) -> None:
    columns = COLUMNS | {"trial": "n"}
    rows = [f"p1,1,inner,25,{number}" for number in (1, 2, 1)]
    with pytest.raises(UsageError, match=r"trials\.csv:4: trial 1 of p1 is complete twice, here and in .*:2"):
        read(tmp_path, rows, header="pid,felt,cloth,freq,n", columns=columns, comparisons=())


def test_a_missing_table_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="the table cannot be read"):
        read_tables([tmp_path / "none.csv"], TableRequest(COLUMNS))


def test_what_is_not_read_is_said(tmp_path: Path) -> None:
    rows = [f"{line},a note" for line in lines()]
    trials = read(tmp_path, rows, header="pid,felt,cloth,freq,comment")
    assert trials.warnings == ("columns of the table that were not read: comment",)


def test_the_same_number_written_otherwise_is_the_same_level(tmp_path: Path) -> None:
    rows = [line.replace(",25", ",25.0") if number % 2 else line for number, line in enumerate(lines())]
    assert read(tmp_path, rows).design.factors[1].levels == (25.0, 100.0)
    named = read(tmp_path, rows, levels={"modulation_hz": ["100", "25"]})
    assert named.design.factors[1].levels == (100.0, 25.0)


def test_names_that_differ_only_in_case_are_said(tmp_path: Path) -> None:
    rows = [*lines(), *(line.replace("p1", "P1").replace("inner", "Inner") for line in lines())]
    warnings = read(tmp_path, rows).warnings
    assert "participants that look alike: P1, p1; are they one?" in warnings
    assert "levels of clothing that look alike: Inner, inner; are they one?" in warnings


def test_uneven_numbers_of_trials_are_said(tmp_path: Path) -> None:
    (warning,) = read(tmp_path, lines()[:-3]).warnings
    assert warning == (
        "numbers of counted stimuli per participant and condition differ: from 7 "
        "(sub-p3, clothing both, modulation_hz 100) to 10"
    )


def test_sessions_of_one_participant_are_said_to_be_pooled(tmp_path: Path) -> None:
    rows = [f"{line},{number % 2}" for number, line in enumerate(lines())]
    trials = read(tmp_path, rows, header="pid,felt,cloth,freq,day", columns={**COLUMNS, "session": "day"})
    assert trials.sessions == 8
    assert "sub-p0 has 2 sessions; their trials are pooled" in trials.warnings


def test_numbers_as_pandas_writes_them(tmp_path: Path) -> None:
    rows = ["p1,1.0,inner,25,1.0,2.0", "p1,0.0,both,25,2.0,", "p1,,both,25,3.0,"]
    columns = {**COLUMNS, "trial": "n", "presses_late": "late"}
    trials = read(tmp_path, rows, header="pid,felt,cloth,freq,n,late", columns=columns)
    assert trials.table["trial"].tolist() == [1, 2, 3]
    assert trials.table["used"].tolist() == [True, True, False]
    assert trials.table["presses_late"].fillna(-1).tolist() == [2, -1, -1]


@pytest.mark.parametrize(
    ("column", "text", "message"),
    [
        ("response_time", "fast", "response_time is 'fast'"),
        ("response_time", "0,5,1", "response_time is '0,5,1'"),
        ("trial", "1.5", "trial is '1.5'"),
        ("block", "-1", "block is '-1'"),
        ("underruns", "some", "underruns is 'some'"),
        ("simulated", "maybe", "simulated is 'maybe'"),
    ],
)
def test_cells_that_make_no_sense_are_refused(tmp_path: Path, column: str, text: str, message: str) -> None:
    rows = ["p1,1,inner,25,", f'p1,1,inner,25,"{text}"']
    with pytest.raises(UsageError, match=rf"trials\.csv:3: {message}"):
        read(tmp_path, rows, header="pid,felt,cloth,freq,x", columns={**COLUMNS, column: "x"}, comparisons=())


@pytest.mark.parametrize("label", ["", "n/a", "NaN"])
def test_a_missing_participant_is_refused(tmp_path: Path, label: str) -> None:
    with pytest.raises(UsageError, match=r"trials\.csv:2: the participant is missing"):
        read(tmp_path, [f"{label},1,inner,25"], comparisons=())


def test_a_column_called_simulated_is_always_read(tmp_path: Path) -> None:
    header = "pid,felt,cloth,freq,simulated"
    assert read(tmp_path, [f"{line},yes" for line in lines()], header=header).simulated
    assert not read(tmp_path, [f"{line},no" for line in lines()], header=header).simulated


def test_a_factor_at_each_of_its_own_levels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="clothing is compared at each of its own levels"):
        read(tmp_path, lines(), comparisons=(COMPARISON.model_copy(update={"at_each": "clothing"}),))


def test_a_comparison_asked_for_twice_is_refused(tmp_path: Path) -> None:
    mirrored = COMPARISON.model_copy(update={"first": "both", "second": "inner"})
    with pytest.raises(UsageError, match="the same comparison twice"):
        read(tmp_path, lines(), comparisons=(COMPARISON, mirrored))


def test_catch_trials_of_some_levels_only_are_said(tmp_path: Path) -> None:
    header = "pid,felt,cloth,freq,kind"
    rows = [f"{line},stimulus" for line in lines()]
    catch = [
        f"p{person},0,{cloth},{hertz},catch"
        for person in range(4)
        for cloth, hertz in (("inner", 25), ("both", ""))
    ]
    columns = {**COLUMNS, "trial_type": "kind"}
    warnings = read(tmp_path, [*rows, *catch], header=header, columns=columns).warnings
    assert any("4 of 8 catch trials have no level of modulation_hz" in warning for warning in warnings)
    assert not any("no level of clothing" in warning for warning in warnings)


def test_one_condition_has_rates(tmp_path: Path) -> None:
    rows = [f"p{person},{trial % 2},inner,25" for person in range(3) for trial in range(4)]
    results = analyse(read(tmp_path, rows, comparisons=()))
    assert [rate.mean for rate in results[RATES].conditions] == [0.5]
    assert "There is one condition only." in plain_words(results)


def test_what_was_not_compared_is_said_with_how_to_ask(tmp_path: Path) -> None:
    words = plain_words(analyse(read(tmp_path, lines(), comparisons=())))
    assert "Nothing was compared" in words
    assert "--compare clothing=both,inner@modulation_hz" in words


def test_bids_events_need_only_the_factors_to_be_named(chest: StudyWriter) -> None:
    (table,) = chest.folder.glob("sub-03/*/beh/*_events.tsv")
    trials = read_tables([table], TableRequest({"clothing": "clothing", "modulation_hz": "modulation_hz"}))
    assert trials.participants == ("03",)
    assert trials.table["session"].unique().tolist() == ["01"]
    assert int(trials.table["felt"].sum()) == sum(CHEST_COUNTS[2])
    assert trials.table["onset_lateness_s"].between(0, 250e-6).all()  # the devices start on a grid


def test_bids_events_without_a_factor_are_told_what_there_is(chest: StudyWriter) -> None:
    (table,) = chest.folder.glob("sub-03/*/beh/*_events.tsv")
    with pytest.raises(UsageError, match=r"--columns modulation_hz,clothing"):
        read_tables([table], TableRequest({}))


def test_a_mixture_of_people_and_programs_is_said(tmp_path: Path) -> None:
    rows = [f"{line},{'yes' if line.startswith('p1') else 'no'}" for line in lines()]
    trials = read(tmp_path, rows, header="pid,felt,cloth,freq,simulated")
    assert trials.simulated
    assert any("40 of 160 lines are of simulated participants" in warning for warning in trials.warnings)


@pytest.mark.parametrize("name", ["used", "rate", "attempt", "interval", "trials", "median_s"])
def test_a_factor_with_the_name_of_another_column_is_refused(tmp_path: Path, name: str) -> None:
    columns = {"participant": "pid", "response": "felt", name: "cloth"}
    with pytest.raises(UsageError, match=f"a factor is called {name}"):
        analyse(read(tmp_path, lines(), columns=columns, comparisons=()))
