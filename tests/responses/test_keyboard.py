"""Response keys on any layout, keys without a meaning, and keys that steer the session."""

import pytest
from pydantic import ValidationError

from autd_trials.clock import RealClock
from autd_trials.responses.keyboard import KeyboardResponder
from autd_trials.responses.responder import Input, Press, Unreadable
from autd_trials.rig.schema import KeyboardSpec
from autd_trials.terminal import Terminal
from tests.conftest import PseudoTerminal

SOON_S = 60.0


def typed(pty: PseudoTerminal, text: str, keys: tuple[str, ...], count: int) -> tuple[list[Input], list[str]]:
    """What the responder gets of some typed text, and what is left for the controls."""
    clock = RealClock()
    with Terminal(clock, fd=pty.near) as terminal:
        responder = KeyboardResponder(terminal, keys)
        responder.open()
        pty.send(text.encode())
        found: list[Input] = []
        while len(found) < count and (new := responder.read(clock.now_s() + SOON_S)):
            found += new
        return found, [key.text for key in terminal.commands.take(clock.now_s())]


@pytest.mark.parametrize("text", [" ", "\u3000", "\u00a0", "\x1b[32u"])
def test_the_space_bar_is_one_key_whatever_it_types(pty: PseudoTerminal, text: str) -> None:
    (press,), _ = typed(pty, text, ("space",), 1)
    assert isinstance(press, Press)
    assert (press.button, press.felt) == ("space", True)


@pytest.mark.parametrize("text", ["j", "J", "о", "ま", "Ｊ"])
def test_a_letter_is_one_key_on_any_layout(pty: PseudoTerminal, text: str) -> None:
    (press,), _ = typed(pty, text, ("j",), 1)
    assert isinstance(press, Press)
    assert press.button == "j"


def test_other_keys_are_said_and_controls_left_to_the_session(pty: PseudoTerminal) -> None:
    found, commands = typed(pty, "фxP\x1b[Aт ", ("space",), 3)
    *others, press = found
    assert isinstance(press, Press)
    assert [each.what for each in others if isinstance(each, Unreadable)] == [
        "the key 'x', which has no meaning here",
        "the key '\\x1b[A', which has no meaning here",
    ]
    assert commands == ["a", "p", "n"]


@pytest.mark.parametrize(
    "keys", [("a",), ("P",), ("n",), ("ф",), ("pagedown",), ("",), ("j", "J"), ("\x07",), ()]
)
def test_keys_that_could_not_work_are_refused_in_the_rig(keys: tuple[str, ...]) -> None:
    with pytest.raises(ValidationError):
        KeyboardSpec(device="keyboard", keys=keys)
    assert KeyboardSpec(device="keyboard", keys=("space", "enter", "j", "1")).keys
