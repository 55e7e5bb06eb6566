"""The experimenter's screens."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.console.controls import Controls
    from autd_trials.console.lines import Lines
    from autd_trials.console.operator import TerminalOperator
    from autd_trials.console.screen import Screen

__all__ = ["Controls", "Lines", "Screen", "TerminalOperator"]

__getattr__ = lazy(
    __name__,
    {
        "Controls": "controls",
        "Lines": "lines",
        "Screen": "screen",
        "TerminalOperator": "operator",
    },
)
