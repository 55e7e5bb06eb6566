"""What a sensor node's stream looks like: Lab Streaming Layer, type MoCap, one sample a captured frame."""

from dataclasses import asdict, dataclass
from typing import Any

from autd_trials.calibration.provenance import Capture
from autd_trials.calibration.sensors.frame import Intrinsics
from autd_trials.errors import DeviceError

TYPE = "MoCap"
NAME = "autd-trials target of unit"
CHANNELS = ("x", "y", "z", "quality", "sequence", "run")
"""Millimetres in the sensor's frame (NaN without a sighting), 0 to 1, the frame's number, the node's run."""

_UNITS = ("mm", "mm", "mm", "", "", "")


@dataclass(frozen=True)
class NodeHeader:
    """Who sends.

    Attributes
    ----------
    unit
        Number of the unit, from 1.
    run
        A number drawn anew whenever a node starts, so that a restart is seen.
    capture
        The sensor; with a time if what it sends was recorded earlier.
    intrinsics
        The sensor's camera.
    """

    unit: int
    run: int
    capture: Capture
    intrinsics: Intrinsics


def stream_info(header: NodeHeader, rate_hz: float) -> Any:
    """Return the stream's description for Lab Streaming Layer.

    The source id names unit and sensor, not the run: a master finds a restarted node again by it.
    """
    import pylsl

    info = pylsl.StreamInfo(
        name=f"{NAME} {header.unit}",
        type=TYPE,
        channel_count=len(CHANNELS),
        nominal_srate=rate_hz,
        channel_format=pylsl.cf_double64,
        source_id=f"autd-trials-unit-{header.unit}-{header.capture.sensor}-{header.capture.serial}",
    )
    description = info.desc()
    channels = description.append_child("channels")
    for label, unit in zip(CHANNELS, _UNITS, strict=True):
        channel = channels.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("unit", unit)
    node = description.append_child("autd_trials")
    node.append_child_value("unit", str(header.unit))
    node.append_child_value("run", str(header.run))
    node.append_child_value("capture", header.capture.model_dump_json())
    camera = node.append_child("intrinsics")
    for name, value in asdict(header.intrinsics).items():
        camera.append_child_value(name, repr(value))
    return info


def read_header(info: Any) -> NodeHeader:
    """Return who sends a stream.

    Raises
    ------
    DeviceError
        The stream has the name of a sensor node but not its header.
    """
    node = info.desc().child("autd_trials")
    camera = node.child("intrinsics")
    try:
        sizes = [int(camera.child_value(name)) for name in ("width", "height")]
        lengths = [float(camera.child_value(name)) for name in ("fx", "fy", "cx", "cy")]
        return NodeHeader(
            unit=int(node.child_value("unit")),
            run=int(node.child_value("run")),
            capture=Capture.model_validate_json(node.child_value("capture")),
            intrinsics=Intrinsics(sizes[0], sizes[1], *lengths),
        )
    except ValueError as error:
        raise DeviceError(
            f"the stream {info.name()!r} has no header of a sensor node",
            where=info.hostname(),
            do="start it with `autd-trials sensor` of the same version",
        ) from error
