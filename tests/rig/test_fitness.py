"""Which calibrations a rig takes."""

import json
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.calibration.file import Calibration, load_calibration
from autd_trials.calibration.provenance import CLOCK_TOLERANCE, Capture, Origin, provenance, source
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.rig.fitness import refuse_unfit
from autd_trials.rig.load import load_rig
from autd_trials.rig.schema import Rig
from autd_trials.yamlfile.shipped import find_file

NOW = datetime(2026, 11, 25, 12, tzinfo=UTC)
FILE = Path("calibration.yaml")
EMULATED = load_rig("emulated", NOW)
VERSION_1 = Path(__file__).parents[1] / "calibration" / "version1" / "calibration.yaml"


def rig(*, real: bool = True, **calibration: object) -> Rig:
    data: dict[str, Any] = EMULATED.rig.model_dump(mode="json")
    if real:
        data["array"]["link"] = {"interface": "none0"}
    data["calibration"] |= calibration
    return Rig.model_validate_json(json.dumps(data))


def calibration(origin: Origin = "measured", taken: datetime | None = NOW) -> Calibration:
    found = [source("track", "unit1.csv", Capture(origin=origin, sensor="camera", taken=taken))]
    return EMULATED.calibration.model_copy(update=dict(provenance(found)))


def test_a_real_rig_takes_what_was_measured() -> None:
    refuse_unfit(calibration(), rig(oldest_days=1), FILE, NOW)


@pytest.mark.parametrize("origin", ["unknown", "simulated", "made up"])
def test_a_real_rig_takes_nothing_else_and_names_the_cause(origin: Origin) -> None:
    with pytest.raises(UnsafeError, match=rf"{origin}.*\(unit1\.csv\)"):
        refuse_unfit(calibration(origin), rig(), FILE, NOW)
    refuse_unfit(calibration(origin), rig(real=False), FILE, NOW)


def test_a_real_rig_takes_no_calibration_of_version_1_and_an_emulated_one_does() -> None:
    old = load_calibration(VERSION_1)[0]
    with pytest.raises(UnsafeError, match="of unknown origin"):
        refuse_unfit(old, rig(), VERSION_1, NOW)
    refuse_unfit(old, rig(real=False), VERSION_1, NOW)


def test_a_real_rig_must_know_when_the_data_were_taken() -> None:
    with pytest.raises(UnsafeError, match="does not say when"):
        refuse_unfit(calibration(taken=None), rig(), FILE, NOW)


@given(
    taken=st.datetimes(timezones=st.timezones() | st.just(timezone(timedelta(hours=14)))),
    oldest_days=st.floats(0.01, 1e6),
)
def test_age_counts_from_when_the_data_were_taken(taken: datetime, oldest_days: float) -> None:
    age = NOW - taken
    fit = -CLOCK_TOLERANCE <= age <= timedelta(days=min(oldest_days, 1e6))
    late = calibration(taken=taken).model_copy(update={"time": NOW})
    expected = "fit" if fit else "future" if age < timedelta(0) else "days old"
    for real in (True, False):
        assert expected in judged(late, rig(real=real, oldest_days=oldest_days))


def judged(late: Calibration, for_rig: Rig) -> str:
    try:
        refuse_unfit(late, for_rig, FILE, NOW)
    except UsageError as error:
        return error.what
    return "fit"


@pytest.mark.parametrize("year", [1, 1970, 2025])
def test_a_computer_that_has_lost_its_clock_is_told_so(year: int) -> None:
    now = datetime(year, 1, 2, tzinfo=UTC)
    for taken in (NOW, now):
        with pytest.raises(UsageError, match="set the clock"):
            refuse_unfit(calibration(taken=taken), rig(), FILE, now)


@pytest.mark.parametrize("time", ["0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-14:00"])
def test_the_first_and_the_last_year_are_told(tmp_path: Path, time: str) -> None:
    folder = find_file("emulated", kind="rig", folder="rigs").parent
    data = yaml.safe_load((folder / "emulated.yaml").read_text())
    data["calibration"] = {"file": "c.yaml", "oldest_days": 7}
    written = yaml.safe_load((folder / "emulated-calibration.yaml").read_text()) | {"time": time}
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(written))
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(data))
    with pytest.raises(UsageError, match=r"days old|in the future"):
        load_rig(str(tmp_path / "rig.yaml"), NOW)


def test_a_calibration_with_a_name_of_300_letters_is_told(tmp_path: Path) -> None:
    data = yaml.safe_load(find_file("emulated", kind="rig", folder="rigs").read_text())
    data["calibration"] = {"file": "c" * 300}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(data))
    with pytest.raises(UsageError, match="does not exist"):
        load_rig(str(tmp_path / "rig.yaml"), NOW)
