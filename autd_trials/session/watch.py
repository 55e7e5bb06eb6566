"""The one place where a session waits, so that nothing goes unnoticed meanwhile."""

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.session.devices import Devices
from autd_trials.session.events import Fault
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.presses import PressBook
from autd_trials.session.recorder import Recorder

_LOOK_S = 0.1
"""How often the devices are looked at while a burst runs, at least."""


class Watch:
    """Waits while it takes presses in and looks at the array, the masker and at requests to abort."""

    def __init__(
        self, devices: Devices, clock: Clock, interrupts: Interrupts, recorder: Recorder, presses: PressBook
    ) -> None:
        self._devices = devices
        self._clock = clock
        self._interrupts = interrupts
        self._recorder = recorder
        self._presses = presses
        self.underruns = 0

    def until(self, time_s: float, *, pausable: bool = False, burst: bool = False) -> None:
        """Wait until the clock shows `time_s`; if `pausable`, only until a pause is requested.

        While a `burst` runs, the array is looked at every 0.1 s also where the clock would wait longer.

        Raises
        ------
        StoppedByPerson
            An abort was requested.
        DeviceError
            The array, the responder or the sound was lost.
        """
        step_s = min(self._clock.poll_s, _LOOK_S) if burst else self._clock.poll_s
        while True:
            self.look()
            now_s = self._clock.now_s()
            self._presses.take(self._devices.responder.read(min(time_s, now_s + step_s)))
            if now_s >= time_s or (pausable and self._interrupts.pause_requested):
                return

    def look(self) -> None:
        """Look once, without waiting; raises as `until` does."""
        self._interrupts.obey()
        self._devices.array.watch()
        if self._devices.masker is None:
            return
        for event in self._devices.masker.events():
            what = f"{event.kind}: {event.detail}"
            happened_t_s = self._recorder.session_time(event.time_s)
            if event.kind == "lost":
                raise DeviceError(
                    what, where="masker", do="see that the sound device is plugged in, then go on"
                )
            self.underruns += 1
            self._recorder.record(Fault, device="masker", what=what, happened_t_s=happened_t_s)
