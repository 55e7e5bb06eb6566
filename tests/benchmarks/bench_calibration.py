"""How well calibrations come out over random cases, as a user gets them by default.

Run `python tests/benchmarks/bench_calibration.py [CASES]`: 20 cases a row by default, 200 for the table in
docs/calibration.md (an hour). Errors in mm are those of the workspace's centre, mapped by unit 2's pose.
Every row is run twice: with the default settings and range errors drawn for each sensor from its prior, and
with sensors whose ranges are right and settings that say so. *Inside* is how often the truth lies in the 95 %
ellipsoid of the reported covariance (chi-square, 3 degrees of freedom).
"""

import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[2]))

from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import moved
from autd_trials.calibration.acoustic.microphone import Microphone, advised_points_mm, listen
from autd_trials.calibration.acoustic.refine import refine
from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.pairing import pair_interpolated
from autd_trials.calibration.pose_error import energy_left
from autd_trials.calibration.registration import register_jointly
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensor_model import SensorNoise
from autd_trials.calibration.sensors.synthetic import SyntheticSensor
from autd_trials.calibration.target import RADIUS_MM, find_target
from autd_trials.errors import UsageError
from autd_trials.yamlfile.shipped import find_file
from tests.calibration.scenes import record, scene
from tests.calibration.situations import Judged, Situation, judge

B_MM = (302.0, 225.0, 1000.0)
FEW = 20

Array = NDArray[np.float64]

SITUATIONS = [
    Situation("119 points, 20 deg", (0, 20)),
    Situation("119 points, 60 deg", (0, 60)),
    Situation("119 points, 90 deg", (0, 90)),
    Situation("119 points, 180 deg", (0, 180)),
    Situation("119 points, 3 units", (0, 60, 120)),
    Situation("119 points, 4 units", (0, 45, 90, 135)),
    Situation("30 % outliers", wrong=0.3),
    Situation("50 % outliers", wrong=0.5),
    Situation("60 % outliers", wrong=0.6),
    Situation("heavy tails (t, 3 df)", heavy_tails=True),
    Situation("noise 2 mm all round", noise=SensorNoise(2.0, 2.0)),
    Situation("noise 1 mm along, 3 across", noise=SensorNoise(1.0, 3.0)),
    Situation("bias 20 mm, 60 deg", (0, 60), bias_mm=20.0, scale=0.0),
    Situation("no range error, 90 deg", bias_mm=0.0, scale=0.0),
    Situation("scale 0.5 %, bias 2 mm", bias_mm=2.0, scale=0.005),
    Situation("scale 2 %, bias 5 mm, wand", bias_mm=5.0, scale=0.02, wand=True),
    Situation("no viewpoint, 39 points, 10 mm", points=39, noise=SensorNoise(10.0, 10.0), viewpoint=False),
    Situation("no viewpoint, 1000 points", points=1000, noise=SensorNoise(10.0, 10.0), viewpoint=False),
    Situation("30 Hz, 0.15 m/s", speed_m_s=0.15),
    Situation("30 Hz, 1 m/s", speed_m_s=1.0),
    Situation("120 Hz, 0.15 m/s", speed_m_s=0.15, rate_hz=120.0),
    Situation("120 Hz, 1 m/s", speed_m_s=1.0, rate_hz=120.0),
    Situation("30 Hz, 3 units", (0, 60, 120), speed_m_s=0.5),
    Situation("30 Hz, noise over 0.2 s", speed_m_s=0.5, correlated_s=0.2),
    Situation("30 Hz, noise over 1 s", speed_m_s=0.5, correlated_s=1.0),
]


def attempt(situation: Situation, right_ranges: bool, seed: int) -> Judged | None:
    """Run one case; None if it was refused."""
    try:
        return judge(situation, seed, right_ranges=right_ranges)
    except UsageError:
        return None


def main() -> None:
    """Print the tables."""
    cases = int(sys.argv[1]) if len(sys.argv) > 1 else FEW
    start_s = time.perf_counter()
    with ProcessPoolExecutor() as pool:
        _print_judged(pool, cases)
        _print_sound(pool, cases)
    print(f"the target is found in {find_target_ms():.1f} ms a frame of 512 x 424 (limit 10)")
    print(f"tracks of 20,000 rows are registered in {long_tracks_s():.1f} s (limit 10)")
    print(f"{time.perf_counter() - start_s:.0f} s")


def _print_judged(pool: ProcessPoolExecutor, cases: int) -> None:
    half = ("refused", "rms", "claimed", "inside", "paper rms")
    table = Table("situation", *half, *half, title=f"{cases} random cases a row; mm", box=None)
    table.add_row("", "range errors", *[""] * 4, "right ranges")
    for situation in SITUATIONS:
        cells: list[str] = []
        fixed = situation.wand or situation.bias_mm is not None or not situation.viewpoint
        for right_ranges in (False,) if fixed else (False, True):
            run = partial(attempt, situation, right_ranges)
            outcomes = list(pool.map(run, range(cases), chunksize=5))
            cells += summary([each for each in outcomes if each is not None], cases)
        table.add_row(situation.name, *cells)
    Console(width=140).print(table)


def summary(outcomes: list[Judged], cases: int) -> list[str]:
    """Return half a row."""
    errors, claims, inside, _, paper = (
        np.array(column, dtype=float) for column in zip(*outcomes, strict=True)
    )
    sizes = [float(np.sqrt((each**2).mean())) for each in (errors, claims)]
    paper_rms = float(np.sqrt((paper**2).mean()))
    return [
        str(cases - len(outcomes)),
        *(f"{size:.2f}" for size in sizes),
        f"{inside.mean():.1%}",
        f"{paper_rms:.2f}",
    ]


def long_tracks_s() -> float:
    """Return how long pairing and registering two tracks of 20,000 rows take."""
    generator = np.random.default_rng(1)
    tracks = record(scene(0, 90), 0.5, 20_000 / 30, generator, clock_offset_s=0.3)
    start_s = time.perf_counter()
    pairs = pair_interpolated(tracks[0], tracks[1], generator)
    seen = np.array([tracks[0].points_mm, pairs.points_mm])
    velocities = np.array([np.zeros_like(pairs.velocities_mm_s), pairs.velocities_mm_s])
    register_jointly(seen, [track.name for track in tracks], generator, velocities_mm_s=velocities)
    return time.perf_counter() - start_s


class Sound(NamedTuple):
    """A row of the table of acoustic refinements: how wrong the start is, and what the microphone gives."""

    name: str
    shift_mm: float
    turn_deg: float
    amplitude_only: bool


SOUNDS = [
    Sound("sound, 20 mm / 1 deg", 20.0, 1.0, False),
    Sound("sound, 40 mm / 3 deg", 40.0, 3.0, False),
    Sound("sound, amplitudes only", 20.0, 1.0, True),
]


def _print_sound(pool: ProcessPoolExecutor, cases: int) -> None:
    table = Table("situation", "refused", "median", "rms", "95 %", "energy 5 %", box=None)
    for sound in SOUNDS:
        outcomes = [each for each in pool.map(partial(hear, sound), range(cases), chunksize=5) if each]
        errors, energies = np.array(outcomes).T
        numbers = [np.median(errors), np.sqrt((errors**2).mean()), np.quantile(errors, 0.95)]
        numbers.append(np.quantile(energies, 0.05))
        table.add_row(sound.name, str(cases - len(outcomes)), *(f"{number:.3f}" for number in numbers))
    Console(width=140).print(table)


def hear(sound: Sound, seed: int) -> tuple[float, float] | None:
    """Run one refinement; return its error in mm and the energy that is left, None if it was refused."""
    try:
        return heard(seed, sound.shift_mm, sound.turn_deg, sound.amplitude_only)
    except UsageError:
        return None


def heard(seed: int, shift_mm: float, turn_deg: float, amplitude_only: bool) -> tuple[float, float]:
    """32 microphone points known to 0.1 mm, 54 transducers of unit 2, air 1 degree (sd) from what is told."""
    generator = np.random.default_rng([5, seed])
    shipped = find_file("emulated-calibration", kind="calibration", folder="rigs")
    units = load_calibration(shipped)[0].unit_poses()
    shift, turn = (size * direction(generator) for size in (shift_mm, turn_deg))
    start = [units[0], moved(units[1], shift, turn)]
    air, microphone = Air(20.0), Microphone(0.1, amplitude_only=amplitude_only)
    speed_m_s = Air(20.0 + generator.standard_normal()).speed_of_sound_m_s
    points_mm = advised_points_mm(np.array(B_MM), generator)
    found = refine(
        start,
        listen(units, (2,), points_mm, microphone, speed_m_s, generator),
        speed_of_sound_m_s=air.speed_of_sound_m_s,
        microphone_sd_mm=0.1,
        generator=generator,
    ).units[1]
    mapped = found.rotation @ units[1].rotation.T @ (np.array(B_MM) - units[1].translation_mm)
    error_mm = float(np.linalg.norm(mapped + found.translation_mm - np.array(B_MM)))
    return error_mm, energy_left(units, [units[0], found], B_MM, air)


def direction(generator: np.random.Generator) -> Array:
    """A random unit vector."""
    vector = Rotation.random(random_state=generator).apply([0.0, 0.0, 1.0])
    return np.asarray(vector)


def find_target_ms() -> float:
    """Return the time that finding the target takes, target 0.5 m away, where it is largest."""
    place = np.array([[0.0, 0.0, 500.0]])
    sensor = SyntheticSensor(
        RigidMotion.identity(), lambda _time_s: place, RADIUS_MM, np.random.default_rng(1), frames=50
    )
    frames = list(sensor)
    start_s = time.process_time()
    for frame in frames:
        find_target(frame, sensor.intrinsics)
    return 1000 * (time.process_time() - start_s) / len(frames)


if __name__ == "__main__":
    main()
