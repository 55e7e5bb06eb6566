"""The SDK's errors, said so that an experimenter knows what to do."""

from autd3 import Autd3Error

from autd_trials.array.backend import StartRefusedError
from autd_trials.errors import DeviceError

_TOO_CLOSE = "firmware error 0x06"

_ADVICE = {
    Autd3Error.TIMEOUT: "check the devices' power and cables, and that nothing else loads this computer",
    Autd3Error.DEVICE: "switch the devices off and on; if it comes again, report it with the session's log",
    Autd3Error.NETWORK: "check the devices' power and cables, the interface's name in the rig file (it needs "
    "an IPv6 link-local address), and that the calibration names as many units as are wired (9 devices each)",
    Autd3Error.INVALID_ARGUMENT: "report this with the session's log: it is a mistake in this program",
    Autd3Error.UNSUPPORTED_FIRMWARE: "put firmware 0.12 on the devices, as the SDK's own tool does it",
}
_OTHER_ADVICE = "switch the devices off and on; if it comes again, report it with the session's log"


def device_error(error: Autd3Error, where: str) -> DeviceError:
    """Return the DeviceError for an error of the SDK; a refused start time is a StartRefusedError."""
    kind = StartRefusedError if _TOO_CLOSE in str(error) else DeviceError
    return kind(f"the array failed: {error}", where=where, do=_ADVICE.get(error.code, _OTHER_ADVICE))
