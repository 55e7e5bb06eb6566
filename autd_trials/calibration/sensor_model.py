"""What is known of a sensor before it was looked through: its noise, and what its ranges may be wrong by."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations in mm of a sensor's points along the viewing ray and across it.

    Only their ratio matters, and how they compare with other sensors'; the size is estimated.
    """

    along_mm: float = 3.0
    across_mm: float = 1.0

    def covariances(self, rays: Vectors) -> NDArray[np.float64]:
        """Return the covariances of points seen along unit vectors, shape (..., 3) to (..., 3, 3)."""
        return self._along_and_across(rays, self.along_mm**2, self.across_mm**2)

    def whitenings(self, rays: Vectors) -> NDArray[np.float64]:
        """Return the inverse square roots of the covariances."""
        return self._along_and_across(rays, 1 / self.along_mm, 1 / self.across_mm)

    @property
    def isotropic(self) -> "SensorNoise":
        """Noise of the same volume, and the same in all directions."""
        size_mm = (self.along_mm * self.across_mm**2) ** (1 / 3)
        return SensorNoise(size_mm, size_mm)

    def _along_and_across(self, rays: Vectors, along: float, across: float) -> NDArray[np.float64]:
        outer = rays[..., :, None] * rays[..., None, :]
        matrices: NDArray[np.float64] = across * np.eye(3) + (along - across) * outer
        return matrices


@dataclass(frozen=True)
class Sensor:
    """What is known of a sensor before it was looked through.

    Attributes
    ----------
    noise
        Of its points.
    bias_sd_mm, scale_sd
        Prior standard deviations of its range's constant error and scale error; 0: its ranges are right.
    viewpoint
        Whether it sees points from the origin of its frame.
    """

    noise: SensorNoise = SensorNoise()  # frozen
    bias_sd_mm: float = 20.0
    scale_sd: float = 0.005
    viewpoint: bool = True

    @classmethod
    def without_viewpoint(cls, noise_mm: float = 1.0) -> "Sensor":
        """Return a source whose frame is no camera's: a robot, motion capture, markers, SLAM."""
        return cls(SensorNoise(noise_mm, noise_mm), 0.0, 0.0, viewpoint=False)

    @property
    def trusted(self) -> "Sensor":
        """The same sensor with right ranges."""
        return replace(self, bias_sd_mm=0.0, scale_sd=0.0)
