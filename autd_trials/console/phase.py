"""What goes on in a session at a moment, as it is shown to the experimenter."""

from typing import Literal

from autd_trials.session.standing import Standing

Phase = Literal[
    "waiting", "lead-in", "ready", "stimulus", "response window", "pause between", "paused", "ended"
]


def phase_at(now: Standing, t_s: float) -> Phase:
    """Return the phase at session time `t_s` in s."""
    if now.finished:
        return "ended"
    if now.paused is not None:
        return "paused"
    if now.block is None:
        return "waiting"
    if now.trial is None:
        return "lead-in"
    since_onset_s = -1.0 if now.trial.onset_t_s is None else t_s - now.trial.onset_t_s
    if since_onset_s < 0:
        return "ready"
    if since_onset_s < now.trial.duration_s:
        return "stimulus"
    if since_onset_s < now.start.protocol.timing.response_window_s:
        return "response window"
    return "pause between"
