"""What a session was run with: versions, and the commit of the code."""

import platform
import subprocess
from importlib.metadata import version
from pathlib import Path

_PACKAGES = ("autd-trials", "autd3", "numpy", "pydantic", "pyserial", "sounddevice")


def versions() -> dict[str, str]:
    """Return the versions of Python, the system and the packages that a session's results depend on."""
    packages = {package: version(package) for package in _PACKAGES}
    return {"python": platform.python_version(), "system": platform.platform(), **packages}


def git_commit() -> str | None:
    """Return the commit of the checkout that this code is in, ``+`` if it was changed; None outside one."""
    folder = Path(__file__).parent
    commit = _git(folder, "rev-parse", "HEAD")
    if not commit or not _git(folder, "ls-files", "--", str(Path(__file__).name)):
        return None
    return f"{commit}+" if _git(folder, "status", "--porcelain", "--untracked-files=no") else commit


def _git(folder: Path, *arguments: str) -> str:
    try:
        command = ["git", "-C", str(folder), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=5, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
