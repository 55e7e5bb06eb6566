"""Situations in which units are calibrated, and what a user gets there: errors, and what is claimed."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

from autd_trials.calibration.normal_equations import Wand
from autd_trials.calibration.pairing import pair_interpolated
from autd_trials.calibration.registration import Registered, register_jointly, register_paper
from autd_trials.calibration.robust import NORMAL_MAD_FACTOR
from autd_trials.calibration.sensor_model import Sensor, SensorNoise
from autd_trials.calibration.settings import Settings
from autd_trials.calibration.track import Track
from tests.calibration.scenes import Scene, cube, hand_path, scene

INSIDE_CHI2 = float(chi2.ppf(0.95, 3))
_CLOCK_OFFSET_S, _JITTER_S = 0.02, 0.002
_DEGREES_OF_HEAVY_TAILS = 3


@dataclass(frozen=True)
class Situation:
    """Units and what their sensors see; points one by one, or tracks of a hand with some mean speed.

    `bias_mm` and `scale` are the range errors of all sensors; None draws them for each from its prior.
    `correlated_s` is the time after which the noise's autocorrelation is down to 1/e.
    """

    name: str
    angles_deg: tuple[float, ...] = (0, 90)
    points: int = 119
    speed_m_s: float | None = None
    rate_hz: float = 30.0
    seconds: float = 20.0
    noise: SensorNoise = field(default_factory=SensorNoise)
    heavy_tails: bool = False
    correlated_s: float = 0.0
    wrong: float = 0.0
    viewpoint: bool = True
    wand: bool = False
    bias_mm: float | None = None
    scale: float | None = None


class Judged(NamedTuple):
    """One case, at the workspace's centre as the second unit has it: mm, and whether the truth is inside."""

    error_mm: float
    claimed_sd_mm: float
    inside: bool
    corrected: bool
    paper_mm: float


def judge(situation: Situation, seed: int, *, right_ranges: bool = False) -> Judged:
    """Return how a random case comes out with the default settings.

    With right ranges the sensors have no range errors, and the settings say so.
    """
    generator = np.random.default_rng([11, seed])
    around = scene(*situation.angles_deg, generator=generator)
    units = range(len(situation.angles_deg))
    errors = [(0.0, 0.0) if right_ranges else _range_error(situation, generator) for _ in units]
    names = [f"unit {unit + 1}" for unit in units]
    settings = Settings(range_bias=False, range_scale_sd=0.0) if right_ranges else Settings()
    sensors = [settings.sensor(viewpoint=situation.viewpoint) for _ in units]
    velocities = None
    if situation.speed_m_s is None:
        cloud = cube(situation.points, 500, generator)
        seen = np.array([_seen(situation, around, cloud, unit, errors[unit], generator) for unit in units])
    else:
        seen, velocities = _tracked(situation, around, errors, generator)
    wands = _wands(around, errors, generator) if situation.wand else []
    found = register_jointly(seen, names, generator, sensors, velocities_mm_s=velocities, wands=wands)
    paper = register_paper(seen, names, NORMAL_MAD_FACTOR)
    error, covariance = _at_the_centre(found, around)
    assert found.joint is not None
    return Judged(
        error_mm=float(np.linalg.norm(error)),
        claimed_sd_mm=float(np.sqrt(np.trace(covariance))),
        inside=bool(error @ np.linalg.solve(covariance, error) < INSIDE_CHI2),
        corrected=found.joint.range_corrected,
        paper_mm=around.centre_error_mm(paper.motions[1]),
    )


def _range_error(situation: Situation, generator: np.random.Generator) -> tuple[float, float]:
    if not situation.viewpoint:
        return 0.0, 0.0
    drawn = generator.normal(0, (Sensor.bias_sd_mm, Sensor.scale_sd))
    bias_mm = drawn[0] if situation.bias_mm is None else situation.bias_mm
    scale = drawn[1] if situation.scale is None else situation.scale
    return float(bias_mm), float(scale)


def _seen(
    situation: Situation,
    around: Scene,
    points_mm: NDArray[np.float64],
    unit: int,
    error: tuple[float, float],
    generator: np.random.Generator,
) -> NDArray[np.float64]:
    right = around.seen(points_mm, unit, generator, SensorNoise(0.0, 0.0), *error)
    noise = around.seen(points_mm, unit, generator, situation.noise, *error) - right
    if situation.heavy_tails:
        squares = generator.chisquare(_DEGREES_OF_HEAVY_TAILS, (len(noise), 1))
        noise = noise / np.sqrt(squares / _DEGREES_OF_HEAVY_TAILS)
    if situation.correlated_s:
        rho = float(np.exp(-1 / (situation.correlated_s * situation.rate_hz)))
        noise = lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], noise, axis=0)
    seen = right + noise
    wrong = (generator.random(len(seen)) < situation.wrong) & (unit > 0)
    seen[wrong] = around.poses[unit].inverse().apply(cube(int(wrong.sum()), 500, generator))
    return np.asarray(seen)


def _tracked(
    situation: Situation, around: Scene, errors: list[tuple[float, float]], generator: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    assert situation.speed_m_s is not None
    path = hand_path(situation.speed_m_s, situation.seconds, generator)
    tracks = []
    for unit, error in enumerate(errors):
        frame_s = 1 / situation.rate_hz
        true_s = np.arange(0, situation.seconds, frame_s) + generator.uniform(0, frame_s)
        points_mm = _seen(situation, around, path(true_s), unit, error, generator)
        stamps_s = true_s + _CLOCK_OFFSET_S * (unit > 0) + generator.normal(0, _JITTER_S, len(true_s))
        later = np.append(True, np.diff(np.maximum.accumulate(stamps_s)) > 0)
        tracks.append(Track(f"unit {unit + 1}", stamps_s[later], points_mm[later]))
    pairs = [pair_interpolated(tracks[0], track, generator) for track in tracks[1:]]
    seen = np.array([tracks[0].points_mm, *(each.points_mm for each in pairs)])
    still = np.zeros_like(tracks[0].points_mm)
    return seen, np.array([still, *(each.velocities_mm_s for each in pairs)])


def _wands(around: Scene, errors: list[tuple[float, float]], generator: np.random.Generator) -> list[Wand]:
    middles, directions = cube(60, 400, generator), generator.standard_normal((60, 3))
    half = 150 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    wands = []
    for unit, error in enumerate(errors):
        ends = [
            around.seen(middles + side * half, unit, generator, SensorNoise(), *error) for side in (1, -1)
        ]
        wands.append(Wand(ends[0], ends[1], 300.0))
    return wands


def _at_the_centre(found: Registered, around: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return error and reported covariance of the workspace's centre, mapped by the second unit's pose."""
    assert found.joint is not None
    true_mm = around.poses[0].inverse().apply(np.zeros(3))
    mapped_mm = found.motions[1].apply(around.poses[1].inverse().apply(np.zeros(3)))
    x, y, z = true_mm - found.joint.centre_mm
    lever = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
    covariance = lever @ found.joint.pose_covariance(1) @ lever.T
    return mapped_mm - true_mm, covariance
