"""Kills sessions with -9 at random moments, resumes them, and counts what was lost or doubled.

    python tests/benchmarks/bench_kills.py [SESSIONS]

Each session of the chest study (60 trials, virtual time) is killed up to three times, at a moment drawn
evenly over the time that a whole session takes, and resumed until it is through. Prints the counts; exits
with 1 if anything was lost, doubled, out of order, rewritten or left unfinished.
"""

import random
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from autd_trials.records.log import LogContents, read_log
from autd_trials.session.events import SessionEnd, TrialEnd

_KILLS = 3
_DEADLINE_S = 60.0


@dataclass
class Counts:
    """What was found over all sessions."""

    sessions: int = 0
    kills_in_session: int = 0
    interrupted_trials: int = 0
    lost: int = 0
    doubled: int = 0
    out_of_order: int = 0
    rewritten_logs: int = 0
    unfinished: int = 0

    @property
    def bad(self) -> int:
        """How much went wrong."""
        return self.lost + self.doubled + self.out_of_order + self.rewritten_logs + self.unfinished


def kill_sessions(sessions: int, folder: Path, *, seed: int = 1) -> Counts:
    """Run, kill and resume sessions in a folder; return what was found."""
    chance = random.Random(seed)
    counts = Counts()
    whole_s = _time_of_a_session(folder / "whole")
    for number in range(sessions):
        _one(folder / f"{number:03d}", whole_s, chance, counts)
    return counts


def _one(data: Path, whole_s: float, chance: random.Random, counts: Counts) -> None:
    counts.sessions += 1
    finished: set[int] = set()
    for _ in range(_KILLS):
        before = _bytes(data)
        process = _start(data)
        _wait_for_log(data, len(before), process)
        time.sleep(chance.uniform(0, whole_s))
        if process.poll() is None:
            process.kill()
            counts.kills_in_session += 1
        process.wait()
        after = _bytes(data)
        counts.rewritten_logs += not after.startswith(before)
        log = _log(data)
        if log is not None:
            now_finished = set(_complete(log))
            counts.lost += len(finished - now_finished)
            finished = now_finished
    last = _start(data)
    last.wait(timeout=_DEADLINE_S)
    _judge(data, finished, counts)


def _judge(data: Path, finished: set[int], counts: Counts) -> None:
    log = _log(data)
    if log is None or not any(isinstance(e, SessionEnd) and e.status == "success" for e in log.events):
        counts.unfinished += 1
        return
    complete = _complete(log)
    planned = [trial.trial for trial in log.start.plan.trials]
    counts.lost += len((finished | set(planned)) - set(complete))
    counts.doubled += len(complete) - len(set(complete))
    counts.out_of_order += complete != planned
    counts.interrupted_trials += sum(
        isinstance(e, TrialEnd) and e.status == "interrupted" for e in log.events
    )


def _complete(log: LogContents) -> list[int]:
    return [e.trial for e in log.events if isinstance(e, TrialEnd) and e.status == "complete"]


def _start(data: Path) -> "subprocess.Popen[bytes]":
    program = "import sys; from autd_trials.cli import run_protocol; sys.exit(run_protocol())"
    arguments = ["chest", "--simulate", "1", "--resume", "--data", str(data)]
    return subprocess.Popen(
        [sys.executable, "-c", program, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def _wait_for_log(data: Path, size: int, process: "subprocess.Popen[bytes]") -> None:
    """Wait until the process has begun to write, so that the kill falls into the session."""
    deadline_s = time.monotonic() + _DEADLINE_S
    while len(_bytes(data)) <= size and process.poll() is None and time.monotonic() < deadline_s:
        time.sleep(0.001)


def _time_of_a_session(data: Path) -> float:
    process = _start(data)
    _wait_for_log(data, 0, process)
    begun_s = time.monotonic()
    process.wait(timeout=_DEADLINE_S)
    return time.monotonic() - begun_s


def _path(data: Path) -> Path | None:
    return next(iter(data.glob("chest/sourcedata/sub-*/ses-*/*_log.jsonl")), None)


def _bytes(data: Path) -> bytes:
    path = _path(data)
    return path.read_bytes() if path else b""


def _log(data: Path) -> LogContents | None:
    path = _path(data)
    return read_log(path) if path and b"\n" in path.read_bytes() else None


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        found = kill_sessions(int(sys.argv[1]) if len(sys.argv) > 1 else 200, Path(folder))
    for name, count in vars(found).items():
        print(f"{name:<20}{count}")
    sys.exit(found.bad > 0)
