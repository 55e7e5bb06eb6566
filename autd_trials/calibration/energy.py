"""The energy that a calibration leaves at a target, from how well it knows the poses."""

import numpy as np

from autd_trials.acoustics.air import Air
from autd_trials.array.geometry import UnitPose
from autd_trials.calibration.file import Calibration, PredictedEnergy
from autd_trials.calibration.pose_error import target_energy

DRAWS = 200
_INTERVAL = (0.05, 0.95)


def predict_energy(
    calibration: Calibration,
    target_mm: tuple[float, float, float],
    air: Air,
    generator: np.random.Generator,
    draws: int = DRAWS,
) -> PredictedEnergy | None:
    """Return what part of the energy at a target the pose errors leave, over errors as the covariances say.

    Parameters
    ----------
    calibration
        With a covariance for every unit but the first.
    target_mm
        The target in mm in the calibrated frame.
    air
        The air.
    generator
        Where the pose errors come from; units are drawn independently.
    draws
        How many errors are drawn.

    Returns
    -------
    PredictedEnergy | None
        None if a unit's covariance is unknown.
    """
    from scipy.spatial.transform import Rotation

    believed = calibration.unit_poses()
    covariances = [unit.covariance for unit in calibration.units[1:]]
    if any(covariance is None for covariance in covariances):
        return None
    left = np.empty(draws)
    best = target_energy(believed, believed, target_mm, air)  # the same within 0.1 % at poses this near
    for draw in range(draws):
        true = [believed[0]]
        for unit, covariance in zip(believed[1:], covariances, strict=True):
            error = generator.multivariate_normal(np.zeros(6), np.array(covariance), method="eigh")
            turn = Rotation.from_rotvec(error[3:]).as_matrix()
            true.append(UnitPose(unit.name, turn @ unit.rotation, unit.translation_mm + error[:3]))
        left[draw] = target_energy(true, believed, target_mm, air) / best
    low, high = np.quantile(left, _INTERVAL)
    return PredictedEnergy(
        target_mm=target_mm, mean=float(left.mean()), low=float(low), high=float(high), draws=draws
    )
