"""How to calibrate."""

from dataclasses import dataclass, field
from typing import Literal

from autd_trials.calibration.robust import NORMAL_MAD_FACTOR
from autd_trials.calibration.sensor_model import Sensor, SensorNoise


@dataclass(frozen=True)
class Settings:
    """How to calibrate.

    Attributes
    ----------
    method
        ``joint`` (robust start, maximum likelihood) or ``paper`` (equations 1 to 10).
    pairing
        ``interpolated`` (with the clocks' offset) or ``nearest`` (the paper's).
    mad_factor
        Of the paper's equation 10.
    range_bias
        Whether the sensors' ranges may be wrong by a constant (20 mm, standard deviation); it is corrected
        where the points show it. Not by the paper's method.
    range_scale_sd
        By what share of the range the sensors may be wrong (standard deviation). Points do not see it: it
        makes the covariance larger. 0 for sensors whose scale was checked. Not by the paper's method.
    noise
        Of the sensors; its shape matters, its size is estimated.
    viewpoint
        Whether the points were seen from the origin of their frame, as by a camera; one for all units, or one
        each; None: of tracks yes, of pairs no. Without one (robots, motion capture,
        SLAM, markers) noise is the same in all directions, and there are no ranges to be wrong.
    target_mm
        Where the energy is predicted, in the calibrated frame; the cloud's centre if None.
    seed
        Of all that is random.
    """

    method: Literal["joint", "paper"] = "joint"
    pairing: Literal["interpolated", "nearest"] = "interpolated"
    mad_factor: float = NORMAL_MAD_FACTOR
    range_bias: bool = True
    range_scale_sd: float = 0.005
    viewpoint: bool | tuple[bool, ...] | None = None
    noise: SensorNoise = field(default_factory=SensorNoise)
    target_mm: tuple[float, float, float] | None = None
    seed: int = 1

    def sensor(self, *, viewpoint: bool) -> Sensor:
        """Return what is known of a sensor."""
        if not viewpoint:
            return Sensor.without_viewpoint(self.noise.isotropic.along_mm)
        return Sensor(self.noise, Sensor.bias_sd_mm if self.range_bias else 0.0, self.range_scale_sd)
