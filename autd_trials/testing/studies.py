"""Protocols to test with, small and in a plain order; their plans come from `make_plan` as ever."""

from collections.abc import Mapping, Sequence
from typing import Any

from autd_trials.array.driver import ArrayInfo
from autd_trials.masking.masker import MaskerInfo
from autd_trials.protocol.plan import Plan
from autd_trials.protocol.schema import (
    Factor,
    Factors,
    Level,
    Masking,
    Order,
    Protocol,
    Response,
    Safety,
    StimulusSpec,
    Study,
    Target,
    Timing,
)
from autd_trials.responses.responder import ResponderInfo
from autd_trials.session.events import DeviceDescriptions

FREQUENCIES_HZ: tuple[Level, ...] = (25.0, 50.0, 100.0)
CLOTHING: tuple[Level, ...] = ("inner", "inner_outer")

DEVICES = DeviceDescriptions(
    array=ArrayInfo(
        driver="virtual",
        link="none",
        emulated=True,
        devices=18,
        transducers=18 * 249,
        firmware=("v12.0.0",),
    ),
    masker=MaskerInfo(
        kind="pink", device="null sink", level_dbfs=-30.0, level_dba=None, sample_rate_hz=48000
    ),
    responder=ResponderInfo(kind="simulated", device="simulated", time_uncertainty_s=0.0),
)
"""What devices might say of themselves."""


def make_protocol(
    name: str = "chest-catch",
    *,
    within: Mapping[str, Sequence[Level]] | None = None,
    between: Mapping[str, Sequence[Level]] | None = None,
    **changes: Any,
) -> Protocol:
    """Return a protocol of two blocks, each with two stimuli at three frequencies and one catch trial.

    Blocks and trials come as they are declared: all kinds of trial in turn, the catch trial as the fourth. So
    a test can say beforehand what trial 5 is, in a plan that `make_plan` makes like any other.

    Parameters
    ----------
    name
        The protocol's name.
    within, between
        Levels by factor, within blocks and between them, instead of frequency and clothing.
    changes
        Fields of `Protocol` that are to be otherwise. They are not validated: a test may ask what happens to
        a protocol that could not be loaded.

    Returns
    -------
    Protocol
        One that can be run, if the changes let it.
    """
    protocol = Protocol(
        name=name,
        description="Detection of a focus on the clothed chest.",
        study=Study(
            title="Midair stimuli on the chest",
            authors=("A. One", "B. Two"),
            institution_name="An Institute",
            institution_address="1 Street, Town",
            department="Haptics",
            ethics_approval="none needed: nobody took part",
        ),
        instructions="Press when you feel something.",
        targets={"chest": Target(x_mm=278.0, y_mm=217.0, z_mm=1000.0)},
        stimulus=StimulusSpec(duration_s=1.0, modulation_hz=50.0, target="chest"),
        factors=Factors(
            within_block=_factors({"modulation_hz": FREQUENCIES_HZ} if within is None else within),
            between_blocks=_factors({"clothing": CLOTHING} if between is None else between),
        ),
        repetitions=2,
        catch_trials_per_block=1,
        order=Order(trials="fixed", blocks="fixed"),
        timing=Timing(response_window_s=2.0, pause_min_s=3.0, pause_max_s=3.0),
        masking=Masking(level_dbfs=-30.0),
        response=Response(question="Did you feel something?"),
        safety=Safety(longest_burst_s=1.0, largest_duty=0.5, session_exposure_s=100.0),
    )
    return protocol.model_copy(update=changes)


def _factors(levels: Mapping[str, Sequence[Level]]) -> dict[str, Factor]:
    return {name: Factor(levels=tuple(its_levels)) for name, its_levels in levels.items()}


def start_fields(
    protocol: Protocol, plan: Plan, participant: str, session: str, *, simulated: bool
) -> dict[str, Any]:
    """Return the fields of a `SessionStart` but for its time, its devices and the protocol file's hash."""
    return {
        "participant": participant,
        "session": session,
        "simulated": simulated,
        "virtual_time": simulated,
        "protocol": protocol,
        "plan": plan,
        "rig": {"name": "emulated"},
        "calibration": {"method": "by hand", "made_up": True, "time": "2026-11-22T08:00:00Z"},
        "calibration_sha256": "cd" * 32,
        "versions": {"autd-trials": "0.1.0", "python": "3.11.7"},
        "git_commit": None,
    }
