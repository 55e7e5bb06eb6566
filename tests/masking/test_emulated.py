"""Faults that a test injects come out as events, at their time."""

from datetime import UTC, datetime

import pytest

from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError
from autd_trials.masking.emulated import EmulatedMasker


def test_injected_events_come_once_in_order_and_with_their_time() -> None:
    clock = VirtualClock(datetime(2026, 11, 22, tzinfo=UTC))
    masker = EmulatedMasker(-30.0, clock)
    masker.open()
    masker.start()
    clock.sleep_until(1.0)
    masker.inject("underrun", "a busy machine")
    clock.sleep_until(2.5)
    masker.inject("lost")
    assert [(e.time_s, e.kind, e.detail) for e in masker.events()] == [
        (1.0, "underrun", "a busy machine"),
        (2.5, "lost", "injected"),
    ]
    assert masker.events() == []


def test_an_underrun_stops_nothing_but_a_loss_needs_a_new_open() -> None:
    masker = EmulatedMasker(-30.0, VirtualClock(datetime(2026, 11, 22, tzinfo=UTC)))
    masker.open()
    masker.inject("underrun")
    masker.start()
    masker.inject("lost")
    with pytest.raises(DeviceError):
        masker.start()
    masker.open()
    masker.start()
    assert masker.events() == []
