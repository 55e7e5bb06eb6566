"""What happens in a session, as it is logged and as listeners hear it.

Times `t_s` are seconds since the session's start, on one axis also across a resume.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from autd_trials.protocol.plan import Plan, TrialType
from autd_trials.protocol.schema import Level, Protocol


class _Event(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    t_s: float
    utc: str


class SessionStart(_Event):
    """The first line: everything needed to know, judge and repeat the session."""

    event: Literal["session-start"] = "session-start"
    format: Literal[1, 2] = 2
    participant: str
    session: str
    simulated: bool
    virtual_time: bool
    protocol: Protocol
    protocol_sha256: str
    plan: Plan
    rig: dict[str, Any]
    calibration: dict[str, Any]
    calibration_sha256: str
    devices: dict[str, Any]
    versions: dict[str, str]
    git_commit: str | None


class BlockStart(_Event):
    """A block begins; `confirmed_by` says who confirmed the conditions that a person arranges."""

    event: Literal["block-start"] = "block-start"
    block: int
    conditions: dict[str, Level]
    confirmed_by: Literal["person", "unattended"]


class TrialStart(_Event):
    """A trial begins; `attempt` counts from 1."""

    event: Literal["trial-start"] = "trial-start"
    trial: int
    block: int
    attempt: int
    trial_type: TrialType
    conditions: dict[str, Level | None]


class StimulusStart(_Event):
    """The start command was accepted; `onset_t_s` is the hardware onset on the session's axis.

    `ear_level_db` is predicted; None where nothing is emitted or the protocol does not say where the head is.
    """

    event: Literal["stimulus"] = "stimulus"
    trial: int
    attempt: int
    onset_t_s: float
    planned_onset_t_s: float
    device_ns: int
    margin_s: float
    duration_s: float
    drive: float
    exposure_s: float
    ear_level_db: float | None = None


class ResponseMade(_Event):
    """A press; `phase` is where it fell.

    `response_time_s` counts from the hardware onset; it is negative before it.
    """

    event: Literal["response"] = "response"
    trial: int | None
    attempt: int | None
    phase: Literal["outside", "before_onset", "window", "late"]
    press_t_s: float
    button: str
    response_time_s: float | None
    device_time_s: float | None


class TrialEnd(_Event):
    """A trial is over; only `complete` ones count, the others are run again.

    `silent_before_s` and `emitting_after_s` bracket the onset: the state read back, relative to it.
    """

    event: Literal["trial-end"] = "trial-end"
    trial: int
    attempt: int
    status: Literal["complete", "interrupted"]
    response: Literal["felt", "not_felt"] | None
    response_time_s: float | None
    silent_before_s: float | None = None
    emitting_after_s: float | None = None
    devices_ready: int | None = None
    thermal: bool | None = None
    underruns: int = 0


class Pause(_Event):
    """The session pauses, array silent; a break between blocks is a pause too."""

    event: Literal["pause"] = "pause"
    reason: str


class Resume(_Event):
    """The session goes on; after a crash with what is known of the devices then."""

    event: Literal["resume"] = "resume"
    after_crash: bool
    confirmed_by: Literal["person", "unattended"]
    devices: dict[str, Any] = Field(default_factory=dict)
    versions: dict[str, str] = Field(default_factory=dict)


class Note(_Event):
    """A note by the experimenter, or by the runner about a deviation."""

    event: Literal["note"] = "note"
    text: str


class Fault(_Event):
    """Something failed at `happened_t_s`; `device` is array, masker, responder, disk or listener."""

    event: Literal["fault"] = "fault"
    device: str
    what: str
    happened_t_s: float


class SessionEnd(_Event):
    """The last line."""

    event: Literal["session-end"] = "session-end"
    status: Literal["success", "aborted", "failed"]
    why: str


Event = Annotated[
    SessionStart
    | BlockStart
    | TrialStart
    | StimulusStart
    | ResponseMade
    | TrialEnd
    | Pause
    | Resume
    | Note
    | Fault
    | SessionEnd,
    Field(discriminator="event"),
]
