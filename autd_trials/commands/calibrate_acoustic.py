"""The refinement of `autd-trials calibrate --acoustic`: poses from what a microphone heard."""

import argparse
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.commands.output import print_json, print_text, say
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    from autd_trials.acoustics.air import Air
    from autd_trials.calibration.acoustic.heard import Heard
    from autd_trials.calibration.file import Calibration
    from autd_trials.calibration.provenance import Inputs

_SIMULATED = "simulated:"
_TARGET_MM = (302.0, 225.0, 1000.0)


def refine_by_sound(options: argparse.Namespace, inputs: "Inputs", now: datetime) -> int:
    """Refine a calibration and write the result."""
    from autd_trials.acoustics.air import Air
    from autd_trials.calibration.acoustic.refined_file import refine_calibration
    from autd_trials.calibration.file import load_calibration, write_calibration

    if options.calibration is None:
        raise UsageError("--acoustic needs a calibration to start from", do="give --calibration FILE")
    calibration, sha256 = load_calibration(options.calibration)
    inputs.add("calibration", options.calibration, sha256, calibration.capture)
    air = Air(options.air_temperature_c)
    simulated = options.acoustic.startswith(_SIMULATED)
    target_mm = options.target or _target_of(calibration)
    heard = _simulated(options, air, inputs, now) if simulated else _measured(Path(options.acoustic), inputs)
    result, refined, changes = refine_calibration(
        calibration,
        heard,
        air=air,
        microphone_sd_mm=options.microphone_sd_mm,
        target_mm=target_mm,
        seed=options.seed,
        time=now,
        inputs=inputs.sha256,
        before=inputs.sources[0],
        sound=inputs.sources[1],
    )
    write_calibration(result, options.out)
    energy = result.predicted_energy
    facts = {
        "calibration": str(options.out),
        "changes": [asdict(change) for change in changes],
        "residual_rad": refined.residual_rad,
        "speed_of_sound_m_s": refined.speed_of_sound_m_s,
        "predicted_energy": None if energy is None else energy.model_dump(),
    }
    if options.json:
        print_json(facts)
    else:
        for change in changes[1:]:
            print_text(f"{change.name}: moved by {change.shift_mm:.2f} mm and {change.turn_deg:.3f} deg")
        print_text(
            f"{refined.residual_rad:.3f} rad are left of the phases; sound goes at "
            f"{refined.speed_of_sound_m_s:.2f} m/s (expected {air.speed_of_sound_m_s:.2f})"
        )
        if energy is not None:
            print_text(f"energy left at the target: {energy.mean:.3f}, 90 % over {energy.low:.3f}")
    say(f"calibration: {options.out}")
    return 0


def _target_of(calibration: "Calibration") -> tuple[float, float, float]:
    energy = calibration.predicted_energy
    return _TARGET_MM if energy is None else energy.target_mm


def _measured(path: Path, inputs: "Inputs") -> "list[Heard]":
    from autd_trials.calibration.acoustic.heard import read_heard

    heard = read_heard(path)
    inputs.add_data("sound", path)
    return heard


def _simulated(options: argparse.Namespace, air: "Air", inputs: "Inputs", now: datetime) -> "list[Heard]":
    """Let a simulated microphone hear all units but the first, standing as another calibration says."""
    import numpy as np

    from autd_trials.calibration.acoustic.microphone import Microphone, advised_points_mm, listen
    from autd_trials.calibration.file import load_calibration
    from autd_trials.calibration.provenance import Capture

    path = Path(options.acoustic.removeprefix(_SIMULATED))
    truth, digest = load_calibration(path)
    inputs.add("sound", path, digest, Capture(origin="simulated", sensor="simulated microphone", taken=now))
    say(f"the microphone is SIMULATED; the units stand as {path} says")
    generator = np.random.default_rng([options.seed, 1])
    microphone = Microphone(options.microphone_sd_mm, amplitude_only=options.amplitude_only)
    points_mm = advised_points_mm(np.array(options.target or _TARGET_MM), generator)
    units = range(2, len(truth.units) + 1)
    return listen(truth.unit_poses(), units, points_mm, microphone, air.speed_of_sound_m_s, generator)
