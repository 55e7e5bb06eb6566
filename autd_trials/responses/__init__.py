"""How an answer comes in: keyboard, serial boxes."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.responses.box_protocols import BoxProtocol, LineProtocol, SingleByteProtocol, XidProtocol
    from autd_trials.responses.keyboard import KeyboardResponder
    from autd_trials.responses.responder import (
        Input,
        Presentation,
        Press,
        Responder,
        ResponderInfo,
        Unreadable,
    )
    from autd_trials.responses.serial_box import SerialBox

__all__ = [
    "BoxProtocol",
    "Input",
    "KeyboardResponder",
    "LineProtocol",
    "Presentation",
    "Press",
    "Responder",
    "ResponderInfo",
    "SerialBox",
    "SingleByteProtocol",
    "Unreadable",
    "XidProtocol",
]

__getattr__ = lazy(
    __name__,
    {
        "BoxProtocol": "box_protocols",
        "Input": "responder",
        "KeyboardResponder": "keyboard",
        "LineProtocol": "box_protocols",
        "Presentation": "responder",
        "Press": "responder",
        "Responder": "responder",
        "ResponderInfo": "responder",
        "SerialBox": "serial_box",
        "SingleByteProtocol": "box_protocols",
        "Unreadable": "responder",
        "XidProtocol": "box_protocols",
    },
)
