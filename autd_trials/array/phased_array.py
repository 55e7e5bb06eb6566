"""The array driver: limits, envelope, focus, timing and health in one place, over any backend.

No backend is reached but through here, so that none can get round the limits.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NoReturn

from autd_trials.array.backend import START_GRID_NS, Backend, Burst, DeviceStates, Reading, StartRefusedError
from autd_trials.array.driver import ArrayInfo, Completion, Exposure, Health, Onset, Stimulus
from autd_trials.array.ears import EarWatch
from autd_trials.array.envelope import samples
from autd_trials.array.focus import focus_phases
from autd_trials.array.geometry import UnitPose, device_poses, transducer_positions_mm
from autd_trials.array.limits import ExposureMeter, refuse_out_of_reach
from autd_trials.clock import Clock
from autd_trials.errors import DeviceError, UsageError
from autd_trials.stimulus import DRIVE_STEPS, Limits, drive_step, exposure_s

_SHORTEST_SEND_LEAD_S, _LONGEST_SEND_LEAD_S = 0.05, 1.0
_ALLOWANCE_S = 0.1  # a host that is late by less than this does not delay the onset
_FIRMWARE_MARGIN_S = 0.01  # the firmware refuses a start that is closer
_IN_HAND_S = 0.01
_SEND_TIMES_KEPT = 20
_START_ATTEMPTS = 3
_LOOK_EVERY_S = 0.05  # while a burst runs
_PATIENCE_S = 0.2  # answers took up to 0.12 s on a busy computer; a loss is to be noticed within 0.3 s
_STALL_TOLD_S = 0.1
_REPORT_DEADLINE_S = 0.1  # the devices' reports lag by up to 15 ms
_REPORT_POLL_S = 0.005


@dataclass(frozen=True)
class _Running:
    ends_s: float
    silent_s: float
    after_onset: Reading


class PhasedArray:
    """Units of phased arrays that emit finite bursts at one focus; implements `ArrayDriver`.

    Parameters
    ----------
    units
        The units' poses in the calibrated frame.
    backend
        The devices.
    limits
        What may be emitted.
    clock
        The host's clock, the same that the backend has.
    speed_of_sound_m_s
        Speed of sound in m/s.
    exposure_used_s
        Exposure that the session has used before, in s at full drive.
    daily_used_s
        What the participant was exposed to in the 24 h before, this session included.
    earlier_bursts
        When earlier bursts began and ended, on the host's clock; the newest last.
    ears
        Watches over the level at the ears; None if it is not known where they are.
    """

    def __init__(
        self,
        units: Sequence[UnitPose],
        backend: Backend,
        limits: Limits,
        clock: Clock,
        *,
        speed_of_sound_m_s: float,
        exposure_used_s: float = 0.0,
        daily_used_s: float = 0.0,
        earlier_bursts: Sequence[tuple[float, float]] = (),
        ears: EarWatch | None = None,
    ) -> None:
        self._units = list(units)
        self._transducers_mm = transducer_positions_mm(self._units)
        self._backend = backend
        self._meter = ExposureMeter(
            limits, exposure_used_s, daily_used_s=daily_used_s, earlier_bursts=earlier_bursts
        )
        self._ears = ears
        self._clock = clock
        self._speed_of_sound_m_s = speed_of_sound_m_s
        self._send_times_s: deque[float] = deque(maxlen=_SEND_TIMES_KEPT)
        self._armed: tuple[Stimulus, Burst] | None = None
        self._running: _Running | None = None
        self._look: tuple[float, Reading] | None = None

    @property
    def exposure_used_s(self) -> float:
        """Exposure that the session has used, in s at full drive."""
        return self._meter.used_s

    @property
    def lead_s(self) -> float:
        """How long before the onset `start` must be called, in s.

        What sending needs, and 0.1 s for a last look at the devices and a busy host.
        """
        return self._send_lead_s + _ALLOWANCE_S

    def open(self) -> ArrayInfo:
        """Take the devices, check that they are all there and well, leave them silent."""
        info = self._backend.open(device_poses(self._units))
        try:
            self._refuse_unwell(self._backend.states())
        except DeviceError:
            self.close()
            raise
        return info

    def check(self, stimuli: Sequence[Stimulus]) -> None:
        """Refuse what could not be emitted one after the other under the limits.

        The share of on-time depends on the onsets, which are not known here; `start` watches over it, and
        `autd_trials.stimulus.largest_duty` tells it for a planned schedule.
        """
        for stimulus in dict.fromkeys(stimuli):
            self._burst(stimulus)
        self._meter.refuse_unsafe(stimuli)

    def earliest_s(self, stimulus: Stimulus, onset_s: float) -> float:
        """Return the earliest host time from `onset_s` on at which the share of on-time allows a stimulus."""
        return self._meter.earliest_s(stimulus, onset_s)

    def arm(self, stimulus: Stimulus) -> Exposure:
        """Preload a stimulus in silence; return its exposure and the level at the ears."""
        self._backend.halted.refuse()
        if self._running:
            raise RuntimeError("arm: the last stimulus was neither finished nor aborted")
        self._armed = None
        self._meter.refuse_unsafe([stimulus])
        burst = self._burst(stimulus)
        self._refuse_unwell(self._backend.states())
        self._backend.load(burst)
        self._armed = (stimulus, burst)
        return Exposure(exposure_s(stimulus), self._ears.level_db(stimulus) if self._ears else None)

    def start(self, onset_s: float) -> Onset:
        """Start the armed stimulus at host time `onset_s`, or as soon after it as the lead allows."""
        self._backend.halted.refuse()
        if self._armed is None:
            raise RuntimeError("start: no stimulus is armed")
        (stimulus, burst), self._armed = self._armed, None
        try:
            for _ in range(_START_ATTEMPTS):
                if onset := self._start_once(stimulus, burst, onset_s):
                    return onset
            raise DeviceError(
                f"the devices refused {_START_ATTEMPTS} starts as too close",
                do="this computer is too busy to send in time: close other programs",
            )
        except DeviceError as error:
            self._fail(error)

    def watch(self) -> None:
        """Look at the devices while a started stimulus runs; never waits for them.

        They are asked every 0.05 s, however often this is called. No answer for 0.2 s counts as a loss; the
        time during which this computer itself stood still does not count.
        """
        self._backend.halted.refuse()
        if self._running is None:
            return
        now_s = self._clock.now_s()
        if self._look is None or (self._look[1].done() and now_s >= self._look[0] + _LOOK_EVERY_S):
            self._look = (now_s, self._backend.reading())
        asked_s, reading = self._look
        try:
            if reading.done():
                self._refuse_unwell(reading.result())
            elif now_s - asked_s > _PATIENCE_S + self._backend.stalled_s():
                raise DeviceError(
                    f"the devices have not answered for {now_s - asked_s:.2f} s{self._stall()}",
                    do="check their power and cables, then go on with --resume",
                )
        except DeviceError:
            self._armed = self._running = self._look = None
            self._backend.silence(confirmed=False)
            raise

    def finish(self) -> Completion:
        """Wait until the started stimulus has ended by itself; silence the array and raise if it does not."""
        if self._running is None:
            raise RuntimeError("finish: no stimulus was started")
        running = self._running
        try:
            while (now_s := self._clock.now_s()) < running.ends_s:
                self.watch()
                self._clock.sleep_until(min(now_s + min(self._clock.poll_s, _LOOK_EVERY_S), running.ends_s))
            self._running = self._look = None
            emitting = running.after_onset.result()
            self._backend.halted.refuse()
            self._refuse_unwell(emitting)
            if emitting.on_burst < emitting.devices:
                raise DeviceError("the burst did not begin on all devices", do="check the devices; run again")
            ended = self._states_when(
                lambda states: states.on_burst == states.ended == states.devices,
                deadline_s=max(running.ends_s, self._clock.now_s()) + _REPORT_DEADLINE_S,
                otherwise="the burst did not end by itself on all devices",
            )
        except DeviceError as error:
            self._fail(error)
        return Completion(running.silent_s, emitting.received_s, ended.received_s, _health(ended))

    def abort(self) -> None:
        """Silence the array now, whatever it does; safe at any time, also twice.

        Raises
        ------
        DeviceError
            If the devices did not confirm that they are silent.
        """
        self._armed = self._running = self._look = None
        self._backend.silence()

    def halt(self) -> None:
        """Silence the array now, from any thread, and refuse every `arm` and `start` until it is opened."""
        self._backend.halt()

    def health(self) -> Health:
        """Read the devices' state now."""
        return _health(self._backend.states())

    def close(self) -> None:
        """Silence and release the array; never raises."""
        self._armed = self._running = self._look = None
        self._backend.close()

    @property
    def _send_lead_s(self) -> float:
        """The firmware's 10 ms, 10 ms in hand, three times the longest of the last 20 sends; 50 ms to 1 s."""
        slowest_s = max(self._send_times_s, default=0.0)
        lead_s = _FIRMWARE_MARGIN_S + _IN_HAND_S + 3 * slowest_s
        return min(max(lead_s, _SHORTEST_SEND_LEAD_S), _LONGEST_SEND_LEAD_S)

    def _burst(self, stimulus: Stimulus) -> Burst:
        refuse_out_of_reach(self._units, stimulus.target_mm)
        if self._ears:
            self._ears.refuse_unsafe(stimulus)
        phases = focus_phases(self._transducers_mm, stimulus.target_mm, self._speed_of_sound_m_s)
        return Burst(samples(stimulus), phases, _intensity(stimulus.drive))

    def _start_once(self, stimulus: Stimulus, burst: Burst, requested_s: float) -> Onset | None:
        """Start as soon as the lead allows; None, silent and loaded again, if it was refused as too close."""
        before = self._backend.states()
        self._refuse_unwell(before)
        if not before.silent:
            raise DeviceError("the array is not silent before a start", do="check the devices; run again")
        sent_s = self._clock.now_s()
        planned_s = max(requested_s, sent_s + self._send_lead_s)
        self._meter.refuse_too_soon(stimulus, planned_s)
        self._meter.charge(
            stimulus, planned_s
        )  # before it is sent: what fails half-way may have been emitted
        pair = self._backend.time_pair()
        device_ns = _on_grid(pair.device_ns_at(planned_s))
        onset_s = pair.host_s_at(device_ns)
        try:
            self._backend.start(device_ns)
        except StartRefusedError:
            self._cancel_before(onset_s)
            self._backend.load(burst)
            return None
        finally:
            accepted_s = self._clock.now_s()
            self._send_times_s.append(accepted_s - sent_s)
        after_onset = self._backend.reading_after(device_ns)
        silent_s = self._last_silent_s(before, onset_s)
        self._running = _Running(onset_s + stimulus.duration_s, silent_s, after_onset)
        return Onset(onset_s, device_ns, requested_s, onset_s - accepted_s)

    def _cancel_before(self, onset_s: float) -> None:
        """Cancel a start that only some devices may have accepted."""
        self._backend.silence()
        if self._clock.now_s() >= onset_s:
            raise DeviceError(
                "some devices refused a start, and others may have emitted before they were silenced",
                do="run the trial again; close other programs on this computer",
            )

    def _last_silent_s(self, before: DeviceStates, onset_s: float) -> float:
        """Read back that the start is pending; return when the array was last known to be silent."""
        accepted = self._states_when(
            lambda states: states.pending + states.on_burst >= states.devices,
            deadline_s=self._clock.now_s() + _REPORT_DEADLINE_S,
            otherwise="an accepted start is not pending on all devices",
        )
        if accepted.on_burst and accepted.received_s < onset_s:
            raise DeviceError(
                "devices emit before the time they were given", do="check the devices' firmware"
            )
        return before.requested_s if accepted.on_burst else accepted.requested_s

    def _states_when(
        self, wanted: Callable[[DeviceStates], bool], *, deadline_s: float, otherwise: str
    ) -> DeviceStates:
        while True:
            states = self._backend.states()
            self._backend.halted.refuse()  # first: what halts the array may mute its devices
            self._refuse_unwell(states)
            if wanted(states):
                return states
            if states.requested_s >= deadline_s:
                raise DeviceError(otherwise, do="switch the devices off and on and start again")
            self._clock.sleep_until(self._clock.now_s() + _REPORT_POLL_S)

    def _refuse_unwell(self, states: DeviceStates) -> None:
        if states.ready < states.devices:
            raise DeviceError(
                f"only {states.ready} of {states.devices} devices answer{self._stall()}",
                do="check their power and cables, then go on with --resume",
            )
        if states.failsafe:
            raise DeviceError(
                f"the devices' failsafe has muted them: they lost touch with this computer{self._stall()}",
                do="check the cables and that the computer did not sleep, then go on with --resume",
            )
        if states.thermal:
            raise DeviceError(
                "a device is too hot",
                do="let the devices cool and check their fans, then go on with --resume",
            )

    def _stall(self) -> str:
        """Return a clause that blames this computer where it stood still, else nothing."""
        stalled_s = self._backend.stalled_s()
        if stalled_s < _STALL_TOLD_S:
            return ""
        return f" (this computer stood still for {stalled_s:.2f} s: it is too busy, close other programs)"

    def _fail(self, error: DeviceError) -> NoReturn:
        try:
            self.abort()
        except DeviceError as not_silent:
            raise DeviceError(
                f"{error.what}; {not_silent.what}", where=error.where, do=not_silent.do
            ) from error
        raise error


def _intensity(drive: float) -> int:
    """Return the intensity byte; the pressure amplitude is proportional to it."""
    if not 0 <= drive <= 1:
        raise UsageError(f"the stimulus's drive is {drive}", do="make drive 0 to 1")
    intensity = drive_step(drive)
    if drive > 0 and intensity == 0:
        raise UsageError(
            f"the stimulus's drive of {drive} is too small for the devices",
            do=f"make drive 0 (nothing is emitted) or at least {1 / DRIVE_STEPS:.4f}",
        )
    return intensity


def _on_grid(device_ns: int) -> int:
    """Return the next grid time: between two, the devices would cut the first sample short."""
    return -(-device_ns // START_GRID_NS) * START_GRID_NS


def _health(states: DeviceStates) -> Health:
    return Health(states.received_s, states.devices, states.ready, states.failsafe, states.thermal)
