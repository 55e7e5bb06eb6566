"""Finds and loads protocols."""

from importlib import resources
from pathlib import Path

from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Protocol
from autd_trials.yamlfile import did_you_mean, load_with_sha256

_SUFFIX = ".yaml"


def shipped_protocols() -> list[str]:
    """Return the names of the protocols that come with the package, sorted."""
    return sorted(path.stem for path in _shipped_folder().glob(f"*{_SUFFIX}"))


def find_protocol(name_or_path: str) -> Path:
    """Return the file that a person means.

    Parameters
    ----------
    name_or_path
        The path of a file, or the bare name of a shipped protocol with or without ``.yaml``. A file of that
        name in the current folder goes first.

    Raises
    ------
    UsageError
        There is neither such a file nor such a shipped protocol.
    """
    path = Path(name_or_path)
    if name_or_path and _is_file(path):
        return path
    shipped = shipped_protocols()
    if name_or_path.removesuffix(_SUFFIX) in shipped:
        return _shipped_folder() / f"{name_or_path.removesuffix(_SUFFIX)}{_SUFFIX}"
    raise UsageError(
        f"there is no protocol {name_or_path!r}{did_you_mean(path.stem, shipped)}",
        do=f"give the path of a YAML file, or one of the shipped names: {', '.join(shipped)}",
    )


def load_protocol(path: Path) -> Protocol:
    """Read and validate a protocol.

    Raises
    ------
    UsageError
        The file cannot be read or is no valid protocol; the message has a line for each problem.
    """
    return load_protocol_with_sha256(path)[0]


def load_protocol_with_sha256(path: Path) -> tuple[Protocol, str]:
    """Read and validate a protocol; return it and the SHA-256 (hexadecimal) of the bytes it was read from."""
    return load_with_sha256(path, Protocol)


def _shipped_folder() -> Path:
    return Path(str(resources.files("protocols")))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long is no file's
        return False
