"""However a table is saved, the same answers are counted; and tables as programs export them."""

import csv
import gzip
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from autd_analysis.data.trials import Trials
from autd_analysis.reading import read_table
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.errors import UsageError

WORDS = ("d\u00fcnn", "warm, dick", "z")


def counted(trials: Trials, *factors: str) -> dict[tuple[Any, ...], tuple[int, int]]:
    """Return how many of how many stimuli each participant felt in each condition."""
    used = trials.table[trials.table["used"] & (trials.table["trial_type"] == "stimulus")]
    groups = used.groupby(["participant", *factors])["felt"]
    return {key: (int(felt.sum()), len(felt)) for key, felt in groups}


@dataclass(frozen=True)
class Saved:
    """How a table is saved."""

    separator: str
    encoding: str
    decimal: str
    end: str
    packed: bool
    stated: bool
    title: bool
    trailing: bool
    unit: str


SAVED = st.builds(
    Saved,
    separator=st.sampled_from(",;\t"),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"]),
    decimal=st.sampled_from(".,"),
    end=st.sampled_from(["\n", "\r\n"]),
    packed=st.booleans(),
    stated=st.booleans(),
    title=st.booleans(),
    trailing=st.booleans(),
    unit=st.sampled_from(["", "", " mm", "Hz"]),
)
LEVELS = st.lists(
    st.integers(0, 99_999).map(lambda hundredths: hundredths / 100), min_size=2, max_size=4, unique=True
)
TRIAL = st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 2), st.booleans())
ROWS = st.lists(TRIAL, min_size=4, max_size=40)
ODD = st.dictionaries(st.integers(0, 40), st.sampled_from(["blank", "spaces", "header"]), max_size=4)


def content(saved: Saved, rows: Sequence[tuple[str, float, str, bool]], odd: Mapping[int, str]) -> bytes:
    """Return a table as it is saved, with odd rows between."""
    names = ["who", "amp", "cloth", "felt"]
    text = io.StringIO()
    writer = csv.writer(text, delimiter=saved.separator, lineterminator=saved.end)
    rest = [""] if saved.trailing else []
    if saved.stated:
        text.write(f"sep={saved.separator}{saved.end}")
    if saved.title:
        writer.writerow(["Results", "", "", "", *rest])
    writer.writerow([*names, *rest])
    for number, (who, level, cloth, felt) in enumerate(rows):
        kind = odd.get(number)
        if kind == "header":
            writer.writerow([*names, *rest])
        elif kind is not None:
            writer.writerow(["" if kind == "blank" else "  "] * (4 + len(rest)))
        spelled = f"{level:g}".replace(".", saved.decimal) + saved.unit
        writer.writerow([who.replace(".", saved.decimal), spelled, f" {cloth} ", int(felt), *rest])
    encoded = text.getvalue().encode(saved.encoding)
    return gzip.compress(encoded) if saved.packed else encoded


@given(saved=SAVED, levels=LEVELS, rows=ROWS, odd=ODD, data=st.data())
def test_the_same_answers_are_counted_however_a_table_is_saved(
    tmp_path_factory: pytest.TempPathFactory,
    saved: Saved,
    levels: list[float],
    rows: list[tuple[int, int, int, bool]],
    odd: dict[int, str],
    data: st.DataObject,
) -> None:
    path = tmp_path_factory.mktemp("saved") / "t.csv"
    spelled = []
    right: dict[tuple[object, ...], tuple[int, int]] = {}
    for who, level, cloth, felt in rows:
        label = data.draw(st.sampled_from([f"{who}", f"0{who}", f"{who}.0", f" {who} "]))
        spelled.append((label, levels[level % len(levels)], WORDS[cloth], felt))
        key = (who, levels[level % len(levels)], WORDS[cloth])
        hits, n = right.get(key, (0, 0))
        right[key] = (hits + felt, n + 1)
    path.write_bytes(content(saved, spelled, odd))
    trials = read_table(path, columns="participant=who,response=felt,amp,cloth")
    amps = {level for _, level, _ in right}
    if saved.unit and len(amps) == 1:  # one word with a number in it is a word
        return
    found = {(int(who), *rest): count for (who, *rest), count in counted(trials, "amp", "cloth").items()}
    assert found == right


@pytest.mark.parametrize(
    ("cells", "levels"),
    [
        (["0,5", "10,0", "2,5"], (0.5, 2.5, 10.0)),
        (["100 Hz", "25 Hz", "50Hz"], (25.0, 50.0, 100.0)),
        (["0,5 mm", "1 mm"], (0.5, 1.0)),
        (["\u22121", "1", "0"], (-1.0, 0.0, 1.0)),
        (["\uff11\uff10\uff10", "25"], (25.0, 100.0)),
        (["25", "None", "50"], (25.0, 50.0)),
        (["1,234", "2,345", "0,5"], (0.5, 1.234, 2.345)),
        (["none", "thin"], ("none", "thin")),
        (["c10", "c2", "c1"], ("c1", "c2", "c10")),
    ],
)
def test_levels_are_numbers_where_all_are(
    tmp_path: Path, cells: list[str], levels: tuple[object, ...]
) -> None:
    path = tmp_path / "t.csv"
    answers = [f'{trial},P1,"{cell}"' for cell in cells for trial in (0, 1)]
    rows = [row for row in answers if "None" not in row] + [",P1,None"] * ("None" in cells)
    path.write_text("\n".join(["felt,who,level", *rows]))
    trials = read_table(path, columns="participant=who,response=felt,level")
    assert trials.design.factors[0].levels == levels
    assert not any("taken as words" in warning for warning in trials.warnings)


@pytest.mark.parametrize(
    ("cells", "why"),
    [
        (["100 Hz", "0.1 kHz"], "they have different units: Hz, kHz"),
        (["100", "50 Hz"], "they have different units: none, Hz"),
        (["25", "50", "high"], "high is no number"),
        (["1,234", "2,345"], "it is not clear whether signs in 1,234 are decimal or group thousands"),
        (["1.234,5", "0,5"], "it is not clear whether signs in 1.234,5 are decimal or group thousands"),
        (["01. Mai", "02. Mai"], "01. Mai looks like a date that a spreadsheet made of a number"),
        (["1-May", "0.5"], "1-May looks like a date that a spreadsheet made of a number"),
    ],
)
def test_what_looks_like_numbers_and_is_not_is_said(tmp_path: Path, cells: list[str], why: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        "\n".join(["felt,who,level", *(f'{trial},P1,"{cell}"' for cell in cells for trial in (0, 1))])
    )
    trials = read_table(path, columns="participant=who,response=felt,level")
    assert all(isinstance(level, str) for level in trials.design.factors[0].levels)
    assert any(f"levels of level are taken as words, as {why}" in warning for warning in trials.warnings)


def test_levels_are_named_as_they_are_written_or_as_numbers(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        "felt;who;level\n" + "".join(f"{n % 2};P1;{('0,5 mm', '1,5 mm')[n % 2]}\n" for n in range(8))
    )
    columns = "participant=who,response=felt,level"
    for compared in ("level=1.5,0.5", "level=1.5 mm,0.5 mm", 'level="1,5","0,5 mm"'):
        (comparison,) = read_table(path, columns=columns, compare=compared).design.comparisons
        assert (comparison.first, comparison.second) == (1.5, 0.5)
    ordered = read_table(path, columns=columns, levels={"level": [1.5, "0,5"]})
    assert ordered.design.factors[0].levels == (1.5, 0.5)


def test_ids_that_read_as_one_number_are_one_and_said_to_be(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    labels = ("1", "1.0", "01", "02", "P1", "p01", "12345678901234567890", "12345678901234567891")
    path.write_text(
        "who,felt,amp\n" + "".join(f"{who},{n % 2},{n % 2}\n" for who in labels for n in range(4))
    )
    trials = read_table(path, columns="participant=who,response=felt,amp")
    assert set(trials.participants) == {"1", "02", *labels[4:]}
    assert "participants that read as one number are taken as one: 01 and 1 and 1.0 (as 1)" in trials.warnings
    assert "participants that look alike: P1, p01; are they one?" in trials.warnings


def test_several_files_are_one_table(tmp_path: Path) -> None:
    """As PsychoPy saves them: a file a person, the time in its name, columns without a name at the end."""
    for who in ("07", "12"):
        (tmp_path / f"{who}_detect_2024-03-05_14h03.22.{who}.csv").write_text(
            "trials.thisN,practice.thisN,amp,key_resp.keys,key_resp.rt,expName,\n"
            + ",0,0.5,None,,detect,\n,,,,,detect,\n"
            + "".join(
                f"{n},,{n % 3 / 2},{('space', 'None')[n % 2]},{0.3 + n / 100},detect,\n" for n in range(12)
            )
        )
    columns = {
        "response": "key_resp.keys", "amp": "amp", "trial": "trials.thisN", "response_time": "key_resp.rt"
    }  # fmt: skip
    trials = read_table(
        str(tmp_path / "*.csv"),
        columns=columns,
        yes=["space"],
        exclude={"trials.thisN": "n/a"},
        catch={"amp": 0},
        ignore="expName,practice.thisN",
    )
    assert trials.participants == ("07", "12")
    assert counted(trials, "amp") == {(who, amp): (2, 4) for who in ("07", "12") for amp in (0.5, 1.0)}
    assert "answers taken as felt: space; as not felt: no answer" in trials.warnings
    assert trials.ordered


def test_german_spreadsheet(tmp_path: Path) -> None:
    path = tmp_path / "Versuch.csv"
    path.write_bytes(
        "Versuch 1;;;;\r\n;;;;\r\nVP;Kleidung;Stärke;gespürt;\r\n".encode("latin-1")
        + "".join(
            f"{n % 3 + 1};{('dünn', 'dick')[n % 2]};{('0,5', '1,25')[n // 2 % 2]};"
            f"{('WAHR', 'FALSCH')[n % 2]};\r\n"
            for n in range(24)
        ).encode("latin-1")
        + b";;;;\r\n" * 3
    )
    trials = read_table(path, columns="participant=VP,response=gesp\u00fcrt,cloth=Kleidung,amp=St\u00e4rke")
    assert counted(trials, "cloth", "amp")["1", "d\u00fcnn", 0.5] == (2, 2)
    assert [warning.split(":")[0] for warning in trials.warnings[:2]] == ["Versuch.csv", "Versuch.csv"]
    assert "Windows-1252" in trials.warnings[0]


def test_e_prime(tmp_path: Path) -> None:
    path = tmp_path / "Detect.txt"
    path.write_bytes(
        (
            "C:\\Exp\\Detect.emrg2\r\n"
            "ExperimentName\tSubject\tSession\tProcedure[Trial]\tStim.ACC\tStim.RT\tFreq\r\n"
            + "".join(
                f"Detect\t{n % 2 + 1}\t1\t{('Main', 'Prac')[n % 5 == 0]}\t{n % 2}\t{400 + n}\t"
                f"{(25, 100)[n % 4 > 1]}\r\n"
                for n in range(40)
            )
        ).encode("utf-16")
    )
    trials = read_table(
        path,
        columns="participant=Subject,response=Stim.ACC,session=Session,response_time=Stim.RT,hz=Freq",
        exclude="Procedure[Trial]=Prac",
    )
    assert trials.participants == ("1", "2")
    assert len(trials.table) == 32
    assert "8 line(s) with Procedure[Trial] Prac left out, as asked for" in trials.warnings
    assert any(
        "--columns" in warning and "response_time_ms=Stim.RT" in warning for warning in trials.warnings
    )
    assert any("--guess 0.5" in warning for warning in trials.warnings)


def test_jspsych(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(
        '"rt","trial_type","subject","amp","correct","response"\n'
        + '"512.5","html-keyboard-response","a1b","","null"," "\n'
        + "".join(
            f'"{500 + n}","html-keyboard-response","a1b","{n % 3}",'
            f'"{("true", "false")[n % 2]}","{"jf"[n % 2]}"\n'
            for n in range(12)
        )
    )
    trials = read_table(path, columns="participant=subject,response=correct,amp,response_time_ms=rt")
    assert counted(trials, "amp") == {("a1b", amp): (2, 4) for amp in (0.0, 1.0, 2.0)}
    assert trials.table["response_time_s"].max() == pytest.approx(0.511)
    assert any("1 line(s) with neither an answer nor a level" in warning for warning in trials.warnings)
    assert any("--catch amp=0" in warning for warning in trials.warnings)


def test_counts_are_as_many_trials(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("who,amp,k,n,kind\na,1,3,4,stimulus\na,2,4,4,stimulus\nb,1,0,5,stimulus\na,0,1,3,catch\n")
    trials = read_table(path, columns="participant=who,felt=k,n,amp,trial_type=kind")
    assert counted(trials, "amp") == {("a", 1.0): (3, 4), ("a", 2.0): (4, 4), ("b", 1.0): (0, 5)}
    assert int((trials.table["trial_type"] == "catch").sum()) == 3
    assert not trials.ordered


def test_catch_trials_by_type_by_amplitude_or_not(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = [f"P{n % 2},{amp},{n % 2},{('main', 'none')[amp == 0]}\n" for n in range(8) for amp in (0, 1, 2)]
    path.write_text("who,amp,felt,kind\n" + "".join(rows))
    columns = "participant=who,response=felt,amp"
    as_read = read_table(path, columns=columns)
    assert as_read.design.factors[0].levels == (0.0, 1.0, 2.0)
    assert any("these are catch trials: --catch amp=0" in warning for warning in as_read.warnings)
    by_amplitude = read_table(path, columns=columns, catch="amp=0")
    by_type = read_table(path, columns=f"{columns},trial_type=kind", catch={"trial_type": "none"})
    for trials in (by_amplitude, by_type):
        assert trials.design.factors[0].levels == (1.0, 2.0)
        assert int((trials.table["trial_type"] == "catch").sum()) == 8
        assert "only catch trials have amp 0, so it is no condition" in trials.warnings
    assert by_amplitude.table.equals(by_type.table)
    named = read_table(path, columns=columns, catch="amp=0", levels={"amp": [0, 1, 2]})
    assert named.design.factors[0].levels == (1.0, 2.0)


def test_answers_of_keys_are_not_taken_for_words(tmp_path: Path) -> None:
    """F is no false and j no ja: the most common keys must be told apart by whoever knows."""
    path = tmp_path / "t.csv"
    path.write_text("who,amp,key\n" + "".join(f"P1,{n % 3},{'fj'[n % 2]}\n" for n in range(12)))
    with pytest.raises(UsageError, match=r"--yes f"):
        read_table(path, columns="participant=who,response=key,amp")
    trials = read_table(path, columns="participant=who,response=key,amp", yes="j")
    assert int(trials.table["felt"].sum()) == 6
    assert "answers taken as felt: j; as not felt: f" in trials.warnings


def test_no_answer_means_not_felt_only_where_it_is_said(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("who,amp,felt\n" + "".join(f"P1,{n % 3},{('1', '')[n % 2]}\n" for n in range(12)))
    as_read = read_table(path, columns="participant=who,response=felt,amp")
    assert counted(as_read, "amp")["P1", 1.0] == (2, 2)
    assert "all answers mean felt; if none means not felt: --yes 1" in as_read.warnings
    told = read_table(path, columns="participant=who,response=felt,amp", yes=1)
    assert counted(told, "amp")["P1", 1.0] == (2, 4)


def test_trials_numbered_anew_in_each_block_are_numbered_through(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(
        "who,amp,felt,b,t\n" + "".join(f"P1,{n % 2},{n % 2},{b},{n}\n" for b in (2, 1) for n in range(4))
    )
    trials = read_table(path, columns="participant=who,response=felt,amp,block=b,trial=t")
    assert trials.table["trial"].tolist() == [5, 6, 7, 8, 1, 2, 3, 4]


def test_one_participants_files_are_sessions(tmp_path: Path) -> None:
    for name in ("sub-01_run-1", "sub-01_run-2", "sub-02_run-1"):
        (tmp_path / f"{name}.csv").write_text(
            "amp,felt,t\n" + "".join(f"{n % 2},{n % 2},{n}\n" for n in range(4))
        )
    trials = read_table(str(tmp_path / "*.csv"), columns="response=felt,amp,trial=t")
    assert trials.participants == ("01", "02")
    assert trials.sessions == 3
    assert any("participants are taken from the files' names" in warning for warning in trials.warnings)


def test_names_of_files_without_a_word_that_varies_first(tmp_path: Path) -> None:
    for name in ("detect_2024-01-05_P3.csv", "detect_2024-01-06_P4.csv"):
        (tmp_path / name).write_text("amp,felt\n" + "".join(f"{n % 2},{n % 2}\n" for n in range(4)))
    assert read_table(str(tmp_path / "*.csv"), columns="response=felt,amp").participants == ("P3", "P4")
    (one,) = tmp_path.glob("*P3.csv")
    assert read_table(one, columns="response=felt,amp", participant="me").participants == ("me",)


def test_a_spreadsheets_line_of_means_is_nobody_and_no_condition(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = [f"P{n % 2},{(1, 2)[n // 2 % 2]},{n % 3 % 2}" for n in range(16)]
    path.write_text("\n".join(["who,amp,felt", *rows, "mean,1.5,"]))
    trials = read_table(path, columns="participant=who,response=felt,amp")
    assert trials.design.factors[0].levels == (1.0, 2.0)
    assert "no answered stimulus has amp 1.5, so it is no condition" in trials.warnings
    assert any("--exclude participant=mean" in warning for warning in trials.warnings)
    excluded = read_table(path, columns="participant=who,response=felt,amp", exclude={"participant": "mean"})
    assert excluded.participants == ("P0", "P1")
    assert excluded.table["used"].all()


def test_commas_that_only_semicolons_make_decimal_are_said(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("who;hz;felt\n" + "".join(f"P1;{('1,000', '250')[n % 2]};{n % 2}\n" for n in range(8)))
    trials = read_table(path, columns="participant=who,response=felt,hz")
    assert "t.csv: commas in hz are read as decimal ones, 1,000 as 1.000" in trials.warnings


def test_rates_are_no_answers(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("who,amp,rate\nP1,1,0.3\nP1,2,0.5\nP1,3,1\n")
    with pytest.raises(UsageError, match="which is no answer but a rate"):
        read_table(path, columns="participant=who,response=rate,amp")


def test_files_of_one_named_participant_are_sessions_too(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("amp,felt,t\n" + "".join(f"{n % 2},1,{n}\n" for n in range(4)))
    trials = read_table(str(tmp_path / "*.csv"), columns="response=felt,amp,trial=t", participant="me")
    assert (trials.participants, trials.sessions) == (("me",), 2)
