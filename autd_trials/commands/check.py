"""`autd-trials check`: what a session would be, and whether it may be, before anybody stands there."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_trials.commands.output import print_json, print_text, say

if TYPE_CHECKING:
    from autd_trials.commands.study import Study
    from autd_trials.protocol.plan import Plan
    from autd_trials.rig.probe import Finding
    from autd_trials.session.preflight import Preflight


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("protocol", metavar="PROTOCOL", help="path, or the bare name of a shipped protocol")
    parser.add_argument("--rig", metavar="FILE", default="emulated", help="rig file, or bare name (emulated)")
    parser.add_argument(
        "--devices", action="store_true", help="open every device that the rig names, and close it again"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Validate, plan a first session, and judge it as the runner will; nothing is emitted."""
    from autd_trials.commands.study import load_study
    from autd_trials.protocol.plan import make_plan

    study = load_study(options.protocol, options.rig, Path("data"))
    plan = make_plan(study.protocol, place=1, session=1, seed=1)
    judged, ear_level_db = _judge(study, plan)
    facts = _facts(study, plan, judged, ear_level_db)
    findings = _probe(study) if options.devices else []
    if options.json:
        devices = {found.device: {"ok": found.failure is None, "found": found.found} for found in findings}
        print_json({**facts, "devices": devices} if options.devices else facts)
    else:
        lines = {**facts, **{f"device: {found.device}": found.found for found in findings}}
        print_text("\n".join(f"{name:<25} {value}" for name, value in lines.items()))
    for remark in (*judged.remarks, *_ear_remarks(ear_level_db)):
        say(f"warning: {remark}")
    failures = [found.failure for found in findings if found.failure is not None]
    for failure in failures:
        say(f"error: {failure}")
    return max((failure.exit_code for failure in failures), default=0)


def _probe(study: "Study") -> "list[Finding]":
    from autd_trials.clock import RealClock
    from autd_trials.rig.build import Builder
    from autd_trials.rig.probe import probe

    return probe(Builder(study.loaded_rig, study.protocol, RealClock(), virtual=False))


def _judge(study: "Study", plan: "Plan") -> "tuple[Preflight, float | None]":
    """Ask the preflight, on an in-process array in virtual time; return the level at the ears too."""
    from datetime import UTC, datetime

    from autd_trials.clock import VirtualClock
    from autd_trials.rig.build import NO_AUDIO, Builder
    from autd_trials.session.devices import array_stimulus
    from autd_trials.session.preflight import Used, preflight

    clock = VirtualClock(datetime.now(UTC))
    audio = NO_AUDIO if study.loaded_rig.rig.sound is None else None  # a run asks for --audio then
    builder = Builder(study.loaded_rig, study.protocol, clock, virtual=True, audio=audio)
    array = builder.array()
    judged = preflight(study.protocol, plan, array, builder.limits, Used(), plan.trials)
    builder.masker(plan.seed, simulated=True)
    array.open()
    stimuli = dict.fromkeys(array_stimulus(study.protocol, trial) for trial in plan.trials)
    levels = [array.arm(stimulus).ear_level_db for stimulus in stimuli]
    return judged, max((level for level in levels if level is not None), default=None)


def _ear_remarks(ear_level_db: float | None) -> tuple[str, ...]:
    from autd_trials.stimulus import PUBLIC_LEVEL_DB

    if ear_level_db is None:
        return ("the level at the ears is not predicted: the protocol does not say where the head is",)
    if ear_level_db > PUBLIC_LEVEL_DB:
        return (
            f"{ear_level_db:.0f} dB SPL are predicted at the ears (free field, linear theory), "
            f"over the {PUBLIC_LEVEL_DB:.0f} dB for the public",
        )
    return ()


def _facts(study: "Study", plan: "Plan", judged: "Preflight", ear_level_db: float | None) -> dict[str, Any]:
    rig, protocol = study.loaded_rig, study.protocol
    own_s, rigs_s = protocol.safety.session_exposure_s, rig.rig.array.limits.session_exposure_s
    return {
        "protocol": protocol.name,
        "rig": rig.rig.name,
        "emulated": rig.rig.emulated,
        "calibration": f"{rig.calibration.method}, {rig.calibration.time:%Y-%m-%d}",
        "blocks": judged.blocks,
        "trials": judged.trials,
        "catch trials": sum(trial.trial_type == "catch" for trial in plan.trials),
        "minutes at least": round(judged.shortest_s / 60, 1),
        "exposure_s": round(judged.exposure_s, 6),
        "exposure of a trial_s": judged.largest_exposure_s,
        "exposure limit_s": judged.limits.session_exposure_s,
        "exposure limit of": "rig" if rigs_s <= own_s else "protocol",
        "daily limit_s": judged.limits.daily_exposure_s,
        "largest duty": round(judged.duty, 4),
        "duty limit": judged.limits.largest_duty,
        "ear level_db": None if ear_level_db is None else round(ear_level_db, 1),
        "ear level limit_db": rig.rig.array.limits.largest_ear_level_db,
        "hearing protection_db": rig.rig.hearing_protection_db,
        "masking": "none" if protocol.masking is None else protocol.masking.noise,
        "sound": "none" if rig.rig.sound is None else rig.rig.sound.player,
        "responses": rig.rig.responses.device,
        "trials of an adaptive run": judged.adaptive_trials,
    }
