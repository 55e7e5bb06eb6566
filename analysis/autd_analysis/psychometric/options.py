"""What a person may ask of psychometric functions: how the rates are found, and which form F has."""

from dataclasses import dataclass

from autd_analysis.psychometric.functions import LOGISTIC, NORMAL, WEIBULL, Core
from autd_analysis.psychometric.likelihood import Rate
from autd_analysis.psychometric.model import LEAST_SPAN, Model
from autd_trials.errors import UsageError

CORES: dict[str, Core] = {core.name.lower(): core for core in (NORMAL, LOGISTIC, WEIBULL)}
"""The forms of F by the words that ask for them."""

ESTIMATED: dict[str, Rate] = {"shared": "shared", "free": "free"}
"""Words for rates that are estimated: one for all conditions of a participant, or one for each."""


@dataclass(frozen=True)
class PsychometricOptions:
    """How psychometric functions are fitted.

    Attributes
    ----------
    guess
        Probability of "felt" (or of a right answer) far below the threshold: a number, such as 0.5 for two
        alternatives; "shared" to estimate one for all conditions of a participant, "free" for one in each
        condition. None: as "shared" for participants with catch trials or stimuli of level 0, else 0.
    lapse
        Probability of "not felt" far above the threshold: a number, "shared" or "free".
    core
        Form of F: "normal", "logistic" or "weibull".

    Raises
    ------
    UsageError
        A rate is not from 0 up to 1, both leave less than a tenth between them, or there is no such core.
    """

    guess: Rate | None = None
    lapse: Rate = 0.02
    core: str = "normal"

    def __post_init__(self) -> None:
        """Refuse what cannot be fitted."""
        for name, rate in (("guess", self.guess), ("lapse", self.lapse)):
            if isinstance(rate, str):
                if rate not in ESTIMATED:
                    raise _unknown(name, rate)
            elif rate is not None and not 0 <= rate < 1:
                raise UsageError(f"the {name} rate is {rate:g}", do="give a number from 0 up to 1")
        fixed = [rate for rate in (self.guess, self.lapse) if not isinstance(rate, str | None)]
        if sum(fixed) > 1 - LEAST_SPAN + 1e-9:
            raise UsageError(
                f"guess and lapse rate are {sum(fixed):g} together: no function can rise",
                do=f"give rates that are at most {1 - LEAST_SPAN:g} together",
            )
        if self.core.lower() not in CORES:
            raise UsageError(f"there is no core {self.core!r}", do=f"take {', '.join(CORES)}")

    def model(self, *, informed: bool) -> Model:
        """Return the model of a participant; `informed`: with trials that determine the guess rate alone."""
        default: Rate = "shared" if informed else 0.0
        guess = default if self.guess is None else self.guess
        return Model(CORES[self.core.lower()], guess, self.lapse)


DEFAULT = PsychometricOptions()
"""What is fitted where nothing is asked for."""


def read_rate(text: str, name: str) -> Rate:
    """Return the rate that a word asks for: a number, ``shared`` or ``free``.

    Parameters
    ----------
    text
        The word.
    name
        ``guess`` or ``lapse``, for the message.

    Raises
    ------
    UsageError
        It is neither.
    """
    if text in ESTIMATED:
        return ESTIMATED[text]
    try:
        return float(text)
    except ValueError as error:
        raise _unknown(name, text) from error


def _unknown(name: str, text: str) -> UsageError:
    return UsageError(f"the {name} rate is {text!r}", do="give a number such as 0.02, or shared, or free")
