"""A sensor node without a sensor: it sends the sightings that it is given; as a program, empty ones."""

import sys
import time
from collections.abc import Iterable
from itertools import count
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from autd_trials.calibration.network.outlet import SightingOutlet
from autd_trials.calibration.network.stream import NodeHeader
from autd_trials.calibration.provenance import Capture
from autd_trials.calibration.sensors.frame import Frame
from autd_trials.calibration.sensors.synthetic import KINECT_V2, SyntheticSensor
from autd_trials.calibration.target import Sighting

RATE_HZ = 30.0
_DEADLINE_S = 60.0
_NO_PIXELS = (np.empty((0, 0), np.uint16), np.empty((0, 0), np.float32))


class Node:
    """Sends as `autd-trials sensor` would, as fast as it is asked to."""

    def __init__(self, unit: int, run: int = 1, capture: Capture = SyntheticSensor.capture) -> None:
        self._outlet = SightingOutlet(NodeHeader(unit, run, capture, KINECT_V2), RATE_HZ)
        self._numbers = count()

    def __enter__(self) -> Self:
        self._outlet.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._outlet.__exit__(kind, error, trace)

    def send(self, times_s: Iterable[float], points_mm: NDArray[np.float64] | None = None) -> None:
        """Send sightings, shape (n, 3), or frames without the target."""
        for row, time_s in enumerate(times_s):
            frame = Frame(*_NO_PIXELS, time_s, "synthetic", next(self._numbers))
            self._outlet.send(frame, None if points_mm is None else Sighting(points_mm[row], 0.9))

    def wait_for_listener(self) -> None:
        """Wait until somebody listens: what is sent before is heard by nobody."""
        deadline = time.monotonic() + _DEADLINE_S
        while not self._outlet.watched:
            assert time.monotonic() < deadline, "nobody listens"
            time.sleep(0.01)

    def send_now(self, frames: int = 1) -> None:
        """Send frames without the target, as of now."""
        import pylsl

        self.send([pylsl.local_clock()] * frames)


def main() -> None:
    """Send empty frames of a unit until killed."""
    with Node(int(sys.argv[1]), run=int(sys.argv[2])) as node:
        while True:
            node.send_now()
            time.sleep(1 / RATE_HZ)


if __name__ == "__main__":
    main()
