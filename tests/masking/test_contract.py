"""What every masker promises, whether it plays or not."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

import pytest

from autd_trials.clock import Clock, RealClock, VirtualClock
from autd_trials.errors import DeviceError, UsageError
from autd_trials.masking.emulated import EmulatedMasker
from autd_trials.masking.masker import Masker, MaskerEvent
from autd_trials.masking.player import SoundMasker
from tests.masking.conftest import SoundServer, wait_until


@dataclass
class Case:
    """A masker that is still closed, and how to take its sound away."""

    kind: str
    masker: Masker
    at_level: Callable[[float], Masker]
    clock: Clock
    lose: Callable[[], None]


def _emulated() -> Case:
    clock = VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))
    masker = EmulatedMasker(-30.0, clock, level_dba=60.0)
    return Case(
        "emulated", masker, lambda dbfs: EmulatedMasker(dbfs, clock), clock, lambda: masker.inject("lost")
    )


def _sound(server: SoundServer) -> Case:
    clock = RealClock()

    def at_level(level_dbfs: float) -> SoundMasker:
        return SoundMasker("default", level_dbfs, 60.0, seed=1, clock=clock, loop_s=2)

    return Case("sound", at_level(-30.0), at_level, clock, server.suspend_sink)


@pytest.fixture(params=["emulated", pytest.param("sound", marks=pytest.mark.audio)])
def case(request: pytest.FixtureRequest) -> Iterator[Case]:
    case = _emulated() if request.param == "emulated" else _sound(request.getfixturevalue("sound_server"))
    yield case
    case.masker.close()


def _events_until_lost(masker: Masker) -> list[MaskerEvent]:
    events: list[MaskerEvent] = []

    def lost() -> bool:
        events.extend(masker.events())
        return any(event.kind == "lost" for event in events)

    wait_until(lost, "the sound is lost", deadline_s=5)
    return events


def test_info_says_what_is_played(case: Case) -> None:
    info = case.masker.open()
    assert info.kind == case.kind
    assert info.device
    assert (info.level_dbfs, info.level_dba, info.sample_rate_hz) == (-30.0, 60.0, 48_000)


def test_a_quiet_run_has_no_events(case: Case) -> None:
    case.masker.open()
    case.masker.start()
    case.masker.start()  # it is already flowing: nothing changes
    assert case.masker.events() == []


def test_start_needs_open(case: Case) -> None:
    with pytest.raises(DeviceError, match="not open"):
        case.masker.start()
    case.masker.open()
    case.masker.close()
    with pytest.raises(DeviceError, match="not open"):
        case.masker.start()


def test_close_is_safe_at_any_time_and_again(case: Case) -> None:
    case.masker.close()
    case.masker.open()
    case.masker.close()
    case.masker.close()
    assert case.masker.events() == []


def test_lost_is_told_once_and_then_start_is_refused(case: Case) -> None:
    case.masker.open()
    case.masker.start()
    before_s = case.clock.now_s()
    case.lose()
    events = _events_until_lost(case.masker)
    assert [event.kind for event in events] == ["lost"]
    assert events[0].detail
    assert before_s <= events[0].time_s <= case.clock.now_s()
    assert case.masker.events() == []
    with pytest.raises(DeviceError):
        case.masker.start()


def test_open_after_close_starts_afresh(case: Case) -> None:
    case.masker.open()
    case.masker.start()
    case.masker.close()
    assert case.masker.open().kind == case.kind
    case.masker.start()
    assert case.masker.events() == []


def test_a_level_that_clips_is_refused_before_anything_is_opened(case: Case) -> None:
    with pytest.raises(UsageError, match="clipped"):
        case.at_level(-14.0)
