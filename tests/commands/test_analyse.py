"""`autd-trials analyse` of a table, as a person types it."""

from pathlib import Path
from typing import Any

import pytest

from tests.analysis.data.test_foreign_tables import lines
from tests.commands.conftest import Run

COLUMNS = "participant=pid,response=felt,clothing=cloth,modulation_hz=freq"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "trials.csv"
    path.write_text("\n".join(["pid,felt,cloth,freq", *lines(people=8)]) + "\n")
    return path


def test_a_table_is_analysed_beside_itself(run: Run, table: Path) -> None:
    result = run(
        "analyse", table, "--columns", COLUMNS, "--levels", "clothing=inner,both",
        "--compare", "clothing=inner,both@modulation_hz", "--json",
    )  # fmt: skip
    assert result.code == 0
    assert [row["mean_difference"] for row in result.json["comparisons"]] == [0.5, 0.5]
    folder = table.with_name("trials-analysis")
    assert (folder / "rates.png").exists()
    assert not (folder / "dataset_description.json").exists()


def test_a_data_sets_table_gives_the_studys_d_prime_and_leaves_its_folder_alone(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Catch trials go with the clothing that they were in, as in the study."""
    monkeypatch.chdir(tmp_path)
    run("run", "chest-catch", "--simulate", 1, "--data", "data")
    study = run("analyse", "data/chest-catch", "--json").json
    (table,) = Path("data").glob("chest-catch/sub-*/ses-*/beh/*_events.tsv")
    beside = sorted(table.parent.iterdir())
    alone = run("analyse", table, "--columns", "modulation_hz,clothing", "--json").json
    assert sorted(table.parent.iterdir()) == beside
    assert (tmp_path / f"{table.stem}-analysis" / "report.html").exists()

    def d_primes(results: dict[str, Any]) -> dict[tuple[str, str], float]:
        rows = results["detectability_by_participant"]
        return {(f"{row['modulation_hz']:g}", row["clothing"]): row["d_prime"] for row in rows}

    (lateness,) = (row for row in alone["timing"] if row["quantity"] == "onset_lateness")
    assert lateness["trials"] == 0
    assert "a table does not say whether in real time" in lateness["notes"]
    assert d_primes(alone) == pytest.approx(d_primes(study))
    assert len(alone["false_alarms"]) == len(study["false_alarms"]) == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "--columns participant=pid,response=felt,cloth,freq"),
        (["--columns", "participant"], "there is no column 'participant'"),
        (["--columns", "participant="], "--columns has 'participant='"),
        (["--columns", f"{COLUMNS},clothing=freq"], "--columns names clothing twice"),
        (["--columns", COLUMNS, "--levels", "clothing=inner,inner"], "--levels names clothing"),
        (["--columns", COLUMNS, "--levels", "clothing"], "--levels has 'clothing'"),
        (["--columns", COLUMNS, "--compare", "clothing=inner"], "name two levels"),
    ],
)
def test_wrong_arguments_are_told(run: Run, table: Path, arguments: list[str], message: str) -> None:
    result = run("analyse", table, *arguments)
    assert result.code == 2
    assert message in result.err


def test_levels_that_no_protocol_could_have_are_compared(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    answers = (f"p{person},{person % 2},{level}" for person in range(6) for level in ("a b", "$c$"))
    path.write_text("\n".join(["pid,felt,cloth", *answers]))
    columns = "participant=pid,response=felt,cloth"
    result = run("analyse", path, "--columns", columns, "--compare", "cloth=a b,$c$", "--json")
    assert result.code == 0
    assert [row["first"] for row in result.json["comparisons"]] == ["a b"]


def test_the_report_says_how_to_make_it_again(run: Run, table: Path) -> None:
    run(
        "analyse",
        table,
        "--columns",
        COLUMNS,
        "--compare",
        "clothing=inner,both@modulation_hz",
        "--without",
        "models",
    )
    report = (table.with_name("trials-analysis") / "report.html").read_text()
    command = (
        f"autd-trials analyse trials.csv --columns {COLUMNS} --compare clothing=inner,both@modulation_hz"
    )
    assert f"{command} --without models" in report


def test_an_error_of_ours_in_one_subject_is_told_by_the_exit_code(
    run: Run, table: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(_trials: object) -> None:
        raise ZeroDivisionError("division by zero")

    command = ("analyse", table, "--columns", COLUMNS, "--only", "rates,order")
    folder = table.with_name("trials-analysis")
    with monkeypatch.context() as patch:
        patch.setattr("autd_analysis.order.order_effects", failing)
        result = run(*command)
    assert result.code == 1
    assert "order: an error of this program (ZeroDivisionError: division by zero)" in result.err
    assert "Traceback" not in result.err + result.out
    assert "Detection rate" in result.out
    assert (folder / "rates.tsv").exists()
    assert "in failing" in (folder / "error-order.txt").read_text()
    assert run(*command).code == 0
    assert not (folder / "error-order.txt").exists()


def test_subjects_are_chosen(run: Run, table: Path) -> None:
    result = run("analyse", table, "--columns", COLUMNS, "--only", "rates,models", "--without", "models")
    assert result.code == 0
    folder = table.with_name("trials-analysis")
    assert {file.stem for file in folder.glob("*.tsv")} == {
        "trials",
        "rates", "rates_by_participant", "false_alarms", "false_alarms_by_participant",
    }  # fmt: skip
    assert "--only rates,models --without models" in (folder / "report.html").read_text()
    refused = run("analyse", table, "--columns", COLUMNS, "--only", "pooled")
    assert refused.code == 2
    assert "there is no subject 'pooled'" in refused.err
    assert "sensitivity" in refused.err


def test_nothing_there_is_told(run: Run, tmp_path: Path) -> None:
    result = run("analyse", tmp_path / "none.csv", "--columns", COLUMNS)
    assert result.code == 2
    assert "there is no such file or folder" in result.err


def test_columns_of_a_study_are_refused(run: Run, tmp_path: Path) -> None:
    result = run("analyse", tmp_path, "--columns", COLUMNS)
    assert result.code == 2
    assert "these are for tables: --columns" in result.err


def test_several_tables_are_one_study(run: Run, tmp_path: Path) -> None:
    """Each of a person, named by its file; a pattern is understood where the shell does not."""
    for person in ("P1", "P2", "P3"):
        rows = [f"{trial % 2},{cloth}" for cloth in ("inner", "both") for trial in range(4)]
        (tmp_path / f"{person}_detect.csv").write_text("\n".join(["felt,cloth", *rows]) + "\n")
    typed = ("--columns", "response=felt,cloth", "--json")
    result = run("analyse", tmp_path / "*.csv", *typed)
    assert result.code == 0
    assert result.json["participants"] == 3
    named = run("analyse", *sorted(tmp_path.glob("*.csv")), *typed)
    assert named.json["rates"] == result.json["rates"]
    assert (tmp_path / f"{tmp_path.name}-analysis" / "trials.tsv").exists()
    assert run("analyse", tmp_path / "*.txt", *typed).code == 2
    assert "is analysed alone" in run("analyse", tmp_path, tmp_path / "P1_detect.csv", *typed).err


def test_a_guess_rate_moves_the_threshold_of_two_alternatives(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    felt = {0.25: 20, 0.5: 22, 1: 30, 2: 38, 4: 40}
    rows = [f"P1,{level},{k},40" for level, k in felt.items()]
    path.write_text("\n".join(["who,contrast,correct,n", *rows]) + "\n")
    columns = "participant=who,felt=correct,n,contrast"
    plain = run("analyse", path, "--columns", columns, "--json").json
    advice = " ".join(warning for warning in plain["warnings"] if "--guess 0.5" in warning)
    assert "right or wrong" in advice
    told = run(
        "analyse", path, "--columns", columns, "--guess", "0.5", "--lapse", "0", "--core", "logistic",
        "--json",
    ).json  # fmt: skip
    assert not any("--guess" in warning for warning in told["warnings"])
    assert told["psychometric"][0]["threshold"] == pytest.approx(1.0, rel=0.15)
    assert plain["psychometric"][0]["threshold"] < 0.5
    report = (tmp_path / "t-analysis" / "report.html").read_text()
    assert "--guess 0.5 --lapse 0 --core logistic" in report


@pytest.mark.parametrize("words", [("--guess", "half"), ("--lapse", "1.5"), ("--core", "cubic")])
def test_what_is_refused_is_refused_before_anything_is_read(
    run: Run, tmp_path: Path, words: tuple[str, str]
) -> None:
    refused = run("analyse", tmp_path, *words)
    assert refused.code == 2
    assert words[1] in refused.err
    (tmp_path / "file").write_text("")
    (tmp_path / "t.csv").write_text("")
    result = run("analyse", tmp_path / "t.csv", "--out", tmp_path / "file")
    assert "results cannot go here" in result.err
    columns = "participant=a,response=b,rate=c"
    assert "a factor is called rate" in run("analyse", tmp_path / "t.csv", "--columns", columns).err
