"""What the tables of trials and of sessions have in common."""

from collections.abc import Callable
from typing import TypeVar

from autd_trials.tables import Column

Of = TypeVar("Of")


def simulated_column(get: Callable[[Of], bool]) -> Column[Of]:
    """Return a column of every table of trials and sessions: each file that is opened says what it is."""
    return Column(
        "simulated",
        "Whether a simulated participant answered.",
        get,
        levels={"yes": "A program answered.", "no": "A person answered."},
    )


def to_us(seconds: float | None) -> float | None:
    """Round a time in s to 1 us, so that its text is short and stable."""
    return None if seconds is None else round(seconds, 6)
