import numpy as np
import pytest
from autd3 import Duration
from autd3.commands import FixedCompletionTime, Pattern, SetSilencer
from autd3.geometry import Autd3, Geometry
from autd3_emulator import Emulator, Recorder
from autd3_pattern import PhaseBuffer

from autd_trials.acoustics.level import sound_level_db
from autd_trials.acoustics.sources import Sources, Vectors
from autd_trials.acoustics.transducer import (
    DIRECTIVITY_TABLE,
    FULL_PRESSURE_PA_MM,
    directivity_polynomial,
    relative_amplitude,
)
from autd_trials.errors import UsageError


def test_the_polynomial_follows_the_data_sheet() -> None:
    cosines = np.cos(np.radians(list(DIRECTIVITY_TABLE)))
    fitted = np.polynomial.polynomial.polyval(cosines, directivity_polynomial())
    assert np.abs(fitted - list(DIRECTIVITY_TABLE.values())).max() < 0.007
    decibels = 20 * np.log10(list(DIRECTIVITY_TABLE.values()))
    assert np.round(decibels).tolist() == [0, 0, 0, -1, -3, -6, -9, -12, -14, -15]


def test_full_drive_is_103_8_db_at_1_m() -> None:
    assert sound_level_db(np.array([FULL_PRESSURE_PA_MM / 1000]))[0] == pytest.approx(103.8, abs=0.05)


@pytest.mark.parametrize("intensity", [0, 1, 2, 10, 64, 127, 128, 200, 254, 255])
def test_amplitudes_are_those_of_the_firmwares_pulse_widths(intensity: int) -> None:
    """The offline recorder tells the pulse width of 512 that an intensity becomes."""

    def emit(recorder: Recorder) -> None:
        fast = FixedCompletionTime(
            intensity=Duration.from_micros(25), phase=Duration.from_micros(25), strict_mode=False
        )
        recorder.send(SetSilencer(fast))
        recorder.send(Pattern(PhaseBuffer.from_array(np.zeros((1, 249), np.uint8)), intensity))
        recorder.tick(Duration.from_millis(2))

    widths = Emulator(Geometry([Autd3([0, 0, 0])])).record(emit).pulse_width().to_numpy()
    emitted = np.sin(np.pi * float(widths[0, -1]) / 512)
    assert relative_amplitude(intensity) == pytest.approx(emitted, abs=1e-12)


def test_amplitude_is_in_proportion_to_the_intensity() -> None:
    bytes_ = np.arange(256)
    assert np.abs(relative_amplitude(bytes_) - bytes_ / 255).max() < 0.004


def good() -> dict[str, Vectors]:
    return {
        "origins_mm": np.zeros((2, 3)),
        "rotations": np.array([np.eye(3)] * 2),
        "places_mm": np.zeros((5, 2)),
        "phases_turns": np.zeros((2, 5)),
        "amplitudes_pa_mm": np.ones((2, 5)),
    }


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("origins_mm", np.zeros((2, 2)), "origins_mm has the shape"),
        ("rotations", np.array([np.eye(3), 2 * np.eye(3)]), "no rotation matrix"),
        ("places_mm", np.zeros((5, 3)), "places_mm has the shape"),
        ("places_mm", np.zeros((0, 2)), "places_mm has the shape"),
        ("phases_turns", np.zeros((5, 2)), "phases_turns has the shape"),
        ("phases_turns", np.full((2, 5), np.nan), "not finite"),
        ("amplitudes_pa_mm", np.full((2, 5), np.inf), "not finite"),
    ],
)
def test_sources_that_do_not_fit_are_refused(name: str, value: Vectors, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        Sources(**{**good(), name: value})
    Sources(**good())
