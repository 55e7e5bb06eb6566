"""Writing what must not be lost: a full or missing disk ends with a message, nothing is overwritten."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from autd_trials.errors import DeviceError, UsageError


@contextmanager
def writing(path: Path, do: str) -> Iterator[None]:
    """Turn what the disk refuses into a message.

    Parameters
    ----------
    path
        Where to.
    do
        What is safe, and what to do.

    Raises
    ------
    DeviceError
        The disk is full, gone or does not let us write.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise DeviceError(f"the disk does not take this: {reason}", where=str(path), do=do) from error


def create_text(path: Path, text: str, what: str) -> None:
    """Write a new file; one that cannot be written whole is removed again.

    Parameters
    ----------
    path
        The file.
    text
        What goes into it.
    what
        What the file is, for messages.

    Raises
    ------
    UsageError
        It exists already, or cannot be written.
    """
    refuse_existing(path, what)
    try:
        with path.open("x", encoding="utf-8") as file:
            try:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            except OSError:
                with suppress(OSError):
                    path.unlink()
                raise
    except FileExistsError:
        raise _existing(path, what) from None
    except OSError as error:
        raise UsageError(
            f"the {what} cannot be written: {error.strerror}",
            where=str(path),
            do="free space or give another name, and do this step again: what it was made from is as it was",
        ) from error


def refuse_existing(path: Path, what: str) -> None:
    """Refuse the name of a new file before anything is computed for it.

    Raises
    ------
    UsageError
        There is such a file, its folder does not exist, or the name is none.
    """
    try:
        path.lstat()
    except FileNotFoundError:
        if path.parent.is_dir():
            return
        reason = "there is no such folder"
    except OSError as error:
        reason = error.strerror or str(error)
    else:
        raise _existing(path, what)
    raise UsageError(f"the {what} cannot be written: {reason}", where=str(path), do="give another name")


def _existing(path: Path, what: str) -> UsageError:
    return UsageError(f"this {what} exists already", where=str(path), do="give another name")
