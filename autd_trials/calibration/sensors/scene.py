"""A made-up scene for synthetic sensors: where units and sensors really stand, and how the hand waves."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydantic import Field

from autd_trials.array.geometry import UnitPose
from autd_trials.calibration.file import Row3, load_calibration
from autd_trials.calibration.mounts import Mounts, load_mounts
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensors.hand import hand_path
from autd_trials.calibration.sensors.synthetic import Imperfections, SyntheticSensor
from autd_trials.calibration.target import RADIUS_MM
from autd_trials.errors import UsageError
from autd_trials.model import Model
from autd_trials.yamlfile import load_model


class Hand(Model):
    """How the target is waved."""

    centre_mm: Row3 = Field(description="Middle of the workspace in the calibrated frame.")
    half_mm: float = Field(gt=0, description="How far the hand goes along each axis.")
    mean_speed_mm_s: float = Field(gt=0, le=3000, description="Mean speed.")
    seed: int = Field(ge=0, description="Of the path, the same for all sensors.")


class SensorFaults(Model):
    """What is wrong with every sensor."""

    frame_noise_mm: float = Field(3.0, ge=0, description="Standard deviation of the range, once a frame.")
    pixel_noise_mm: float = Field(2.0, ge=0, description="Standard deviation of the range, each pixel.")
    range_bias_mm: float = Field(0.0, description="Constant error of the range.")
    dropouts: float = Field(0.0, ge=0, le=1, description="Share of frames without the target.")


class Scene(Model):
    """What synthetic sensors see."""

    calibration: str = Field(description="Where the units really stand; a path relative to this file.")
    mounts: str = Field(description="How the sensors are mounted; a path relative to this file.")
    hand: Hand
    sensor: SensorFaults


class LoadedScene:
    """A scene with the files it names.

    Parameters
    ----------
    path
        The scene file.

    Raises
    ------
    UsageError
        A file is missing or wrong, or mounts and calibration are of different units.
    """

    def __init__(self, path: Path) -> None:
        self._scene = load_model(path, Scene)
        self._units: list[UnitPose] = load_calibration(path.parent / self._scene.calibration)[0].unit_poses()
        mounts: Mounts = load_mounts(path.parent / self._scene.mounts)[0]
        self._mounts = {mount.unit: mount.motion for mount in mounts.mounts}
        if set(self._mounts) != {unit.name for unit in self._units}:
            raise UsageError("mounts and calibration are of different units", where=str(path))

    def sensor(
        self,
        unit: int,
        generator: np.random.Generator,
        *,
        start_s: float = 0.0,
        wait_until: Callable[[float], None] = lambda _time_s: None,
        frames: int | None = None,
    ) -> SyntheticSensor:
        """Return a unit's sensor.

        Parameters
        ----------
        unit
            Number of the unit, from 1.
        generator
            Of the sensor's noise.
        start_s, wait_until, frames
            As for `SyntheticSensor`.

        Raises
        ------
        UsageError
            There is no such unit.
        """
        if not 1 <= unit <= len(self._units):
            raise UsageError(f"the scene has no unit {unit}", do=f"there are units 1 to {len(self._units)}")
        pose = self._units[unit - 1]
        mounted = RigidMotion(pose.rotation, pose.translation_mm).after(self._mounts[pose.name])
        hand = self._scene.hand
        path = hand_path(
            np.array(hand.centre_mm), hand.half_mm, hand.mean_speed_mm_s, np.random.default_rng(hand.seed)
        )
        return SyntheticSensor(
            mounted,
            path,
            RADIUS_MM,
            generator,
            start_s=start_s,
            wait_until=wait_until,
            imperfections=Imperfections(**self._scene.sensor.model_dump()),
            frames=frames,
        )
