"""What a BIDS data set says of itself: its description, its changes, its participants, its task."""

from collections.abc import Sequence
from typing import Any

from autd_trials.records.log_table import LOG_COLUMNS
from autd_trials.records.sessions import StudySession
from autd_trials.records.trials_table import trial_columns
from autd_trials.tables import MISSING, Column, describe

_BIDS_VERSION = "1.10.0"


def by_time(sessions: Sequence[StudySession]) -> list[StudySession]:
    """Return sessions in the order in which they began."""
    return sorted(sessions, key=lambda s: (s.log.start.utc, s.paths.participant, s.paths.session))


def simulated(sessions: Sequence[StudySession]) -> str:
    """Return whether all these sessions had simulated participants: yes, no or partly."""
    answers = {session.log.start.simulated for session in sessions}
    return "partly" if len(answers) > 1 else "yes" if answers.pop() else "no"


def dataset_description(sessions: Sequence[StudySession]) -> dict[str, Any]:
    """Return ``dataset_description.json``; the newest session's protocol speaks for the study."""
    newest = by_time(sessions)[-1].log.start
    study = newest.protocol.study
    return {
        "Name": f"{study.title}{_mark(sessions)}",
        "BIDSVersion": _BIDS_VERSION,
        "HEDVersion": "8.3.0",  # no HED tags are used, but the validator warns without it
        "DatasetType": "raw",
        "License": study.license,
        "Authors": list(study.authors),
        "EthicsApprovals": [study.ethics_approval],
        "GeneratedBy": [
            {
                "Name": "autd-trials",
                "Version": newest.versions.get("autd-trials", "unknown"),
                "Description": "Tables made from the raw logs in sourcedata.",
            }
        ],
        "SourceDatasets": [{"URL": "bids::sourcedata/"}],
    }


def changes_text(sessions: Sequence[StudySession]) -> str:
    """Return ``CHANGES``, the newest session first; every session that was begun is a version."""
    entries = [
        f"1.0.{number} {session.log.start.utc[:10]}\n"
        f"  - Session {session.paths.session} of participant {session.paths.participant} was begun"
        f"{_mark([session])}.\n"
        for number, session in enumerate(by_time(sessions))
    ]
    return "\n".join(reversed(entries))


def task_description(sessions: Sequence[StudySession]) -> dict[str, Any]:
    """Return the sidecar of all trial tables; the newest session's protocol speaks for the task."""
    protocols = [session.log.start.protocol for session in by_time(sessions)]
    return {**_task(sessions), **describe(trial_columns(protocols))}


def log_description(sessions: Sequence[StudySession]) -> dict[str, Any]:
    """Return the sidecar of all tables of what happened beside the trials."""
    return {**_task(sessions), **describe(LOG_COLUMNS)}


def _task(sessions: Sequence[StudySession]) -> dict[str, Any]:
    newest = by_time(sessions)[-1].log.start
    study = newest.protocol.study
    return {
        "TaskName": newest.protocol.name,
        "TaskDescription": f"{newest.protocol.description}{_mark(sessions)}",
        "Instructions": f"{newest.protocol.instructions}\n{newest.protocol.response.question}",
        "CogAtlasID": MISSING,
        "CogPOID": MISSING,
        "InstitutionName": study.institution_name,
        "InstitutionAddress": study.institution_address,
        "InstitutionalDepartmentName": study.department,
        "StimulusPresentation": {
            "SoftwareName": "autd-trials",
            "SoftwareVersion": newest.versions.get("autd-trials", "unknown"),
            "OperatingSystem": newest.versions.get("system", "unknown"),
        },
    }


def _counting(sessions: Sequence[StudySession]) -> Sequence[StudySession]:
    """Return the sessions whose place counts: those that came to a trial; of people, if there are such."""
    for wanted in (
        [each for each in sessions if each.standing.attempts and not each.log.start.simulated],
        [each for each in sessions if each.standing.attempts],
    ):
        if wanted:
            return wanted
    return sessions


def _mark(sessions: Sequence[StudySession]) -> str:
    return {"yes": " (simulated)", "no": "", "partly": " (partly simulated)"}[simulated(sessions)]


PARTICIPANT_COLUMNS: tuple[Column[Sequence[StudySession]], ...] = (
    Column(
        "participant_id",
        "The participant, under a pseudonym.",
        lambda sessions: f"sub-{sessions[0].paths.participant}",
    ),
    Column(
        "place",
        "Place in the roster, from 1, in order of first appearance; the order of the blocks is balanced over "
        "the places.",
        lambda sessions: _counting(sessions)[0].log.start.plan.place,
    ),
    Column(
        "simulated",
        "Whether a simulated participant answered.",
        simulated,
        levels={
            "yes": "A program answered in all sessions.",
            "no": "A person answered in all sessions.",
            "partly": "A program answered in some sessions, a person in others.",
        },
    ),
    Column("sessions", "Sessions that were begun.", len),
)
"""Columns of ``participants.tsv``; a row is all sessions of a participant."""
