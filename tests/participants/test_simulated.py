"""Simulated participants as responders: repeatable, resumable, and as good as their specification."""

import itertools
from datetime import UTC, datetime

import numpy as np
import numpy.typing as npt
import pytest
from scipy import stats

from autd_trials.clock import RealClock, VirtualClock
from autd_trials.participants.simulated import SimulatedParticipant
from autd_trials.participants.traits import PREDICTED_FORCE_MN, ParticipantTraits
from autd_trials.protocol.plan import Plan, PlannedTrial
from autd_trials.protocol.schema import StimulusSpec
from autd_trials.responses.responder import Presentation

EAGER = ParticipantTraits(threshold_offset_db=0.0, inner_loss_db=-1.0, outer_loss_db=-1.0, criterion=-1000.0)


def virtual_clock() -> VirtualClock:
    return VirtualClock(datetime(2026, 1, 1, tzinfo=UTC))


def shown(
    trial: int,
    onset_s: float,
    *,
    attempt: int = 1,
    drive: float = 1.0,
    modulation_hz: float = 100.0,
    clothing: float | str | None = "inner",
) -> Presentation:
    return Presentation(trial, attempt, onset_s, 1.0, drive, modulation_hz, "chest", {"clothing": clothing})


def reaction_times_s(
    trials: range, *, seed: int = 1, place: int = 1, session: int = 1, attempt: int = 1
) -> list[float | None]:
    """Run trials of one participant; None is no press."""
    clock = virtual_clock()
    participant = SimulatedParticipant(clock, seed=seed, place=place, session=session)
    participant.open()
    times: list[float | None] = []
    for trial in trials:
        onset_s = 10.0 * trial
        participant.present(shown(trial, onset_s, attempt=attempt, modulation_hz=50.0))
        presses = participant.read(onset_s + 9.0)
        times.append(round(presses[0].time_s - onset_s, 9) if presses else None)
    return times


def test_answers_are_the_same_wherever_a_session_is_resumed() -> None:
    whole = reaction_times_s(range(1, 61))
    for cut in (1, 17, 60):
        assert reaction_times_s(range(1, cut)) + reaction_times_s(range(cut, 61)) == whole


def test_every_number_of_the_key_matters() -> None:
    answers = [
        reaction_times_s(range(1, 41)),
        reaction_times_s(range(1, 41), seed=2),
        reaction_times_s(range(1, 41), place=2),
        reaction_times_s(range(1, 41), session=2),
        reaction_times_s(range(1, 41), attempt=2),
        reaction_times_s(range(101, 141)),
        reaction_times_s(range(1, 41), seed=2**64 + 1),
        reaction_times_s(range(1, 41), seed=0),
    ]
    for first, second in itertools.combinations(answers, 2):
        times = {time for time in first if time} & {time for time in second if time}
        assert first != second
        assert not times


def test_people_keep_their_traits_over_sessions() -> None:
    clock = virtual_clock()
    first = SimulatedParticipant(clock, seed=5, place=3, session=1)
    assert SimulatedParticipant(clock, seed=5, place=3, session=2).traits == first.traits
    assert SimulatedParticipant(clock, seed=5, place=4, session=1).traits != first.traits
    assert SimulatedParticipant(clock, seed=6, place=3, session=1).traits != first.traits


def test_traits_are_the_same_on_every_machine() -> None:
    traits = SimulatedParticipant(virtual_clock(), seed=1, place=1, session=1).traits
    assert traits.threshold_offset_db == pytest.approx(0.33773506154374255)
    assert traits.inner_loss_db == pytest.approx(-3.5818494642193084)
    assert traits.outer_loss_db == pytest.approx(-7.781652122048461)
    assert traits.criterion == pytest.approx(1.4535310308099385)


def test_press_falls_due_a_reaction_time_after_the_onset() -> None:
    clock = virtual_clock()
    participant = SimulatedParticipant(clock, seed=1, place=1, session=1, traits=EAGER)
    participant.open()
    participant.present(shown(1, 100.0))
    assert participant.read(100.0) == []
    assert clock.now_s() == 100.0
    (press,) = participant.read(110.0)
    assert 100.1 < press.time_s < 103.0
    assert clock.now_s() == press.time_s
    assert participant.read(110.0) == []
    assert clock.now_s() == 110.0


def test_real_time_works_alike() -> None:
    clock = RealClock()
    participant = SimulatedParticipant(clock, seed=1, place=1, session=1, traits=EAGER)
    participant.open()
    onset_s = clock.now_s() - 0.2
    participant.present(shown(1, onset_s))
    (press,) = participant.read(onset_s + 5.0)
    assert 0.0 <= clock.now_s() - press.time_s < 0.5


def test_press_of_an_aborted_trial_still_comes() -> None:
    participant = SimulatedParticipant(virtual_clock(), seed=1, place=1, session=1, traits=EAGER)
    participant.open()
    for attempt in (1, 2):
        participant.present(shown(1, 10.0 * attempt, attempt=attempt))
    first, second = participant.read(15.0), participant.read(25.0)
    assert 10.0 < first[0].time_s < 15.0
    assert 20.0 < second[0].time_s < 25.0


def test_catch_trials_need_no_clothing() -> None:
    participant = SimulatedParticipant(virtual_clock(), seed=1, place=1, session=1, traits=EAGER)
    participant.open()
    participant.present(shown(1, 0.0, drive=0.0, clothing=None))
    assert len(participant.read(100.0)) == 1  # a false alarm, of somebody who always says yes


@pytest.mark.parametrize("level", ["outer_only", "Inner", "", 2.0])
def test_unknown_clothing_is_felt_as_bare_skin(level: float | str) -> None:
    pressed = []
    for clothing in (level, None):
        participant = SimulatedParticipant(virtual_clock(), seed=1, place=1, session=1)
        participant.open()
        for trial in range(1, 50):
            participant.present(shown(trial, 0.0, clothing=clothing))
        pressed.append(participant.read(100.0))
    assert pressed[0] == pressed[1]
    assert pressed[0]


def test_unknown_clothing_of_a_plan_is_said() -> None:
    trials = [
        PlannedTrial(
            trial=number,
            block=1,
            trial_type="stimulus",
            conditions={"clothing": clothing},
            stimulus=StimulusSpec(duration_s=1.0, modulation_hz=50.0, target="chest"),
            pause_before_s=1.0,
        )
        for number, clothing in enumerate(("inner_outer", "coat", 2.0, None), start=1)
    ]
    plan = Plan(protocol="p", place=1, session=1, seed=1, blocks=(), trials=tuple(trials))
    participant = SimulatedParticipant(virtual_clock(), seed=1, place=1, session=1)
    remarks = participant.remarks(plan)
    assert len(remarks) == 2
    assert "clothing 2.0 lets through" in remarks[0]
    assert "clothing coat lets through" in remarks[1]


def test_other_words_for_clothing_can_be_given() -> None:
    clock = virtual_clock()
    participant = SimulatedParticipant(
        clock, seed=1, place=1, session=1, traits=EAGER, clothing_factor="wear", layers={"coat": ("outer",)}
    )
    participant.open()
    participant.present(
        Presentation(1, 1, 0.0, 1.0, 1.0, 100.0, "chest", {"wear": "coat", "clothing": "unknown"})
    )
    assert participant.read(100.0)


CONDITIONS = list(itertools.product(("inner", "inner_outer"), (25.0, 50.0, 100.0)))
PUBLISHED_RATES = {
    ("inner", 25.0): 0.53,
    ("inner", 50.0): 0.79,
    ("inner", 100.0): 0.965,
    ("inner_outer", 25.0): 0.17,
    ("inner_outer", 50.0): 0.26,
    ("inner_outer", 100.0): 0.455,
}


def participant_rates(seed: int, place: int) -> list[float]:
    """Run one participant of the chest study with catch trials through the responder; rates by condition."""
    clock = virtual_clock()
    participant = SimulatedParticipant(clock, seed=seed, place=place, session=1)
    participant.open()
    trial = 0
    rates = []
    for clothing, modulation_hz, drive in [
        *((*condition, 1.0) for condition in CONDITIONS),
        (None, 100.0, 0.0),
    ]:
        felt = 0
        for _ in range(10):
            trial += 1
            onset_s = clock.now_s() + 5.0
            participant.present(
                shown(trial, onset_s, drive=drive, modulation_hz=modulation_hz, clothing=clothing)
            )
            felt += bool(participant.read(onset_s + 30.0))
        rates.append(felt / 10)
    return rates


@pytest.mark.slow
def test_studies_of_8_reproduce_the_specified_mean_rates() -> None:
    """The sheet's means are over 400 random studies, rounded to half a per cent or a tenth."""
    number = 120
    rates = np.array([participant_rates(seed, place) for seed in range(number) for place in range(1, 9)])
    means = rates.mean(axis=0)
    errors = rates.std(axis=0, ddof=1) / np.sqrt(len(rates))
    expected = np.array([*(PUBLISHED_RATES[condition] for condition in CONDITIONS), 0.066])
    rounding = np.array([0.005] * 6 + [0.0005])
    assert (np.abs(means - expected) < 4 * np.sqrt(1 + number / 400) * errors + rounding).all(), np.c_[
        means, expected, errors
    ]
    studies = rates.reshape(number, 8, 7)
    assert np.mean([is_best_at_100_hz(study) for study in studies]) == pytest.approx(0.9975, abs=0.01)
    p_values = stats.ttest_rel(studies[:, :, 2], studies[:, :, 5], axis=1).pvalue
    assert np.log10(np.quantile(p_values, [0.25, 0.5, 0.75])) == pytest.approx(
        np.log10([1.2e-3, 4.2e-3, 1.1e-2]), abs=0.15
    )


def is_best_at_100_hz(study: npt.NDArray[np.float64]) -> bool:
    rates = study.mean(axis=0)
    return bool(rates[2] == rates[:3].max() and rates[5] == rates[3:6].max())


def felt(predicted_force_mn: dict[str, float]) -> int:
    """How many of 200 faint stimuli are felt under a field."""
    clock = virtual_clock()
    average = ParticipantTraits(0.0, inner_loss_db=-3.0, outer_loss_db=-6.5, criterion=1.65)
    participant = SimulatedParticipant(
        clock, seed=1, place=1, session=1, traits=average, predicted_force_mn=predicted_force_mn
    )
    participant.open()
    for trial in range(1, 201):
        participant.present(shown(trial, 10.0 * trial, modulation_hz=50.0))
    return len(participant.read(10_000.0)) + sum(len(participant.read(10_000.0)) for _ in range(200))


def test_a_weaker_field_is_felt_less_often() -> None:
    good, half, lost = felt({}), felt({"chest": PREDICTED_FORCE_MN / 2}), felt({"chest": 0.0})
    assert good > half + 20 > lost + 20
    assert felt({"chest": PREDICTED_FORCE_MN}) == good
    assert felt({"elsewhere": 0.0}) == good


def test_the_record_says_which_force_was_taken() -> None:
    participant = SimulatedParticipant(
        virtual_clock(), seed=1, place=1, session=1, predicted_force_mn={"chest": PREDICTED_FORCE_MN / 4}
    )
    assert "5.0 mN at chest" in participant.open().device
