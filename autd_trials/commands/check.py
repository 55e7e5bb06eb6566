"""`autd-trials check`: what a session would be, and whether it may be, before anybody stands there."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_trials.commands.output import print_json, print_text, say

if TYPE_CHECKING:
    from autd_trials.commands.study import Study
    from autd_trials.protocol.plan import Plan
    from autd_trials.rig.probe import Finding


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("protocol", metavar="PROTOCOL", help="path, or the bare name of a shipped protocol")
    parser.add_argument("--rig", metavar="FILE", default="emulated", help="rig file, or bare name (emulated)")
    parser.add_argument(
        "--devices", action="store_true", help="open every device that the rig names, and close it again"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Validate, plan a first session, and let the array layer judge every stimulus; nothing is emitted."""
    from autd_trials.commands.study import load_study
    from autd_trials.protocol.plan import make_plan

    study = load_study(options.protocol, options.rig, Path("data"))
    plan = make_plan(study.protocol, place=1, session=1, seed=1)
    ear_level_db = _refuse_unsafe(study, plan)
    facts = _facts(study, plan, ear_level_db)
    findings = _probe(study) if options.devices else []
    if options.json:
        devices = {found.device: {"ok": found.failure is None, "found": found.found} for found in findings}
        print_json({**facts, "devices": devices} if options.devices else facts)
    else:
        lines = {**facts, **{f"device: {found.device}": found.found for found in findings}}
        print_text("\n".join(f"{name:<24}{value}" for name, value in lines.items()))
    _warn(facts)
    failures = [found.failure for found in findings if found.failure is not None]
    for failure in failures:
        say(f"error: {failure}")
    return max((failure.exit_code for failure in failures), default=0)


def _probe(study: "Study") -> "list[Finding]":
    from autd_trials.clock import RealClock
    from autd_trials.rig.build import Builder
    from autd_trials.rig.probe import probe

    return probe(Builder(study.loaded_rig, study.protocol, RealClock(), virtual=False))


def _refuse_unsafe(study: "Study", plan: "Plan") -> float | None:
    """Ask the array layer itself, on an in-process array in virtual time; return the level at the ears."""
    from datetime import UTC, datetime

    from autd_trials.clock import VirtualClock
    from autd_trials.rig.build import Builder
    from autd_trials.session.devices import array_stimulus
    from autd_trials.session.tracks import possible_stimuli

    clock = VirtualClock(datetime.now(UTC))
    array = Builder(study.loaded_rig, study.protocol, clock, virtual=True).array()
    stimuli = [array_stimulus(study.protocol, trial) for trial in plan.trials]
    array.check(stimuli)
    for stimulus in possible_stimuli(study.protocol, plan.trials):
        array.check([stimulus])
    array.open()
    levels = [array.arm(stimulus).ear_level_db for stimulus in dict.fromkeys(stimuli)]
    return max((level for level in levels if level is not None), default=None)


def _warn(facts: dict[str, Any]) -> None:
    from autd_trials.stimulus import PUBLIC_LEVEL_DB

    left_s = facts["exposure limit_s"] - facts["exposure_s"]
    if left_s < facts["exposure of a trial_s"]:
        say(
            f"warning: the exposure limit of the {facts['exposure limit of']} leaves {left_s:g} s, "
            "not enough to run a trial again that was interrupted: such a session could not be finished"
        )
    ear_level_db = facts["ear level_db"]
    if ear_level_db is None:
        say("warning: the level at the ears is not predicted: the protocol does not say where the head is")
    elif ear_level_db > PUBLIC_LEVEL_DB:
        say(
            f"warning: {ear_level_db:.0f} dB SPL are predicted at the ears (free field, linear theory), "
            f"over the {PUBLIC_LEVEL_DB:.0f} dB for the public"
        )


def _facts(study: "Study", plan: "Plan", ear_level_db: float | None) -> dict[str, Any]:
    from autd_trials.console.status import time_left_s
    from autd_trials.stimulus import exposure_s, total_exposure_s

    rig, protocol = study.loaded_rig, study.protocol
    limits_s = {
        "rig": rig.rig.array.limits.session_exposure_s,
        "protocol": protocol.safety.session_exposure_s,
    }
    planned_s = total_exposure_s(trial.stimulus for trial in plan.trials)
    return {
        "protocol": protocol.name,
        "rig": rig.rig.name,
        "emulated": rig.rig.emulated,
        "calibration": f"{rig.calibration.method}, {rig.calibration.time:%Y-%m-%d}",
        "blocks": len(plan.blocks),
        "trials": len(plan.trials),
        "catch trials": sum(trial.trial_type == "catch" for trial in plan.trials),
        "minutes at least": round(time_left_s(plan, protocol.timing, completed=0) / 60, 1),
        "exposure_s": round(planned_s, 6),
        "exposure of a trial_s": max(exposure_s(trial.stimulus) for trial in plan.trials),
        "exposure limit_s": min(limits_s.values()),
        "exposure limit of": min(limits_s, key=lambda name: limits_s[name]),
        "ear level_db": None if ear_level_db is None else round(ear_level_db, 1),
        "ear level limit_db": rig.rig.array.limits.largest_ear_level_db,
        "hearing protection_db": rig.rig.hearing_protection_db,
        "masking": "none" if protocol.masking is None else protocol.masking.noise,
        "sound": "none" if rig.rig.sound is None else rig.rig.sound.player,
        "responses": rig.rig.responses.device,
    }
