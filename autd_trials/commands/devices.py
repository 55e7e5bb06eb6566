"""`autd-trials devices`: what is connected, in the words that a rig file needs."""

import argparse
import socket
from dataclasses import asdict

from autd_trials.commands.output import print_json, print_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """List the devices; opens none of them."""
    from autd_trials.masking.devices import list_devices

    sound = list_devices()
    if options.json:
        print_json(
            {
                "network_interfaces": _network_interfaces(),
                "serial_ports": [{"port": port, "description": text} for port, text in _serial_ports()],
                "sound_devices": [asdict(device) for device in sound.devices],
                "sound_problem": sound.problem,
            }
        )
        return 0
    _list("network interfaces (array.link.interface)", _network_interfaces())
    _list("serial ports (responses.port)", [f"{port}  {text}" for port, text in _serial_ports()])
    _list("sound devices (sound.device)", [str(device) for device in sound.devices], sound.problem)
    return 0


def _list(kind: str, found: list[str], problem: str | None = None) -> None:
    lines = found or [problem or "none found"]
    print_text("\n  ".join((f"{kind}:", *lines)))


def _network_interfaces() -> list[str]:
    return [name for _, name in socket.if_nameindex()]


def _serial_ports() -> list[tuple[str, str]]:
    from serial.tools import list_ports

    return [(port.device, port.description) for port in sorted(list_ports.comports())]
