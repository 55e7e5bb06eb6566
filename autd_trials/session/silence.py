"""Silence first, then the log."""

from autd_trials.array.driver import ArrayDriver
from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.session.events import Fault
from autd_trials.session.recorder import Recorder


def silence(array: ArrayDriver, recorder: Recorder, clock: Clock) -> None:
    """Silence the array; if it did not confirm, record that, as the session's end must still be recorded."""
    try:
        array.abort()
    except DeviceError as error:
        recorder.record(
            Fault,
            device="array",
            what=f"silence was not confirmed: {error.what}",
            happened_t_s=recorder.session_time(clock.now_s()),
        )
