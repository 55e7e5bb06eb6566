"""The experimenter at the terminal."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.panel import Panel
from rich.text import Text

from autd_trials.clock import Clock
from autd_trials.console.controls import Controls
from autd_trials.console.screen import Screen
from autd_trials.errors import DeviceError, StoppedByPerson
from autd_trials.protocol.plan import PlannedBlock
from autd_trials.session.events import ConfirmedBy
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import Decision
from autd_trials.tables import level_text
from autd_trials.terminal import Terminal
from autd_trials.terminal.keys import plain_key

_POLL_S = 0.1


class TerminalOperator:
    """Asks on the terminal. One that is closed ends the session, as a person would.

    Parameters
    ----------
    terminal
        The open terminal.
    screen
        Hidden while a question is asked.
    console
        Where longer texts are shown.
    interrupts
        Requests to pause or abort; Ctrl-C at a question ends the session.
    controls
        Knows whether a pause is for a note.
    clock
        The machine's clock.
    """

    confirmed_by: ConfirmedBy = "person"

    def __init__(
        self,
        terminal: Terminal,
        screen: Screen,
        console: Console,
        interrupts: Interrupts,
        controls: Controls,
        clock: Clock,
    ) -> None:
        self._terminal = terminal
        self._screen = screen
        self._console = console
        self._interrupts = interrupts
        self._controls = controls
        self._clock = clock

    def read_out(self, instructions: str) -> None:
        """Show the instructions and wait until they were read out."""
        self._confirm("Read this out to the participant", instructions, "Read out, and understood?")

    def confirm_block(self, block: PlannedBlock) -> None:
        """Show what a person must arrange for a block and wait until it is so."""
        conditions = "\n".join(f"{name}: {level_text(level)}" for name, level in block.conditions.items())
        arrange = "\n".join((conditions, *block.descriptions))
        self._confirm(
            f"Block {block.block}", arrange, "Is everything as it says, headphones on, eyes closed?"
        )

    def confirm_known(self, summary: str) -> None:
        """Show what is recorded under an id and ask whether this is the same person; no ends it."""
        self._confirm_or_end("Known participant", summary, "Is this the same person?")

    def confirm_resume(self, summary: str) -> None:
        """Show what is known of an interrupted session and ask whether it may go on; no ends it."""
        self._confirm_or_end("Resume", summary, "Same participant, same set-up, and willing to go on?")

    def decide_after_pause(self, reason: str) -> Decision:
        """Ask what to do, and take notes."""
        notes: list[str] = []
        with self._asking("PAUSED: the array is silent", reason, style="red"):
            while True:
                note_wanted, self._controls.note_wanted = self._controls.note_wanted, False
                choice = "n" if note_wanted else self._choose("[c] continue   [n] note   [a] abort", "cna")
                if choice != "n":
                    return Decision(go_on=choice == "c", notes=tuple(notes))
                if note := self._terminal.ask_line("note: ", cancelled=self._aborted):
                    notes.append(note)

    def _confirm_or_end(self, title: str, text: str, question: str) -> None:
        with self._asking(title, text):
            if not self._yes(question):
                raise StoppedByPerson(f"not confirmed: {question}")

    def _confirm(self, title: str, text: str, question: str) -> None:
        """Ask until the answer is yes: no means not yet."""
        with self._asking(title, text):
            while not self._yes(question):
                self._console.print(Text("Waiting: y when it is so; Ctrl-C ends the session."))

    def _yes(self, question: str) -> bool:
        confirmed = self._terminal.confirm(question, cancelled=lambda: self._interrupts.pause_requested)
        self._interrupts.obey()
        if self._interrupts.pause_requested:
            raise StoppedByPerson(f"not confirmed: {question}")
        return confirmed

    @contextmanager
    def _asking(self, title: str, text: str, style: str = "cyan") -> Iterator[None]:
        """Show what a question is about, with the screen hidden while it is asked."""
        try:
            with self._screen.hidden():
                self._console.print(Panel(Text(text.strip()), title=title, border_style=style))
                yield
        except (OSError, DeviceError) as error:
            self._interrupts.request_abort("the terminal was closed")
            raise StoppedByPerson(self._interrupts.why) from error

    def _choose(self, question: str, choices: str) -> str:
        self._console.print(Text(question))
        with self._terminal.question() as keys:
            while not self._aborted():
                for key in keys.take(self._clock.now_s() + _POLL_S):
                    if (choice := plain_key(key.text)) in choices:
                        return choice
        return "a"

    def _aborted(self) -> bool:
        return self._interrupts.abort_requested
