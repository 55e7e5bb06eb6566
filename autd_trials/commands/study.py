"""What every session of a study shares."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.schema import Protocol
from autd_trials.records.layout import study_folder
from autd_trials.records.protocol_hash import protocol_sha256
from autd_trials.rig.load import LoadedRig, load_rig


@dataclass(frozen=True)
class Study:
    """A protocol, a rig, and the folder where the sessions go."""

    protocol: Protocol
    protocol_sha256: str
    loaded_rig: LoadedRig
    folder: Path


def load_study(protocol: str, rig: str, data: Path) -> Study:
    """Load what the command line names; raises UsageError with everything that is wrong with a file."""
    loaded = load_protocol(find_protocol(protocol))
    sha256 = protocol_sha256(loaded.model_dump(mode="json"))
    return Study(loaded, sha256, load_rig(rig, datetime.now(UTC)), study_folder(data, loaded.name))
