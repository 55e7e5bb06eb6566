"""Finds and loads protocols."""

from pathlib import Path

from autd_trials.protocol.rules import faults
from autd_trials.protocol.schema import Protocol
from autd_trials.yamlfile import load_with_sha256
from autd_trials.yamlfile.shipped import find_file


def find_protocol(name_or_path: str) -> Path:
    """Return the file that a person means: a path, or the bare name of a shipped protocol.

    Raises
    ------
    UsageError
        There is neither such a file nor such a shipped protocol.
    """
    return find_file(name_or_path, kind="protocol")


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
    return load_with_sha256(path, Protocol, faults)
