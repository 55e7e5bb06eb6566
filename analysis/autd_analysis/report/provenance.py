"""Where the results come from, and what makes them again."""

import hashlib
import shlex
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path

from autd_analysis.data.sessions import LoggedSession
from autd_analysis.results import Results

Facts = Mapping[str, str]
"""What is known, by what it is about."""


def software_versions() -> dict[str, str]:
    """Return the versions of what the numbers depend on, by name."""
    return {name: version(name) for name in ("autd-trials", "numpy", "scipy", "pandas")}


def input_hashes(results: Results) -> dict[str, str]:
    """Return the SHA-256 of every file that was read, by its name."""
    return {path.name: _sha256(path) for path in results.trials.inputs}


def recorded_facts(results: Results) -> Facts:
    """Return what the raw logs say of how the study was recorded; nothing without logs."""
    logged = results.trials.logged
    if not logged:
        return {}
    starts = [session.start for session in logged]
    return {
        "Study": _each(start.protocol.study.title for start in starts),
        "Ethics approval": _each(start.protocol.study.ethics_approval for start in starts),
        "Protocol (SHA-256)": _each(start.protocol_sha256 for start in starts),
        "Calibration (SHA-256)": _each(start.calibration_sha256 for start in starts),
        "Git commit of the runner": _each(start.git_commit or "not known" for start in starts),
        "Software of the runner": _each(_versions(session) for session in logged),
        "Seeds": _each(str(start.plan.seed) for start in starts),
        "Time": _each("virtual" if start.virtual_time else "real" for start in starts),
        "Recorded": f"{min(start.utc for start in starts)} to {max(start.utc for start in starts)}",
    }


def command(results: Results) -> str:
    """Return what a person types to make the results again."""
    return shlex.join([*shlex.split(results.trials.command), *results.choice])


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _versions(session: LoggedSession) -> str:
    return ", ".join(f"{name} {each}" for name, each in session.start.versions.items()) or "not known"


def _each(values: Iterable[str]) -> str:
    """Return all that differ, each once."""
    return "; ".join(dict.fromkeys(values))
