"""A real-time session on the firmware emulator, on an idle and on a busy machine, judged by its own log.

    python tests/benchmarks/bench_real_time.py [TRIALS]

Prints for 0, 1 and 2 busy processes: the least time in hand between the acceptance of a start command and
its device time (limit 10 ms), in how many trials the state read back brackets the onset, and the most that
the host added to the planned time between trials (limit 30 ms). That the emission starts within 25 us of the
device time is proved by the offline recorder in tests/array.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import yaml

from autd_trials.protocol.load import find_protocol
from autd_trials.records.log import read_log
from autd_trials.session.events import StimulusStart, TrialEnd

_LEAST_MARGIN_S = 0.010
_MOST_ADDED_S = 0.030
_BUSY = "import time\nend = time.monotonic() + {seconds}\nwhile time.monotonic() < end: pass"


@dataclass(frozen=True)
class Timing:
    """What a session's log says of its timing, in s."""

    trials: int
    least_margin_s: float
    median_margin_s: float
    bracketed: int
    most_added_s: float

    @property
    def within_limits(self) -> bool:
        """Whether every trial was on time."""
        in_time = self.least_margin_s >= _LEAST_MARGIN_S and self.most_added_s <= _MOST_ADDED_S
        return in_time and self.bracketed == self.trials


def measure(trials: int, busy: int, folder: Path) -> Timing:
    """Run a session of so many trials in real time beside so many busy processes."""
    protocol = _short_protocol(trials, folder)
    program = "import sys; from autd_trials.cli import run_protocol; sys.exit(run_protocol())"
    arguments = [str(protocol), "--simulate", "1", "--real-time", "--data", str(folder / f"busy{busy}")]
    with _busy(busy, seconds=60 + 3 * trials):
        subprocess.run([sys.executable, "-c", program, *arguments], check=True, capture_output=True)
    return _judge(next((folder / f"busy{busy}").glob("*/sourcedata/sub-*/ses-*/*_log.jsonl")))


def _judge(path: Path) -> Timing:
    log = read_log(path)
    starts = [event for event in log.events if isinstance(event, StimulusStart)]
    ends = [event for event in log.events if isinstance(event, TrialEnd)]
    margins_s = sorted(start.margin_s for start in starts)
    added_s = [start.onset_t_s - start.planned_onset_t_s for start in starts]
    bracketed = [
        end.silent_before_s is not None
        and end.emitting_after_s is not None
        and end.silent_before_s > 0
        and end.emitting_after_s > 0
        for end in ends
    ]
    return Timing(len(starts), margins_s[0], margins_s[len(margins_s) // 2], sum(bracketed), max(added_s))


def _short_protocol(trials: int, folder: Path) -> Path:
    """Write a protocol like chest.yaml with one block of `trials` short trials."""
    protocol = yaml.safe_load(find_protocol("chest").read_text(encoding="utf-8"))
    protocol["name"] = "timing"
    protocol["stimulus"]["duration_s"] = 0.25
    protocol["factors"]["between_blocks"] = {}
    protocol["factors"]["within_block"] = {}
    protocol["comparisons"] = []
    protocol["repetitions"] = trials
    protocol["timing"] = {"lead_in_s": 1.0, "response_window_s": 0.5, "pause_min_s": 0.5, "pause_max_s": 0.7}
    path = folder / "timing.yaml"
    path.write_text(yaml.safe_dump(protocol), encoding="utf-8")
    return path


@contextmanager
def _busy(processes: int, seconds: int) -> Iterator[None]:
    """Keep so many processes busy; they end by themselves if nobody ends them."""
    program = _BUSY.format(seconds=seconds)
    running = [subprocess.Popen([sys.executable, "-c", program]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in running:
            process.kill()
            process.wait()


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    print(
        "busy  trials  margin ms (min / median, limit 10)  bracketed  added ms (max, limit 30)  within limits"
    )
    with tempfile.TemporaryDirectory() as temporary:
        results = [(busy, measure(count, busy, Path(temporary))) for busy in (0, 1, 2)]
    for busy, found in results:
        margins_ms = f"{1e3 * found.least_margin_s:.1f} / {1e3 * found.median_margin_s:.1f}"
        print(
            f"{busy:>4}  {found.trials:>6}  {margins_ms:>34}  "
            f"{found.bracketed:>9}  {1e3 * found.most_added_s:>24.2f}  {found.within_limits}"
        )
    sys.exit(not all(found.within_limits for _, found in results))
