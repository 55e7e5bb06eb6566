"""`autd-trials run`: sessions of a protocol, with a person or with simulated participants."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.commands.output import print_json, say
from autd_trials.errors import TrialsError, UsageError

if TYPE_CHECKING:
    from autd_trials.commands.bench import Choices
    from autd_trials.commands.session import Started
    from autd_trials.commands.study import Study

_SIMULATED_SEED = 1
"""Seed of simulated studies where none is given, so that they can be repeated."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("protocol", metavar="PROTOCOL", help="path, or the bare name of a shipped protocol")
    parser.add_argument("--participant", metavar="ID", help="letters and digits (default: the next free one)")
    parser.add_argument("--session", metavar="ID", help="letters and digits (default: the next free number)")
    parser.add_argument(
        "--place",
        type=_positive,
        metavar="N",
        help="the participant's place in the roster, as of somebody who dropped out (default: the next)",
    )
    parser.add_argument("--rig", metavar="FILE", default="emulated", help="rig file, or bare name (emulated)")
    parser.add_argument(
        "--simulate", type=_positive, metavar="N", help="run N simulated participants in virtual time"
    )
    parser.add_argument("--seed", type=_seed, metavar="N", help="seed of the random order (drawn and logged)")
    parser.add_argument(
        "--data", type=Path, default=Path("data"), metavar="DIR", help="where studies lie (data)"
    )
    parser.add_argument("--resume", action="store_true", help="go on with an interrupted session")
    parser.add_argument(
        "--real-time", action="store_true", help="with --simulate: on the emulator in real time"
    )
    parser.add_argument("--unblind", action="store_true", help="show the condition of the running trial")
    parser.add_argument("--yes", action="store_true", help="answer all confirmations: an unattended run")
    parser.add_argument("--audio", metavar="none|DEVICE", help="no masking noise, or another sound device")
    parser.add_argument("--json", action="store_true", help="print one JSON object at the end")


def execute(options: argparse.Namespace) -> int:
    """Run the sessions, and make the data set whatever happened."""
    _refuse_contradictions(options)
    from autd_trials.commands.study import load_study

    study = load_study(options.protocol, options.rig, options.data)
    if study.loaded_rig.rig.emulated:
        say("*** EMULATED: the array is emulated, no ultrasound is emitted ***")
    if not options.resume:
        _name_unfinished(study)
    results: list[Started] = []
    try:
        results.extend(_sessions(study, options))
    finally:
        _export(study.folder)
    if options.json:
        sessions = [{"participant": r.participant, "session": r.session, "log": str(r.log)} for r in results]
        print_json({"study": str(study.folder), "sessions": sessions})
    return 0


def _sessions(study: "Study", options: argparse.Namespace) -> Iterator["Started"]:
    from autd_trials.commands.bench import Choices
    from autd_trials.commands.session import begin, resume
    from autd_trials.records.roster import next_participant
    from autd_trials.records.sessions import find_session

    choices = Choices(
        simulated=options.simulate is not None,
        real_time=options.real_time,
        unattended=options.yes,
        unblind=options.unblind,
        audio=options.audio,
    )
    seed = _seed_of(options)
    if options.simulate is not None:
        yield from _simulated_sessions(study, choices, options, seed)
    elif options.resume:
        yield resume(study, choices, find_session(study.folder, options.participant, options.session))
    else:
        participant = options.participant or next_participant(study.folder)
        yield begin(study, choices, participant, options.session, seed, options.place)


def _name_unfinished(study: "Study") -> None:
    """Name the sessions that could be gone on with, lest one is forgotten."""
    from autd_trials.records.history import unfinished_sessions

    for found in unfinished_sessions(study.folder):
        standing, paths = found.standing, found.paths
        say(
            f"note: session {paths.session} of participant {paths.participant} is not finished "
            f"({standing.status}, {len(standing.complete)} of {len(standing.start.plan.trials)} trials); "
            f"to go on with it: --resume --participant {paths.participant} --session {paths.session}"
        )


def _simulated_sessions(
    study: "Study", choices: "Choices", options: argparse.Namespace, seed: int
) -> Iterator["Started"]:
    """Run each participant's session; with --resume only what their newest session still lacks."""
    from autd_trials.commands.session import begin, resume
    from autd_trials.records.sessions import study_sessions

    recorded = study_sessions(study.folder) if options.resume else []
    newest = {s.paths.participant: s for s in recorded if options.session in (None, s.paths.session)}
    for participant in _simulated_participants(options):
        found = newest.get(participant)
        if found is None:
            yield begin(study, choices, participant, options.session, seed, options.place)
        elif found.standing.status != "success":
            yield resume(study, choices, found)


def _simulated_participants(options: argparse.Namespace) -> list[str]:
    if options.participant is not None:
        return [options.participant]
    return [f"sim{number:02d}" for number in range(1, options.simulate + 1)]


def _export(study: Path) -> None:
    """Make the data set; a failure is reported but does not hide how the session ended."""
    from autd_trials.commands.integrity import say_of_records
    from autd_trials.records.bids import export_study
    from autd_trials.records.layout import log_paths

    if not log_paths(study):
        return
    try:
        done = export_study(study)
        say(f"data set: {study}")
        say_of_records(study, done.problems, done.told)
    except TrialsError as error:
        say(f"error: the data set was not made: {error}\n  -> mend that, then: autd-trials export {study}")


def _refuse_contradictions(options: argparse.Namespace) -> None:
    if options.real_time and options.simulate is None:
        raise UsageError(
            "--real-time goes with --simulate", do="a session with a person always is in real time"
        )
    if options.simulate is not None and options.simulate > 1 and options.participant is not None:
        raise UsageError("--participant names one participant, --simulate asks for more", do="leave one out")
    if options.place is not None and (options.resume or (options.simulate or 1) > 1):
        raise UsageError("--place is for one new session", do="leave it out")
    if options.simulate is not None and not options.real_time and options.audio not in (None, "none"):
        raise UsageError("sound cannot be played in virtual time", do="add --real-time, or leave --audio out")


def _seed_of(options: argparse.Namespace) -> int:
    import secrets

    if options.seed is not None:
        return int(options.seed)
    return _SIMULATED_SEED if options.simulate is not None else secrets.randbelow(2**31)


def _positive(text: str) -> int:
    number = int(text) if text.isdecimal() else 0
    if not 1 <= number <= 999:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1 to 999")
    return number


def _seed(text: str) -> int:
    number = int(text) if text.isdecimal() else -1
    if not 0 <= number < 2**63:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 to 2^63 - 1")
    return number
