"""From a YAML file to a validated model, or to one error that lists everything wrong with the file."""

import hashlib
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import InitErrorDetails

from autd_trials.errors import UsageError
from autd_trials.yamlfile.explain import problems, spelled
from autd_trials.yamlfile.tree import MalformedYaml, Problem, mark_at, parse

T = TypeVar("T", bound=BaseModel)

LARGEST_BYTES = 1_000_000
_MOST_PROBLEMS = 100


Rules = Callable[[T], Iterable[InitErrorDetails]]
"""Yields what the schema cannot say: how fields must be to each other."""


def _no_rules(_model: object) -> tuple[()]:
    return ()


def load_model(path: Path, model: type[T], rules: Rules[T] = _no_rules) -> T:
    """Read a YAML file and validate it.

    The data are validated as JSON, so strict models take whole numbers for floats and lists for tuples.

    Parameters
    ----------
    path
        The file; UTF-8, at most 1 MB.
    model
        What the file must hold.
    rules
        Asked of a file that holds it; what they yield gets a line as well.

    Returns
    -------
    T
        The model.

    Raises
    ------
    UsageError
        The file cannot be read, is not YAML or does not fit; its text has a line
        ``file:line:column: key: what is wrong`` for each problem.
    """
    return load_with_sha256(path, model, rules)[0]


def load_with_sha256(path: Path, model: type[T], rules: Rules[T] = _no_rules) -> tuple[T, str]:
    """Read a YAML file like `load_model`; return the model and the SHA-256 of the very bytes it came from."""
    content = _read(path)
    text = _decode(content, path)
    try:
        document = parse(text)
    except MalformedYaml as error:
        raise _refusal(path, [error.problem]) from error
    try:
        loaded = model.model_validate_json(json.dumps(document.data))
        if broken := list(rules(loaded)):
            raise ValidationError.from_exception_data(model.__name__, broken)
    except ValidationError as error:
        found, further = problems(error, document, model, _MOST_PROBLEMS)
        raise _refusal(path, document.problems + found, further) from error
    if document.problems:
        raise _refusal(path, document.problems)
    return loaded, hashlib.sha256(content).hexdigest()


def _read(path: Path) -> bytes:
    try:
        if not path.exists():
            raise UsageError("there is no such file", where=str(path), do="check the name")
        if not path.is_file():
            raise UsageError("this is not a file", where=str(path), do="name a YAML file")
        with path.open("rb") as file:
            content = file.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise UsageError(f"the file cannot be read: {error.strerror}", where=str(path)) from error
    if len(content) > LARGEST_BYTES:
        raise UsageError("the file is larger than 1 MB, so it is not a settings file", where=str(path))
    return content


def _decode(content: bytes, path: Path) -> str:
    try:
        return content.decode("utf-8-sig")  # Windows editors put a byte order mark first
    except UnicodeDecodeError as error:
        before = content[: error.start].decode("utf-8", errors="replace")
        mark = mark_at(before, len(before))
        raise _refusal(path, [Problem(mark, (), "this is not UTF-8 text; save the file as UTF-8")]) from error


def _refusal(path: Path, found: list[Problem], further: int = 0) -> UsageError:
    """Return the error that lists the first problems in the order of the file, and counts all others."""
    lines = [
        f"{path}:{problem.mark.line}:{problem.mark.column}: {spelled(problem.path)}{problem.what}"
        for problem in sorted(found, key=lambda problem: problem.mark)[:_MOST_PROBLEMS]
    ]
    if further := further + len(found) - len(lines):
        lines.append(f"{path}: and {further} more")
    return UsageError("\n".join(lines))
