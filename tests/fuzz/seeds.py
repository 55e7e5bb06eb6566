"""The sound files that mutants are made of; the small ones are made here."""

import random
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from autd_trials.responses.box_protocols import BoxProtocol

_SHIPPED = Path(__file__).parents[2] / "protocols"
_SERIAL_RIG = """
responses:
  device: serial
  port: /dev/ttyACM0
  protocol: {kind: line, baud: 115200}
"""


@cache
def protocols() -> Sequence[str]:
    """Return the shipped protocols."""
    return [path.read_text(encoding="utf-8") for path in sorted(_SHIPPED.glob("*.yaml"))]


@cache
def rigs() -> Sequence[str]:
    """Return the emulated rig, with the keyboard and with a serial box."""
    emulated = (_SHIPPED / "rigs" / "emulated.yaml").read_text(encoding="utf-8")
    return [emulated, emulated[: emulated.index("responses:")] + _SERIAL_RIG]


@cache
def calibration() -> str:
    """Return the emulated rig's calibration."""
    return (_SHIPPED / "rigs" / "emulated-calibration.yaml").read_text(encoding="utf-8")


@cache
def tracks() -> tuple[str, str]:
    """Return what two sensors 1 m apart see of one target that is waved for 6 s, with 1 mm of noise."""
    chance = np.random.default_rng(1)
    time_s = np.arange(180) / 30
    phases = np.outer(time_s, (1.1, 1.7, 0.6)) * 2
    first_mm = np.array([300.0, 200.0, 1000.0]) + 300 * np.sin(phases)
    turn = np.array([[0.5, 0.0, -(0.75**0.5)], [0.0, 1.0, 0.0], [0.75**0.5, 0.0, 0.5]])
    second_mm = (first_mm - np.array([900.0, 0.0, 400.0])) @ turn + np.array([200.0, 100.0, 900.0])
    noisy = [points + chance.normal(0, 1, points.shape) for points in (first_mm, second_mm)]
    lines = [
        "".join(f"{t:.4f},{x:.2f},{y:.2f},{z:.2f}\n" for t, (x, y, z) in zip(time_s, points, strict=True))
        for points in noisy
    ]
    return "t_s,x_mm,y_mm,z_mm\n" + lines[0], "t_s,x_mm,y_mm,z_mm\n" + lines[1]


@cache
def scan() -> str:
    """Return a small microphone scan."""
    rows = (
        f"{x},225,{z},{1000 - 5 * abs(x - 300) - abs(z - 1000)}\n"
        for x in range(280, 321, 5)
        for z in (990, 1000)
    )
    return "x_mm,y_mm,z_mm,p_pa\n" + "".join(rows)


@cache
def answers() -> str:
    """Return a table of answers of four people."""
    rows = (
        f"p{who},{cloth},{hertz},{trial},{'yes' if (who + trial + hertz) % 3 else 'no'},{0.3 + trial / 10}\n"
        for who in range(1, 5)
        for cloth in ("inner", "outer")
        for hertz in (25, 50, 100)
        for trial in range(1, 5)
    )
    return "participant,clothing,modulation_hz,repetition,response,response_time\n" + "".join(rows)


def read_answers(path: Path) -> object:
    """Read a table as `analyse TABLE --columns ...` does."""
    from autd_analysis.data.foreign.request import TableRequest
    from autd_analysis.data.foreign.tables import read_tables

    names = ("participant", "response", "clothing", "modulation_hz", "response_time")
    return read_tables([path], TableRequest(columns={name: name for name in names}))


@cache
def box_protocols() -> Sequence[BoxProtocol]:
    """Return a protocol of each kind of serial box."""
    adapter: TypeAdapter[BoxProtocol] = TypeAdapter(BoxProtocol)
    kinds = (
        {"kind": "line"},
        {"kind": "single_byte", "buttons": {"a": "left", "0x42": "right"}, "felt": ("left",)},
        {"kind": "xid"},
    )
    return [adapter.validate_python(kind) for kind in kinds]


def serial(chance: random.Random) -> Sequence[bytes]:
    """Return a stretch of what boxes of each kind send."""
    return [
        chance.choice([b"B1 %d\r\n" % n, b"a", b"B", b"k\x10" + n.to_bytes(4, "little"), b"\r\n"])
        for n in range(100)
    ]
