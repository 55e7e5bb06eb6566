"""A live session on the firmware emulator, typed into by a person at a (pseudo-)terminal."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pexpect
import pytest

from tests.commands.conftest import RUN_PROTOCOL, Run, WriteProtocol, events, of
from tests.commands.test_run import of_or_none, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.emulator]

Person = Callable[..., "pexpect.spawn[str]"]


@pytest.fixture
def sit_down(tmp_path: Path) -> Iterator[Person]:
    """Return what starts `run-protocol` in a terminal."""
    children: list[pexpect.spawn[str]] = []

    def start(*arguments: object) -> "pexpect.spawn[str]":
        words = [*RUN_PROTOCOL[1:], *map(str, arguments), "--data", str(tmp_path)]
        children.append(
            pexpect.spawn(RUN_PROTOCOL[0], words, encoding="utf-8", timeout=30, dimensions=(45, 120))
        )
        return children[-1]

    yield start
    for child in children:
        child.close(force=True)


def begin(child: "pexpect.spawn[str]") -> None:
    """Answer the questions before the first trial."""
    child.expect("Read this out to the participant")
    child.expect("Thank you for taking part")
    child.expect("Read out, and understood")
    child.send("y")
    child.expect("clothing: inner")
    child.expect("Is everything as it says")
    child.send("y")


def wait_for_trial(child: "pexpect.spawn[str]", data: Path, number: int) -> None:
    """Wait, reading the screen meanwhile, until so many trials were started."""
    for _ in range(1500):
        if len(of_or_none("stimulus", data)) >= number:
            return
        child.expect([pexpect.TIMEOUT, r".+"], timeout=0.02)
    raise AssertionError(f"trial {number} did not start")


def look_on(child: "pexpect.spawn[str]", seconds: float) -> None:
    """Let time pass as a person does, reading the screen."""
    child.expect([pexpect.TIMEOUT, "no such text"], timeout=seconds)


def test_a_session_with_presses_a_note_and_a_pause(
    sit_down: Person, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    child = sit_down(write_protocol())
    begin(child)
    child.expect("EMULATED: no ultrasound is emitted")
    child.expect("hidden")
    wait_for_trial(child, tmp_path, 1)
    look_on(child, 0.25)
    child.send(" ")
    child.expect("felt, ")
    child.send("n")
    child.expect("PAUSED: the array is silent")
    child.expect("note: ")
    child.send("moved [a bit]\r")
    child.expect(r"\[c\] continue")
    child.send("c")
    wait_for_trial(child, tmp_path, 2)
    child.sendintr()
    child.expect("PAUSED")
    child.expect(r"\[c\] continue")
    child.send("c")
    child.expect("clothing: inner_outer")
    child.expect("Is everything")
    child.send("y")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 0
    assert [e["text"] for e in of("note", tmp_path)] == ["moved [a bit]"]
    assert len(of("pause", tmp_path)) == 3, "note, Ctrl-C and the break"
    first = of("trial-end", tmp_path)[0]
    assert first["response"] == "felt"
    assert first["response_time_s"] > 0
    assert all(e["confirmed_by"] == "person" for e in of("block-start", tmp_path))
    assert [e["trial"] for e in of("trial-end", tmp_path)] == [1, 2, 3, 4, 5, 6]


def test_two_ctrl_c_abort_and_resume_asks_a_person(
    sit_down: Person, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    protocol = write_protocol(lambda data: data["timing"].update(pause_min_s=3, pause_max_s=3))
    child = sit_down(protocol)
    begin(child)
    wait_for_trial(child, tmp_path, 1)
    child.sendintr()
    look_on(child, 0.15)
    child.sendintr()
    child.expect("-> to go on with this session, add --resume")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 3
    assert events(tmp_path)[-1]["status"] == "aborted"
    again = sit_down(protocol, "--resume", "--participant", "01", "--session", "01")
    again.expect(r"\d of 6 trials complete")
    again.expect("Same participant, same set-up, and willing to go on")
    again.send("n")
    again.expect("not confirmed")
    again.expect(pexpect.EOF)
    again.close()
    assert again.exitstatus == 3
    assert events(tmp_path)[-1]["status"] == "aborted", "nothing was added"


def test_no_means_not_yet_and_ctrl_c_at_the_first_questions_leaves_no_session(
    sit_down: Person, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    child = sit_down(write_protocol())
    child.expect("Read out, and understood")
    child.send("n")
    child.expect("Waiting: y when it is so")
    child.send("y")
    child.expect("Is everything as it says")
    child.sendintr()
    child.expect("not confirmed")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 3
    assert list(tmp_path.rglob("*.jsonl")) == []


def test_a_closed_terminal_aborts_and_the_session_is_gone_on_with(
    sit_down: Person, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    child = sit_down(write_protocol())
    begin(child)
    wait_for_trial(child, tmp_path, 1)
    terminal: Any = child
    terminal.ptyproc.fileobj.close()  # the window is closed: the system sends SIGHUP, and writing fails
    terminal.closed = terminal.ptyproc.closed = True
    wait_for(lambda: of_or_none("session-end", tmp_path))
    end = events(tmp_path)[-1]
    assert (end["status"], end["why"]) == ("aborted", "the terminal was closed")
    again = sit_down(write_protocol(), "--resume")
    again.expect("aborted: the terminal was closed")
    again.expect("willing to go on")
    again.send("y")
    again.expect("Read out, and understood")


def test_a_known_id_is_asked_about_and_no_leaves_no_second_session(
    sit_down: Person, run: Run, tmp_path: Path, write_protocol: WriteProtocol
) -> None:
    protocol = write_protocol()
    assert run("run", protocol, "--simulate", 1, "--participant", "p", "--data", tmp_path).code == 0
    child = sit_down(protocol, "--participant", "p")
    child.expect(r"participant p has 1 session\(s\) in this study already")
    child.expect("Is this the same person")
    child.send("n")
    child.expect("not confirmed")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 3
    assert len(list(tmp_path.rglob("*_log.jsonl"))) == 1


@pytest.mark.parametrize("yes", [True, False])
def test_the_abort_key_stops_in_mid_stimulus_also_without_anybody_to_confirm(
    sit_down: Person, tmp_path: Path, write_protocol: WriteProtocol, yes: bool
) -> None:
    protocol = write_protocol(lambda data: data["timing"].update(pause_min_s=3, pause_max_s=3))
    child = sit_down(protocol, *(["--yes"] if yes else []))
    if not yes:
        begin(child)
    child.expect("a: ABORT")
    wait_for_trial(child, tmp_path, 1)
    child.send("a")
    child.expect("aborted by the experimenter")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 3
    assert events(tmp_path)[-1]["status"] == "aborted"


def test_unblind_shows_the_condition(sit_down: Person, write_protocol: WriteProtocol) -> None:
    child = sit_down(write_protocol(), "--unblind")
    begin(child)
    child.expect(re.compile(r"stimulus: .*modulation_hz (25|50|100)"))
    child.send("a")
    child.expect("aborted by the experimenter")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 3
