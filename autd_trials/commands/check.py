"""`autd-trials check`: what a session would be, and whether it may be, before anybody stands there."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_trials.commands.output import print_json, print_text

if TYPE_CHECKING:
    from autd_trials.commands.study import Study
    from autd_trials.protocol.plan import Plan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("protocol", metavar="PROTOCOL", help="path, or the bare name of a shipped protocol")
    parser.add_argument("--rig", metavar="FILE", default="emulated", help="rig file, or bare name (emulated)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Validate, plan a first session, and let the array layer judge every stimulus; nothing is started."""
    from autd_trials.commands.study import load_study
    from autd_trials.protocol.plan import make_plan

    study = load_study(options.protocol, options.rig, Path("data"))
    plan = make_plan(study.protocol, place=1, session=1, seed=1)
    _refuse_unsafe(study, plan)
    facts = _facts(study, plan)
    if options.json:
        print_json(facts)
    else:
        print_text("\n".join(f"{name:<22}{value}" for name, value in facts.items()))
    return 0


def _refuse_unsafe(study: "Study", plan: "Plan") -> None:
    """Ask the array layer itself, on an in-process array in virtual time."""
    from datetime import UTC, datetime

    from autd_trials.clock import VirtualClock
    from autd_trials.rig.build import Builder
    from autd_trials.session.devices import array_stimulus

    rig = study.loaded_rig
    clock = VirtualClock(datetime.now(UTC))
    array = Builder(rig.rig, rig.calibration, study.protocol, clock, virtual=True).array()
    array.check([array_stimulus(study.protocol, trial) for trial in plan.trials])


def _facts(study: "Study", plan: "Plan") -> dict[str, Any]:
    from autd_trials.console.status import time_left_s

    rig, protocol = study.loaded_rig, study.protocol
    exposure_s = sum(t.stimulus.drive**2 * t.stimulus.duration_s for t in plan.trials)
    return {
        "protocol": protocol.name,
        "rig": rig.rig.name,
        "emulated": rig.rig.emulated,
        "calibration": f"{rig.calibration.method}, {rig.calibration.time:%Y-%m-%d}",
        "blocks": len(plan.blocks),
        "trials": len(plan.trials),
        "catch trials": sum(trial.trial_type == "catch" for trial in plan.trials),
        "minutes at least": round(time_left_s(plan, protocol.timing, completed=0) / 60, 1),
        "exposure_s": round(exposure_s, 6),
        "exposure limit_s": min(rig.rig.array.limits.session_exposure_s, protocol.safety.session_exposure_s),
        "masking": "none" if protocol.masking is None else protocol.masking.noise,
        "sound": "none" if rig.rig.sound is None else rig.rig.sound.player,
        "responses": rig.rig.responses.device,
    }
