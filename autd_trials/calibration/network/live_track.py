"""One unit's sightings while they come, by the master's clock, for the guidance of the waving hand."""

from collections.abc import Sequence

import numpy as np

from autd_trials.calibration.network.recording import CLOCK_JUMP_S, Sample
from autd_trials.calibration.track import Track


class LiveTrack:
    """Collects sightings; what counts for the calibration is on disk.

    A sighting is held until the offset of its node's clock is known, as clocks of different computers may
    differ by any amount. When stamps show that the clock was set or that the node started again, sightings
    are held until the next offset; if that has jumped, the track begins anew.

    Parameters
    ----------
    name
        The unit's.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._rows: list[tuple[float, float, float, float]] = []
        self._held: list[Sample] = []
        self._offset_s: float | None = None
        self._holding = True
        self._last: Sample | None = None

    def add(self, samples: Sequence[Sample], clock: Sequence[tuple[float, float]]) -> None:
        """Take in samples, and offsets of the node's clock (time, offset in s) that came with them."""
        for sample in samples:
            self._holding = self._holding or not self._is_continued_by(sample)
            self._last = sample
            self._held.append(sample)
        for _, offset_s in clock:
            if self._offset_s is not None and abs(offset_s - self._offset_s) > CLOCK_JUMP_S:
                self._rows = []
            self._offset_s = offset_s
            self._holding = False
        if self._offset_s is not None and not self._holding:
            for sample in self._held:
                self._append(sample, self._offset_s)
            self._held = []

    def track(self) -> Track:
        """Return the sightings so far."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 4)
        return Track(self._name, rows[:, 0], rows[:, 1:])

    def _is_continued_by(self, sample: Sample) -> bool:
        """Tell whether a sample is of the same run and clock as the one before, as far as stamps show it.

        A stamp that goes back, or that lies after its own arrival, is of a clock that was set.
        """
        last = self._last
        if last is not None and (sample.run != last.run or sample.t_raw_s < last.t_raw_s):
            return False
        return self._offset_s is None or sample.t_raw_s + self._offset_s < sample.arrival_s + CLOCK_JUMP_S

    def _append(self, sample: Sample, offset_s: float) -> None:
        time_s = sample.t_raw_s + offset_s
        if sample.seen and (not self._rows or time_s > self._rows[-1][0]):
            self._rows.append((time_s, sample.x_mm, sample.y_mm, sample.z_mm))
