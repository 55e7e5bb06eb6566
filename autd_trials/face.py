"""The public face of a room: names that are imported from their modules when they are first asked for.

A command must start in a fraction of a second, so that a room's ``__init__`` may not import numpy or an SDK
for one who wants something else of it.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy(room: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a room's ``__getattr__`` (PEP 562).

    Parameters
    ----------
    room
        The room's ``__name__``.
    homes
        The module of the room in which each public name lies.
    """

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        return getattr(import_module(f"{room}.{homes[name]}"), name)

    return find
