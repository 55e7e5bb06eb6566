"""From a YAML file to a validated model, or to one error that lists everything wrong with the file."""

import hashlib
import json
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from autd_trials.errors import UsageError
from autd_trials.yamlfile import explain, tree

T = TypeVar("T", bound=BaseModel)

LARGEST_BYTES = 1_000_000
_MOST_PROBLEMS = 100


def load_model(path: Path, model: type[T]) -> T:
    """Read a YAML file and validate it.

    The data are validated as JSON, so strict models take whole numbers for floats and lists for tuples.

    Parameters
    ----------
    path
        The file; UTF-8, at most 1 MB.
    model
        What the file must hold. Validators may raise a `pydantic.ValidationError` of their own whose errors
        carry a location; these get a line as well.

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
    return load_with_sha256(path, model)[0]


def load_with_sha256(path: Path, model: type[T]) -> tuple[T, str]:
    """Read a YAML file like `load_model`; return the model and the SHA-256 of the very bytes it came from."""
    content = _read(path)
    text = _decode(content, path)
    try:
        document = tree.parse(text)
    except tree.MalformedYaml as error:
        raise _refusal(path, [error.problem]) from error
    try:
        loaded = model.model_validate_json(json.dumps(document.data))
    except ValidationError as error:
        raise _refusal(path, document.problems + explain.problems(error, document, model)) from error
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
        mark = tree.mark_at(before, len(before))
        raise _refusal(
            path, [tree.Problem(mark, (), "this is not UTF-8 text; save the file as UTF-8")]
        ) from error


def _refusal(path: Path, problems: list[tree.Problem]) -> UsageError:
    """Return the error that lists the problems in the order in which they stand in the file."""
    lines = [
        f"{path}:{problem.mark.line}:{problem.mark.column}: {explain.spelled(problem.path)}{problem.what}"
        for problem in sorted(problems, key=lambda problem: problem.mark)
    ]
    further = len(lines) - _MOST_PROBLEMS
    if further > 0:
        lines[_MOST_PROBLEMS:] = [f"{path}: and {further} more"]
    return UsageError("\n".join(lines))
