"""A broken rule, reported at the place in the protocol to correct."""

from collections.abc import Iterable, Iterator, Sequence

from pydantic_core import InitErrorDetails, PydanticCustomError

from autd_trials.protocol.conditions import Location
from autd_trials.yamlfile import did_you_mean


def fault(location: Location, message: str) -> InitErrorDetails:
    """Return a fault for `pydantic.ValidationError.from_exception_data`."""
    error = PydanticCustomError("protocol", "{message}", {"message": message})
    return InitErrorDetails(type=error, loc=location, input=None)


def unknown(kind: str, word: str, allowed: Iterable[str]) -> str:
    """Return the message about a word that names nothing."""
    known = list(allowed)
    return f"there is no {kind} {word!r}; allowed: {', '.join(known) or 'none'}{did_you_mean(word, known)}"


def repeated(values: Sequence[object]) -> Iterator[int]:
    """Yield the index of each value that was there before."""
    seen = set()
    for index, value in enumerate(values):
        if value in seen:
            yield index
        seen.add(value)
