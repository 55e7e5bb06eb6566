"""The tables of models: complete, described, and saying what is undefined."""

import csv
from pathlib import Path

import pytest
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.table import ResultTable
from autd_analysis.report.writing import write_results
from autd_analysis.study import analyse

from autd_trials.protocol.schema import Comparison
from autd_trials.testing.recorded import StudyWriter
from tests.analysis.conftest import chest_protocol

NAMES = ("model_means", "model_effects", "model_fit", "other_models", "firth_logits")


def tables(writer: StudyWriter) -> dict[str, ResultTable]:
    return {table.name: table for table in analyse(writer.folder).tables if table.name in NAMES}


def add_constant(writer: StudyWriter, people: int, felt: bool) -> None:
    for number in range(1, people + 1):
        writer.add(f"{number:02}", lambda conditions, repetition: felt)


def test_the_chest_study_has_everything(chest: StudyWriter) -> None:
    found = tables(chest)
    assert {name: len(found[name].rows) for name in NAMES} == {
        "model_means": 12,  # six conditions by two links
        "model_effects": 6,
        "model_fit": 2,
        "other_models": 15,  # three comparisons by five methods
        "firth_logits": 6,
    }
    for table in found.values():
        described = {column.name for column in table.columns}
        assert all(set(row) <= described for row in table.rows)
    for name in NAMES:
        assert all(row["participants"] == 8 for row in found[name].rows)
    assert all(row["converged"] is True for row in found["model_fit"].rows)
    assert {row["interaction_df"] for row in found["model_fit"].rows} == {2}
    for name in ("model_means", "model_effects", "other_models", "firth_logits"):
        assert all(row["reading"] for row in found[name].rows)


def test_readings_say_the_estimate(chest: StudyWriter) -> None:
    row = next(row for row in tables(chest)["other_models"].rows if "Kauermann" in str(row["method"]))
    assert row["logits"] == pytest.approx(1.6898)  # log of (41/39) / (13/67)
    assert str(row["reading"]).startswith(
        "the odds of feeling are 5.4 times as high with inner as with inner_outer (95 %: 3.8 to 7.8)"
    )


@pytest.mark.parametrize("felt", [True, False])
def test_all_or_none_felt_is_said_with_finite_penalised_estimates(
    writer: StudyWriter, tmp_path: Path, felt: bool
) -> None:
    add_constant(writer, 5, felt)
    found = tables(writer)
    assert all(row["separated"] is True and row["logit"] is not None for row in found["firth_logits"].rows)
    assert all(row["penalised"] is True and row["notes"] for row in found["model_fit"].rows)
    for row in found["other_models"].rows:
        given = row["method"] == "Firth logistic"
        assert (row["logits"] is not None) == given
        assert (row["notes"] is None) == given
    write_results(analyse(writer.folder), tmp_path, FigureOptions(formats=("svg",)))
    with (tmp_path / "other_models.tsv").open(encoding="utf-8", newline="") as file:
        assert {row["wald_p"] for row in csv.DictReader(file, delimiter="\t")} == {"n/a"}


def test_too_few_people_are_said_in_every_row(writer: StudyWriter) -> None:
    add_constant(writer, 1, True)
    found = tables(writer)
    for name, column in (
        ("model_means", "mean"),
        ("model_effects", "difference"),
        ("model_fit", "converged"),
    ):
        assert found[name].rows
        assert all(row.get(column) is None for row in found[name].rows)
        assert all("it takes 4" in str(row["notes"]) for row in found[name].rows)
    assert all("it takes 4" in str(row["notes"]) for row in found["other_models"].rows)


def test_a_condition_that_nobody_had_is_said(writer: StudyWriter) -> None:
    for number in range(1, 6):
        writer.add(
            f"{number:02}",
            lambda conditions, repetition, number=number: (  # type: ignore[misc]
                None
                if (conditions["clothing"], conditions["modulation_hz"]) == ("inner", 50.0)
                else (repetition + number) % 3 == 0
            ),
        )
    found = tables(writer)
    (missing,) = [
        row for row in found["model_means"].rows if row["link"] == "logit" and row.get("mean") is None
    ]
    assert (missing["clothing"], missing["modulation_hz"]) == ("inner", 50.0)
    assert missing["notes"] == "no trials there"
    (effect,) = [
        row for row in found["model_effects"].rows if row["link"] == "logit" and row.get("difference") is None
    ]
    assert effect["notes"] == "a condition has no trials"
    assert [row["notes"] for row in found["firth_logits"].rows].count("no trials") == 1


def test_a_study_without_factors_or_comparisons_has_means_alone(writer: StudyWriter) -> None:
    writer.protocol = chest_protocol(within={}, between={}, comparisons=())
    for number in range(1, 6):
        writer.add(f"{number:02}", lambda conditions, repetition, number=number: repetition < number + 2)  # type: ignore[misc]
    found = tables(writer)
    assert len(found["model_means"].rows) == 2
    assert all(row["mean"] is not None for row in found["model_means"].rows)
    for name in ("model_effects", "other_models"):
        (row,) = found[name].rows
        assert row["notes"] == "the protocol plans no comparison"
    assert found["model_fit"].rows[0]["slope_sd"] is None


def test_a_third_level_is_in_the_model_but_not_compared(writer: StudyWriter) -> None:
    planned = Comparison(factor="clothing", first="inner", second="coat")
    writer.protocol = chest_protocol(
        within={}, between={"clothing": ("inner", "shirt", "coat")}, comparisons=(planned,)
    )
    for number in range(1, 7):
        writer.add(
            f"{number:02}",
            lambda conditions, repetition, number=number: (
                repetition  # type: ignore[misc]
                < {"inner": 5, "shirt": 4, "coat": 1}[str(conditions["clothing"])] + number % 3
            ),
        )
    found = tables(writer)
    means = {row["clothing"]: row["mean"] for row in found["model_means"].rows if row["link"] == "logit"}
    (effect,) = [row for row in found["model_effects"].rows if row["link"] == "logit"]
    assert isinstance(means["inner"], float)
    assert isinstance(means["coat"], float)
    assert effect["difference"] == pytest.approx(means["inner"] - means["coat"], abs=1e-3)
    assert effect["at"] is None
