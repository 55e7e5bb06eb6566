"""Tables of whoever recorded them: read right, and refused with their place."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from analysis.any_table import TableRequest, read_any_table
from analysis.study import results_of
from analysis.trials import Trials
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison

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
    return read_any_table(path, TableRequest(columns, levels or {}, comparisons))


def test_rates_and_comparisons_are_those_of_the_table(tmp_path: Path) -> None:
    results = results_of(read(tmp_path, lines(), levels={"clothing": ["inner", "both"]}))
    assert [float(rate.mean or 0) for rate in results.rates] == pytest.approx([0.8, 0.8, 0.3, 0.3])
    assert [comparison.mean for comparison in results.comparisons] == pytest.approx([0.5, 0.5])
    assert results.comparisons[0].at == (("modulation_hz", 25.0),)
    assert not results.simulated


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
    results = results_of(trials)
    assert results.false_alarms is not None
    assert results.detectability is not None


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
            {"columns": {"participant": "pid", "clothing": "cloth"}},
            "no column is named for response",
        ),
        (lines(), {"columns": {"participant": "pid", "response": "felt"}}, "no factor is named"),
        (lines(), {"levels": {"clothing": ["inner", "coat"]}}, "levels that --levels does not name: both"),
        (["p1,1,inner,25"], {}, "there is one condition only"),
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
        read_any_table(tmp_path / "none.csv", TableRequest(COLUMNS))
