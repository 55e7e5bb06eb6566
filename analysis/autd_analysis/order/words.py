"""Effects of order in words."""

from collections.abc import Iterator, Mapping, Sequence

from autd_analysis.data.trials import Trials
from autd_analysis.order.numbers import OrderEffect
from autd_analysis.report.wording import format_interval, format_rate, p_equals
from autd_analysis.subject import Shown

DEFINITIONS: Mapping[str, str] = {
    "order_effects": (
        "Checks of order: slopes of answers over the course of a session and of a block and from session to "
        "session, and the correlation with the answer before, tested by 1999 shuffles of answers within "
        "participant and condition (seed 1); order of blocks and carry-over by Welch's t test between those "
        "who began with either."
    ),
}
"""How each quantity was found."""


def words(effects: Sequence[OrderEffect], _trials: Trials) -> Shown:
    """Return the checks as lines for a terminal."""
    return Shown(summary=tuple(_lines(effects)))


def _lines(effects: Sequence[OrderEffect]) -> Iterator[str]:
    known = [effect for effect in effects if effect.estimate is not None]
    if not known:
        return
    yield "Order effects (checks, not adjusted):"
    for effect in known:
        test = f", {p_equals(effect.p)}" if effect.p is not None else ", not testable"
        yield (
            f"  {effect.name}: {effect.about} {format_rate(effect.estimate)} "
            f"{format_interval(effect.interval)}{test}"
        )
