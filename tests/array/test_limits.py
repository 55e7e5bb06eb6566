"""Over a limit is refused, never clipped."""

import math
from collections.abc import Callable

import pytest

from autd_trials.array.driver import Stimulus
from autd_trials.array.geometry import UnitPose
from autd_trials.array.limits import ExposureMeter, refuse_out_of_reach
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.stimulus import Limits

MakeStimulus = Callable[..., Stimulus]


def limits(drive: float, burst_s: float, duty: float, exposure_s: float) -> Limits:
    return Limits(
        largest_drive=drive, longest_burst_s=burst_s, largest_duty=duty, session_exposure_s=exposure_s
    )


@pytest.mark.parametrize(
    ("changes", "numbers"),
    [
        ({"drive": 0.91}, r"drive would be 0\.91, over the limit of 0\.9"),
        ({"duration_s": 2.5}, r"length in s would be 2\.5, over the limit of 2"),
        ({"duration_s": math.nan}, "length in s would be nan"),
    ],
)
def test_a_burst_over_a_limit_is_refused_with_both_numbers(
    make_stimulus: MakeStimulus, changes: dict[str, float], numbers: str
) -> None:
    meter = ExposureMeter(limits(0.9, 2.0, 0.5, 100.0))
    with pytest.raises(UnsafeError, match=numbers):
        meter.refuse_unsafe([make_stimulus(**{"drive": 0.5, **changes})])


def test_a_burst_at_the_limits_is_allowed(make_stimulus: MakeStimulus) -> None:
    meter = ExposureMeter(limits(0.9, 2.0, 2.0 / 60, 0.81 * 2.0))
    meter.refuse_unsafe([make_stimulus(drive=0.9, duration_s=2.0)])
    meter.refuse_too_soon(make_stimulus(drive=0.9, duration_s=2.0), 0.0)


@pytest.mark.parametrize("drive", [-0.1, 1.1, math.nan])
def test_an_impossible_drive_is_refused(make_stimulus: MakeStimulus, drive: float) -> None:
    with pytest.raises(UsageError, match="drive"):
        ExposureMeter(limits(1.0, 2.0, 0.5, 100.0)).refuse_unsafe([make_stimulus(drive=drive)])


def test_the_exposure_of_a_whole_session_is_refused_before_it_begins(make_stimulus: MakeStimulus) -> None:
    meter = ExposureMeter(limits(1.0, 2.0, 0.5, 10.0))
    meter.refuse_unsafe([make_stimulus(drive=0.5)] * 40)
    with pytest.raises(UnsafeError, match=r"exposure .* 10\.25, over the limit of 10"):
        meter.refuse_unsafe([make_stimulus(drive=0.5)] * 41)


def test_a_resumed_session_starts_from_what_was_used(make_stimulus: MakeStimulus) -> None:
    meter = ExposureMeter(limits(1.0, 2.0, 0.5, 10.0), used_s=9.5)
    with pytest.raises(UnsafeError, match="exposure"):
        meter.refuse_unsafe([make_stimulus()])
    meter.refuse_unsafe([make_stimulus(drive=0.5)])


def test_what_was_emitted_is_charged(make_stimulus: MakeStimulus) -> None:
    meter = ExposureMeter(limits(1.0, 2.0, 0.5, 10.0), used_s=1.0)
    meter.charge(make_stimulus(drive=0.5, duration_s=2.0), onset_s=0.0)
    assert meter.used_s == pytest.approx(1.5)


def test_catch_trials_cost_nothing(make_stimulus: MakeStimulus) -> None:
    meter = ExposureMeter(limits(1.0, 2.0, 0.01, 10.0))
    catch = make_stimulus(drive=0.0, duration_s=2.0)
    for onset_s in range(0, 60, 2):
        meter.refuse_unsafe([catch])
        meter.refuse_too_soon(catch, onset_s)
        meter.charge(catch, onset_s)
    assert meter.used_s == 0


def test_too_much_on_time_within_a_minute_is_refused_until_it_has_passed(make_stimulus: MakeStimulus) -> None:
    meter = ExposureMeter(limits(1.0, 2.0, 0.1, 100.0))  # 6 s in any 60 s
    for onset_s in (0.0, 10.0, 20.0):
        meter.refuse_too_soon(make_stimulus(duration_s=2.0), onset_s)
        meter.charge(make_stimulus(duration_s=2.0), onset_s)
    with pytest.raises(UnsafeError, match=r"on-time in 60 s would be 0\.116667, over the limit of 0\.1"):
        meter.refuse_too_soon(make_stimulus(duration_s=1.0), 30.0)
    meter.refuse_too_soon(make_stimulus(duration_s=2.0), 60.0)


@pytest.mark.parametrize(
    ("target_mm", "named"),
    [
        ((302.0, 225.0, 100.0), "unit 1"),
        ((302.0, 225.0, -1000.0), "unit 1"),
        ((302.0, 225.0, 3000.0), "unit 1"),
        ((2500.0, 225.0, 1000.0), "unit 1"),
        ((-600.0, 217.0, 800.0), "unit 2"),
        ((math.nan, 225.0, 1000.0), "unit 1"),
    ],
)
def test_a_target_out_of_reach_is_refused_by_the_units_name(
    units: list[UnitPose], target_mm: tuple[float, float, float], named: str
) -> None:
    with pytest.raises(
        UsageError, match=f"out of reach of {named}: .* m from its centre, .* degrees off its axis"
    ):
        refuse_out_of_reach(units, target_mm)


def test_the_usual_target_is_in_reach(units: list[UnitPose]) -> None:
    refuse_out_of_reach(units, (302.0, 225.0, 1000.0))
