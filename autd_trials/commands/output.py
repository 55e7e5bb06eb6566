"""What goes where: results to standard output, messages for people to standard error."""

import json
import sys
from typing import Any


def print_json(result: object) -> None:
    """Print a command's result as one JSON object."""
    sys.stdout.write(json.dumps(result, ensure_ascii=False, allow_nan=False) + "\n")


def print_text(text: str) -> None:
    """Print a command's result as text."""
    sys.stdout.write(text if text.endswith("\n") else text + "\n")


def say(message: Any) -> None:
    """Tell the person something."""
    sys.stderr.write(f"{message}\n")
