"""The experimenter's terminal: single keys, stamped on arrival, and questions."""

from autd_trials.terminal.terminal import Terminal

__all__ = ["Terminal"]
