"""The options of figures on the command line: read, refused where they make no sense, and done."""

import argparse
from pathlib import Path

import pytest

from autd_trials.commands.figure_arguments import add_figure_arguments, figure_options
from autd_trials.errors import UsageError
from tests.commands.conftest import Run


def parsed(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_figure_arguments(parser)
    return parser.parse_args(arguments)


def test_all_options_are_read() -> None:
    options = figure_options(
        parsed(
            *("--figure-width", "single", "--colours", "#0072B2, tab:red", "--order", "cloth=b,a"),
            *("--labels", "cloth=Clothing", "--labels", "cloth:a=bare = skin", "--no-caption"),
            *("--no-test-table", "--format", "pdf,tiff"),
        )
    )
    assert options.width_mm == 85
    assert options.colours == ("#0072B2", "tab:red")
    assert options.order == {"cloth": ["b", "a"]}
    assert options.titles == {"cloth": "Clothing"}
    assert options.labels == {"cloth": {"a": "bare = skin"}}
    assert not options.caption
    assert not options.test_table
    assert options.formats == ("pdf", "tiff")
    plain = figure_options(parsed())
    assert plain.width_mm == 174
    assert plain.caption
    assert plain.formats == ("png", "svg", "pdf")


@pytest.mark.parametrize(
    "wrong",
    [
        ("--figure-width", "wide"),
        ("--figure-width", "5"),
        ("--colours", "no-colour"),
        ("--colours", "red,,blue"),
        ("--order", "cloth"),
        ("--order", "cloth=a,a"),
        ("--labels", "cloth"),
        ("--labels", "cloth:=x"),
        ("--labels", "cloth:a="),
        ("--format", "gif"),
    ],
)
def test_what_makes_no_sense_is_refused(wrong: tuple[str, str]) -> None:
    with pytest.raises(UsageError):
        figure_options(parsed(*wrong))


def test_analyse_makes_figures_as_asked_for(run: Run, tmp_path: Path) -> None:
    table = tmp_path / "answers.csv"
    rows = [f"p{person},{cloth},{trial % 2}" for person in range(3) for cloth in "abc" for trial in range(4)]
    table.write_text("\n".join(["who,cloth,felt", *rows]) + "\n")
    named = ("--columns", "participant=who,response=felt,cloth")
    asked = ("--labels", "cloth:a=bare skin", "--order", "cloth=c,b", "--format", "svg")
    done = run("analyse", str(table), *named, *asked)
    assert done.code == 0
    folder = tmp_path / "answers-analysis"
    assert {file.name for file in folder.glob("rates.*")} == {"rates.tsv", "rates.svg"}
    report = (folder / "report.html").read_text(encoding="utf-8")
    assert "Cloth (c, b, bare skin)" in report
    assert "--order cloth=c,b" in report
    refused = run("analyse", str(table), *named, "--labels", "coat:a=x")
    assert refused.code == 2
    assert "there is no factor coat" in refused.err
