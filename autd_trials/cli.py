"""The two programs, `autd-trials COMMAND` and `run-protocol` (which is `autd-trials run`)."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from typing import Final

from autd_trials.errors import TrialsError
from autd_trials.neutral import printable

_COMMANDS: Final = {
    "run": "run a protocol's session (run-protocol is short for it)",
    "check": "validate a protocol and a rig, and say what a session would be",
    "plan": "print the trials of a session as a table",
    "schema": "print the JSON Schema of protocol or rig files, for editors",
    "export": "make a study's BIDS data set again from its logs",
    "analyse": "detection rates, planned comparisons and the figure of a study",
    "study": "look after a recorded study: verify its logs",
    "field": "the predicted field around foci: pictures, metrics, pose errors, microphone scans",
    "power": "how many participants a study needs: whole studies, simulated and tested",
    "calibrate": "where the units stand: from a waved target, live or from files, and from sound",
    "sensor": "watch the target from one unit, and send what is seen to the computer that calibrates",
    "devices": "list what is connected: serial ports, sound devices, network interfaces",
}
_MODULES: Final = {"study": "study_records"}
"""Modules of commands that are not called as their command."""

_STOPPED_BY_SIGNAL = 130
_OUTPUT_CLOSED = 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `autd-trials`; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="autd-trials",
        description="Experiment runner for midair haptics with phased arrays of ultrasound transducers.",
        epilog="Exit codes: 0 done, 2 bad usage or file, 3 stopped by a person, 4 a device failed, "
        "5 unsafe and refused.",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, summary in _COMMANDS.items():
        command = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        _module(name).add_arguments(command)
    return _execute(parser.parse_args(arguments))


def run_protocol(arguments: Sequence[str] | None = None) -> int:
    """Run `run-protocol`; return its exit code."""
    given = sys.argv[1:] if arguments is None else arguments
    parser = argparse.ArgumentParser(prog="run-protocol", description="Run a protocol's session.")
    _module("run").add_arguments(parser)
    return _execute(parser.parse_args([*given], argparse.Namespace(command="run")))


def _execute(options: argparse.Namespace) -> int:
    try:
        return int(_module(options.command).execute(options))
    except TrialsError as error:
        print(printable(f"error: {error}"), file=sys.stderr)  # noqa: T201
        return error.exit_code
    except KeyboardInterrupt:
        return _STOPPED_BY_SIGNAL
    except BrokenPipeError:
        sys.stderr.close()  # whoever read our output has gone; Python would complain about it at exit
        return _OUTPUT_CLOSED


def _module(command: str):  # type: ignore[no-untyped-def]  # a module of autd_trials.commands
    return importlib.import_module(f"autd_trials.commands.{_MODULES.get(command, command)}")
