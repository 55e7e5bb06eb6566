"""Files of what a microphone heard."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.calibration.acoustic.heard import AMPLITUDE_COLUMNS, PHASE_COLUMNS, read_heard
from autd_trials.errors import UsageError

POINTS = [(x * 100.0, 0.0, 1000.0 + x) for x in range(6)]


def phase_lines() -> list[str]:
    return [
        f"2,{source},{x},{y},{z},0.5,{0.1 * source + 0.01 * x}" for source in range(6) for x, y, z in POINTS
    ]


def write(tmp_path: Path, columns: tuple[str, ...], lines: list[str]) -> Path:
    path = tmp_path / "heard.csv"
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    return path


def test_phases_are_arranged_by_sources_and_points(tmp_path: Path) -> None:
    (heard,) = read_heard(write(tmp_path, PHASE_COLUMNS, phase_lines()))
    assert heard.unit == 2
    assert heard.synchronised
    assert heard.sources == tuple((n,) for n in range(6))
    assert heard.points_mm == pytest.approx(np.array(POINTS))
    x = np.array(POINTS)[:, 0]
    assert np.exp(1j * heard.lags_rad) == pytest.approx(
        np.exp(1j * (0.1 * np.arange(6)[:, None] + 0.01 * x[None])), abs=1e-9
    )


@given(lag=st.floats(-3.1, 3.1), strength=st.floats(0.2, 5.0))
def test_four_amplitudes_tell_the_lag(
    tmp_path_factory: pytest.TempPathFactory, lag: float, strength: float
) -> None:
    lines = []
    for source in range(1, 7):
        for x, y, z in POINTS:
            for step in range(4):
                together = 1 + strength * np.exp(1j * (lag + step * math.pi / 2))
                lines.append(f"1,{source},0,{step},{x},{y},{z},{abs(together):.12f}")
    path = write(tmp_path_factory.mktemp("heard"), AMPLITUDE_COLUMNS, lines)
    (heard,) = read_heard(path)
    assert not heard.synchronised
    assert heard.sources[0] == (0,)
    assert heard.lags_rad[0] == pytest.approx(0)
    assert np.exp(1j * heard.lags_rad[1:]) == pytest.approx(np.exp(1j * lag), abs=1e-6)


def test_what_is_hardly_heard_is_left_out(tmp_path: Path) -> None:
    lines = phase_lines()
    lines[7] = lines[7].replace(",0.5,", ",0.001,")
    (heard,) = read_heard(write(tmp_path, PHASE_COLUMNS, lines[:-1]))
    assert np.isnan(heard.lags_rad).sum() == 2  # the weak one, and the one that is not there


def test_groups_are_joined_by_plus(tmp_path: Path) -> None:
    lines = [line.replace("2,0,", "2,7+6+8,", 1) for line in phase_lines()]
    (heard,) = read_heard(write(tmp_path, PHASE_COLUMNS, lines))
    assert (6, 7, 8) in heard.sources


@pytest.mark.parametrize(
    ("columns", "lines", "message"),
    [
        (("unit", "x_mm"), [], r"heard\.csv:1: the columns are unit, x_mm"),
        (PHASE_COLUMNS, [], "nothing was measured"),
        (PHASE_COLUMNS, ["2,1,0,0,1000,0.5,nan"], r"heard\.csv:2: phase_rad is 'nan'"),
        (PHASE_COLUMNS, ["2,1,0,0,1000,-0.5,1"], r"heard\.csv:2: amplitude_pa is -0.5"),
        (PHASE_COLUMNS, ["0,1,0,0,1000,0.5,1"], r"heard\.csv:2: unit is 0"),
        (PHASE_COLUMNS, ["2,2241,0,0,1000,0.5,1"], "'2241' names no transducers"),
        (PHASE_COLUMNS, ["2,a,0,0,1000,0.5,1"], "'a' names no transducers"),
        (PHASE_COLUMNS, phase_lines()[:30], "heard with 5 sources at 6 points"),
        (AMPLITUDE_COLUMNS, ["2,1,0,4,0,0,1000,0.5"], "step is 4"),
        (AMPLITUDE_COLUMNS, ["2,1,0,0,0,0,1000,0.5"], "source 1 at .* lacks step 1, 2, 3"),
        (AMPLITUDE_COLUMNS, ["2,1,0,0,0,0,1000,0.5", "2,1,3,1,0,0,1000,0.5"], "another reference"),
    ],
)
def test_a_bad_file_is_told(tmp_path: Path, columns: tuple[str, ...], lines: list[str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        read_heard(write(tmp_path, columns, lines))


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="the measurement cannot be read"):
        read_heard(tmp_path / "none.csv")
