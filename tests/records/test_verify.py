"""Whatever is changed in recorded logs is noticed."""

import json
import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from autd_analysis.data.trials import read_trials

from autd_trials.cli import main
from autd_trials.protocol.load import find_protocol
from autd_trials.records.chain import Head, Line, split_lines
from autd_trials.records.problem import unexplained
from autd_trials.records.protocol_hash import protocol_sha256
from autd_trials.records.verify import verify_log, verify_study

EDITS_IN_SHORT, EDITS_IN_FULL = 60, 500
VERSION_1 = Path(__file__).parent / "version1" / "short"


def record(folder: Path) -> Path:
    """Record three simulated sessions; the last one is cut off in a trial, torn, and taken up again."""
    protocol = yaml.safe_load(find_protocol("chest-catch").read_text(encoding="utf-8"))
    protocol["name"] = "short"
    protocol["stimulus"]["duration_s"] = 0.2
    protocol["repetitions"] = 1
    protocol["catch_trials_per_block"] = 1
    protocol["timing"] = {
        "lead_in_s": 0.3,
        "response_window_s": 1.5,
        "pause_min_s": 0.3,
        "pause_max_s": 0.6,
        "break_s": 1,
    }
    protocol["safety"] = {"longest_burst_s": 1, "largest_duty": 0.5, "session_exposure_s": 10}
    path = folder / "short.yaml"
    path.write_text(yaml.safe_dump(protocol), encoding="utf-8")
    run = ["run", str(path), "--simulate", "3", "--data", str(folder)]
    assert main(run) == 0
    study = folder / "short"
    shutil.rmtree(study / "sub-sim03")
    (study / "sourcedata" / "chains.tsv").unlink()
    cut_off(study)
    assert main([*run, "--resume"]) == 0
    return study


def cut_off(study: Path) -> None:
    log = logs_of(study)[2]
    lines = split_lines(log.read_bytes())
    starts = [number for number, line in enumerate(lines) if b'"event":"stimulus"' in line]
    log.write_bytes(b"\n".join(lines[: starts[3] + 1]) + b'\n{"n":19,"t_s":12.3,"ut')


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("recorded"))


@pytest.fixture
def study(recorded: Path, tmp_path: Path) -> Path:
    copy = tmp_path / "short"
    shutil.copytree(recorded, copy)
    return copy


def logs_of(study: Path) -> list[Path]:
    return sorted(study.glob("sourcedata/sub-*/ses-*/*_log.jsonl"))


def found(study: Path) -> list[str]:
    return [str(problem) for problem in unexplained(verify_study(study))]


def test_what_was_recorded_has_nothing_wrong(study: Path) -> None:
    assert found(study) == []
    explained = [problem.what for problem in verify_study(study)]
    assert explained == ["torn, as it was when the session was taken up again behind it"]
    (study / "sourcedata" / "chains.tsv").unlink()
    assert found(study) == []


def test_version_1_is_read_and_checked_without_a_chain(tmp_path: Path) -> None:
    study = tmp_path / "short"
    shutil.copytree(VERSION_1, study)
    assert found(study) == []
    assert sum("not chained (version 1)" in problem.what for problem in verify_study(study)) == 2
    assert main(["export", str(study)]) == 0
    log = logs_of(study)[0]
    text = log.read_text(encoding="utf-8")
    log.write_text(text.replace('"response":"not_felt"', '"response":"felt"', 1), encoding="utf-8")
    assert len(found(study)) >= 2, "the register and the presses both say so"


# --- random edits


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    if isinstance(value, dict):
        for key, below in value.items():
            yield from leaves(below, (*path, key))
    elif isinstance(value, list):
        for index, below in enumerate(value):
            yield from leaves(below, (*path, index))
    else:
        yield path, value


def other_value(value: Any, draw: random.Random) -> Any:
    if isinstance(value, bool):
        return not value
    if value is None:
        return draw.choice([0, 0.4, "felt", True])
    if isinstance(value, int | float):
        return draw.choice([value + 1, value - 1, value * 2 + 1, -999, value + 0.001, None])
    return draw.choice([f"{value}x", value[1:] + "y", "not_felt" if value == "felt" else "felt", ""])


def edit_a_value(lines: list[bytes], draw: random.Random) -> list[bytes]:
    number = draw.choice([0, *range(len(lines))])
    line = Line.parse(lines[number])
    if line.chain is None:
        return [*lines[:number], lines[number] + b"x", *lines[number + 1 :]]
    event = json.loads(lines[number])
    path, value = draw.choice(list(leaves(event)))
    at = event
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = other_value(value, draw)
    text = json.dumps(event, ensure_ascii=False, separators=(",", ":")).encode()
    return [*lines[:number], text, *lines[number + 1 :]]


def edit_a_byte(lines: list[bytes], draw: random.Random) -> list[bytes]:
    number = draw.randrange(len(lines))
    line = bytearray(lines[number])
    place = draw.randrange(len(line))
    line[place] = (line[place] + draw.randrange(1, 255)) % 256
    return [*lines[:number], bytes(line), *lines[number + 1 :]]


def remove_lines(lines: list[bytes], draw: random.Random) -> list[bytes]:
    first = draw.randrange(len(lines))
    return lines[:first] + lines[first + draw.randrange(1, 6) :]


def double_a_line(lines: list[bytes], draw: random.Random) -> list[bytes]:
    line, place = draw.choice(lines), draw.randrange(len(lines) + 1)
    return [*lines[:place], line, *lines[place:]]


def swap_lines(lines: list[bytes], draw: random.Random) -> list[bytes]:
    first, second = draw.sample(range(len(lines)), 2)
    lines = list(lines)
    lines[first], lines[second] = lines[second], lines[first]
    return lines


def reverse_lines(lines: list[bytes], draw: random.Random) -> list[bytes]:
    first = draw.randrange(len(lines) - 1)
    last = draw.randrange(first + 2, len(lines) + 1)
    return [*lines[:first], *reversed(lines[first:last]), *lines[last:]]


def cut_the_end(lines: list[bytes], draw: random.Random) -> list[bytes]:
    return lines[: draw.randrange(1, len(lines))]


def put_in_a_line(lines: list[bytes], draw: random.Random) -> list[bytes]:
    note = b'{"t_s":1.0,"utc":"2026-11-22T09:00:00+00:00","event":"note","text":""}'
    new = draw.choice([b"", b"{}", b"\xff\xfe", note])
    place = draw.randrange(len(lines))
    return [*lines[:place], new, *lines[place:]]


def take_the_chain_out(lines: list[bytes], _draw: random.Random) -> list[bytes]:
    events = [Line.parse(line).event for line in lines]
    return [events[0].replace(b'"format":2', b'"format":1'), *events[1:]]


LINE_EDITS = [
    edit_a_value,
    edit_a_value,
    edit_a_value,
    edit_a_byte,
    remove_lines,
    double_a_line,
    swap_lines,
    reverse_lines,
    cut_the_end,
    put_in_a_line,
    take_the_chain_out,
]


def edit_lines(study: Path, draw: random.Random) -> str:
    log, edit = draw.choice(logs_of(study)), draw.choice(LINE_EDITS)
    before = split_lines(log.read_bytes())
    after = before
    while after == before:
        after = edit(before, draw)
    log.write_bytes(b"\n".join(after) + draw.choice([b"\n", b"\n", b""]))
    return edit.__name__


def cut_bytes(study: Path, draw: random.Random) -> str:
    log = draw.choice(logs_of(study))
    content = log.read_bytes()
    log.write_bytes(content[: draw.randrange(len(content) - 1)])
    return "cut bytes"


def remove_a_log(study: Path, draw: random.Random) -> str:
    draw.choice(logs_of(study)).unlink()
    return "a log is removed"


def remove_a_session(study: Path, draw: random.Random) -> str:
    participant = draw.choice(["sub-sim01", "sub-sim02", "sub-sim03"])
    shutil.rmtree(study / participant)
    shutil.rmtree(study / "sourcedata" / participant)
    return "a whole session is removed"


def copy_a_session(study: Path, draw: random.Random) -> str:
    log = draw.choice(logs_of(study))
    to = draw.choice([("sim09", "01"), (log.parent.parent.name[4:], "02")])
    text = log.read_bytes()
    if draw.random() < 0.5:
        text = text.replace(log.parent.parent.name[4:].encode(), to[0].encode())
    copy = study / "sourcedata" / f"sub-{to[0]}" / f"ses-{to[1]}"
    copy.mkdir(parents=True)
    (copy / f"sub-{to[0]}_ses-{to[1]}_task-short_run-1_log.jsonl").write_bytes(text)
    return "a copied session"


def swap_sessions(study: Path, draw: random.Random) -> str:
    first, second = draw.sample(logs_of(study), 2)
    contents = first.read_bytes(), second.read_bytes()
    first.write_bytes(contents[1])
    second.write_bytes(contents[0])
    return "two sessions are swapped"


def edit_a_table(study: Path, draw: random.Random) -> str:
    table = draw.choice(sorted(study.glob("sub-*/ses-*/beh/*_events.tsv")))
    text = table.read_text(encoding="utf-8")
    table.write_text(text.replace("not_felt", "felt", 1) if "not_felt" in text else text[:-9])
    return "an edited table"


STUDY_EDITS = [
    *[edit_lines] * 6,
    cut_bytes,
    remove_a_log,
    remove_a_session,
    copy_a_session,
    swap_sessions,
    edit_a_table,
]


def unnoticed(recorded: Path, folder: Path, count: int) -> list[tuple[int, str]]:
    """Make so many random edits, each to a copy of its own; return those that are not noticed."""
    missed = []
    for seed in range(count):
        draw = random.Random(seed)
        study = folder / "short"
        shutil.copytree(recorded, study)
        what = draw.choice(STUDY_EDITS)(study, draw)
        if not unexplained(verify_study(study)):
            missed.append((seed, what))
        shutil.rmtree(study)
    return missed


def test_random_edits_are_noticed(recorded: Path, tmp_path: Path) -> None:
    assert unnoticed(recorded, tmp_path, EDITS_IN_SHORT) == []


@pytest.mark.fuzz
@pytest.mark.timeout(900)
def test_500_random_edits_are_noticed(recorded: Path, tmp_path: Path) -> None:
    assert unnoticed(recorded, tmp_path, EDITS_IN_FULL) == []


# --- edits after which somebody computed the chain again, with the register taken out


def chained_again(log: Path, events: list[dict[str, Any]]) -> None:
    lines, head = [], Head()
    for event in events:
        text = {key: value for key, value in event.items() if key not in ("n", "chain")}
        lines.append(head.seal(json.dumps(text, ensure_ascii=False, separators=(",", ":")).encode()))
        head = head.after(Line.parse(lines[-1]))
    log.write_bytes(b"".join(line + b"\n" for line in lines))


def of(kind: str, events: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [event for event in events if event["event"] == kind]


Change = Callable[[list[dict[str, Any]]], object]


def set_in(kind: str, **values: Any) -> Change:
    return lambda events: of(kind, events)[-1].update(values)


def felt_end(events: list[dict[str, Any]]) -> dict[str, Any]:
    return next(end for end in of("trial-end", events) if end["response"] == "felt")


def other_protocol(events: list[dict[str, Any]]) -> None:
    events[0]["protocol"]["repetitions"] = 2


def other_protocol_and_hash(events: list[dict[str, Any]]) -> None:
    events[0]["protocol"]["repetitions"] = 2
    events[0]["protocol_sha256"] = protocol_sha256(events[0]["protocol"])


def other_words(events: list[dict[str, Any]]) -> None:
    events[0]["protocol"]["description"] = "Something else."


def without_a_trial(events: list[dict[str, Any]]) -> None:
    events[:] = [event for event in events if event.get("trial") != 3]


def in_another_order(events: list[dict[str, Any]]) -> None:
    for event in events:
        if event.get("trial") in (3, 4):
            event["trial"] = 7 - event["trial"]


def without_a_press(events: list[dict[str, Any]]) -> None:
    press = next(number for number, event in enumerate(events) if event["event"] == "response")
    del events[press]


CHANGES: dict[str, Change] = {
    "an answer taken back": lambda events: felt_end(events).update(response="not_felt", response_time_s=None),
    "an answer made up": lambda events: next(
        end for end in of("trial-end", events) if end["response"] == "not_felt"
    ).update(response="felt", response_time_s=0.5),
    "a faster answer": lambda events: felt_end(events).update(response_time_s=0.2),
    "an impossible answer": lambda events: felt_end(events).update(response_time_s=-999.0),
    "a press taken out": without_a_press,
    "a faster press": lambda events: of("response", events)[0].update(response_time_s=0.2),
    "a press outside its window": lambda events: of("response", events)[0].update(phase="late"),
    "less drive": set_in("stimulus", drive=0.5),
    "less exposure": set_in("stimulus", exposure_s=0.0),
    "an earlier onset": lambda events: of("stimulus", events)[2].update(
        onset_t_s=of("stimulus", events)[2]["onset_t_s"] - 0.2
    ),
    "another device time": lambda events: of("stimulus", events)[2].update(device_ns=5),
    "another condition": lambda events: of("trial-start", events)[0]["conditions"].update(modulation_hz=33.0),
    "another trial type": lambda events: of("trial-start", events)[0].update(
        trial_type="catch" if of("trial-start", events)[0]["trial_type"] == "stimulus" else "stimulus"
    ),
    "a real person": lambda events: events[0].update(simulated=False, virtual_time=False),
    "a real array": lambda events: events[0]["devices"]["array"].update(emulated=False),
    "another participant": lambda events: events[0].update(participant="sim09"),
    "another session": lambda events: events[0].update(session="07"),
    "another seed": lambda events: events[0]["plan"].update(seed=99),
    "another place": lambda events: events[0]["plan"].update(place=5),
    "another plan": lambda events: events[0]["plan"]["trials"][0].update(pause_before_s=9.0),
    "another protocol": other_protocol,
    "another protocol under its own hash": other_protocol_and_hash,
    "other words in the protocol": other_words,
    "another hash": lambda events: events[0].update(protocol_sha256="0" * 64),
    "a trial taken out": without_a_trial,
    "two trials swapped": in_another_order,
    "a success that was none": lambda events: events.__delitem__(slice(-4, -1)),
    "a second end": lambda events: events.append(dict(events[-1])),
    "a second start": lambda events: events.insert(5, dict(events[0])),
    "a time that goes back": lambda events: events[9].update(t_s=0.5),
    "another wall-clock time": lambda events: events[9].update(utc="2020-01-01T00:00:00+00:00"),
    "lines in reverse": lambda events: events.__setitem__(slice(3, 9), events[8:2:-1]),
    "a person who confirmed": set_in("block-start", confirmed_by="person"),
    "a gap in the noise": set_in("trial-end", underruns=3),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_an_edit_is_noticed_though_the_chain_was_computed_again(study: Path, change: Change) -> None:
    (study / "sourcedata" / "chains.tsv").unlink()
    log = logs_of(study)[0]
    events = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    chained_again(log, events)
    assert found(study) == [], "the chain is computed as the log does it"
    change(events)
    chained_again(log, events)
    assert found(study) != []


def test_problems_have_their_places(study: Path) -> None:
    log = logs_of(study)[0]
    lines = log.read_bytes().split(b"\n")
    lines[6] = lines[6].replace(b'"trial":', b'"trial": ')
    log.write_bytes(b"\n".join(lines))
    (problem, *_) = verify_log(log)
    assert (problem.file, problem.line) == (log, 7)
    assert str(problem).startswith(f"{log.name}:7: ")


# --- what people are told


def flip(study: Path) -> None:
    log = logs_of(study)[0]
    text = log.read_text(encoding="utf-8")
    log.write_text(text.replace('"response":"not_felt"', '"response":"felt"', 1), encoding="utf-8")


def test_verify_says_so_and_with_which_exit_code(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "verify", str(study)]) == 0
    assert "nothing wrong with 3 log(s)" in capsys.readouterr().out
    flip(study)
    assert main(["study", "verify", str(study)]) == 2
    assert "the chain breaks" in capsys.readouterr().out
    assert main(["study", "verify", str(study), "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert (told["logs"], told["whole"]) == (3, False)
    assert {problem["file"] for problem in told["problems"] if not problem["explained"]} == {
        logs_of(study)[0].relative_to(study).as_posix()
    }
    assert main(["study", "verify", str(study / "none")]) == 2


def test_export_says_so_where_nobody_can_miss_it(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flip(study)
    for _ in range(2):  # a second export does not forget it
        assert main(["export", str(study)]) == 0
        assert "*** WARNING: the records are not as they were written" in capsys.readouterr().err
        readme = (study / "README.md").read_text(encoding="utf-8").splitlines()
        assert readme[0].startswith("**Simulated data")
        assert readme[2].startswith("**WARNING: the records are not as they were written")
    warnings = read_trials(study).warnings
    assert warnings[0].startswith("THE RECORDS ARE NOT AS THEY WERE WRITTEN")
    assert "the chain breaks" in warnings[1]


@pytest.mark.slow
def test_analyse_says_so_in_all_that_it_writes(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flip(study)
    assert main(["analyse", str(study)]) == 0
    said = capsys.readouterr()
    assert "*** WARNING" in said.err
    assert "the chain breaks" in said.out
    for name in ("README.md", "report.html", "results.json"):
        text = (study / "derivatives" / "analysis" / name).read_text(encoding="utf-8")
        assert "the chain breaks" in text, name
