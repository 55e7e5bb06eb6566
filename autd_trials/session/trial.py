"""One trial, from arming to the end of the response window."""

from dataclasses import dataclass

from autd_trials.array.driver import Completion, Exposure
from autd_trials.clock import Clock
from autd_trials.protocol.plan import PlannedTrial
from autd_trials.protocol.schema import Protocol
from autd_trials.responses.responder import Presentation
from autd_trials.session.devices import Devices, array_stimulus
from autd_trials.session.events import StimulusStart, TrialEnd, TrialStart
from autd_trials.session.presses import PressBook, TrialWindow
from autd_trials.session.recorder import Recorder
from autd_trials.session.silence import silence
from autd_trials.session.watch import Watch

_RESERVE_S = 0.03
"""Kept free before the start command for the safe point and for making `trial-start` durable."""

_GRACE_S = 0.02
"""How long after its window a trial still waits for a press that a device stamped inside it."""


@dataclass(frozen=True)
class Ended:
    """How a complete trial ended: when its window did, on the host's clock, and whether it was felt."""

    window_end_s: float
    felt: bool


@dataclass(frozen=True)
class TrialRunner:
    """Runs single attempts of trials with a session's devices."""

    protocol: Protocol
    devices: Devices
    clock: Clock
    recorder: Recorder
    presses: PressBook
    watch: Watch

    def arm(self, trial: PlannedTrial, onset_s: float) -> Exposure:
        """Preload the trial in silence and wait until shortly before it must be started.

        Returns early when a pause is requested.

        Returns
        -------
        Exposure
            What the stimulus would do.
        """
        exposure = self.devices.array.arm(array_stimulus(self.protocol, trial))
        self.watch.until(onset_s - self.devices.array.lead_s - _RESERVE_S, pausable=True)
        return exposure

    def run(self, trial: PlannedTrial, attempt: int, onset_s: float, exposure: Exposure) -> Ended:
        """Run the armed trial at host time `onset_s` to the end of its response window.

        Whatever ends the trial early silences the array first; the trial is then recorded as interrupted.
        """
        start_s = self.clock.now_s()
        self.recorder.record(
            TrialStart,
            trial=trial.trial,
            block=trial.block,
            attempt=attempt,
            trial_type=trial.trial_type,
            conditions=trial.conditions,
        )
        underruns_before, started = self.watch.underruns, False
        try:
            self.watch.look()  # making the start durable may have taken long
            started = True
            window = self._stimulate(trial, attempt, start_s, onset_s, exposure)
            self.watch.until(window.onset_s + trial.stimulus.duration_s, burst=True)
            completion = self.devices.array.finish()
            self.watch.until(window.end_s + _GRACE_S)
            self.presses.refuse_doubtful()
        except BaseException:
            silence(self.devices.array, self.recorder, self.clock)
            self.recorder.record(
                TrialEnd,
                trial=trial.trial,
                attempt=attempt,
                status="interrupted",
                response=None,
                response_time_s=None,
                underruns=self.watch.underruns - underruns_before,
                started=started,
            )
            raise
        self._end(window, completion, self.watch.underruns - underruns_before)
        return Ended(window.end_s, self.presses.response_time_s is not None)

    def _stimulate(
        self, trial: PlannedTrial, attempt: int, start_s: float, onset_s: float, exposure: Exposure
    ) -> TrialWindow:
        onset = self.devices.array.start(onset_s)
        spec = trial.stimulus
        self.recorder.record(
            StimulusStart,
            trial=trial.trial,
            attempt=attempt,
            onset_t_s=self.recorder.session_time(onset.onset_s),
            planned_onset_t_s=self.recorder.session_time(onset_s),
            device_ns=onset.device_ns,
            margin_s=round(onset.margin_s, 6),
            duration_s=spec.duration_s,
            drive=spec.drive,
            exposure_s=exposure.exposure_s,
            ear_level_db=None if exposure.ear_level_db is None else round(exposure.ear_level_db, 1),
        )
        self.devices.responder.present(
            Presentation(
                trial=trial.trial,
                attempt=attempt,
                onset_s=onset.onset_s,
                duration_s=spec.duration_s,
                drive=spec.drive,
                modulation_hz=spec.modulation_hz,
                target=spec.target,
                conditions=trial.conditions,
            )
        )
        window_end_s = onset.onset_s + self.protocol.timing.response_window_s
        window = TrialWindow(trial.trial, attempt, start_s, onset.onset_s, window_end_s)
        self.presses.open_window(window)
        return window

    def _end(self, window: TrialWindow, completion: Completion, underruns: int) -> None:
        response_time_s = self.presses.response_time_s
        self.recorder.record(
            TrialEnd,
            trial=window.trial,
            attempt=window.attempt,
            status="complete",
            response="not_felt" if response_time_s is None else "felt",
            response_time_s=response_time_s,
            silent_before_s=round(window.onset_s - completion.silent_s, 6),
            emitting_after_s=round(completion.emitting_s - window.onset_s, 6),
            devices_ready=completion.health.devices_ready,
            thermal=completion.health.thermal,
            underruns=underruns,
            started=True,
        )
