"""Tests of a rig without hardware: a stage in virtual time, scripted people, whole studies."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.testing.recorded import StudyWriter
    from autd_trials.testing.responder import ScriptedResponder
    from autd_trials.testing.script import SessionScript, write_log
    from autd_trials.testing.stage import MemoryLog, ScriptedOperator, Stage, make_stage
    from autd_trials.testing.studies import make_protocol

__all__ = [
    "MemoryLog",
    "ScriptedOperator",
    "ScriptedResponder",
    "SessionScript",
    "Stage",
    "StudyWriter",
    "make_protocol",
    "make_stage",
    "write_log",
]

__getattr__ = lazy(
    __name__,
    {
        "MemoryLog": "stage",
        "ScriptedOperator": "stage",
        "ScriptedResponder": "responder",
        "SessionScript": "script",
        "Stage": "stage",
        "StudyWriter": "recorded",
        "make_protocol": "studies",
        "make_stage": "stage",
        "write_log": "script",
    },
)
