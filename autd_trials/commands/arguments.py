"""Numbers on a command line."""

import argparse
import math
from datetime import datetime

Triple = tuple[float, float, float]


def triple(text: str) -> Triple:
    """Read X,Y,Z."""
    x, y, z = numbers(text, (3,))
    return x, y, z


def numbers(text: str, lengths: tuple[int, ...]) -> tuple[float, ...]:
    """Read finite numbers separated by commas, as many as one of some lengths.

    Raises
    ------
    argparse.ArgumentTypeError
        It is something else.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in lengths or not all(map(math.isfinite, values)):
        wanted = " or ".join(map(str, lengths))
        raise argparse.ArgumentTypeError(f"{text!r} is not {wanted} numbers separated by commas")
    return values


def positive(text: str) -> float:
    """Read a number over 0.

    Raises
    ------
    argparse.ArgumentTypeError
        It is something else.
    """
    (value,) = numbers(text, (1,))
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not over 0")
    return value


def moment(text: str) -> datetime:
    """Read a time with its time zone, as 2026-11-22T09:30:00Z.

    Raises
    ------
    argparse.ArgumentTypeError
        It is something else.
    """
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        time = None
    if time is None or time.tzinfo is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no time with a time zone, as 2026-11-22T09:30:00Z")
    return time
