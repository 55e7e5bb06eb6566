"""Button boxes on a serial port, USB ones included, through pyserial."""

import contextlib
import errno
import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.inbox import Inbox
from autd_trials.responses.box_protocols import LONGEST_LINE_BYTES, BoxProtocol, Message, Parser, Report
from autd_trials.responses.rate import IN_S, MOST_INPUTS, STUCK_ADVICE, Rate
from autd_trials.responses.responder import Meaning, Presentation, Press, ResponderInfo, Unreadable

if TYPE_CHECKING:
    from serial import Serial

_HOST_UNCERTAINTY_S = 0.005
"""99 % of presses over a pseudo-terminal were stamped within this; measured (docs/decisions/0037)."""

_USB_FRAME_S = 0.001
"""Polling interval of full-speed USB; stands for the adapter where it tells no latency."""

_BITS_PER_BYTE = 10  # with start and stop bit
_LARGEST_READ = 4096
_READ_TIMEOUT_S = 0.1
_LONGEST_MESSAGE_S = 0.5
"""A message that has begun ends within this, beside the time that the longest one takes on the line."""
_HANDSHAKE_TIMEOUT_S = 1.0
_USB_SERIAL = Path("/sys/bus/usb-serial/devices")


class SerialBox:
    """Reads a button box in a thread and stamps each press on arrival.

    `Press.time_s` is the arrival, the box's own stamp is only kept. A press is never dropped: bounces and
    repeats are the session's to judge. What is no press is kept as unreadable. A box that sends more than
    `MOST_INPUTS` messages in `IN_S` is out of order: it is read no further, and counts as lost.
    Opening a port resets most Arduinos; they are deaf for 2 s then.

    Buttons that `buttons` does not name are undeclared. Where the rig declares none at all (as the first
    version's did), the only button of a box means felt; as soon as a second one is pressed it is not known
    any more what a press means, and all are undeclared.

    An FTDI adapter collects bytes for up to its latency timer, 16 ms by default. It is read, told in
    `ResponderInfo` and counted in its uncertainty. To set it to 1 ms until the box is unplugged, as root:
    ``echo 1 > /sys/bus/usb-serial/devices/ttyUSB0/latency_timer``; for good, a udev rule:
    ``ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"``.

    Parameters
    ----------
    port
        The port's name. ``/dev/serial/by-id/...`` stays the same when the box is plugged in again.
    protocol
        What the box sends.
    clock
        Stamps the presses.
    buttons
        What each button means, by name; None if the rig does not say.
    """

    def __init__(
        self,
        port: str,
        protocol: BoxProtocol,
        clock: Clock,
        *,
        buttons: Mapping[str, Meaning] | None = None,
    ) -> None:
        self._port = port
        self._protocol = protocol
        self._clock = clock
        self._buttons = buttons
        self._pressed: set[str] = set()
        self._inbox: Inbox[Press | Unreadable] = Inbox(clock)
        self._unreadable: list[Unreadable] = []
        self._serial: Serial | None = None
        self._receiver: _Receiver | None = None
        self._thread: threading.Thread | None = None

    def open(self) -> ResponderInfo:
        """Open the port for this process alone; raises DeviceError. What arrived before is discarded."""
        self.close()
        serial = _open_port(self._port, self._protocol.baud)
        try:
            if self._protocol.kind == "xid":
                _start_xid(serial, self._port, self._clock)
            serial.reset_input_buffer()
        except BaseException:
            serial.close()
            raise
        serial.timeout = _READ_TIMEOUT_S
        self._inbox, self._serial = Inbox(self._clock), serial
        self._unreadable.clear()
        self._pressed.clear()
        self._receiver = _Receiver(serial, self._port, self._protocol, self._inbox, self._clock)
        self._thread = threading.Thread(
            target=self._receiver.run,
            name="serial box",
            daemon=True,
        )
        self._thread.start()
        return self._info()

    def present(self, presentation: Presentation) -> None:
        """Nothing: a person is presented with the real thing."""

    def read(self, until_s: float) -> list[Press]:
        """Wait until `until_s` or a press; see `Responder.read`."""
        if self._serial is None:
            raise DeviceError("the button box is not open", where=self._port, do="open it first")
        came = self._inbox.take(until_s)
        self._unreadable += [each for each in came if isinstance(each, Unreadable)]
        return [self._with_meaning(each) for each in came if isinstance(each, Press)]

    def unreadable(self) -> list[Unreadable]:
        """Return what came with the presses that were read and is none, since the last call."""
        unreadable, self._unreadable = self._unreadable, []
        return unreadable

    def _with_meaning(self, press: Press) -> Press:
        self._pressed.add(press.button)
        if self._buttons is not None:
            return replace(press, means=self._buttons.get(press.button, "undeclared"))
        return press if len(self._pressed) == 1 else replace(press, means="undeclared")

    def close(self) -> None:
        """Release the port; presses that were not read are gone."""
        serial, self._serial = self._serial, None
        if serial is None:
            return
        if self._receiver is not None and self._thread is not None:
            self._receiver.stop()
            self._thread.join()
        with contextlib.suppress(OSError):  # an unplugged port has nothing left to release
            serial.close()

    def _info(self) -> ResponderInfo:
        latency_s = ftdi_latency_s(self._port)
        adapter = "" if latency_s is None else f", FTDI latency timer {1000 * latency_s:.0f} ms"
        line_s = _BITS_PER_BYTE * self._protocol.message_bytes / self._protocol.baud
        return ResponderInfo(
            kind="serial_box",
            device=f"{self._port}, {self._protocol.kind}, {self._protocol.baud} Bd{adapter}",
            time_uncertainty_s=round(
                _HOST_UNCERTAINTY_S + line_s + (_USB_FRAME_S if latency_s is None else latency_s), 6
            ),
        )


def ftdi_latency_s(port: str, devices: Path = _USB_SERIAL) -> float | None:
    """Return the latency timer in s of an FTDI adapter.

    Parameters
    ----------
    port
        The port's name; links (``/dev/serial/by-id/...``) are followed.
    devices
        Where Linux lists its USB serial adapters.

    Returns
    -------
    float or None
        None where the port has no latency timer, or the system does not tell it (only Linux does).
    """
    try:
        return int((devices / Path(port).resolve().name / "latency_timer").read_text()) / 1000
    except (OSError, ValueError):
        return None


def _open_port(port: str, baud: int) -> "Serial":
    from serial import Serial, SerialException

    try:
        return Serial(port, baud, exclusive=True)
    except (SerialException, ValueError) as error:
        raise DeviceError(
            f"the button box cannot be opened: {error}", where=port, do=_advice(error)
        ) from error


def _advice(error: Exception) -> str:
    number = getattr(error, "errno", None)
    if number == errno.EACCES:
        return "allow this user to use serial ports (on Debian: add it to the group dialout and log in again)"
    if number == errno.ENOENT:
        from serial.tools.list_ports import comports

        ports = ", ".join(sorted(info.device for info in comports())) or "none"
        return f"plug it in, or correct the rig file; serial ports here: {ports}"
    return "see that the rig file is right and that no other program uses the port"


def _start_xid(serial: "Serial", port: str, clock: Clock) -> None:
    """Ask a Cedrus pad who it is and put it into XID mode, a byte a ms as the maker's library does."""
    serial.reset_input_buffer()
    serial.timeout = _HANDSHAKE_TIMEOUT_S
    try:
        _send_slowly(serial, b"_c1", clock)
        reply = serial.read(5)
        if reply.startswith(b"_xid") and reply != b"_xid0":
            _send_slowly(serial, b"c10", clock)
    except OSError as error:
        raise DeviceError(f"the response pad was lost: {error}", where=port, do="plug it in again") from error
    if not reply.startswith(b"_xid"):
        raise DeviceError(
            f"no Cedrus XID pad answers (it said {reply!r})",
            where=port,
            do="set the pad's switches to XID, or correct the protocol in the rig file",
        )
    serial.timeout = None


def _send_slowly(serial: "Serial", command: bytes, clock: Clock) -> None:
    for byte in command:
        serial.write(bytes([byte]))
        clock.sleep_until(clock.now_s() + 0.001)


class _Receiver:
    """Reads a port in a thread of its own, a bounded piece at a time."""

    def __init__(
        self,
        serial: "Serial",
        port: str,
        protocol: BoxProtocol,
        inbox: Inbox[Press | Unreadable],
        clock: Clock,
    ) -> None:
        self._serial = serial
        self._port = port
        self._parser: Parser = protocol.parser()
        self._patience_s = _LONGEST_MESSAGE_S + LONGEST_LINE_BYTES * _BITS_PER_BYTE / protocol.baud
        self._inbox = inbox
        self._clock = clock
        self._rate = Rate()
        self._begun_s: float | None = None
        self._closing = threading.Event()

    def stop(self) -> None:
        """Make `run` return."""
        self._closing.set()
        self._serial.cancel_read()

    def run(self) -> None:
        """Read until the port is closed or lost, or sends too much."""
        while True:
            try:
                data = self._serial.read(min(max(1, self._serial.in_waiting), _LARGEST_READ))
            except OSError as error:  # pyserial's SerialException is one
                self._inbox.lose(
                    f"the button box was lost: {error}", where=self._port, do="plug it in again, then go on"
                )
                return
            if self._closing.is_set() or not self._take(self._messages(data)):
                return

    def _messages(self, data: bytes) -> list[Message]:
        """Return what is complete, and what has waited for its end too long."""
        now_s = self._clock.now_s()
        messages = self._parser.feed(data)
        if messages or not self._parser.pending:
            self._begun_s = None
        if self._parser.pending:
            self._begun_s = now_s if self._begun_s is None else self._begun_s
            if now_s - self._begun_s > self._patience_s:
                self._begun_s = None
                messages += self._parser.flush()
        return messages

    def _take(self, messages: list[Message]) -> bool:
        """Hand messages over; return False, and say that the box is out of order, if there are too many."""
        time_s = self._clock.now_s()
        for number, message in enumerate(messages):
            if not self._rate.allows(time_s):
                self._inbox.lose(
                    f"the button box sent more than {MOST_INPUTS} messages in {IN_S:g} s and is read no "
                    f"further; {len(messages) - number} that came are not recorded",
                    where=self._port,
                    do=STUCK_ADVICE,
                )
                return False
            self._inbox.put([_stamped(message, time_s)])
        return True


def _stamped(message: Message, time_s: float) -> Press | Unreadable:
    if isinstance(message, Report):
        return Press(time_s, message.button, message.device_time_s)
    return Unreadable(time_s, str(message))
