"""The master: finds all units' nodes, takes what they send, and notices when one falls silent or restarts.

A second node that says it watches a unit while the first one sends is refused, also in mid-recording.
"""

import threading
from dataclasses import dataclass
from typing import Any, Self

from autd_trials.calibration.network.recording import LONGEST_SILENCE_S, Sample
from autd_trials.calibration.network.rivals import Rivals, find_nodes
from autd_trials.calibration.network.stream import NodeHeader
from autd_trials.errors import DeviceError

_CLOCK_PERIOD_S = 2.0
_CLOCK_TIMEOUT_S = 2.0
_MOST_SAMPLES = 4096


@dataclass
class NodeState:
    """What is known of one node while it sends.

    Attributes
    ----------
    header
        Who sends, as it was when it was found.
    samples, sightings
        How many came, and in how many the target was seen.
    lost
        Frames that the sensor numbered and that never came.
    restarts
        How often the node came back as another run.
    silent_since_s
        When the last sample came, in the master's clock, if that is over 0.5 s ago; None otherwise.
    silences
        How many times it was silent for over 0.5 s.
    """

    header: NodeHeader
    samples: int = 0
    sightings: int = 0
    lost: int = 0
    restarts: int = 0
    silent_since_s: float | None = None
    silences: int = 0


class Nodes:
    """The nodes of units 1 to N.

    Parameters
    ----------
    units
        How many there must be.
    timeout_s
        How long to look for them.

    Raises
    ------
    DeviceError
        A unit was not found, or two nodes say that they are the same one.
    """

    def __init__(self, units: int, timeout_s: float) -> None:
        found = find_nodes(units, timeout_s)
        self._links = [_Link(unit, *found[unit]) for unit in range(1, units + 1)]
        self._rivals = Rivals({stream.uid() for stream, _ in found.values()})

    def __enter__(self) -> Self:
        for link in self._links:
            link.open()
        self._rivals.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._rivals.stop()
        for link in self._links:
            link.close()

    @property
    def states(self) -> list[NodeState]:
        """What is known of each unit's node."""
        return [link.state for link in self._links]

    def take(self) -> list[tuple[list[Sample], list[tuple[float, float]]]]:
        """Return each unit's new samples and new clock offsets (time, offset in s); never waits.

        Raises
        ------
        DeviceError
            Another node has appeared that says it watches one of these units too.
        """
        taken = [link.take() for link in self._links]
        for unit, (samples, _) in enumerate(taken, start=1):
            self._rivals.refuse(unit, samples)
        return taken


class _Link:
    """One unit's inlet; its clock is compared in a thread of its own, as that may wait for the network."""

    def __init__(self, unit: int, info: Any, header: NodeHeader) -> None:
        self.state = NodeState(header)
        self._unit = unit
        self._info = info
        self._inlet: Any = None
        self._over = threading.Event()
        self._clock = threading.Thread(target=self._compare_clocks, name=f"clock of unit {unit}", daemon=True)
        self._offsets: list[tuple[float, float]] = []
        self._lock = threading.Lock()
        self._last: Sample | None = None

    def open(self) -> None:
        import pylsl

        self._inlet = pylsl.StreamInlet(self._info, max_buflen=360, recover=True)
        try:
            self._inlet.open_stream(timeout=5.0)
        except pylsl.util.TimeoutError as error:
            raise DeviceError(f"the node of unit {self._unit} does not answer") from error
        self._clock.start()

    def close(self) -> None:
        self._over.set()
        if self._clock.ident is not None:
            self._clock.join()
        self._inlet = None

    def take(self) -> tuple[list[Sample], list[tuple[float, float]]]:
        import pylsl

        values, stamps = self._inlet.pull_chunk(timeout=0.0, max_samples=_MOST_SAMPLES)
        now_s = float(pylsl.local_clock())
        samples = [_sample(each, stamp, now_s) for each, stamp in zip(values, stamps, strict=True)]
        for sample in samples:
            self._count(sample)
        self._notice_silence(now_s)
        with self._lock:
            offsets, self._offsets = self._offsets, []
        return samples, offsets

    def _count(self, sample: Sample) -> None:
        state, last = self.state, self._last
        state.samples += 1
        state.sightings += sample.seen
        if last is not None:
            if sample.run != last.run:
                state.restarts += 1
            else:
                state.lost += max(0, sample.sequence - last.sequence - 1)
        self._last = sample

    def _notice_silence(self, now_s: float) -> None:
        if self._last is None:
            return
        silent = now_s - self._last.arrival_s > LONGEST_SILENCE_S
        if silent and self.state.silent_since_s is None:
            self.state.silences += 1
        self.state.silent_since_s = self._last.arrival_s if silent else None

    def _compare_clocks(self) -> None:
        import pylsl

        while not self._over.is_set():
            try:
                offset_s = float(self._inlet.time_correction(timeout=_CLOCK_TIMEOUT_S))
            except (pylsl.util.TimeoutError, pylsl.util.LostError):
                continue  # the node is away; its silence is noticed elsewhere
            with self._lock:
                self._offsets.append((float(pylsl.local_clock()), offset_s))
            self._over.wait(_CLOCK_PERIOD_S)


def _sample(values: list[float], stamp_s: float, arrival_s: float) -> Sample:
    x, y, z, quality, sequence, run = values
    return Sample(stamp_s, arrival_s, int(run), int(sequence), x, y, z, quality)
