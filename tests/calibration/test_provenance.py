"""Where data come from follows them through every step; what was simulated never passes for measured."""

import json
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from autd_trials.calibration.file import Calibration, load_calibration, write_calibration
from autd_trials.calibration.provenance import (
    CLOCK_TOLERANCE,
    UNKNOWN,
    Capture,
    Inputs,
    Origin,
    Source,
    provenance,
    read_capture,
    refuse_future,
    sidecar_path,
    sidecar_text,
    source,
    taken_of,
    worst,
)
from autd_trials.errors import UsageError
from autd_trials.yamlfile.shipped import find_file

NOW = datetime(2026, 11, 25, 12, tzinfo=UTC)
ORIGINS: tuple[Origin, ...] = ("measured", "unknown", "simulated", "made up")
VERSION_1 = Path(__file__).parent / "version1" / "calibration.yaml"
SHIPPED = load_calibration(find_file("emulated-calibration", kind="calibration", folder="rigs"))[0]

moments = st.datetimes(timezones=st.just(UTC))
captures = st.builds(
    Capture, origin=st.sampled_from(ORIGINS), sensor=st.just("camera"), taken=st.none() | moments
)
sources = st.builds(
    lambda what, capture: source(what, "a.csv", capture),
    st.sampled_from(["track", "pairs", "sound", "wand", "mounts", "calibration", "start"]),
    captures,
)


def resting_on(*found: Source) -> Calibration:
    return SHIPPED.model_copy(update=dict(provenance(found)))


def test_the_worst_source_decides() -> None:
    for better, worse in pairwise(ORIGINS):
        assert worst([worse, better, better]) == worse
    assert worst([]) == "unknown"


@given(st.lists(sources, max_size=5))
def test_nothing_simulated_or_made_up_is_called_measured(found: list[Source]) -> None:
    said = provenance(found)
    assert said["made_up"] == any(each.origin in ("simulated", "made up") for each in found)
    assert (said["origin"] == "measured") == (bool(found) and {each.origin for each in found} == {"measured"})


@given(st.lists(sources, max_size=5))
def test_a_calibration_is_as_old_as_the_oldest_data_about_places(found: list[Source]) -> None:
    dated = [each.taken for each in found if each.what not in ("wand", "mounts", "start")]
    known = [taken for taken in dated if taken is not None]
    expected = min(known) if known and len(known) == len(dated) else None
    assert taken_of(found) == expected


@given(st.lists(sources, max_size=4))
def test_a_written_calibration_keeps_its_sources(
    tmp_path_factory: pytest.TempPathFactory, found: list[Source]
) -> None:
    path = tmp_path_factory.mktemp("calibration") / "calibration.yaml"
    calibration = resting_on(*found)
    write_calibration(calibration, path)
    assert load_calibration(path)[0] == calibration


@pytest.mark.parametrize(
    "lie",
    [
        {"origin": "measured"},
        {"made_up": False},
        {"made_up": False, "origin": "measured"},
        {"taken": "2026-11-25T11:00:00Z"},
        {"taken": None},
    ],
)
def test_a_file_whose_words_and_sources_differ_is_refused(lie: dict[str, object]) -> None:
    simulated = Capture(origin="simulated", sensor="synthetic", taken=NOW)
    honest = resting_on(source("track", "unit1.csv", simulated)).model_dump(mode="json")
    with pytest.raises(ValidationError):
        Calibration.model_validate_json(json.dumps(honest | lie))


def test_a_calibration_of_version_1_is_read_and_of_unknown_origin() -> None:
    calibration, _ = load_calibration(VERSION_1)
    assert calibration.capture == UNKNOWN
    assert calibration.units[1].translation_mm[2] == pytest.approx(889.2, abs=0.1)
    assert SHIPPED.capture.origin == "made up"


def test_what_is_taken_now_gets_the_time_and_a_replay_keeps_its_own() -> None:
    earlier = NOW - timedelta(days=3)
    live = Capture(origin="measured", sensor="camera")
    assert live.at(NOW).taken == NOW
    assert live.model_copy(update={"taken": earlier}).at(NOW).taken == earlier
    assert UNKNOWN.at(NOW).taken is None


def track(tmp_path: Path, capture: Capture) -> Path:
    path = tmp_path / "unit1.csv"
    path.write_text("t_s,x_mm,y_mm,z_mm\n0,1,2,3\n")
    sidecar_path(path).write_text(sidecar_text(capture, path.read_bytes()))
    return path


def test_a_track_says_where_it_comes_from_and_no_other_track_can_use_its_words(tmp_path: Path) -> None:
    capture = Capture(origin="measured", sensor="camera", serial="7", taken=NOW)
    path = track(tmp_path, capture)
    assert read_capture(path) == capture
    path.write_text(path.read_text() + "1,1,2,3\n")
    with pytest.raises(UsageError, match=r"about other data than unit1\.csv"):
        read_capture(path)
    sidecar_path(path).unlink()
    assert read_capture(path) == UNKNOWN


@pytest.mark.parametrize("text", ["", "{}", "[1", "\0", '{"sha256": "ab", "capture": {}}'])
def test_damaged_words_beside_a_track_are_told(tmp_path: Path, text: str) -> None:
    path = track(tmp_path, UNKNOWN)
    sidecar_path(path).write_text(text)
    with pytest.raises(UsageError, match=r"does not say where unit1\.csv comes from"):
        read_capture(path)


@pytest.mark.parametrize("origin", ["measured", "simulated"])
def test_what_a_person_says_never_overrides_what_the_file_says(tmp_path: Path, origin: Origin) -> None:
    stated = Capture(origin="measured", sensor="motion capture", taken=NOW)
    own = Capture(origin=origin, sensor="synthetic", taken=NOW)
    inputs = Inputs(stated, NOW)
    path = track(tmp_path, own)
    inputs.add_data("track", path)
    sidecar_path(path).unlink()
    inputs.add_data("track", path)
    assert inputs.sources == [source("track", path, own), source("track", path, stated)]
    assert list(inputs.sha256) == [str(path)]


@given(moments, moments)
def test_only_what_lies_in_the_future_is_refused_as_such(taken: datetime, now: datetime) -> None:
    try:
        refuse_future(taken, now, "unit1.csv")
    except UsageError:
        assert taken > now + CLOCK_TOLERANCE
    else:
        assert taken - now <= CLOCK_TOLERANCE


def test_a_track_from_the_future_is_refused(tmp_path: Path) -> None:
    path = track(tmp_path, Capture(origin="measured", sensor="camera", taken=NOW + timedelta(hours=1)))
    with pytest.raises(UsageError, match="lies in the future"):
        Inputs(None, NOW).add_data("track", path)
