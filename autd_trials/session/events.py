"""What happens in a session, as it is logged and as listeners hear it.

Times `t_s` are seconds since the session's start, on one axis also across a resume. The log adds each line's
number and its chained hash; logs of version 1 have neither, and lack the fields that are None by default.
"""

from datetime import UTC, datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, JsonValue

from autd_trials.array.driver import ArrayInfo
from autd_trials.masking.masker import MaskerInfo
from autd_trials.model import Model
from autd_trials.protocol.plan import Plan, TrialType
from autd_trials.protocol.schema import Level, Protocol
from autd_trials.responses.responder import ResponderInfo
from autd_trials.stimulus import Fraction, Limits

_EARLIEST, _LATEST = datetime(1970, 1, 1, tzinfo=UTC), datetime(9999, 1, 1, tzinfo=UTC)
_LONGEST_S = 1e9


def _time(text: str) -> str:
    """Refuse what is no point in time, or none that can be reckoned with."""
    try:
        time = datetime.fromisoformat(text)
        known = time.tzinfo is not None and _EARLIEST <= time < _LATEST
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{text!r} is not a time") from error
    if not known:
        raise ValueError(f"{text!r} is not a time with its zone, from 1970 on")
    return text


Utc = Annotated[str, AfterValidator(_time)]
SessionTime = Annotated[float, Field(ge=0, le=_LONGEST_S)]
AnyTime = Annotated[float, Field(ge=-_LONGEST_S, le=_LONGEST_S)]
"""On the session's axis, but perhaps before its start: a press."""
Number = Annotated[int, Field(ge=1)]
Count = Annotated[int, Field(ge=0)]
Json = dict[str, JsonValue]
"""A rig or a calibration: rooms that the session does not know, so their files' contents as they are."""
ConfirmedBy = Literal["person", "unattended"]


class HostTime(Model):
    """A clock that nobody sets: seconds since the computer was switched on, and which time that was.

    `boot` is None where the system does not say.
    """

    boot: str | None
    since_boot_s: float


class DeviceDescriptions(Model):
    """What the devices said of themselves when they were opened."""

    array: ArrayInfo
    masker: MaskerInfo | None
    responder: ResponderInfo


class _NothingKnown(Model):
    """What version 1 had where nothing was known: an empty object."""


def _none_if_nothing(devices: DeviceDescriptions | _NothingKnown | None) -> DeviceDescriptions | None:
    return None if isinstance(devices, _NothingKnown) else devices


class _Event(Model):
    t_s: SessionTime
    utc: Utc


class SessionStart(_Event):
    """The first line: everything needed to know, judge and repeat the session.

    `limits` are those under which both rig and protocol hold, `exposure_today_s` is what the participant was
    exposed to in the 24 h before.
    """

    event: Literal["session-start"] = "session-start"
    format: Literal[1, 2] = 2
    participant: str
    session: str
    simulated: bool
    virtual_time: bool
    protocol: Protocol
    protocol_sha256: str
    plan: Plan
    rig: Json
    calibration: Json
    calibration_sha256: str
    devices: DeviceDescriptions
    versions: dict[str, str]
    git_commit: str | None
    limits: Limits | None = None
    exposure_today_s: float | None = Field(None, ge=0)
    host: HostTime | None = None


class BlockStart(_Event):
    """A block begins; `confirmed_by` says who confirmed the conditions that a person arranges."""

    event: Literal["block-start"] = "block-start"
    block: Number
    conditions: dict[str, Level]
    confirmed_by: ConfirmedBy


class TrialStart(_Event):
    """A trial begins; `attempt` counts from 1.

    It is durable before the start command is given, and the attempt's exposure is charged with it.
    """

    event: Literal["trial-start"] = "trial-start"
    trial: Number
    block: Number
    attempt: Number
    trial_type: TrialType
    conditions: dict[str, Level | None]


class StimulusStart(_Event):
    """The start command was accepted; `onset_t_s` is the hardware onset on the session's axis.

    `ear_level_db` is predicted; None where nothing is emitted or the protocol does not say where the head is.
    """

    event: Literal["stimulus"] = "stimulus"
    trial: Number
    attempt: Number
    onset_t_s: SessionTime
    planned_onset_t_s: SessionTime
    device_ns: int
    margin_s: float
    duration_s: float = Field(gt=0)
    drive: Fraction
    exposure_s: float = Field(ge=0)
    ear_level_db: float | None = None


class ResponseMade(_Event):
    """A press; `phase` is where it fell.

    `response_time_s` counts from the hardware onset; it is negative before it. `meaning` is felt, or other
    for a button that does not mean felt, or repeat where a key that is held down repeats itself; only felt
    counts. It is None in version 1, where every press counted.
    """

    event: Literal["response"] = "response"
    trial: Number | None
    attempt: Number | None
    phase: Literal["outside", "before_onset", "window", "late"]
    press_t_s: AnyTime
    button: str
    response_time_s: float | None
    device_time_s: float | None
    meaning: Literal["felt", "other", "repeat"] | None = None

    @property
    def counts(self) -> bool:
        """Whether it is an answer if it falls in the response window."""
        return self.meaning in (None, "felt")


class TrialEnd(_Event):
    """A trial is over; only `complete` ones count, the others are run again.

    `started` says whether the start command was given: if not, nothing was emitted and nothing is charged.
    `silent_before_s` and `emitting_after_s` bracket the onset: the state read back, relative to it.
    """

    event: Literal["trial-end"] = "trial-end"
    trial: Number
    attempt: Number
    status: Literal["complete", "interrupted"]
    response: Literal["felt", "not_felt"] | None
    response_time_s: float | None
    silent_before_s: float | None = None
    emitting_after_s: float | None = None
    devices_ready: Count | None = None
    thermal: bool | None = None
    underruns: Count = 0
    started: bool | None = None


class Pause(_Event):
    """The session pauses, array silent; a break between blocks is a pause too."""

    event: Literal["pause"] = "pause"
    reason: str


class Resume(_Event):
    """The session goes on; where it was taken up again, with what it then runs on, as in its start."""

    event: Literal["resume"] = "resume"
    after_crash: bool
    confirmed_by: ConfirmedBy
    devices: Annotated[DeviceDescriptions | _NothingKnown | None, AfterValidator(_none_if_nothing)] = None
    versions: dict[str, str] = Field(default_factory=dict)
    rig: Json | None = None
    calibration: Json | None = None
    calibration_sha256: str | None = None
    limits: Limits | None = None
    exposure_today_s: float | None = Field(None, ge=0)
    host: HostTime | None = None


class Note(_Event):
    """A note by the experimenter, or by the runner about a deviation."""

    event: Literal["note"] = "note"
    text: str


class Fault(_Event):
    """Something failed at `happened_t_s`; `device` is array, masker, responder, disk or listener."""

    event: Literal["fault"] = "fault"
    device: str
    what: str
    happened_t_s: AnyTime


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
