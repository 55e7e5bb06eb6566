"""Button boxes on a serial port, USB ones included, through pyserial."""

import contextlib
import errno
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

from serial import Serial, SerialException

from autd_trials.clock import Clock
from autd_trials.errors import DeviceError
from autd_trials.inbox import Inbox
from autd_trials.responses.box_protocols import BoxProtocol, Garbage, Parser
from autd_trials.responses.responder import Input, Presentation, Press, ResponderInfo, Unreadable

_HOST_UNCERTAINTY_S = 0.005
"""99 % of presses over a pseudo-terminal were stamped within this; measured (docs/decisions/0037)."""

_USB_FRAME_S = 0.001
"""Polling interval of full-speed USB; stands for the adapter where the adapter reports no latency."""

_BITS_PER_BYTE = 10  # with start and stop bit
_HANDSHAKE_TIMEOUT_S = 1.0
_UNFINISHED_S = 0.5  # a message whose end does not come for so long has none
_SHOWN = 3
_USB_SERIAL = Path("/sys/bus/usb-serial/devices")


class SerialBox:
    """Reads a button box in a thread and stamps each press on arrival.

    `Press.time_s` is the arrival, the box's own stamp is only kept. No press is dropped: bounces and repeats
    are the session's to judge; what the protocol does not know comes as `Unreadable`. Opening a port resets
    most Arduinos; they are deaf for 2 s then.

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
    """

    def __init__(self, port: str, protocol: BoxProtocol, clock: Clock) -> None:
        self._port = port
        self._protocol = protocol
        self._clock = clock
        self._inbox: Inbox[Input] = Inbox(clock)
        self._serial: Serial | None = None
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()

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
        serial.timeout = _UNFINISHED_S
        self._closing.clear()
        self._inbox, self._serial = Inbox(self._clock), serial
        self._thread = threading.Thread(
            target=self._receive, args=(serial, self._inbox), name="serial box", daemon=True
        )
        self._thread.start()
        return self._info()

    def present(self, presentation: Presentation) -> None:
        """Nothing: a person is presented with the real thing."""

    def read(self, until_s: float) -> Sequence[Input]:
        """Wait until `until_s` or a message; see `Responder.read`."""
        if self._serial is None:
            raise DeviceError("the button box is not open", where=self._port, do="open it first")
        return self._inbox.take(until_s)

    def close(self) -> None:
        """Release the port; presses that were not read are gone."""
        serial, self._serial = self._serial, None
        if serial is None:
            return
        self._closing.set()
        serial.cancel_read()
        if self._thread is not None:
            self._thread.join()
        with contextlib.suppress(OSError):  # an unplugged port has nothing left to release
            serial.close()

    def _receive(self, serial: Serial, inbox: Inbox[Input]) -> None:
        parser = self._protocol.parser()
        while not self._closing.is_set():
            try:
                data = serial.read(max(1, serial.in_waiting))
            except OSError as error:  # pyserial's SerialException is one
                inbox.lose(
                    f"the button box was lost: {error}", where=self._port, do="plug it in again, then go on"
                )
                return
            if not inbox.put(self._inputs(parser, data)):
                return

    def _inputs(self, parser: Parser, data: bytes) -> Iterator[Input]:
        """Yield what arrived now; bytes that belong to nothing are summed up in one."""
        time_s = self._clock.now_s()
        garbage: list[Garbage] = []
        for item in parser.feed(data) if data else parser.flush():
            if isinstance(item, Garbage):
                garbage.append(item)
            else:
                felt = item.button in self._protocol.buttons_felt
                yield Press(time_s, item.button, item.device_time_s, felt)
        if garbage:
            yield Unreadable(time_s, _described(garbage), may_be_answer=True)

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


def _described(garbage: Sequence[Garbage]) -> str:
    """Return what the box sent that its protocol does not know, in printable characters."""
    shown = ", ".join(repr(each.first)[1:] for each in garbage[:_SHOWN])
    size = sum(each.size for each in garbage)
    return f"{size} bytes that the box's protocol does not know: {shown}{', ...' * (len(garbage) > _SHOWN)}"


def _open_port(port: str, baud: int) -> Serial:
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


def _start_xid(serial: Serial, port: str, clock: Clock) -> None:
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


def _send_slowly(serial: Serial, command: bytes, clock: Clock) -> None:
    for byte in command:
        serial.write(bytes([byte]))
        clock.sleep_until(clock.now_s() + 0.001)
