"""Units whose sensors watch a target, as the paper's do: the truth is known, what they see is simulated."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensor_model import SensorNoise
from autd_trials.calibration.track import Track

Points = NDArray[np.float64]

DISTANCE_MM = 1200.0


@dataclass(frozen=True)
class Scene:
    """Sensors around the middle of a workspace, which is the origin; `poses` are from sensor to workspace."""

    poses: tuple[RigidMotion, ...]

    @property
    def motions(self) -> list[RigidMotion]:
        """From each sensor's frame to the first one's."""
        return [self.poses[0].inverse().after(pose) for pose in self.poses]

    def seen(
        self,
        points_mm: Points,
        unit: int,
        generator: np.random.Generator,
        noise: SensorNoise = SensorNoise(3.0, 1.0),  # noqa: B008
        bias_mm: float = 0.0,
        scale: float = 0.0,
    ) -> Points:
        """What a unit's sensor sees of points in the workspace."""
        true = self.poses[unit].inverse().apply(points_mm)
        rays = true / np.linalg.norm(true, axis=1, keepdims=True)
        across = generator.standard_normal(true.shape)
        along = (across * rays).sum(axis=1, keepdims=True)
        errors = noise.across_mm * across + (noise.along_mm - noise.across_mm) * along * rays
        seen: Points = true * (1 + scale) + bias_mm * rays + errors
        return seen

    def centre_error_mm(self, motion: RigidMotion, unit: int = 1) -> float:
        """How far a registration puts the workspace's centre from where it is."""
        middle = np.zeros(3)
        mapped = motion.apply(self.poses[unit].inverse().apply(middle))
        return float(np.linalg.norm(mapped - self.poses[0].inverse().apply(middle)))


def scene(*angles_deg: float, generator: np.random.Generator | None = None) -> Scene:
    """Sensors at angles around the vertical, all looking at the workspace, slightly tilted if random."""
    poses = []
    for angle in angles_deg:
        tilt = np.zeros(3) if generator is None else generator.normal(0, 0.05, 3)
        turn = Rotation.from_rotvec([0, np.radians(angle), 0]) * Rotation.from_rotvec(tilt)
        poses.append(RigidMotion(turn.as_matrix(), turn.apply([0, 0, -DISTANCE_MM])))
    return Scene(tuple(poses))


def cube(points: int, half_mm: float, generator: np.random.Generator) -> Points:
    return generator.uniform(-half_mm, half_mm, (points, 3))


def hand_path(
    mean_speed_m_s: float, seconds: float, generator: np.random.Generator
) -> Callable[[Points], Points]:
    """A smooth path within 450 mm of the workspace's centre, from times in s to points in mm."""
    rates = generator.uniform(0.1, 0.6, (3, 4))
    phases = generator.uniform(0, 2 * np.pi, (3, 4))
    sizes = generator.uniform(0.5, 1.0, (3, 4))

    def shape(time_s: Points) -> Points:
        waves: Points = sizes * np.sin(2 * np.pi * rates * time_s[:, None, None] + phases)
        path: Points = waves.sum(axis=2)
        return path

    dense = np.linspace(0, seconds, 3000)
    size_mm = 450 / np.abs(shape(dense)).max(axis=0)
    steps_m = np.linalg.norm(np.diff(shape(dense) * size_mm, axis=0), axis=1) / 1000
    pace = mean_speed_m_s / (steps_m.mean() / (dense[1] - dense[0]))
    return lambda time_s: shape(time_s * pace) * size_mm


def record(
    around: Scene,
    mean_speed_m_s: float,
    seconds: float,
    generator: np.random.Generator,
    *,
    clock_offset_s: float = 0.0,
    jitter_s: float = 0.0,
    outliers: float = 0.0,
    noise: SensorNoise = SensorNoise(3.0, 1.0),  # noqa: B008
    bias_mm: float = 0.0,
) -> list[Track]:
    """Tracks of free-running 30 Hz sensors; every clock but the first one's is ahead by the offset."""
    path = hand_path(mean_speed_m_s, seconds, generator)
    tracks = []
    for unit in range(len(around.poses)):
        true_s = np.arange(0, seconds, 1 / 30) + generator.uniform(0, 1 / 30)
        points = around.seen(path(true_s), unit, generator, noise, bias_mm)
        wrong = generator.random(len(true_s)) < outliers
        points[wrong] = around.poses[unit].inverse().apply(cube(int(wrong.sum()), 500, generator))
        stamps = true_s + clock_offset_s * (unit > 0) + generator.normal(0, jitter_s, len(true_s))
        tracks.append(Track(f"unit {unit + 1}", stamps, points))
    return tracks


def write_track(track: Track, path: Path) -> Path:
    rows = (
        f"{t:.6f},{x:.4f},{y:.4f},{z:.4f}" for t, (x, y, z) in zip(track.time_s, track.points_mm, strict=True)
    )
    path.write_text("\n".join(["t_s,x_mm,y_mm,z_mm", *rows]) + "\n")
    return path


def write_tracks(tracks: Sequence[Track], folder: Path) -> list[str]:
    return [str(write_track(track, folder / f"unit{number}.csv")) for number, track in enumerate(tracks, 1)]
