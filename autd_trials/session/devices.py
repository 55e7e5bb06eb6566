"""The devices of a session, together."""

from dataclasses import dataclass

from autd_trials.array.driver import ArrayDriver, Stimulus
from autd_trials.masking.masker import Masker
from autd_trials.protocol.plan import PlannedTrial
from autd_trials.protocol.schema import Protocol
from autd_trials.responses.responder import Responder
from autd_trials.session.events import DeviceDescriptions


@dataclass(frozen=True)
class Devices:
    """What a session runs on; `masker` is None where the protocol asks for none or the sound was declined."""

    array: ArrayDriver
    masker: Masker | None
    responder: Responder

    def open(self) -> DeviceDescriptions:
        """Open all; return what they say of themselves. If one fails, the others are closed again."""
        try:
            return DeviceDescriptions(
                array=self.array.open(),
                masker=self.masker.open() if self.masker else None,
                responder=self.responder.open(),
            )
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
    return Stimulus(target_mm=(target.x_mm, target.y_mm, target.z_mm), **spec.model_dump(exclude={"target"}))
