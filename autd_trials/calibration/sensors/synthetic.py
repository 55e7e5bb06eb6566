"""A simulated depth sensor that watches a simulated target.

Simulated, not measured: the target is a sphere; brightness is even over its disc with anti-aliased edges;
depth errs by one normal error a frame and one a pixel, and by a constant bias along the viewing ray.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.provenance import Capture
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensors.frame import Frame, Intrinsics
from autd_trials.calibration.sensors.hand import HandPath

KINECT_V2 = Intrinsics(512, 424, 366.0, 366.0, 256.0, 212.0)
"""Size and focal length of the paper's sensor, rounded."""

FRAME_RATE_HZ = 30.0

_WALL_M = 3.0
_DARK, _BRIGHT, _LARGEST = 300.0, 30_000.0, 65_535.0
_DARK_NOISE = 60.0
_MARGIN_PX = 4


@dataclass(frozen=True)
class Reflector:
    """Something else that shines: a sphere that stands still in the sensor's frame."""

    centre_mm: tuple[float, float, float]
    radius_mm: float


@dataclass(frozen=True)
class Imperfections:
    """What is wrong with the sensor and its surroundings.

    Attributes
    ----------
    frame_noise_mm, pixel_noise_mm
        Standard deviations of the range, common to a frame and of each pixel.
    range_bias_mm
        Constant error of the range.
    saturated
        Whether the target blinds the infrared camera, as without an infrared-cut film: a bloom of twice its
        size, and no depth in its middle.
    dropouts
        Share of frames in which the target is not seen.
    reflectors
        Other things that shine.
    """

    frame_noise_mm: float = 3.0
    pixel_noise_mm: float = 2.0
    range_bias_mm: float = 0.0
    saturated: bool = False
    dropouts: float = 0.0
    reflectors: tuple[Reflector, ...] = ()


class SyntheticSensor:
    """Renders the target as a posed sensor would see it.

    Parameters
    ----------
    pose
        From the sensor's frame (x right, y down, z forward) to the path's.
    path
        Where the target is when.
    radius_mm
        The target's radius.
    wait_until
        Waits for a frame's time in s and returns it, so that the sensor runs in real time; times go up in
        steps of 1/30 s from the first one.
    start_s
        Time of the first frame.
    generator
        Where noise comes from.
    imperfections
        What is wrong.
    frames
        How many frames there are; without end if None.
    """

    capture = Capture(origin="simulated", sensor="synthetic", serial="synthetic")
    intrinsics = KINECT_V2

    def __init__(
        self,
        pose: RigidMotion,
        path: HandPath,
        radius_mm: float,
        generator: np.random.Generator,
        *,
        start_s: float = 0.0,
        wait_until: Callable[[float], None] = lambda _time_s: None,
        imperfections: Imperfections | None = None,
        frames: int | None = None,
    ) -> None:
        self._to_sensor = pose.inverse()
        self._path = path
        self._radius_mm = radius_mm
        self._generator = generator
        self._start_s = start_s
        self._wait_until = wait_until
        self._wrong = imperfections or Imperfections()
        self._frames = frames

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        return None

    def __iter__(self) -> Iterator[Frame]:
        number = 0
        while self._frames is None or number < self._frames:
            time_s = self._start_s + number / FRAME_RATE_HZ
            self._wait_until(time_s)
            yield self._render(time_s, number)
            number += 1

    def _render(self, time_s: float, number: int) -> Frame:
        camera = self.intrinsics
        shape = (camera.height, camera.width)
        infrared = self._generator.normal(_DARK, _DARK_NOISE, shape)
        depth_m = np.full(shape, _WALL_M, dtype=np.float32)
        for reflector in self._wrong.reflectors:
            self._add_sphere(np.array(reflector.centre_mm), reflector.radius_mm, infrared, depth_m)
        if self._generator.random() >= self._wrong.dropouts:
            target_mm = self._to_sensor.apply(self._path(np.array([time_s])))[0]
            self._add_sphere(target_mm, self._radius_mm, infrared, depth_m, blinding=self._wrong.saturated)
        bright = np.clip(infrared, 0, _LARGEST).astype(np.uint16)
        return Frame(bright, depth_m, time_s, "synthetic", number)

    def _add_sphere(
        self,
        centre_mm: Vectors,
        radius_mm: float,
        infrared: NDArray[np.float64],
        depth_m: NDArray[np.float32],
        *,
        blinding: bool = False,
    ) -> None:
        camera = self.intrinsics
        if centre_mm[2] <= radius_mm:
            return
        u, v = camera.project(centre_mm)
        size_px = camera.fx * radius_mm / centre_mm[2]
        bloom_px = 2 * size_px if blinding else size_px
        rows = _window(v, bloom_px, camera.height)
        columns = _window(u, bloom_px, camera.width)
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return
        grid_v, grid_u = np.mgrid[rows, columns]
        away_px = np.hypot(grid_u - u, grid_v - v)
        covered = np.clip(bloom_px - away_px + 0.5, 0, 1)
        infrared[rows, columns] += covered * (4 * _LARGEST if blinding else _BRIGHT)
        inside = away_px <= size_px
        surface_mm = self._surface_depth_mm(centre_mm, radius_mm, grid_u, grid_v)
        known = inside & ~(blinding & (away_px < 0.6 * size_px))
        part = depth_m[rows, columns]
        part[inside] = 0.0
        part[known] = surface_mm[known] / 1000

    def _surface_depth_mm(
        self, centre_mm: Vectors, radius_mm: float, u: NDArray[np.int64], v: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return the depth at which the pixels' rays enter the sphere, with its errors."""
        camera = self.intrinsics
        rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1)
        lengths = np.linalg.norm(rays, axis=-1)
        along = rays @ centre_mm / lengths
        inside = np.maximum(radius_mm**2 - (centre_mm @ centre_mm - along**2), 0)
        noise_mm = self._generator.normal(0, self._wrong.pixel_noise_mm, u.shape)
        noise_mm += self._generator.normal(0, self._wrong.frame_noise_mm)
        ranges_mm = along - np.sqrt(inside) + noise_mm + self._wrong.range_bias_mm
        depths: NDArray[np.float64] = ranges_mm / lengths
        return depths


def _window(middle_px: float, size_px: float, length: int) -> slice:
    first = max(0, int(middle_px - size_px) - _MARGIN_PX)
    return slice(first, max(first, min(length, int(middle_px + size_px) + _MARGIN_PX)))
