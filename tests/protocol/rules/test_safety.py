import pytest

from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.plan import make_plan
from autd_trials.protocol.rules.safety import session_exposure_s


@pytest.mark.parametrize("name", ["chest", "chest-catch", "chest-threshold", "pilot"])
def test_exposure_is_that_of_the_planned_stimuli(name: str) -> None:
    protocol = load_protocol(find_protocol(name))
    plan = make_plan(protocol, place=1, session=1, seed=3)
    planned_s = sum(trial.stimulus.drive**2 * trial.stimulus.duration_s for trial in plan.trials)
    assert session_exposure_s(protocol) == pytest.approx(planned_s)
