"""The noise as a sound card asks for it: block after block out of the loop, ramped in and out."""

from typing import TYPE_CHECKING

from autd_trials.masking.noise import raised_cosine

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Playback:
    """Play some silence, then a loop from its beginning, for ever, until asked to stop.

    Parameters
    ----------
    loop
        One period of the noise.
    lead_samples
        Length of the silence.
    ramp_samples
        Length of the ramps in and out.
    """

    def __init__(self, loop: "NDArray[np.float32]", *, lead_samples: int, ramp_samples: int) -> None:
        import numpy as np

        rise = raised_cosine(ramp_samples)
        self._loop = loop
        self._lead_samples = lead_samples
        # The last value of each holds for ever after, which `take` with "clip" makes of it.
        self._rise = np.concatenate([np.zeros(lead_samples), rise, [1]]).astype(np.float32)
        self._fall = np.append(rise[::-1], np.float32(0))
        self._stopping = False
        self._stopped_at: int | None = None
        self.frames = 0
        """Frames handed out so far."""

    def stop(self) -> None:
        """Ramp out from the next block on; may be called from any thread."""
        self._stopping = True

    @property
    def ended(self) -> bool:
        """Whether the ramp out has been handed out as a whole; silence follows."""
        return self._stopped_at is not None and self.frames >= self._stopped_at + len(self._fall) - 1

    def fill(self, block: "NDArray[np.float32]") -> None:
        """Write the next frames, the same noise on every channel, into a (frames, channels) block."""
        import numpy as np

        if self._stopping and self._stopped_at is None:
            self._stopped_at = self.frames
        position = self.frames + np.arange(len(block))
        noise = self._loop.take(position - self._lead_samples, mode="wrap")
        noise *= self._rise.take(position, mode="clip")
        if self._stopped_at is not None:
            noise *= self._fall.take(position - self._stopped_at, mode="clip")
        block[:] = noise[:, np.newaxis]
        self.frames += len(block)
