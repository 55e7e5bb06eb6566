"""The experimenter at the terminal."""

from rich.console import Console
from rich.panel import Panel
from rich.text import Text

from autd_trials.clock import Clock
from autd_trials.console.screen import Screen
from autd_trials.errors import StoppedByPerson
from autd_trials.protocol.plan import PlannedBlock
from autd_trials.session.interrupts import Interrupts
from autd_trials.session.operator import ConfirmedBy, Decision
from autd_trials.tables import level_text
from autd_trials.terminal import Terminal

_POLL_S = 0.1


class TerminalOperator:
    """Asks on the terminal, and turns keys typed while trials run into requests.

    Parameters
    ----------
    terminal
        The open terminal.
    screen
        Hidden while a question is asked.
    console
        Where longer texts are shown.
    interrupts
        Where requests to pause or abort go; Ctrl-C at a question ends the session.
    clock
        The machine's clock.
    """

    confirmed_by: ConfirmedBy = "person"

    def __init__(
        self, terminal: Terminal, screen: Screen, console: Console, interrupts: Interrupts, clock: Clock
    ) -> None:
        self._terminal = terminal
        self._screen = screen
        self._console = console
        self._interrupts = interrupts
        self._clock = clock
        self._note_wanted = False

    def poll(self) -> None:
        """Take in p (pause), n (pause for a note) and a (abort)."""
        for key in self._terminal.commands.take(self._clock.now_s()):
            match key.text.lower():
                case "p":
                    self._interrupts.request_pause()
                case "n":
                    self._note_wanted = True
                    self._interrupts.request_pause()
                case "a":
                    self._interrupts.request_abort()

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

    def confirm_resume(self, summary: str) -> None:
        """Show what is known of an interrupted session and ask whether it may go on."""
        self._confirm("Resume", summary, "Same participant, same set-up, and willing to go on?")

    def decide_after_pause(self, reason: str) -> Decision:
        """Ask what to do, and take notes."""
        notes: list[str] = []
        with self._screen.hidden():
            self._console.print(Panel(Text(reason), title="PAUSED: the array is silent", border_style="red"))
            while True:
                choice = (
                    "n" if self._note_wanted else self._choose("[c] continue   [n] note   [a] abort", "cna")
                )
                self._note_wanted = False
                if choice != "n":
                    return Decision(go_on=choice == "c", notes=tuple(notes))
                if note := self._terminal.ask_line("note: ", cancelled=self._aborted):
                    notes.append(note)

    def _confirm(self, title: str, text: str, question: str) -> None:
        with self._screen.hidden():
            self._console.print(Panel(Text(text.strip()), title=title, border_style="cyan"))
            confirmed = self._terminal.confirm(question, cancelled=lambda: self._interrupts.pause_requested)
        if not confirmed:
            raise StoppedByPerson(f"not confirmed: {question}")

    def _choose(self, question: str, choices: str) -> str:
        self._console.print(Text(question))
        with self._terminal.question() as keys:
            while not self._aborted():
                for key in keys.take(self._clock.now_s() + _POLL_S):
                    if key.text.lower() in choices:
                        return key.text.lower()
        return "a"

    def _aborted(self) -> bool:
        return self._interrupts.abort_requested
