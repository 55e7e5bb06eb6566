"""The terminal over real pseudo-terminals: routing, questions, and that it is always put back."""

import io
import os
import sys
import termios
import textwrap
from collections.abc import Iterator

import pexpect
import pytest

from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError, UsageError
from autd_trials.inbox import Inbox
from autd_trials.responses.keyboard import KeyboardResponder
from autd_trials.responses.responder import Press
from autd_trials.terminal import Terminal
from autd_trials.terminal.keys import Key
from tests.conftest import PseudoTerminal

SOON_S = 60.0
"""Long enough on the busiest machine; never waited for in full."""
CLOCK = RealClock()


@pytest.fixture
def terminal(pty: PseudoTerminal) -> Iterator[Terminal]:
    with Terminal(CLOCK, fd=pty.near, output=io.StringIO()) as terminal:
        yield terminal


def take_text(inbox: Inbox[Key], count: int) -> str:
    """Take keys until `count` came, or nothing for a while."""
    keys: list[Key] = []
    while len(keys) < count and (new := inbox.take(CLOCK.now_s() + SOON_S)):
        keys += new
    return "".join(key.text for key in keys)


class Typist:
    """Types once a question is shown; keeps all that is shown."""

    def __init__(self, pty: PseudoTerminal, text: bytes) -> None:
        self.shown: list[str] = []
        self._pty = pty
        self._text = text

    def __call__(self, shown: str) -> None:
        self.shown.append(shown)
        text, self._text = self._text, b""
        self._pty.send(text)


class TypistBehindAScreen(io.StringIO):
    """Types once something is written; a screen in whose place a test looks."""

    def __init__(self, pty: PseudoTerminal, text: bytes) -> None:
        super().__init__()
        self._typist = Typist(pty, text)

    def write(self, text: str) -> int:
        self._typist(text)
        return super().write(text)


def test_keys_nobody_wants_are_commands(pty: PseudoTerminal, terminal: Terminal) -> None:
    before_s = CLOCK.now_s()
    pty.send(b"p")
    (key,) = terminal.commands.take(before_s + SOON_S)
    assert key.text == "p"
    assert before_s < key.time_s < CLOCK.now_s()


def test_subscribed_keys_go_to_the_subscribers_alone(pty: PseudoTerminal, terminal: Terminal) -> None:
    first, second = terminal.subscribe(" "), terminal.subscribe({" ", "x"})
    pty.send(b" px")
    assert take_text(second, 2) == " x"
    assert take_text(first, 1) == " "
    assert take_text(terminal.commands, 1) == "p"
    terminal.unsubscribe(second)
    pty.send(b"x")
    assert take_text(terminal.commands, 1) == "x"


def test_responder_leaves_controls_to_the_runner(pty: PseudoTerminal, terminal: Terminal) -> None:
    responder = KeyboardResponder(terminal, keys=("space", "enter", "b"))
    responder.open()
    pty.send(b"p \rnba")
    buttons: list[str] = []
    while len(buttons) < 3:
        found = responder.read(CLOCK.now_s() + SOON_S)
        buttons += [press.button for press in found if isinstance(press, Press)]
    assert buttons == ["space", "enter", "b"]
    assert take_text(terminal.commands, 3) == "pna"
    responder.close()
    pty.send(b" ")
    assert take_text(terminal.commands, 1) == " "


@pytest.mark.parametrize("keys", [(), ("",), (" ",), ("spacebar",), ("\x01",), ("space", "ab")])
def test_response_keys_that_are_none_are_refused(terminal: Terminal, keys: tuple[str, ...]) -> None:
    with pytest.raises(UsageError):
        KeyboardResponder(terminal, keys)


def test_keyboard_of_a_closed_terminal_does_not_open() -> None:
    with pytest.raises(DeviceError, match="not open"):
        KeyboardResponder(Terminal(CLOCK)).open()


def test_function_key_is_no_command_even_if_it_comes_in_pieces(
    pty: PseudoTerminal, terminal: Terminal
) -> None:
    pty.send(b"\x1b[")
    pty.send(b"Ap")
    keys = [key.text for key in terminal.commands.take(CLOCK.now_s() + SOON_S)]
    while "p" not in keys:
        keys += [key.text for key in terminal.commands.take(CLOCK.now_s() + SOON_S)]
    assert "".join(keys) == "\x1b[Ap"
    assert "A" not in keys


def test_lone_escape_arrives(pty: PseudoTerminal, terminal: Terminal) -> None:
    pty.send(b"\x1b")
    assert take_text(terminal.commands, 1) == "\x1b"


def test_note_goes_to_nobody_else(pty: PseudoTerminal, terminal: Terminal) -> None:
    responder = KeyboardResponder(terminal)
    responder.open()
    typist = Typist(pty, "a pöusex\x7f\r".encode())
    assert terminal.ask_line("note: ", show=typist) == "a pöuse"
    assert typist.shown[0] == "note: "
    assert typist.shown[-1] == "note: a pöuse"
    assert responder.read(0.0) == []
    assert terminal.commands.take(0.0) == []


def test_note_is_echoed_where_nobody_draws_it(pty: PseudoTerminal) -> None:
    output = TypistBehindAScreen(pty, b"hello\r")
    with Terminal(CLOCK, fd=pty.near, output=output) as terminal:
        assert terminal.ask_line("note: ") == "hello"
    assert output.getvalue().rstrip().endswith("note: hello")


def test_note_is_cancelled_by_escape(pty: PseudoTerminal, terminal: Terminal) -> None:
    assert terminal.ask_line("note: ", show=Typist(pty, b"no\x1b")) is None


def test_question_ends_when_cancelled(terminal: Terminal) -> None:
    assert terminal.ask_line("note: ", cancelled=lambda: True) is None
    assert not terminal.confirm("really?", cancelled=lambda: True)


@pytest.mark.parametrize(
    ("typed", "answer"), [(b"y", True), (b"Y", True), (b"n", False), (b"\x1b", False), (b" \rxy", True)]
)
def test_confirm(pty: PseudoTerminal, terminal: Terminal, typed: bytes, answer: bool) -> None:
    assert terminal.confirm("headphones on?", show=Typist(pty, typed)) is answer


def test_key_typed_before_the_question_does_not_confirm(pty: PseudoTerminal, terminal: Terminal) -> None:
    pty.send(b"y")
    assert take_text(terminal.commands, 1) == "y"
    assert not terminal.confirm("headphones on?", show=Typist(pty, b"n"))


def test_type_ahead_is_discarded(pty: PseudoTerminal) -> None:
    pty.send(b"y y\n")
    with Terminal(CLOCK, fd=pty.near) as terminal:
        assert terminal.commands.take(CLOCK.now_s() + 0.1) == []


def test_losing_the_terminal_is_a_device_error_for_all_who_wait(
    pty: PseudoTerminal, terminal: Terminal
) -> None:
    inbox = terminal.subscribe(" ")
    pty.unplug()
    for waiting in (inbox, terminal.commands):
        with pytest.raises(DeviceError, match="lost"):
            waiting.take(CLOCK.now_s() + SOON_S)
    with pytest.raises(DeviceError, match="lost"):
        terminal.confirm("still there?")
    with pytest.raises(DeviceError, match="lost"):
        terminal.subscribe("x")


def test_settings_are_put_back(pty: PseudoTerminal) -> None:
    before = termios.tcgetattr(pty.near)
    for _ in range(2):
        with Terminal(CLOCK, fd=pty.near) as terminal:
            lflag = termios.tcgetattr(pty.near)[3]
            assert not lflag & (termios.ECHO | termios.ICANON)
            assert lflag & termios.ISIG
            terminal.open()  # again: nothing
        terminal.close()
        assert termios.tcgetattr(pty.near) == before


def test_what_is_no_terminal_is_refused_with_advice() -> None:
    read, write = os.pipe()
    with pytest.raises(UsageError, match="no terminal") as error:
        Terminal(CLOCK, fd=read).open()
    os.close(read)
    os.close(write)
    assert "--yes with --simulate, or a rig with a button box" in str(error.value)
    assert error.value.exit_code == 2


@pytest.mark.parametrize("stdin", [None, io.StringIO("text")])
def test_standard_input_that_is_no_file_is_refused(
    monkeypatch: pytest.MonkeyPatch, stdin: io.StringIO | None
) -> None:
    monkeypatch.setattr(sys, "stdin", stdin)
    with pytest.raises(UsageError, match="no terminal"):
        Terminal(CLOCK).open()


PROGRAM = textwrap.dedent(
    """
    import os, signal, sys
    from autd_trials.clock import RealClock
    from autd_trials.terminal import Terminal
    clock = RealClock()
    terminal = Terminal(clock)
    terminal.open()
    print("ready", flush=True)
    how = sys.argv[1]
    try:
        while True:
            for key in terminal.commands.take(clock.now_s() + 60):
                print("key", ascii(key.text), flush=True)
                if key.text == "q" and how == "exit":
                    sys.exit(7)
                if key.text == "q" and how == "raise":
                    raise RuntimeError("bug")
                if key.text == "q" and how == "sigterm":
                    os.kill(os.getpid(), signal.SIGTERM)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
    """
)


def spawn(how: str) -> "pexpect.spawn[str]":
    """Start a program that holds a terminal under a shell-like parent that keeps the pty open."""
    shell = 'trap : INT; "$0" -c "$1" "$2"; echo "ended $?"; stty -a; sleep 60'
    child = pexpect.spawn(
        "/bin/sh", ["-c", shell, sys.executable, PROGRAM, how], encoding="utf-8", timeout=20
    )
    child.expect("ready")
    return child


@pytest.mark.parametrize(("how", "status"), [("exit", 7), ("raise", 1), ("sigterm", 143)])
def test_program_that_never_closes_its_terminal_still_puts_it_back(how: str, status: int) -> None:
    child = spawn(how)
    child.send("q")
    child.expect(f"ended {status}")
    child.expect(r"[^-]icanon")
    child.expect(r"[^-]echo ")
    child.close(force=True)


def test_ctrl_c_interrupts_and_ctrl_z_and_ctrl_s_do_not() -> None:
    child = spawn("exit")
    child.send("\x1a")
    child.expect(r"key '\\x1a'")
    child.send("\x13")
    child.expect(r"key '\\x13'")
    child.sendintr()
    child.expect("interrupted")
    child.expect("ended 0")
    child.expect(r"[^-]icanon")
    child.close(force=True)


def test_program_in_the_background_is_told_so() -> None:
    program = (
        "from autd_trials.clock import RealClock; from autd_trials.terminal import Terminal\n"
        "try: Terminal(RealClock()).open()\n"
        "except Exception as error: print(type(error).__name__, error)"
    )
    child = pexpect.spawn(
        "/bin/bash",
        ["-mc", f"\"{sys.executable}\" -c '{program}' < /dev/tty & wait"],
        encoding="utf-8",
        timeout=20,
    )
    child.expect("UsageError.*another job")
    child.close(force=True)


@pytest.mark.parametrize(
    ("typed", "control"),
    [
        *zip("pPｐзЗπせセｾㅔㄣยპज", "p" * 14, strict=True),
        *zip("aAａфαちチﾁㅁㄇשა", "a" * 12, strict=True),
        *zip("nNｎтνみミㅜㄙ", "n" * 9, strict=True),
        ("\x1b[97u", "a"),
        ("\x1b[1092::97u", "a"),
        ("\x1b[27;2;65~", "a"),
        ("\x1b[97;65u", "a"),
        ("\x1b[97;129:1u", "a"),
    ],
)
def test_controls_work_on_every_layout(
    pty: PseudoTerminal, terminal: Terminal, typed: str, control: str
) -> None:
    pty.send(typed.encode())
    assert take_text(terminal.commands, 1) == control


@pytest.mark.parametrize(
    "typed", [" ", "\u3000", "\u00a0", "\x00", "\x1b[32u", "\x1b[32;5u", "\x1b[27;5;32~"]
)
def test_the_space_bar_is_one_key_under_input_methods(
    pty: PseudoTerminal, terminal: Terminal, typed: str
) -> None:
    responder = KeyboardResponder(terminal)
    responder.open()
    pty.send(typed.encode())
    (press,) = responder.read(CLOCK.now_s() + SOON_S)
    assert isinstance(press, Press)
    assert press.button == "space"


def test_a_key_that_is_let_go_is_no_input(pty: PseudoTerminal, terminal: Terminal) -> None:
    responder = KeyboardResponder(terminal)
    responder.open()
    pty.send(b"\x1b[32;1:3u\x1b[32;1:1u")
    assert [type(each) for each in responder.read(CLOCK.now_s() + SOON_S)] == [Press]


def test_ctrl_c_that_comes_as_a_key_interrupts() -> None:
    child = spawn("exit")
    child.send("\x1b[99;5u")
    child.expect("interrupted")
    child.expect("ended 0")
    child.close(force=True)


def test_a_letter_of_another_layout_confirms_nothing(pty: PseudoTerminal, terminal: Terminal) -> None:
    """On a Russian layout the first letter of "no" lies on the key y."""
    assert not terminal.confirm("headphones on?", show=Typist(pty, "нn".encode()))
