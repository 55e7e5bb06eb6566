"""Mutated files through the commands that read them: no traceback, bounded time and memory, exit codes.

``python tests/fuzz/inputs.py`` gives each kind of input 10,000 mutants and prints, for each kind, how often
the command ended with which exit code, and the mutants that broke a rule; its exit code is then 1.
"""

import argparse
import contextlib
import io
import multiprocessing
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.fuzz import seeds
from tests.fuzz.mutations import mutated_bytes, mutated_table, mutated_yaml

LONGEST_CPU_S = 2.0
LONGEST_CALIBRATION_S = 10.0
"""Tracks that are accepted are calibrated: 5 s of work here, also where nothing was changed."""

LARGEST_GROWTH_MB = 500.0
EXIT_CODES = {0, 2, 4, 5}
_GIVE_UP_S = 30
_MUTANTS_A_PROCESS = 400


@dataclass(frozen=True)
class Outcome:
    """What a command did with one mutant; `broken` says which rule it broke."""

    seed: int
    exit_code: int | None
    broken: str | None


def main() -> int:
    """Run the kinds named on the command line, all by default; return 1 if any rule was broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--mutants", type=int, default=10_000, help="of each kind (10000)")
    parser.add_argument("--seed", type=int, default=None, help="of the first mutant (random)")
    options = parser.parse_args()
    first = random.SystemRandom().randrange(2**31) if options.seed is None else options.seed
    print(f"first seed {first}")
    broken = sum(report(kind, options.mutants, first) for kind in options.kinds or KINDS)
    return 1 if broken else 0


def report(kind: str, mutants: int, first_seed: int) -> int:
    """Try mutants of a kind on all cores and print what came of them; return how many broke a rule."""
    began_s = time.monotonic()
    cases = ((kind, seed) for seed in range(first_seed, first_seed + mutants))
    context = multiprocessing.get_context("forkserver")
    with context.Pool(initializer=_warm_up, maxtasksperchild=_MUTANTS_A_PROCESS) as pool:
        outcomes = list(pool.imap_unordered(outcome_of, cases, chunksize=1))
    codes = Counter(outcome.exit_code for outcome in outcomes)
    counts = ", ".join(f"exit {code}: {count}" for code, count in sorted(codes.items(), key=str))
    broken = [outcome for outcome in outcomes if outcome.broken]
    print(f"{kind}: {mutants} mutants in {time.monotonic() - began_s:.0f} s; {counts}; broken: {len(broken)}")
    for outcome in broken[:20]:
        print(f"  {kind} --seed {outcome.seed} --mutants 1: {outcome.broken}")
    return len(broken)


def outcome_of(case: tuple[str, int]) -> Outcome:
    """Make one mutant in a folder of its own, run its command in this process, and judge what it did."""
    kind, seed = case
    chance = random.Random(seed)
    before_mb, began_s = _peak_mb(), time.process_time()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        code, told = _run(lambda: KINDS[kind](chance))
    cpu_s, growth_mb = time.process_time() - began_s, _peak_mb() - before_mb
    longest_s = LONGEST_CALIBRATION_S if kind == "tracks" and code == 0 else LONGEST_CPU_S
    return Outcome(seed, code, _broken(code, told, cpu_s, longest_s, growth_mb))


def check_protocol(chance: random.Random) -> int:
    """A protocol through `check`."""
    _write("mutant.yaml", mutated_yaml(chance, chance.choice(seeds.protocols())), chance)
    return _command("check", "mutant.yaml")


def check_rig(chance: random.Random) -> int:
    """A rig through `check --rig`."""
    _write("emulated-calibration.yaml", seeds.calibration())
    _write("mutant.yaml", mutated_yaml(chance, chance.choice(seeds.rigs())), chance)
    return _command("check", "pilot", "--rig", "mutant.yaml")


def check_calibration(chance: random.Random) -> int:
    """A calibration through the rig that names it."""
    _write("emulated-calibration.yaml", mutated_yaml(chance, seeds.calibration()), chance)
    _write("rig.yaml", seeds.rigs()[0])
    return _command("check", "pilot", "--rig", "rig.yaml")


def calibrate_tracks(chance: random.Random) -> int:
    """A track through `calibrate --points`."""
    first, second = seeds.tracks()
    _write("one.csv", mutated_table(chance, first), chance)
    _write("two.csv", second)
    return _command("calibrate", "--points", "one.csv", "two.csv", "--out", "calibration.yaml")


def read_scan(chance: random.Random) -> int:
    """A microphone scan through the reader of `field --measured`; the field itself takes seconds."""
    from autd_trials.acoustics.scan import read_scan as read

    _write("scan.csv", mutated_table(chance, seeds.scan()), chance)
    return _reading(lambda: read(Path("scan.csv")))


def analyse_answers(chance: random.Random) -> int:
    """A table of answers through the reader of `analyse`; the analysis itself takes seconds."""
    from tests.fuzz.seeds import read_answers

    _write("answers.csv", mutated_table(chance, seeds.answers()), chance)
    return _reading(lambda: read_answers(Path("answers.csv")))


def parse_serial(chance: random.Random) -> int:
    """Bytes of a serial box through every parser, in random chunks."""
    from autd_trials.responses import box_protocols

    data = mutated_bytes(chance, b"".join(seeds.serial(chance)))
    for protocol in seeds.box_protocols():
        parser = protocol.parser()
        rest = data
        while rest:
            size = chance.randint(1, 64)
            parser.feed(rest[:size])
            rest = rest[size:]
    assert box_protocols.LONGEST_LINE_BYTES > 0
    return 0


KINDS: dict[str, Callable[[random.Random], int]] = {
    "protocols": check_protocol,
    "rigs": check_rig,
    "calibrations": check_calibration,
    "tracks": calibrate_tracks,
    "scans": read_scan,
    "answers": analyse_answers,
    "serial": parse_serial,
}


def _run(command: Callable[[], int]) -> tuple[int | None, str]:
    """Return a command's exit code and what it told; None and the traceback if it did not return."""
    told = io.StringIO()
    signal.signal(signal.SIGALRM, _give_up)
    signal.alarm(_GIVE_UP_S)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(told):
            return command(), told.getvalue()
    except SystemExit as end:
        return (end.code if isinstance(end.code, int) else 1), told.getvalue()
    except BaseException:
        return None, traceback.format_exc()
    finally:
        signal.alarm(0)


def _give_up(_number: int, _frame: object) -> None:
    raise TimeoutError(f"no end after {_GIVE_UP_S} s")


def _broken(code: int | None, told: str, cpu_s: float, longest_s: float, growth_mb: float) -> str | None:
    if code is None or "Traceback" in told:
        return " | ".join(told.strip().splitlines()[-3:])
    if code not in EXIT_CODES:
        return f"exit code {code}: {told[:200]}"
    if code != 0 and not told.strip():
        return f"exit code {code} without a message"
    if re.search(r"[\x00-\x08\x0b-\x1f\x7f]", told):
        return f"control characters in the message: {told[:200]!r}"
    if cpu_s > longest_s:
        return f"{cpu_s:.1f} s of CPU time"
    if growth_mb > LARGEST_GROWTH_MB:
        return f"{growth_mb:.0f} MB more"
    return None


def _command(*arguments: str) -> int:
    from autd_trials.cli import main as autd_trials

    return autd_trials(arguments)


def _warm_up() -> None:
    """Run each kind once, as a first call imports and compiles for seconds."""
    for kind in KINDS:
        outcome_of((kind, 0))


def _reading(read: Callable[[], object]) -> int:
    from autd_trials.errors import TrialsError

    try:
        read()
    except TrialsError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _write(name: str, text: str, chance: random.Random | None = None) -> None:
    data = text.encode("utf-8", errors="surrogatepass")
    if chance is not None and chance.random() < 0.1:
        data = mutated_bytes(chance, data)
    Path(name).write_bytes(data)


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(main())
