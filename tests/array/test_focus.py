"""The focus against the SDK's, a direct sum of waves, and the SDK's sound field."""

import numpy as np
import pytest
from autd3.geometry import Autd3, Geometry
from autd3_core import Length
from autd3_pattern import PhaseBuffer, focus
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from autd_trials.array.focus import focus_phases
from autd_trials.array.geometry import UnitPose, device_poses, transducer_positions_mm

SPEED_M_S = 343.2
WAVENUMBER_PER_MM = 2 * np.pi * 40_000 / (1000 * SPEED_M_S)
TARGETS = st.tuples(st.floats(-200, 800), st.floats(-200, 600), st.floats(400, 2000))


def amplitude_at(point_mm: np.ndarray, transducers_mm: np.ndarray, phases: np.ndarray) -> float:
    """Sum unit waves exp(i (k r + phase)), the sign in which the SDK's phases count, over all transducers."""
    distance_mm = np.linalg.norm(transducers_mm - point_mm, axis=-1)
    waves = np.exp(1j * (WAVENUMBER_PER_MM * distance_mm + 2 * np.pi * phases / 256))
    return float(abs(waves.sum()))


@given(TARGETS)
def test_all_contributions_arrive_in_phase(target_mm: tuple[float, float, float]) -> None:
    units = [
        UnitPose("a", np.eye(3), np.zeros(3)),
        UnitPose(
            "b", Rotation.from_euler("yx", [60, 5], degrees=True).as_matrix(), np.array([-700.0, 20, 500])
        ),
    ]
    transducers_mm = transducer_positions_mm(units)
    phases = focus_phases(transducers_mm, target_mm, SPEED_M_S)
    quantisation_loss = 1 - np.sinc(1 / 256)  # of a phase that is off by at most half a step
    share = amplitude_at(np.array(target_mm), transducers_mm, phases) / phases.size
    assert 1 - share < 4 * quantisation_loss


@given(TARGETS)
def test_phases_agree_with_the_sdks_within_a_step(target_mm: tuple[float, float, float]) -> None:
    turn = Rotation.from_euler("yxz", [75, 3, 2], degrees=True)
    units = [
        UnitPose("a", np.eye(3), np.zeros(3)),
        UnitPose("b", turn.as_matrix(), np.array([-700.0, 3, 500])),
    ]
    geometry = Geometry(
        [Autd3(pose.origin_mm, Rotation.from_matrix(pose.rotation)) for pose in device_poses(units)]
    )
    sdks = PhaseBuffer(len(geometry))
    focus(geometry, target_mm, Length.from_mm(1000 * SPEED_M_S / 40_000), sdks)
    ours = focus_phases(transducer_positions_mm(units), target_mm, SPEED_M_S)
    difference = (ours.astype(int) - sdks.to_numpy().astype(int) + 128) % 256 - 128
    assert np.abs(difference).max() <= 1


def test_a_speed_of_sound_wrong_by_one_percent_spoils_the_focus(units: list[UnitPose]) -> None:
    transducers_mm = transducer_positions_mm(units)
    target_mm = (650.0, 225.0, 1000.0)  # farther from one unit than from the other
    wrong = focus_phases(transducers_mm, target_mm, 1.01 * SPEED_M_S)
    assert amplitude_at(np.array(target_mm), transducers_mm, wrong) < 0.9 * wrong.size


def test_the_sdks_sound_field_is_strongest_at_the_target() -> None:
    """The SDK's emulator turns phases into pressure on its own: its focus must be where we aim."""
    from autd3 import Duration
    from autd3.commands import Clear, Pattern, SetSilencer
    from autd3_core import Velocity
    from autd3_emulator import Emulator, Grid, Recorder, RmsRecordOption

    target_mm = (86.0, 66.0, 300.0)
    unit = UnitPose("unit", np.eye(3), np.zeros(3))
    phases = focus_phases(transducer_positions_mm([unit])[:1], target_mm, SPEED_M_S)

    def emit(recorder: Recorder) -> None:
        recorder.send(Clear())
        recorder.send(SetSilencer.disable())
        recorder.send(Pattern(PhaseBuffer.from_array(phases), 255))
        recorder.tick(Duration.from_millis(1))

    record = Emulator(Geometry([Autd3([0, 0, 0])])).record(emit)
    grid = Grid((56.0, 116.0), (36.0, 96.0), 300.0, 2.0, "xyz")
    field = record.sound_field(grid, RmsRecordOption(Velocity.from_m_s(SPEED_M_S)))
    points = field.observe_points()
    rms_pa = field.next(Duration.from_millis(1)).to_numpy()[:, -1]
    strongest = points.row(int(np.argmax(rms_pa)))
    assert np.hypot(strongest[0] - target_mm[0], strongest[1] - target_mm[1]) <= 2.0
    distance_mm = np.linalg.norm(transducer_positions_mm([unit])[0] - target_mm, axis=-1)
    all_in_phase_pa = (275.574 * 200 / (4 * np.pi * np.sqrt(2)) / distance_mm).sum()
    assert rms_pa.max() == pytest.approx(all_in_phase_pa, rel=0.01)
