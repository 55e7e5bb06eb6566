"""Text from elsewhere is harmless on a terminal, in a README and in a spreadsheet."""

import json
from pathlib import Path

import pytest
from autd_analysis.reading import read_table
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.writing import write_results
from autd_analysis.study import analyse
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.cli import main
from autd_trials.commands.output import print_json, print_text, say
from autd_trials.neutral import markdown, printable
from autd_trials.tables import Column, shielded, tsv
from autd_trials.tables import read_table as read_text

HOSTILE = (
    "=cmd|' /C calc'!A0",
    "+1+1",
    "@SUM(A1)",
    "-2+3",
    "<script>x</script>",
    "\x1b[31mred",
    "\u202eabc",
)


@given(st.text())
def test_no_text_commands_a_terminal(text: str) -> None:
    found = printable(text)
    assert not any(ord(sign) < 32 and sign not in "\n\t" for sign in found)
    assert not set(found) & set(map(chr, range(0x7F, 0xA0)))


def test_markdown_keeps_what_is_no_html() -> None:
    assert markdown("p < .05, a <b>, <!-- --> <https://x.org> 1<2") == (
        "p < .05, a &lt;b>, &lt;!-- --> &lt;https://x.org> 1<2"
    )


@pytest.mark.parametrize("number", ["-5", "+3", "-0.5", "-1e-3"])
def test_numbers_stay_numbers(number: str) -> None:
    assert shielded(number) == number


@given(st.text() | st.sampled_from([*HOSTILE, "\uff1d1", "'=1", "''+2", "'a"]))
def test_no_cell_is_a_formula_and_all_are_read_back(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    column = Column[str]("a", "A.", lambda word: word)
    path = tmp_path_factory.mktemp("t") / "t.tsv"
    written = tsv([column, Column("b", "B.", lambda _word: 1)], [text])
    path.write_bytes(written.encode())
    cell = written.splitlines()[1].split("\t")[0].strip('"')
    assert cell[:1] not in ("=", "+", "-", "@", "\t", "\r") or cell == shielded(cell)
    (read,) = read_text(path, "table", separator="\t").column("a")
    assert read == (printable(" ".join(text.split())) or "n/a")


def test_errors_and_messages_are_neutral(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "t.csv"
    path.write_text("who,felt,amp\nP1,1,\u202e1\nP1,\x9b31m,2\n", encoding="utf-8")
    assert main(["analyse", str(path), "--columns", "participant=who,response=felt,\x1b[31mamp"]) == 2
    assert main(["analyse", str(path), "--columns", "participant=who,response=felt,amp"]) == 2
    print_text("\x1b[2Jtext")
    print_json({"a": "\x9b31m\u202e"})
    say("\x1b]0;title\x07")
    captured = capsys.readouterr()
    for sign in ("\x1b", "\x9b", "\u202e", "\x07"):
        assert sign not in captured.out + captured.err
    assert json.loads(captured.out.splitlines()[-1]) == {"a": "\x9b31m\u202e"}


def test_results_of_a_hostile_table_are_neutral(tmp_path: Path) -> None:
    path = tmp_path / "<script>.csv"
    cells = [word.replace("\x1b", "") for word in HOSTILE]
    rows = [f'{who},{n % 2},"{cell}"' for who in ("=P1", "@P2") for cell in cells for n in range(3)]
    path.write_text("\n".join(["who,felt,cloth,<b>note", *(f"{row}," for row in rows)]), encoding="utf-8")
    trials = read_table(path, columns="participant=who,response=felt,cloth")
    write_results(analyse(trials), tmp_path / "out", FigureOptions(formats=("svg",)))
    readme = (tmp_path / "out" / "README.md").read_text(encoding="utf-8")
    assert "<script" not in readme
    assert "<b>" not in readme
    for table in (tmp_path / "out").glob("*.tsv"):
        for cell in table.read_text(encoding="utf-8").replace("\n", "\t").split("\t"):
            assert shielded(cell) == cell or cell.startswith("'"), (table.name, cell)
            assert "\u202e" not in cell
