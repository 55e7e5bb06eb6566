"""The devices of a session, together."""

from dataclasses import asdict, dataclass
from typing import Any

from autd_trials.array.driver import ArrayDriver, Stimulus
from autd_trials.masking.masker import Masker
from autd_trials.protocol.plan import PlannedTrial
from autd_trials.protocol.schema import Protocol
from autd_trials.responses.responder import Responder


@dataclass(frozen=True)
class Devices:
    """What a session runs on; `masker` is None where the protocol asks for none or the sound was declined."""

    array: ArrayDriver
    masker: Masker | None
    responder: Responder

    def open(self) -> dict[str, Any]:
        """Open all; return what the log keeps of them. If one fails, the others are closed again."""
        try:
            return {
                "array": self.array.open().model_dump(mode="json"),
                "masker": self.masker.open().model_dump(mode="json") if self.masker else None,
                "responder": asdict(self.responder.open()),
            }
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close all, the array first; never raises."""
        self.array.close()
        if self.masker:
            self.masker.close()
        self.responder.close()


def array_stimulus(protocol: Protocol, trial: PlannedTrial) -> Stimulus:
    """Return a planned trial's stimulus in the array's words."""
    spec = trial.stimulus
    target = protocol.targets[spec.target]
    return Stimulus(
        target_mm=(target.x_mm, target.y_mm, target.z_mm),
        duration_s=spec.duration_s,
        modulation_hz=spec.modulation_hz,
        waveform=spec.waveform,
        depth=spec.depth,
        drive=spec.drive,
        force_law=spec.force_law,
        ramp_s=spec.ramp_s,
    )
