"""Running a session: events, the runner, what it needs of devices and of the operator."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.session.devices import Devices
    from autd_trials.session.events import Event
    from autd_trials.session.interrupts import Interrupts
    from autd_trials.session.operator import Operator, Unattended
    from autd_trials.session.preflight import Preflight
    from autd_trials.session.recorder import Recorder
    from autd_trials.session.runner import Done, SessionRunner
    from autd_trials.session.standing import Standing

__all__ = [
    "Devices",
    "Done",
    "Event",
    "Interrupts",
    "Operator",
    "Preflight",
    "Recorder",
    "SessionRunner",
    "Standing",
    "Unattended",
]

__getattr__ = lazy(
    __name__,
    {
        "Devices": "devices",
        "Done": "runner",
        "Event": "events",
        "Interrupts": "interrupts",
        "Operator": "operator",
        "Preflight": "preflight",
        "Recorder": "recorder",
        "SessionRunner": "runner",
        "Standing": "standing",
        "Unattended": "operator",
    },
)
