"""A responder that presses at scripted times."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from autd_trials.clock import VirtualClock
from autd_trials.errors import DeviceError
from autd_trials.responses.responder import Input, Presentation, Press, ResponderInfo


@dataclass
class ScriptedResponder:
    """Presses at given times after each onset, and may be lost.

    Parameters
    ----------
    clock
        The session's clock, which `read` moves on.
    press_after_s
        When it presses after every onset, in s; may be negative.
    answer
        When it presses after the onset of a presentation, in s, beside `press_after_s`.
    lost_at_s
        The host time at which it is lost, once; None for never.
    lost_in
        Trial and attempt in which it is lost 0.1 s after the onset.
    kind
        What it says that it is.

    Attributes
    ----------
    presented
        What it was presented with.
    due
        Inputs that are still to come, in order; a test may add its own, unreadable ones too.
    """

    clock: VirtualClock
    press_after_s: tuple[float, ...] = ()
    answer: Callable[[Presentation], Iterable[float]] = lambda _presentation: ()
    lost_at_s: float | None = None
    lost_in: set[tuple[int, int]] = field(default_factory=set)
    kind: str = "scripted"
    presented: list[Presentation] = field(default_factory=list)
    due: list[Input] = field(default_factory=list)

    def open(self) -> ResponderInfo:
        """Begin."""
        return ResponderInfo(kind=self.kind, device="script", time_uncertainty_s=0.0)

    def present(self, presentation: Presentation) -> None:
        """Take note of what is presented, and of the presses that follow."""
        self.presented.append(presentation)
        if (presentation.trial, presentation.attempt) in self.lost_in:
            self.lost_at_s = presentation.onset_s + 0.1
        after_s = (*self.press_after_s, *self.answer(presentation))
        self.due += [Press(presentation.onset_s + each_s, "a") for each_s in after_s]
        self.due.sort(key=lambda press: press.time_s)

    def read(self, until_s: float) -> list[Input]:
        """Wait until `until_s` or the next input; see `Responder.read`."""
        if self.lost_at_s is not None and until_s >= self.lost_at_s:
            self.clock.sleep_until(self.lost_at_s)
            self.lost_at_s = None
            raise DeviceError("unplugged", where="responder", do="plug it in")
        self.clock.sleep_until(min([until_s, *(press.time_s for press in self.due[:1])]))
        presses = [press for press in self.due if press.time_s <= self.clock.now_s()]
        self.due = self.due[len(presses) :]
        return presses

    def close(self) -> None:
        """Forget what was to come."""
        self.due.clear()
