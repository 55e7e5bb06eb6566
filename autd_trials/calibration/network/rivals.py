"""Which nodes there are: one a unit, and no second one for a unit while the first one sends."""

import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from autd_trials.calibration.network.recording import Sample
from autd_trials.calibration.network.stream import NAME, TYPE, NodeHeader, read_header
from autd_trials.errors import DeviceError

_RESOLVE_S = 1.0
_HEADER_TIMEOUT_S = 5.0
_GRACE_S = 1.0
"""What a node had sent before it was replaced may arrive so long after the new one was found."""


def find_nodes(units: int, timeout_s: float) -> dict[int, tuple[Any, NodeHeader]]:
    """Return the streams of units 1 to N and who sends them.

    Raises
    ------
    DeviceError
        A unit was not found, or two nodes say that they watch the same one.
    """
    import pylsl

    deadline_s = pylsl.local_clock() + timeout_s
    wanted = set(range(1, units + 1))
    while True:
        found: dict[int, tuple[Any, NodeHeader]] = {}
        for stream in _resolve():
            header = _header(stream)
            if header.unit in found and found[header.unit][1].run != header.run:
                raise _two_nodes(header.unit, stream.hostname(), found[header.unit][0].hostname())
            found[header.unit] = (stream, header)
        if wanted <= set(found):
            return found
        if pylsl.local_clock() > deadline_s:
            break
    missing = ", ".join(str(unit) for unit in sorted(wanted - set(found)))
    raise DeviceError(
        f"no sensor node of unit {missing} was found within {timeout_s:g} s; found: {sorted(found)}",
        do="start `autd-trials sensor --unit N` there; where multicast is blocked, name the computers under "
        "KnownPeers in lsl_api.cfg (a template is in protocols/rigs)",
    )


class Rivals:
    """Looks, in a thread of its own, for nodes that appear after those that are recorded.

    One that appears because a node was restarted takes its place. One that appears while samples of another
    run go on coming is a second node of that unit.

    Parameters
    ----------
    known
        Identifiers of the streams that are recorded.
    """

    def __init__(self, known: set[str]) -> None:
        self._known = known
        self._found: dict[int, tuple[NodeHeader, str, float]] = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, name="search for other nodes", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Stop looking."""
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()

    def refuse(self, unit: int, samples: Sequence[Sample]) -> None:
        """Refuse a second node of a unit whose samples these are.

        Raises
        ------
        DeviceError
            There is one.
        """
        rival = self._found.get(unit)
        if rival is None:
            return
        header, host, since_s = rival
        if any(each.run != header.run and each.arrival_s > since_s + _GRACE_S for each in samples):
            raise _two_nodes(unit, host)

    def _look(self) -> None:
        import pylsl

        while not self._over.is_set():
            for stream in _resolve():
                if stream.uid() in self._known:
                    continue
                self._known.add(stream.uid())
                with suppress(DeviceError):  # it has gone, or is no node: nothing of it is recorded
                    header = _header(stream)
                    self._found[header.unit] = (header, stream.hostname(), float(pylsl.local_clock()))


def _resolve() -> list[Any]:
    """Return all streams of nodes that answer within a second.

    The first ones alone would hide that two claim one unit.
    """
    import pylsl

    return [s for s in pylsl.resolve_streams(_RESOLVE_S) if s.type() == TYPE and s.name().startswith(NAME)]


def _header(stream: Any) -> NodeHeader:
    """Ask for a stream's header, which is not part of what is found."""
    import pylsl

    try:
        return read_header(pylsl.StreamInlet(stream, recover=False).info(timeout=_HEADER_TIMEOUT_S))
    except (pylsl.util.TimeoutError, pylsl.util.LostError) as error:
        raise DeviceError(f"the stream {stream.name()!r} does not answer", where=stream.hostname()) from error


def _two_nodes(unit: int, *hosts: str) -> DeviceError:
    places = f": on {' and on '.join(hosts)}" if len(hosts) > 1 else f"; the second one is on {hosts[0]}"
    return DeviceError(
        f"two nodes say that they watch unit {unit}{places}",
        do="stop one of them, or give it another --unit",
    )
