"""A sensor node: sends what it sees of the target, stamped at capture."""

import math
import time
from typing import Self

from autd_trials.calibration.network.stream import NodeHeader, stream_info
from autd_trials.calibration.sensors.frame import Frame
from autd_trials.calibration.target import Sighting

_UNSEEN = (math.nan, math.nan, math.nan, 0.0)


class SightingOutlet:
    """Sends one sample a frame, sighting or not, so that silence means a lost node and not a lost target.

    Parameters
    ----------
    header
        Who sends.
    rate_hz
        The sensor's frame rate.
    """

    def __init__(self, header: NodeHeader, rate_hz: float) -> None:
        import pylsl

        self._header = header
        self._outlet = pylsl.StreamOutlet(stream_info(header, rate_hz))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        del self._outlet  # closes the stream

    @property
    def watched(self) -> bool:
        """Whether anybody listens."""
        return bool(self._outlet.have_consumers())

    def send(self, frame: Frame, sighting: Sighting | None) -> None:
        """Send what was seen in a frame."""
        seen = _UNSEEN if sighting is None else (*map(float, sighting.point_mm), sighting.quality)
        self._outlet.push_sample([*seen, float(frame.sequence), float(self._header.run)], _lsl_time(frame))


def _lsl_time(frame: Frame) -> float:
    """Return a frame's time of capture by the clock of Lab Streaming Layer.

    A camera's own hardware clock has nothing to do with it; then only the time of arrival is known.
    """
    import pylsl

    now_s = float(pylsl.local_clock())
    if frame.clock == "system":
        return now_s - (time.time() - frame.time_s)
    return now_s if frame.clock == "hardware" else frame.time_s
