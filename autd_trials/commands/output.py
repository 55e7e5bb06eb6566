"""What goes where: results to standard output, messages for people to standard error."""

import contextlib
import json
import os
import sys
from typing import Any

from autd_trials.errors import UsageError
from autd_trials.neutral import UNPRINTABLE, printable


def print_json(result: object) -> None:
    """Print a command's result as one JSON object."""
    text = json.dumps(result, ensure_ascii=False, allow_nan=False)
    _write(UNPRINTABLE.sub(lambda found: f"\\u{ord(found[0]):04x}", text) + "\n")


def print_text(text: str) -> None:
    """Print a command's result as text."""
    _write(printable(text if text.endswith("\n") else text + "\n"))


def say(message: Any) -> None:
    """Tell the person something; a full disk behind standard error stops nothing."""
    with contextlib.suppress(OSError):
        sys.stderr.write(printable(f"{message}\n"))


def _write(text: str) -> None:
    """Write to standard output now, so that a full disk is noticed and told."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        _give_up_output()
        raise UsageError(
            f"the result cannot be written: {error.strerror}",
            where="standard output",
            do="make room where the output goes, or send it elsewhere",
        ) from error


def _give_up_output() -> None:
    """Send what is left to nowhere: Python would try to write it once more at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
