"""A subject is one declaration: its table, figure and words appear, and its errors stop no other."""

import importlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.data.trials import Trials, read_trials
from autd_analysis.rates import RATES
from autd_analysis.rates.numbers import Rates
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.summary import plain_words
from autd_analysis.report.table import Declared
from autd_analysis.report.writing import write_results
from autd_analysis.study import SUBJECTS, analyse
from autd_analysis.subject import NotApplicable, Others, Shown, Subject
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from autd_trials.errors import UsageError
from autd_trials.tables import Column

NAMES = [subject.name for subject in SUBJECTS]


@pytest.fixture(scope="module")
def trials(recorded_chest: Path) -> Trials:
    return read_trials(recorded_chest)


# --- A subject of twenty lines, defined here alone. ---
@dataclass(frozen=True)
class Bias:
    participant: str
    share: float


def bias(trials: Trials, _results: Others) -> Sequence[Bias]:
    felt = trials.table[trials.table["used"]].groupby("participant")["felt"].mean()
    return [Bias(str(participant), float(share)) for participant, share in felt.items()]


def draw(found: Sequence[Bias], _results: Others, axes: Axes, _options: FigureOptions) -> None:
    axes.bar([each.participant for each in found], [each.share for each in found])


def figures(found: Sequence[Bias], results: Others) -> Iterator[ResultFigure]:
    def drawn(options: FigureOptions) -> Figure:
        figure = Figure()
        draw(found, results, figure.subplots(), options)
        return figure

    yield ResultFigure("bias", "Who says felt", "A bar for each participant.", drawn)


def words(found: Sequence[Bias], _trials: Trials) -> Shown:
    highest = max(found, key=lambda each: each.share)
    sentence = f"Of all, {highest.participant} said felt most often."
    return Shown(summary=("Bias:", f"  {sentence}"), paragraphs=(sentence,), remarks=("bias is a toy",))


PARTICIPANT = Column[Bias]("participant", "Who.", lambda each: each.participant)
SHARE = Column[Bias]("share", "Share of felt.", lambda each: each.share)
TABLE = Declared[Sequence[Bias], Bias]("bias", "Who says felt.", lambda found: found, (PARTICIPANT, SHARE))
BIAS = Subject(
    "bias",
    "Bias",
    bias,
    definitions={"bias": "A mean."},
    tables=(TABLE,),
    words=words,
    figures=figures,
    plot=draw,
)
# ------------------------------------------------------


def test_a_subject_defined_here_is_in_everything_that_is_written(trials: Trials, tmp_path: Path) -> None:
    results = analyse(trials, only=["rates", "bias"], subjects=(*SUBJECTS, BIAS))
    write_results(results, tmp_path, FigureOptions(formats=("svg",)))
    report = (tmp_path / "report.html").read_text()
    sentence = "said felt most often."
    for expected in (
        sentence,
        "Who says felt",
        'aria-label="A bar for each participant."',
        "bias.tsv",
        "A mean.",
    ):
        assert expected in report
    assert "bias is a toy" in (tmp_path / "README.md").read_text()
    assert (tmp_path / "bias.tsv").read_text().startswith("participant\tshare\tnotes\tsimulated\n")
    assert len(json.loads((tmp_path / "results.json").read_text())["bias"]) == 8
    assert (tmp_path / "bias.svg").exists()
    assert sentence in plain_words(results)
    assert results.bias.to_frame()["share"].between(0, 1).all()
    axes = Figure().subplots()
    assert results.bias.plot(ax=axes) is axes
    assert len(axes.patches) == 8


def test_each_subject_stands_after_those_it_needs_and_names_are_used_once() -> None:
    for place, subject in enumerate(SUBJECTS):
        assert set(subject.needs) <= set(SUBJECTS[:place]), subject.name
        assert subject.name.isidentifier()
        assert importlib.import_module(f"autd_analysis.{subject.name}").__doc__
    tables = [table.name for subject in SUBJECTS for table in subject.tables]
    definitions = [name for subject in SUBJECTS for name in subject.definitions]
    for names in (NAMES, tables, definitions):
        assert len(names) == len(set(names))


def test_only_and_without_choose_and_what_is_needed_is_computed_unseen(trials: Trials) -> None:
    results = analyse(trials, only=["interactions"])
    assert [outcome.subject.name for outcome in results.shown] == ["interactions"]
    assert [outcome.subject.name for outcome in results.outcomes] == ["rates", "comparisons", "interactions"]
    assert {table.name for table in results.tables} == {"interactions", "trends"}
    left_out = ["models", "sensitivity", "psychometric", "order"]
    results = analyse(trials, without=left_out)
    assert [outcome.subject.name for outcome in results.outcomes] == [
        name for name in NAMES if name not in [*left_out]
    ]
    with pytest.raises(UsageError, match="there is no subject 'rate'"):
        analyse(trials, only=["rate"])


def test_each_subject_is_computed_once_and_shown_once(trials: Trials) -> None:
    counted: list[str] = []

    def count(_trials: Trials, _results: Others) -> int:
        counted.append("one")
        return 1

    one = Subject[int]("one", "One", count)
    two = Subject[int]("two", "Two", lambda _trials, results: results[one] + 1, needs=(one,))
    three = Subject[int](
        "three", "Three", lambda _trials, results: results[one] + results[two], needs=(two, one)
    )
    shares: list[float] = []
    results = analyse(trials, only=["three"], subjects=(one, two, three), progress=shares.append)
    assert shares == pytest.approx([1 / 3, 2 / 3, 1])
    assert (results[one], results[two], results[three]) == (1, 2, 3)
    assert counted == ["one"]


def failing(trials: Trials, results: Others) -> float:
    return 1 / len(trials.participants[:0])


def test_an_error_of_ours_in_one_subject_leaves_the_others(trials: Trials, tmp_path: Path) -> None:
    broken = Subject[float](
        "broken", "Broken", failing, tables=(Declared("broken", "None.", lambda _: (), ()),)
    )
    needing = Subject[float]("needing", "Needing", lambda _t, results: results[broken], needs=(broken,))
    results = analyse(trials, subjects=(RATES, broken, needing, COMPARISONS))
    results = write_results(results, tmp_path, FigureOptions(formats=("svg",))).results
    assert list(results.failures) == ["broken"]
    assert "ZeroDivisionError" in results.failures["broken"].cause
    assert "failing" in (tmp_path / "error-broken.txt").read_text()
    assert any(remark.startswith("broken: an error of this program") for remark in results.remarks)
    assert any(remark.startswith("needing: it needs broken") for remark in results.remarks)
    assert "Not computed: an error of this program" in (tmp_path / "report.html").read_text()
    written = json.loads((tmp_path / "results.json").read_text())
    assert written["broken"] is None
    assert len(written["comparisons"]) == 3
    assert (tmp_path / "rates.svg").exists()
    with pytest.raises(UsageError, match="broken: an error of this program"):
        results.broken.to_frame()
    write_results(
        analyse(trials, subjects=(RATES, replace(BIAS, name="broken"))),
        tmp_path,
        FigureOptions(formats=("svg",)),
    )
    assert not (tmp_path / "error-broken.txt").exists()


def boom(*_: object) -> Any:
    raise RuntimeError("boom")


def conditions_of(rates: Subject[Rates], _trials: Trials, results: Others) -> int:
    return len(results[rates].conditions)


def test_an_error_in_a_table_or_a_word_leaves_the_numbers_to_others(trials: Trials) -> None:
    for broken in (
        replace(RATES, words=boom),
        replace(RATES, tables=(Declared("rates", "None.", lambda _: [1], (Column("a", "A.", boom),)),)),
    ):
        after = Subject[int]("after", "After", partial(conditions_of, broken), needs=(broken,))
        results = analyse(trials, subjects=(broken, after))
        assert list(results.failures) == ["rates"]
        assert results[after] == 6


def test_an_error_in_a_figure_leaves_the_tables(trials: Trials, tmp_path: Path) -> None:
    def declared(found: object, results: Others) -> Iterator[ResultFigure]:
        yield ResultFigure("rates", "Rates", "Rates.", boom)

    for broken in (replace(RATES, figures=boom), replace(RATES, figures=declared)):
        results = write_results(
            analyse(trials, subjects=(broken,)), tmp_path, FigureOptions(formats=("svg",))
        ).results
        assert "its figures are missing" in results.failures["rates"].cause
        assert (tmp_path / "rates.tsv").exists()
        assert "boom" in (tmp_path / "error-rates.txt").read_text()


def test_what_the_data_do_not_allow_is_a_remark_and_what_the_design_lacks_is_none(trials: Trials) -> None:
    def refuse(_trials: Trials, _results: Others) -> int:
        raise UsageError("amplitude is no number", where="t.csv")

    refused = Subject[int]("refused", "Refused", refuse)
    absent = Subject[int]("absent", "Absent", lambda _t, _r: NotApplicable("there is none"))
    results = analyse(trials, subjects=(refused, absent))
    assert [remark for remark in results.remarks if remark not in trials.warnings] == [
        "refused: amplitude is no number"
    ]
    assert not results.failures
    asked = analyse(trials, only=["absent"], subjects=(refused, absent))
    assert "absent: there is none" in asked.remarks
