"""How the devices are reached, and the hold on them: one runner at a time."""

import contextlib
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from autd_trials.array.emulator import Emulator
from autd_trials.errors import DeviceError
from autd_trials.host import FileHeldError, HeldFile


@dataclass(frozen=True)
class EmulatorLink:
    """The SDK's firmware emulator: a fresh one of our own, or a running one at ``[::1]:PORT``."""

    address: str | None = None


@dataclass(frozen=True)
class NetworkLink:
    """Real devices behind a named network interface (``enp3s0``)."""

    interface: str


Link = EmulatorLink | NetworkLink


class HeldLink:
    """A link that is ready for the SDK and held against other runners until it is released.

    Parameters
    ----------
    link
        How the devices are reached.
    devices
        How many devices to emulate, for an emulator of our own.

    Raises
    ------
    DeviceError
        If another runner holds the devices, or the emulator does not start.
    """

    def __init__(self, link: Link, devices: int) -> None:
        self.emulated = isinstance(link, EmulatorLink)
        with contextlib.ExitStack() as stack:
            if isinstance(link, NetworkLink):
                self.address = link.interface
                self.description = f"network interface {link.interface}"
            else:
                self.address = link.address or stack.enter_context(Emulator(devices)).address
                self.description = f"firmware emulator {self.address}"
            self._hold: HeldFile | None = None
            if isinstance(link, NetworkLink) or link.address:  # an emulator of our own nobody else knows
                self._hold = _hold(self.address, self.description)
                stack.callback(self._hold.release)
            self._release = stack.pop_all()

    def refuse_lost_hold(self) -> None:
        """Raise DeviceError if the lock file was removed or replaced, as another runner may hold it then."""
        if self._hold is not None and not self._hold.intact:
            raise DeviceError(
                "the array's lock file was removed or replaced, so another runner may be using the array",
                where=self.description,
                do="see that no other runner uses this array, then go on; let no program tidy up "
                f"{tempfile.gettempdir()}",
            )

    def release(self) -> None:
        """Let the devices go; ends an emulator of our own."""
        self._release.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _hold(address: str, description: str) -> HeldFile:
    name = re.sub(r"\W+", "-", address).strip("-")
    path = Path(tempfile.gettempdir(), f"autd-trials-array-{name}.lock")
    try:
        return HeldFile(path)
    except FileHeldError as held:
        raise DeviceError(
            f"another runner (process {held.pid}) is using this array",
            where=description,
            do="end it first: two runners on one array would disturb each other unnoticed",
        ) from None
    except OSError as error:
        raise DeviceError(
            f"cannot lock this array: {error}", where=description, do=f"make {path} writable, or remove it"
        ) from error
