"""Every advice that a refused table gets is typed as it is printed: it must mend what it is about."""

import argparse
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

import pytest
from autd_analysis.data.foreign.tables import read_tables, table_paths
from autd_analysis.data.trials import Trials

from autd_trials.commands import analyse
from autd_trials.errors import UsageError

OPTION = re.compile(r"""(--[a-z]+) ((?:'[^']*'|"'"|[^\s'"])+)""")
WHOLE = {"--columns", "--participant", "--encoding"}
"""Options of which there is one."""

NAMED = ["--columns", "participant=who,response=felt,cloth,hz=freq"]
ROWS = [
    f"P{person},{int(trial < felt)},{cloth},{hertz},{trial}"
    for person in (1, 2, 3)
    for hertz in (25, 100)
    for cloth, felt in (("inner", 3), ("both", 1))
    for trial in range(4)
]
HEADER = "who,felt,cloth,freq,number"


def typed(arguments: Sequence[str]) -> Trials:
    """Read tables as a command line says."""
    parser = argparse.ArgumentParser()
    analyse.add_arguments(parser)
    options = parser.parse_args(arguments)
    return read_tables(table_paths(options.study), analyse.table_request(options))


def advised(arguments: Sequence[str], error: UsageError) -> list[list[str]]:
    """Return the command line with each option that was advised, in place of that which it is about."""
    told = f"{error.where} {error.what}"
    lines = []
    for option, word in OPTION.findall(error.do or ""):
        kept = list(arguments)
        while option in kept and (option in WHOLE or option in told):
            place = kept.index(option)
            del kept[place : place + 2]
        lines.append([*kept, option, *shlex.split(word)])
    return lines


def mended(arguments: Sequence[str], steps: int = 4) -> list[str]:
    """Type what is advised until the tables are read; return the first message."""
    try:
        typed(arguments)
    except UsageError as error:
        message = str(error)
        assert steps, message
        lines = advised(arguments, error)
        assert lines, f"nothing to type: {message}"
        for line in lines:
            again = mended(line, steps - 1)
            assert message not in again, message
        return [message, *again]
    return []


def column(rows: Sequence[str], place: int, old: str, new: str) -> list[str]:
    """Return rows with a word of one column in place of another."""
    changed = []
    for row in rows:
        cells = row.split(",")
        cells[place] = new if cells[place] == old else cells[place]
        changed.append(",".join(cells))
    return changed


CASES: dict[str, tuple[Sequence[str], Sequence[str], str]] = {
    "nothing named": (ROWS, [], "no column is named for participant"),
    "no answers named": (ROWS, ["--columns", "participant=who,cloth"], "no column is named for response"),
    "no factor named": (ROWS, ["--columns", "participant=who,response=felt"], "no factor is named"),
    "misspelled column": (ROWS, ["--columns", "participant=Who,response=felt,cloths"], "there is no column"),
    "no such column": (ROWS, ["--columns", "participant=xyz,response=felt,cloth"], "there is no column"),
    "no such column to ignore": (ROWS, [*NAMED, "--ignore", "numbr"], "there is no column"),
    "a reserved name": (ROWS, ["--columns", "participant=who,response=felt,rate=freq"], "is called rate"),
    "one column twice": (
        ROWS,
        ["--columns", "participant=who,response=felt,a=cloth,b=cloth"],
        "is named for",
    ),
    "counts and answers": (
        ROWS,
        ["--columns", "participant=who,response=felt,n=number,cloth"],
        "both response",
    ),
    "counts of one trial": (
        ["P1,2,inner,25,4", "P2,3,both,25,4"],
        ["--columns", "participant=who,felt,n=number,cloth,response_time=freq"],
        "a line of counts has no response_time",
    ),
    "half of the counts": (ROWS, ["--columns", "participant=who,felt,cloth"], "no column is named for n"),
    "counts that cannot be": (
        ["P1,5,inner,25,4", "P1,3,inner,25,4"],
        ["--columns", "participant=who,felt,n=number,cloth"],
        "5 of 4 trials are felt",
    ),
    "a count that is missing": (
        ["P1,,inner,25,4", "P1,3,inner,25,4"],
        ["--columns", "participant=who,felt,n=number,cloth"],
        "felt is missing",
    ),
    "other answers": (column(column(ROWS, 1, "1", "left"), 1, "0", "right"), NAMED, "no yes or no"),
    "answers of keys": (column(column(ROWS, 1, "1", "f"), 1, "0", "j"), NAMED, "no yes or no"),
    "ratings": (column(column(ROWS, 1, "1", "4"), 1, "0", "2"), NAMED, "no yes or no"),
    "one odd answer": ([*ROWS, "Mean,0.5,inner,25,"], NAMED, "response is '0.5'"),
    "no such answer": (ROWS, [*NAMED, "--yes", "felt"], "no answer is felt"),
    "no participant": ([*ROWS, ",1,inner,25,1"], NAMED, "the participant is missing"),
    "no level": ([*ROWS, "P1,1,,25,1"], NAMED, "cloth is missing"),
    "an error of a spreadsheet": ([*ROWS, "P1,1,#REF!,25,1"], NAMED, "an error of a spreadsheet"),
    "no such participant to exclude": (ROWS, [*NAMED, "--exclude", "participant=P9"], "is nowhere P9"),
    "no such column to exclude by": (ROWS, [*NAMED, "--exclude", "who_=P1"], "--exclude names who_"),
    "no such catch trials": (ROWS, [*NAMED, "--catch", "hz=0"], "hz is nowhere 0"),
    "no such column of catch trials": (ROWS, [*NAMED, "--catch", "amp=25"], "--catch names amp"),
    "other types of trials": (
        column(column(ROWS, 4, "0", "none"), 4, "1", "main"),
        ["--columns", "participant=who,response=felt,cloth,trial_type=number"],
        "trial_type is",
    ),
    "another status": (
        [*ROWS[:-1], ROWS[-1][:-1] + "x"],
        ["--columns", "participant=who,response=felt,cloth,trial_status=number"],
        "trial_status is",
    ),
    "trials twice": (
        ROWS,
        ["--columns", "participant=who,response=felt,cloth,hz=freq,trial=number"],
        "is complete twice",
    ),
    "a strange number": (
        [*ROWS, "P1,1,inner,25,x"],
        ["--columns", "participant=who,response=felt,cloth,hz=freq,presses_late=number"],
        "presses_late is 'x'",
    ),
    "no whole number": (
        [*ROWS, "P1,1,inner,25,1.5"],
        ["--columns", "participant=who,response=felt,cloth,hz=freq,block=number"],
        "block is '1.5'",
    ),
    "a level that is not named": (ROWS, [*NAMED, "--levels", "cloth=inner"], "--levels does not name: both"),
    "a number that is no level": (ROWS, [*NAMED, "--levels", "hz=25,many"], "--levels names many"),
    "levels of no factor": (ROWS, [*NAMED, "--levels", "clothing=inner,both"], "which is no factor"),
    "no such level compared": (ROWS, [*NAMED, "--compare", "cloth=inner,coat"], "are not two levels"),
    "no such factor compared": (ROWS, [*NAMED, "--compare", "coat=inner,both"], "compared but no factor"),
    "at no such factor": (ROWS, [*NAMED, "--compare", "cloth=inner,both@clothing"], "compared but no factor"),
    "at each of its own": (ROWS, [*NAMED, "--compare", "cloth=inner,both@cloth"], "its own levels"),
    "no factor at all": (
        [f"{row},{number}" for number, row in enumerate(ROWS * 2)],
        ["--columns", "participant=who,response=felt,cloth,number2"],
        "has 96 levels",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_advised_can_be_typed(tmp_path: Path, case: str) -> None:
    rows, arguments, told = CASES[case]
    path = tmp_path / "t.csv"
    header = f"{HEADER},number2" if rows[0].count(",") > HEADER.count(",") else HEADER
    path.write_text("\n".join([header, *rows]) + "\n")
    messages = mended([str(path), *arguments])
    assert told in messages[0]


def test_advice_keeps_names_and_levels_that_hold_signs(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        'subject,"felt, really?",what\n'
        + "".join(
            f"P{n % 3},{n % 2},{('a, b', '@home', 'it')[n % 3]!r}\n".replace("'", '"') for n in range(30)
        )
    )
    assert mended([str(path)])
    ((option, columns),) = OPTION.findall(mended([str(path)])[0])
    named = [str(path), option, *shlex.split(columns)]
    assert typed(named).design.factors[0].levels == ("@home", "a, b", "it")
    assert mended([*named, "--levels", "what=it"])
    (compared,) = typed([*named, "--compare", 'what="a, b","@home"']).design.comparisons
    assert (compared.first, compared.second) == ("a, b", "@home")


def test_several_files_and_a_column_of_participants_that_is_not_named(tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("\n".join([HEADER, *ROWS]) + "\n")
    arguments = [str(tmp_path / "*.csv"), "--columns", "response=felt,cloth,hz=freq"]
    messages = mended(arguments)
    assert "there is a column who" in messages[0]
    assert typed([*arguments, "--ignore", "who"]).participants == ("a", "b")


def test_the_command_that_is_told_reads_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("t.csv").write_text("\n".join([HEADER, *ROWS, "x y,1,inner,25,0"]) + "\n")
    trials = typed(
        [
            "t.csv", *NAMED, "--levels", "cloth=inner,both", "--compare", "cloth=inner,both@hz", "--yes", "1",
            "--catch", "number=3", "--exclude", "participant=x y,P2", "--ignore", "number",
            "--encoding", "utf-8",
        ]
    )  # fmt: skip
    again = typed(shlex.split(trials.command)[2:])
    assert again.command == trials.command
    assert again.warnings == trials.warnings
    assert again.table.equals(trials.table)
    assert again.design == trials.design
