"""What lasts: the event log, reading it back, the BIDS data set."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.records.bids import export_study
    from autd_trials.records.layout import SessionPaths
    from autd_trials.records.log import EventLog, LogContents, read_log
    from autd_trials.records.sessions import StudySession, study_sessions
    from autd_trials.records.verify import verify_log, verify_study

__all__ = [
    "EventLog",
    "LogContents",
    "SessionPaths",
    "StudySession",
    "export_study",
    "read_log",
    "study_sessions",
    "verify_log",
    "verify_study",
]

__getattr__ = lazy(
    __name__,
    {
        "EventLog": "log",
        "LogContents": "log",
        "SessionPaths": "layout",
        "StudySession": "sessions",
        "export_study": "bids",
        "read_log": "log",
        "study_sessions": "sessions",
        "verify_log": "verify",
        "verify_study": "verify",
    },
)
