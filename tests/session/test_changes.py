"""A session goes on as it was begun, or it is told, or it is refused."""

import copy
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.errors import UnsafeError, UsageError
from autd_trials.session.changes import device_changes, refuse_less_safe, rig_changes
from autd_trials.session.events import Json
from autd_trials.session.standing import Standing, standing
from autd_trials.stimulus import Limits
from autd_trials.testing.script import SessionScript
from autd_trials.testing.studies import DEVICES

LIMITS = Limits(largest_drive=0.5, longest_burst_s=1.0, largest_duty=0.3, session_exposure_s=3.0)
RIG: Json = {
    "name": "lab",
    "array": {
        "link": "emulator",
        "air_temperature_c": 20.0,
        "limits": {"session_exposure_s": 3.0, "largest_ear_level_db": 100.0},
    },
    "hearing_protection_db": 20.0,
}


def begun(rig: Json = RIG) -> Standing:
    script = SessionScript()
    script.events[0] = script.events[0].model_copy(update={"rig": rig, "limits": LIMITS})
    return standing(script.events)


def changed(path: str, value: Any) -> Json:
    rig = copy.deepcopy(RIG)
    *parents, key = path.split(".")
    place: Any = rig
    for parent in parents:
        place = place[parent]
    place[key] = value
    return rig


def test_every_difference_of_the_rig_is_told() -> None:
    assert rig_changes(begun(), RIG, "cd" * 32) == ()
    rig = changed("array.air_temperature_c", 45.0)
    assert rig_changes(begun(), rig, "cd" * 32) == ("rig.array.air_temperature_c: 20.0 -> 45.0",)
    assert rig_changes(begun(), {**RIG, "sound": {"player": "emulated"}}, "cd" * 32) == (
        "rig.sound: none -> {'player': 'emulated'}",
    )
    assert rig_changes(begun(), RIG, "ef" * 32) == (f"calibration: sha256 {'cd' * 32} -> {'ef' * 32}",)


def test_the_devices_own_words_are_compared_but_for_their_address() -> None:
    array = DEVICES.array.model_copy(update={"link": "elsewhere", "firmware": ("v13",)})
    now = DEVICES.model_copy(update={"array": array, "masker": None})
    lines = device_changes(DEVICES, now)
    assert [line.partition(":")[0] for line in lines] == ["devices.array.firmware", "devices.masker"]


@given(name=st.sampled_from(sorted(Limits.model_fields)), factor=st.floats(0.1, 0.999))
def test_any_looser_limit_is_refused_and_any_stricter_one_is_not(name: str, factor: float) -> None:
    looser = LIMITS.model_copy(update={name: getattr(LIMITS, name) / factor})
    with pytest.raises(UnsafeError, match=name):
        refuse_less_safe(begun(), RIG, looser)
    refuse_less_safe(begun(), RIG, LIMITS.model_copy(update={name: getattr(LIMITS, name) * factor}))


@pytest.mark.parametrize(
    ("path", "value"), [("array.limits.largest_ear_level_db", 110.0), ("hearing_protection_db", 35.0)]
)
def test_more_sound_at_the_ears_is_refused(path: str, value: float) -> None:
    with pytest.raises(UnsafeError, match=path.rpartition(".")[2]):
        refuse_less_safe(begun(), changed(path, value), LIMITS)
    refuse_less_safe(begun(), changed(path, 1.0), LIMITS)


def test_another_kind_of_array_is_refused_either_way() -> None:
    real = changed("array.link", {"interface": "eth0"})
    with pytest.raises(UsageError, match="an emulated array, and would go on with a real array"):
        refuse_less_safe(begun(), real, LIMITS)
    with pytest.raises(UsageError, match="a real array, and would go on with an emulated array"):
        refuse_less_safe(begun(real), RIG, LIMITS)
    refuse_less_safe(begun(real), changed("array.link", {"interface": "eth1"}), LIMITS)


def test_what_was_made_stricter_at_a_resume_stays_so() -> None:
    script = SessionScript()
    script.events[0] = script.events[0].model_copy(update={"rig": RIG, "limits": LIMITS})
    script.trial(1).resume()
    stricter = LIMITS.model_copy(update={"session_exposure_s": 2.0})
    script.events[-1] = script.events[-1].model_copy(update={"limits": stricter, "rig": RIG})
    with pytest.raises(UnsafeError, match="session_exposure_s from 2 to 3"):
        refuse_less_safe(standing(script.events), RIG, LIMITS)
