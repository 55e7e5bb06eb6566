"""What the array emits, in the acoustics room's words."""

from collections.abc import Sequence

import numpy as np

from autd_trials.acoustics.sources import Sources
from autd_trials.acoustics.transducer import FULL_PRESSURE_PA_MM, relative_amplitude
from autd_trials.array.focus import PHASE_STEPS, focus_phases
from autd_trials.array.geometry import (
    TRANSDUCERS_PER_DEVICE,
    UnitPose,
    device_poses,
    transducer_places_mm,
    transducer_positions_mm,
)
from autd_trials.stimulus import drive_step


def focused_sources(
    units: Sequence[UnitPose],
    target_mm: tuple[float, float, float],
    *,
    speed_of_sound_m_s: float,
    drive: float = 1.0,
    believed: Sequence[UnitPose] | None = None,
) -> Sources:
    """Return the array's sources when its driver focuses on a target, with an envelope of 1.

    Parameters
    ----------
    units
        Where the units stand.
    target_mm
        The focus in mm in the calibrated frame.
    speed_of_sound_m_s
        What the driver takes the speed of sound for.
    drive
        0 to 1.
    believed
        Where the driver takes the units to stand, which its phases follow; there indeed if None.
    """
    positions_mm = transducer_positions_mm(believed or units)
    phases = focus_phases(positions_mm, target_mm, speed_of_sound_m_s)
    poses = device_poses(units)
    amplitude = FULL_PRESSURE_PA_MM * relative_amplitude(drive_step(drive))
    return Sources(
        origins_mm=np.array([pose.origin_mm for pose in poses]),
        rotations=np.array([pose.rotation for pose in poses]),
        places_mm=transducer_places_mm(),
        phases_turns=phases / PHASE_STEPS,
        amplitudes_pa_mm=np.full((len(poses), TRANSDUCERS_PER_DEVICE), amplitude),
    )
