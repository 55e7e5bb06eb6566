"""How well calibrations come out over random cases: registration, pairing in time, range biases, wand, sound.

Run `python tests/benchmarks/bench_calibration.py [CASES]` (200 cases by default, 5 minutes). Errors are those
of the mapped centre of the workspace in mm. The bound is the Cramer-Rao bound of each case's very points,
computed here from the noise without the code under test.
"""

import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[2]))

import protocols
from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import moved
from autd_trials.calibration.acoustic.microphone import Microphone, advised_points_mm, listen
from autd_trials.calibration.acoustic.refine import refine
from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.joint import SensorNoise, Wand, fit_jointly
from autd_trials.calibration.pairing import pair_interpolated, pair_nearest
from autd_trials.calibration.pose_error import energy_left
from autd_trials.calibration.registration import register_jointly, register_paper
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.robust import NORMAL_MAD_FACTOR
from autd_trials.calibration.sensors.synthetic import SyntheticSensor
from autd_trials.calibration.target import RADIUS_MM, find_target
from autd_trials.calibration.track import Track
from autd_trials.errors import UsageError
from tests.calibration.scenes import Scene, cube, record, scene

NOISE = SensorNoise(3.0, 1.0)
NAMES = ("unit 1", "unit 2")
POINTS = 119
B_MM = (302.0, 225.0, 1000.0)
FAILED_MM = 5.0

Array = NDArray[np.float64]


class Outcome(NamedTuple):
    """One case: errors in mm, the bound or the claimed standard deviation, and energy left."""

    ours_mm: float
    paper_mm: float = np.nan
    sd_mm: float = np.nan
    energy: float = np.nan


def outliers(seed: int, share: float) -> Outcome:
    generator = np.random.default_rng([1, seed])
    around = scene(0, 90, generator=generator)
    cloud = cube(POINTS, 500, generator)
    seen = np.array([around.seen(cloud, unit, generator, NOISE) for unit in (0, 1)])
    wrong = np.arange(POINTS) < share * POINTS
    seen[1, wrong] = around.poses[1].inverse().apply(cube(int(wrong.sum()), 500, generator))
    bound_mm = cramer_rao_mm(around, cloud[~wrong])
    ours = register_jointly(seen, NAMES, generator, NOISE)
    paper = register_paper(seen, NAMES, NORMAL_MAD_FACTOR)
    return Outcome(
        around.centre_error_mm(ours.motions[1]), around.centre_error_mm(paper.motions[1]), bound_mm
    )


def cramer_rao_mm(around: Scene, cloud_mm: Array) -> float:
    """Root of the summed variances of the mapped workspace's centre that no unbiased estimate can beat.

    A pair's difference has the sum of both sensors' covariances; its mean moves with a shift t and a turn w
    about the centre as t + w x p. So the information is the sum of J^T S^-1 J with J = [I, -[p]x].
    """
    information = np.zeros((6, 6))
    for point in cloud_mm:
        spread = np.zeros((3, 3))
        for pose in around.poses:
            ray = point - pose.translation_mm
            ray = ray / np.linalg.norm(ray)
            spread += NOISE.across_mm**2 * np.eye(3)
            spread += (NOISE.along_mm**2 - NOISE.across_mm**2) * np.outer(ray, ray)
        x, y, z = point
        lever = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
        information += lever.T @ np.linalg.solve(spread, lever)
    return float(np.sqrt(np.trace(np.linalg.inv(information)[:3, :3])))


def biased(seed: int, bias_mm: float) -> Outcome:
    generator = np.random.default_rng([2, seed])
    around = scene(0, 60, generator=generator)
    cloud = cube(POINTS, 500, generator)
    seen = np.array([around.seen(cloud, unit, generator, NOISE, bias_mm) for unit in (0, 1)])
    ours = register_jointly(seen, NAMES, generator, NOISE, range_bias=True)
    paper = register_paper(seen, NAMES, NORMAL_MAD_FACTOR)
    assert ours.joint is not None
    x, y, z = around.poses[0].inverse().apply(np.zeros(3)) - ours.joint.centre_mm
    lever = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
    sd_mm = float(np.sqrt(np.trace(lever @ ours.joint.pose_covariance(1) @ lever.T)))
    return Outcome(around.centre_error_mm(ours.motions[1]), around.centre_error_mm(paper.motions[1]), sd_mm)


def scaled(seed: int) -> Outcome:
    """Range scale 2 % and bias 5 mm; a wand of 300 mm in 60 poses."""
    generator = np.random.default_rng([3, seed])
    around = scene(0, 90, generator=generator)
    cloud = cube(POINTS, 500, generator)
    seen = np.array([around.seen(cloud, unit, generator, NOISE, 5, 0.02) for unit in (0, 1)])
    middles, directions = cube(60, 400, generator), generator.standard_normal((60, 3))
    half = 150 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    wands = []
    for unit in (0, 1):
        ends = [around.seen(middles + side * half, unit, generator, NOISE, 5, 0.02) for side in (1, -1)]
        wands.append(Wand(ends[0], ends[1], 300.0))
    ours = fit_jointly(seen, around.motions, NOISE, wands=wands)
    paper = register_paper(seen, NAMES, NORMAL_MAD_FACTOR)
    return Outcome(around.centre_error_mm(ours.motions[1]), around.centre_error_mm(paper.motions[1]))


def timed(seed: int, speed_m_s: float) -> Outcome:
    """30 s at 30 Hz, clocks 20 ms apart, stamps jittering by 2 ms; the paper: 119 of the points."""
    generator = np.random.default_rng([4, seed])
    around = scene(0, 90, generator=generator)
    tracks = record(around, speed_m_s, 30, generator, clock_offset_s=0.02, jitter_s=0.002)
    pairs = pair_interpolated(tracks[0], tracks[1], generator)
    seen = np.array([tracks[0].points_mm, pairs.points_mm])
    velocities = np.array([np.zeros_like(pairs.velocities_mm_s), pairs.velocities_mm_s])
    ours = register_jointly(seen, NAMES, generator, NOISE, velocities_mm_s=velocities)
    chosen = np.sort(generator.choice(len(tracks[0].time_s), POINTS, replace=False))
    few = Track(NAMES[0], tracks[0].time_s[chosen], tracks[0].points_mm[chosen])
    paper = register_paper(
        np.array([few.points_mm, pair_nearest(few, tracks[1]).points_mm]), NAMES, NORMAL_MAD_FACTOR
    )
    return Outcome(around.centre_error_mm(ours.motions[1]), around.centre_error_mm(paper.motions[1]))


def heard(seed: int, shift_mm: float, turn_deg: float, amplitude_only: bool) -> Outcome:
    """32 microphone points known to 0.1 mm, 54 transducers of unit 2, air 1 degree (sd) from what is told."""
    generator = np.random.default_rng([5, seed])
    units = load_calibration(Path(protocols.__path__[0], "rigs", "emulated-calibration.yaml"))[0].unit_poses()
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
    return Outcome(error_mm, energy=energy_left(units, [units[0], found], B_MM, air))


def direction(generator: np.random.Generator) -> Array:
    """A random unit vector."""
    vector = Rotation.random(random_state=generator).apply([0.0, 0.0, 1.0])
    return np.asarray(vector)


class Case(NamedTuple):
    """A row of the table."""

    name: str
    run: Callable[..., Outcome]
    arguments: tuple[float | bool, ...]


CASES = [
    Case("clean, 90 deg", outliers, (0.0,)),
    Case("30 % outliers", outliers, (0.3,)),
    Case("50 % outliers", outliers, (0.5,)),
    Case("60 % outliers", outliers, (0.6,)),
    Case("range bias 20 mm, 60 deg", biased, (20.0,)),
    Case("range scale 2 %, wand", scaled, ()),
    Case("20 ms, 0.3 m/s", timed, (0.3,)),
    Case("20 ms, 1 m/s", timed, (1.0,)),
    Case("sound, 20 mm / 1 deg", heard, (20.0, 1.0, False)),
    Case("sound, 40 mm / 3 deg", heard, (40.0, 3.0, False)),
    Case("sound, amplitudes only", heard, (20.0, 1.0, True)),
]


def attempt(job: tuple[Case, int]) -> Outcome | None:
    """Run one case; None if it was refused."""
    case, seed = job
    try:
        return case.run(seed, *case.arguments)
    except UsageError:
        return None


def main() -> None:
    """Print the table."""
    cases = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    columns = (
        "case",
        "failed",
        "median",
        "rms",
        "bound",
        "rms/bound",
        "95 %",
        "within 2 sd",
        "paper",
        "energy 5 %",
    )
    table = Table(*columns, title=f"{cases} random cases each; errors of the centre in mm", box=None)
    start_s = time.perf_counter()
    with ProcessPoolExecutor() as pool:
        for case in CASES:
            outcomes = list(pool.map(attempt, [(case, seed) for seed in range(cases)], chunksize=5))
            table.add_row(case.name, *summary([each for each in outcomes if each is not None], cases))
    Console(width=120).print(table)
    print(f"the target is found in {find_target_ms():.1f} ms a frame of 512 x 424 (limit 10)")
    print(f"{time.perf_counter() - start_s:.0f} s")


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


def summary(outcomes: list[Outcome], cases: int) -> list[str]:
    """Return a row: a failure is a refusal, or an error over 5 mm."""
    ours, paper, sd, energy = (np.array(column) for column in zip(*outcomes, strict=True))
    failed = cases - len(ours) + int((ours > FAILED_MM).sum())
    rms = float(np.sqrt((ours**2).mean()))
    bound = float(np.sqrt((sd**2).mean()))
    numbers = [np.median(ours), rms, bound, rms / bound, np.quantile(ours, 0.95)]
    within = np.nan if np.isnan(sd).any() else float((ours < 2 * sd).mean())
    numbers += [within, np.median(paper), np.nan if np.isnan(energy).any() else np.quantile(energy, 0.05)]
    return [str(failed), *("" if np.isnan(number) else f"{number:.3f}" for number in numbers)]


if __name__ == "__main__":
    main()
