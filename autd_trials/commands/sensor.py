"""`autd-trials sensor`: watch the target from one unit, and send what is seen to the master."""

import argparse
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.commands.arguments import positive
from autd_trials.commands.output import print_json, say
from autd_trials.errors import StoppedByPerson, UsageError

if TYPE_CHECKING:
    from types import FrameType

    from autd_trials.calibration.network.outlet import SightingOutlet
    from autd_trials.calibration.sensors.frame import Sensor

_FRAME_RATE_HZ = 30.0
_SAY_EVERY_S = 10.0
_FEW_SIGHTINGS = 0.3
_A_LITTLE_S = 1e-6  # rounding in times of frames


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("--unit", type=int, required=True, metavar="N", help="number of the unit, from 1")
    parser.add_argument(
        "--sensor",
        required=True,
        metavar="KIND",
        help="realsense[:SERIAL], replay:FOLDER, or synthetic[:SCENE], which is simulated (emulated)",
    )
    parser.add_argument(
        "--record", type=Path, metavar="FOLDER", help="write the frames down (1 GB a minute or so)"
    )
    parser.add_argument("--seconds", type=positive, metavar="S", help="stop after so long (never)")
    parser.add_argument(
        "--radius-mm", type=positive, metavar="MM", help="from the target's surface to its centre (12.07)"
    )
    parser.add_argument(
        "--speed",
        type=positive,
        default=1.0,
        metavar="F",
        help="synthetic: how much faster than real time (1)",
    )
    parser.add_argument(
        "--seed", type=int, default=1, metavar="N", help="synthetic: of the sensor's noise (1)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object at the end")


@dataclass
class _Counts:
    frames: int = 0
    sightings: int = 0


def execute(options: argparse.Namespace) -> int:
    """Send sightings until the sensor ends, the time is over or a person stops it."""
    import numpy as np

    from autd_trials.calibration.network.outlet import SightingOutlet
    from autd_trials.calibration.network.stream import NodeHeader

    if options.unit < 1:
        raise UsageError(f"--unit is {options.unit}", do="units are numbered from 1")
    sensor = _recorded(_sensor(options), options.record)
    run = int(np.random.default_rng().integers(1, 2**31))
    counts = _Counts()
    with suppress(StoppedByPerson), ExitStack() as stack:
        stack.enter_context(_stopped_by_signals())
        stack.enter_context(sensor)
        header = NodeHeader(options.unit, run, sensor.capture, sensor.intrinsics)
        outlet = stack.enter_context(SightingOutlet(header, _FRAME_RATE_HZ))
        say(f"unit {options.unit}: {_described(sensor)} sends as run {run}; Ctrl-C stops it")
        _send_all(sensor, outlet, counts, options)
    if options.json:
        print_json({"unit": options.unit, "run": run, "frames": counts.frames, "sightings": counts.sightings})
    else:
        say(f"unit {options.unit}: {counts.frames} frames, target seen in {counts.sightings}")
    return 0


def _described(sensor: "Sensor") -> str:
    capture = sensor.capture
    taken = "" if capture.taken is None else f", recorded at {capture.taken.isoformat()}"
    return f"{capture.sensor or 'sensor'} {capture.serial} ({capture.origin}{taken})"


def _send_all(
    sensor: "Sensor", outlet: "SightingOutlet", counts: _Counts, options: argparse.Namespace
) -> None:
    from autd_trials.calibration.target import RADIUS_MM, find_target

    radius_mm = options.radius_mm or RADIUS_MM
    first_s: float | None = None
    said = _Counts()
    for frame in sensor:
        first_s = frame.time_s if first_s is None else first_s
        if options.seconds is not None and frame.time_s - first_s >= options.seconds - _A_LITTLE_S:
            break
        sighting = find_target(frame, sensor.intrinsics, radius_mm)
        outlet.send(frame, sighting)
        counts.frames += 1
        counts.sightings += sighting is not None
        if counts.frames - said.frames >= _SAY_EVERY_S * _FRAME_RATE_HZ:
            _say_progress(options.unit, counts, said)
            said = _Counts(counts.frames, counts.sightings)


def _say_progress(unit: int, counts: _Counts, before: _Counts) -> None:
    frames, sightings = counts.frames - before.frames, counts.sightings - before.sightings
    say(f"unit {unit}: {counts.frames} frames; target seen in {sightings} of the last {frames}")
    if sightings < _FEW_SIGHTINGS * frames:
        say(
            "  -> show the target to this sensor; if it shines so brightly that its depth is lost, cover the "
            "infrared camera with infrared-cut film"
        )


def _sensor(options: argparse.Namespace) -> "Sensor":
    from autd_trials.calibration.sensors.realsense import find_realsense
    from autd_trials.calibration.sensors.replay import ReplaySensor

    kind, _, which = options.sensor.partition(":")
    if kind == "synthetic":
        return _synthetic(options, which or "emulated")
    if options.speed != 1:
        raise UsageError("--speed is for synthetic sensors", do="leave it out")
    if kind == "replay":
        return ReplaySensor(Path(which))
    if kind == "realsense":
        return find_realsense(which or None)
    raise UsageError(f"there is no sensor {kind!r}", do="name realsense, replay:FOLDER or synthetic")


def _synthetic(options: argparse.Namespace, scene: str) -> "Sensor":
    """Return a simulated sensor whose clock is that of Lab Streaming Layer, times the speed."""
    import time

    import numpy as np
    import pylsl

    from autd_trials.calibration.sensors.scene import LoadedScene
    from autd_trials.yamlfile.shipped import find_file

    def wait_until(time_s: float) -> None:
        time.sleep(max(0.0, time_s / options.speed - pylsl.local_clock()))

    generator = np.random.default_rng([options.seed, options.unit])
    path = find_file(scene, kind="scene", folder="scenes")
    start_s = pylsl.local_clock() * options.speed + generator.uniform(0, 1 / _FRAME_RATE_HZ)
    say(f"unit {options.unit}: SIMULATED sensor in the made-up scene {path.stem}")
    return LoadedScene(path).sensor(options.unit, generator, start_s=start_s, wait_until=wait_until)


def _recorded(sensor: "Sensor", folder: Path | None) -> "Sensor":
    from autd_trials.calibration.sensors.replay import RecordingSensor

    return (
        sensor
        if folder is None
        else RecordingSensor(sensor, folder, datetime.now(UTC).replace(microsecond=0))
    )


@contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the loop where it is."""

    def stop(_signal: int, _frame: "FrameType | None") -> None:
        raise StoppedByPerson("stopped")

    before = {each: signal.signal(each, stop) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
