"""What a depth sensor gives, whoever made it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.provenance import Capture


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera: size in pixels, focal lengths and principal point in pixels; no distortion."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def ray(self, u: float, v: float) -> Vectors:
        """Return the point at a depth of 1 that is seen at column u, row v; x right, y down, z forward."""
        return np.array([(u - self.cx) / self.fx, (v - self.cy) / self.fy, 1.0])

    def project(self, point: Vectors) -> tuple[float, float]:
        """Return column and row of a point, shape (3,), in front of the camera."""
        x, y, z = point
        return float(self.fx * x / z + self.cx), float(self.fy * y / z + self.cy)


@dataclass(frozen=True, eq=False)
class Frame:
    """One capture.

    Attributes
    ----------
    infrared
        Brightness, shape (height, width), 8 or 16 bits.
    depth_m
        Distance along the optical axis in m, shape (height, width); 0 where unknown.
    time_s
        When it was captured.
    clock
        Which clock `time_s` is of.
    sequence
        The sensor's own number of the capture; a missing number is a lost frame.
    """

    infrared: NDArray[np.uint16]
    depth_m: NDArray[np.float32]
    time_s: float
    clock: str
    sequence: int


class Sensor(Protocol):
    """A depth sensor: entered, it runs; iterated, it gives frames until it has no more."""

    @property
    def capture(self) -> Capture:
        """Return what takes the frames: kind, serial number, whether it is simulated; when, if not now."""

    @property
    def intrinsics(self) -> Intrinsics:
        """Return the camera of infrared and depth, which see through the same one."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...

    def __iter__(self) -> Iterator[Frame]: ...
