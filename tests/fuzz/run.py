"""Deep random runs, outside CI: all properties over new examples, and mutated files, in rounds."""

import argparse
import random
import subprocess
import sys
import time
from pathlib import Path

_ROOT = Path(__file__).parents[2]


def main() -> int:
    """Run rounds until the time is over; return 1 if any of them failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    end_s = time.monotonic() + 60 * parser.parse_args().minutes
    failed = rounds = 0
    while not rounds or time.monotonic() < end_s:
        seed = random.SystemRandom().randrange(2**31)
        print(f"round {rounds + 1}, seed {seed}", flush=True)
        failed += sum(
            subprocess.run(command, cwd=_ROOT, check=False).returncode != 0 for command in _round(seed)
        )
        rounds += 1
    print(f"{rounds} rounds, {failed} failed commands")
    return 1 if failed else 0


def _round(seed: int) -> list[list[str]]:
    properties = [
        "-m",
        "hypothesis or fuzz",
        "--hypothesis-profile=random",
        f"--hypothesis-seed={seed}",
        "-n",
        "auto",
        "-q",
    ]
    return [
        [sys.executable, "-m", "pytest", *properties],
        [sys.executable, "tests/fuzz/inputs.py", "--seed", str(seed), "--mutants", "1000"],
    ]


if __name__ == "__main__":
    sys.exit(main())
