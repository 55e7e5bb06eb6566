import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.field import pressure
from autd_trials.acoustics.level import sound_level_db
from autd_trials.acoustics.sources import Medium
from autd_trials.array.driver import Stimulus
from autd_trials.array.ears import EarWatch, Head
from autd_trials.array.emission import focused_sources
from autd_trials.array.geometry import UnitPose
from autd_trials.array.phased_array import PhasedArray
from autd_trials.array.virtual_backend import VirtualBackend
from autd_trials.clock import VirtualClock
from autd_trials.errors import UnsafeError
from autd_trials.stimulus import Limits

MakeStimulus = Callable[..., Stimulus]
AIR = Air()
HEAD_MM = (302.0, 625.0, 1000.0)


def watch(units: list[UnitPose], *, protection_db: float = 0.0, largest_db: float = 200.0) -> EarWatch:
    return EarWatch(units, [Head("participant", HEAD_MM, protection_db)], AIR, largest_db=largest_db)


def test_the_level_is_that_of_the_field_around_the_ears(
    units: list[UnitPose], make_stimulus: MakeStimulus
) -> None:
    """By the other solver, on points of its own: nowhere is it louder than predicted plus 1 dB."""
    sources = focused_sources(units, (302.0, 225.0, 1000.0), speed_of_sound_m_s=AIR.speed_of_sound_m_s)
    generator = np.random.default_rng(1)
    ears_mm = np.add(HEAD_MM, [[-75.0, 0, 0], [75.0, 0, 0]])
    points_mm = np.vstack([ear + generator.uniform(-24, 24, (3000, 3)) for ear in ears_mm])
    levels_db = sound_level_db(pressure(sources, Medium.of(AIR), points_mm))
    predicted_db = watch(units).level_db(make_stimulus())
    assert predicted_db is not None
    assert levels_db.max() - 3 < predicted_db < levels_db.max() + 1


def test_level_goes_with_drive_and_protection(units: list[UnitPose], make_stimulus: MakeStimulus) -> None:
    full_db = watch(units).level_db(make_stimulus())
    assert full_db is not None
    assert watch(units).level_db(make_stimulus(drive=0.5)) == pytest.approx(full_db - 6.02, abs=0.1)
    assert watch(units, protection_db=30).level_db(make_stimulus()) == pytest.approx(full_db - 30)
    assert watch(units).level_db(make_stimulus(drive=0.0)) is None


def test_too_loud_at_the_ears_is_refused(units: list[UnitPose], make_stimulus: MakeStimulus) -> None:
    with pytest.raises(
        UnsafeError,
        match=r"the ears \(participant\) would be 14\d\.\d dB SPL, over the limit of 110 dB",
    ):
        watch(units, largest_db=110).refuse_unsafe(make_stimulus())
    watch(units, largest_db=110, protection_db=40).refuse_unsafe(make_stimulus())
    watch(units, largest_db=110).refuse_unsafe(make_stimulus(drive=0.0))


def test_a_focus_close_to_the_head_is_refused_however_faint(
    units: list[UnitPose], make_stimulus: MakeStimulus
) -> None:
    with pytest.raises(UnsafeError, match=r"200 mm from the middle of the head \(participant\)"):
        watch(units).refuse_unsafe(make_stimulus(target_mm=(302.0, 425.0, 1000.0), drive=0.01))


def test_the_array_refuses_to_arm_and_emits_nothing(
    units: list[UnitPose], make_stimulus: MakeStimulus, limits: Limits, virtual_clock: VirtualClock
) -> None:
    backend = VirtualBackend(virtual_clock)
    ears = watch(units, largest_db=110)
    array = PhasedArray(units, backend, limits, virtual_clock, speed_of_sound_m_s=343.2, ears=ears)
    array.open()
    with pytest.raises(UnsafeError, match="at the ears"):
        array.check([make_stimulus()])
    with pytest.raises(UnsafeError, match="at the ears"):
        array.arm(make_stimulus())
    with pytest.raises(RuntimeError, match="no stimulus is armed"):
        array.start(virtual_clock.now_s() + 1)
    assert backend.emissions == []


def test_the_array_tells_the_level_of_what_it_armed(
    units: list[UnitPose], make_stimulus: MakeStimulus, limits: Limits, virtual_clock: VirtualClock
) -> None:
    backend = VirtualBackend(virtual_clock)
    array = PhasedArray(
        units, backend, limits, virtual_clock, speed_of_sound_m_s=343.2, ears=watch(units, protection_db=20)
    )
    array.open()
    assert array.arm(make_stimulus()).ear_level_db == watch(units, protection_db=20).level_db(make_stimulus())
    assert array.arm(make_stimulus(drive=0.0)).ear_level_db is None


@given(
    target_mm=st.tuples(st.floats(200, 400), st.floats(100, 300), st.floats(800, 1200)),
    largest_db=st.floats(60, 150),
)
@settings(max_examples=8, deadline=None)
def test_the_largest_drive_that_is_named_is_allowed_and_one_step_more_is_not(
    target_mm: tuple[float, float, float], largest_db: float
) -> None:
    units = [UnitPose("unit 1", np.eye(3), np.zeros(3))]
    ears = EarWatch(units, [Head("participant", HEAD_MM, 0.0)], AIR, largest_db=largest_db)

    def stimulus(drive: float) -> Stimulus:
        return Stimulus(target_mm=target_mm, duration_s=1.0, modulation_hz=50.0, drive=drive)

    try:
        ears.refuse_unsafe(stimulus(1.0))
    except UnsafeError as refusal:
        named = re.search(r"the largest drive allowed is ([\d.]+)", refusal.what)
        steps = round(255 * float(named[1])) if named else 0
        if named:
            ears.refuse_unsafe(stimulus(float(named[1])))
        with pytest.raises(UnsafeError):
            ears.refuse_unsafe(stimulus((steps + 1) / 255))


def test_everybodys_ears_count(units: list[UnitPose], make_stimulus: MakeStimulus) -> None:
    participant = Head("participant", HEAD_MM, 60.0)
    experimenter = Head("experimenter", HEAD_MM, 0.0)
    alone = EarWatch(units, [participant], AIR, largest_db=200).level_db(make_stimulus())
    both = EarWatch(units, [participant, experimenter], AIR, largest_db=120)
    assert alone is not None
    assert both.level_db(make_stimulus()) == watch(units).level_db(make_stimulus())
    assert alone < 120
    with pytest.raises(UnsafeError, match=r"level at the ears \(experimenter\)"):
        both.refuse_unsafe(make_stimulus())
    elsewhere = Head("experimenter", (500.0, 225.0, 1000.0), 0.0)
    with pytest.raises(UnsafeError, match=r"198 mm from the middle of the head \(experimenter\)"):
        EarWatch(units, [participant, elsewhere], AIR, largest_db=200).refuse_unsafe(
            make_stimulus(drive=0.01)
        )
