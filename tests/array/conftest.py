"""Units, stimuli and limits that the array's tests share."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from autd_trials.array.driver import ArrayDriver, Stimulus
from autd_trials.array.geometry import UnitPose
from autd_trials.clock import Clock, VirtualClock
from autd_trials.stimulus import Limits

MakeStimulus = Callable[..., Stimulus]
TARGET_MM = (302.0, 225.0, 1000.0)


def watch_until(array: ArrayDriver, clock: Clock, time_s: float) -> None:
    """Watch the devices as a session does."""
    while (now_s := clock.now_s()) < time_s:
        array.watch()
        clock.sleep_until(now_s + 0.01)


@pytest.fixture
def units() -> list[UnitPose]:
    """Two units whose beams meet at the target under 75 degrees."""
    turn = Rotation.from_euler("y", 75, degrees=True).as_matrix()
    target_mm = np.array(TARGET_MM)
    return [
        UnitPose("unit 1", np.eye(3), np.zeros(3)),
        UnitPose("unit 2", turn, target_mm - turn @ target_mm),
    ]


@pytest.fixture
def make_stimulus() -> MakeStimulus:
    """Return what makes a stimulus like the chest study's, but for what is given."""

    def make(**changes: Any) -> Stimulus:
        usual: dict[str, Any] = {
            "target_mm": TARGET_MM,
            "duration_s": 1.0,
            "modulation_hz": 50.0,
            "waveform": "sine",
            "depth": 1.0,
            "drive": 1.0,
            "force_law": "amplitude",
            "ramp_s": 0.005,
        }
        return Stimulus(**usual).model_copy(update=changes)  # unvalidated: the array refuses by itself

    return make


@pytest.fixture
def limits() -> Limits:
    return Limits(largest_drive=1.0, longest_burst_s=2.0, largest_duty=0.5, session_exposure_s=100.0)


@pytest.fixture
def virtual_clock() -> VirtualClock:
    return VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))
