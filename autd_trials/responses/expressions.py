"""Regular expressions of rig files, matched in time proportional to the text.

They run on every line that a box sends, in a thread that shares the interpreter with the session: one that
backtracks would hold up everything, a stop included. RE2 has no backtracking, and so no backreferences and
no looking ahead or behind.
"""

from functools import cache
from typing import Annotated, Any

from pydantic import AfterValidator, Field

_MOST_MEMORY_BYTES = 1 << 20


def _checked(expression: str) -> str:
    """Refuse what RE2 cannot compile."""
    compiled(expression)
    return expression


Expression = Annotated[str, Field(min_length=1, max_length=500), AfterValidator(_checked)]
"""A regular expression in RE2's syntax, which is Python's without backreferences and looking around."""


@cache
def compiled(expression: str) -> Any:
    """Return the compiled expression; raises ValueError if it is none."""
    import re2  # here, as only rigs with a box need it

    options = re2.Options()
    options.max_mem = _MOST_MEMORY_BYTES
    options.log_errors = False
    try:
        return re2.compile(expression, options=options)
    except re2.error as error:
        reason = error.args[0].decode("utf-8", errors="replace") if error.args else "unknown"
        raise ValueError(
            f"no regular expression: {reason} (backreferences and looking ahead or behind are not allowed)"
        ) from error
