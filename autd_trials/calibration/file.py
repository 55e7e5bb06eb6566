"""The calibration file: where each unit stands, and how well that is known."""

from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import AfterValidator, AwareDatetime, Field, field_validator, model_validator

from autd_trials.array.geometry import UnitPose, is_rotation
from autd_trials.calibration.provenance import Capture, Origin, Sha256, Source, taken_of, worst
from autd_trials.calibration.writing import create_text
from autd_trials.model import Model
from autd_trials.yamlfile import load_with_sha256

Row3 = tuple[float, float, float]
Row6 = tuple[float, float, float, float, float, float]


def _rotation(rows: tuple[Row3, Row3, Row3]) -> tuple[Row3, Row3, Row3]:
    if not is_rotation(np.array(rows)):
        raise ValueError(
            "this is not a rotation matrix: its rows must be orthonormal and its determinant +1, "
            "within 1e-6; calibrate again, or write it with nine digits"
        )
    return rows


MOST_LETTERS = 100
"""Of a unit's name."""

UnitName = Annotated[str, Field(min_length=1, max_length=MOST_LETTERS)]

RotationRows = Annotated[tuple[Row3, Row3, Row3], AfterValidator(_rotation)]
"""A rotation matrix, row by row."""

_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Residuals(Model):
    """What was left between the mapped points, in mm. Small residuals do not prove a good focus."""

    rms_mm: float = Field(ge=0, description="Root mean square, outliers left out.")
    largest_mm: float = Field(ge=0, description="Largest, outliers left out.")


class Counts(Model):
    """How many points the pose rests on."""

    points: int = Field(ge=0, description="Paired points.")
    outliers: int = Field(ge=0, description="Points among them that were left out.")


class RangeError(Model):
    """What a sensor's range was found to be wrong by: it read ``bias_mm + (1 + scale) * range``."""

    bias_mm: float = Field(description="Constant part in mm.")
    bias_sd_mm: float = Field(ge=0, description="Its standard deviation in mm.")
    scale: float = Field(description="Share of the range; 0 unless a wand was waved.")
    scale_sd: float = Field(ge=0, description="Its standard deviation; 0 unless a wand was waved.")


class PredictedEnergy(Model):
    """Energy at a target relative to perfectly known poses, over pose errors as the covariances say.

    What points cannot see, such as a sensor that sits elsewhere on its unit than assumed, is not in it.
    """

    target_mm: Row3 = Field(description="The target in mm in the calibrated frame.")
    mean: float = Field(ge=0, description="Mean over the errors.")
    low: float = Field(ge=0, description="5 % quantile.")
    high: float = Field(ge=0, description="95 % quantile.")
    draws: int = Field(gt=0, description="How many errors were drawn.")


class CalibratedUnit(Model):
    """One unit; a point p of its own lies at ``rotation p + translation_mm`` in the calibrated frame."""

    name: UnitName = Field(description="What people call the unit.")
    rotation: RotationRows = Field(description="Rotation matrix, row by row.")
    translation_mm: Row3 = Field(description="The unit's origin in mm.")
    residuals: Residuals | None = Field(None, description="Left out where nothing was measured.")
    counts: Counts | None = Field(None, description="Left out where nothing was measured.")
    covariance: tuple[Row6, Row6, Row6, Row6, Row6, Row6] | None = Field(
        None,
        description="Of the origin's x, y, z in mm and the rotation vector about it in rad, in the "
        "calibrated frame; left out where unknown.",
    )
    range_error: RangeError | None = Field(None, description="Left out where it was not estimated.")


class Calibration(Model):
    """Where the units stand, in one frame: that of the first unit."""

    frame: str = Field(min_length=1, description="What the calibrated frame is, in words.")
    made_up: bool = Field(description="True if anything in it was simulated or made up.")
    origin: Origin = Field(
        "unknown", description="That of the worst source; unknown in files of version 1 that are not made up."
    )
    taken: AwareDatetime | None = Field(
        None,
        description="When the oldest data about the units' places were taken; left out if unknown. The "
        "calibration's age counts from it.",
    )
    method: str = Field(min_length=1, description="How the poses were found.")
    time: AwareDatetime = Field(
        description="When they were computed, with the time zone: 2026-11-22T09:30:00Z."
    )
    sources: tuple[Source, ...] = Field(
        (), description="The files that the poses rest on, and where each comes from."
    )
    inputs: dict[str, Sha256] = Field(
        default_factory=dict, description="SHA-256 of each file that the poses were computed from."
    )
    settings: dict[str, str | int | float | bool] = Field(
        default_factory=dict, description="What else is needed to compute the poses again."
    )
    predicted_energy: PredictedEnergy | None = Field(
        None, description="Left out where the covariances are unknown."
    )
    units: tuple[CalibratedUnit, ...] = Field(min_length=1, description="In the order of wiring.")

    @field_validator("units")
    @classmethod
    def _must_be_in_the_first_ones_frame(
        cls, units: tuple[CalibratedUnit, ...]
    ) -> tuple[CalibratedUnit, ...]:
        if units[0].rotation != _IDENTITY or any(units[0].translation_mm):
            raise ValueError(
                f"the calibrated frame is the first unit's, so the pose of {units[0].name!r} "
                "must be the identity matrix and [0, 0, 0]"
            )
        names = [unit.name for unit in units]
        if len(set(names)) < len(names):
            raise ValueError(f"each unit needs a name of its own; these are {', '.join(names)}")
        return units

    @model_validator(mode="after")
    def _must_not_be_better_than_its_sources(self) -> Self:
        if self.sources and self.origin != worst([each.origin for each in self.sources]):
            raise ValueError(f"origin is {self.origin!r}, which is not that of the worst source")
        if self.sources and self.taken != taken_of(self.sources):
            raise ValueError("taken is not the oldest time of the sources")
        if not self.made_up and self.origin in ("simulated", "made up"):
            raise ValueError(f"made_up is false, but origin is {self.origin!r}")
        return self

    @property
    def capture(self) -> Capture:
        """Where the poses come from, as a source of another calibration or for a rig to judge."""
        made_up = self.made_up and self.origin in ("measured", "unknown")
        return Capture(origin="made up" if made_up else self.origin, sensor="", taken=self.taken)

    def unit_poses(self) -> list[UnitPose]:
        """Return the units' poses, in order."""
        return [
            UnitPose(unit.name, np.array(unit.rotation), np.array(unit.translation_mm)) for unit in self.units
        ]


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Write a calibration file.

    Raises
    ------
    UsageError
        The file exists, as nothing recorded is overwritten, or cannot be written.
    """
    import yaml

    text = yaml.safe_dump(
        calibration.model_dump(mode="json", exclude_none=True),
        sort_keys=False,
        allow_unicode=True,
        default_flow_style=None,
        width=100,
    )
    create_text(path, text, "calibration")


def load_calibration(path: Path) -> tuple[Calibration, str]:
    """Read and validate a calibration file.

    Returns
    -------
    tuple[Calibration, str]
        The calibration, and the SHA-256 (hexadecimal) of the bytes it was read from.

    Raises
    ------
    UsageError
        The file cannot be read or is no valid calibration; the message has a line for each problem.
    """
    return load_with_sha256(path, Calibration)
