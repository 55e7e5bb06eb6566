"""YAML text to plain data that knows where each value stands.

Only what a person writes in a settings file is read: mappings, lists, text, decimal numbers, true, false
and nothing. Anchors, tags and several documents in one file are refused, and so is every word that YAML 1.1
and YAML 1.2 read differently (``no``, ``1:30``, ``2026-11-22``, ``010``): a level ``no`` must not turn into
``false`` in somebody else's program. ``1e3`` is the number that it looks like.
"""

import math
import re
import unicodedata
from dataclasses import dataclass, field
from typing import Any, cast

import yaml

Path = tuple[str | int, ...]
"""Keys and list indices from the root to a value."""

DEEPEST = 20
_LONGEST_INTEGER = 18
_DECIMAL = re.compile(r"[-+]?(?:(?:0|[1-9][0-9]*)(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_INTEGER = re.compile(r"[-+]?[0-9]+")
_NOTHING = frozenset({"", "~", "null", "Null", "NULL"})
_TRUTH = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_READ_AS = {
    "bool": "true or false",
    "timestamp": "a date",
    "int": "a number that is not decimal",
    "float": "a number that is not decimal or not finite",
}


@dataclass(frozen=True, order=True)
class Mark:
    """A place in a file; line and column count from 1."""

    line: int
    column: int


@dataclass(frozen=True)
class Problem:
    """Something wrong at a place."""

    mark: Mark
    path: Path
    what: str


class MalformedYaml(Exception):
    """The text cannot be read on from here."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.what)
        self.problem = problem


@dataclass
class Tree:
    """A file's data, with the places of its values and keys, and what is wrong with single values."""

    data: Any = None
    value_marks: dict[Path, Mark] = field(default_factory=dict)
    key_marks: dict[Path, Mark] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)


def parse(text: str) -> Tree:
    """Read one YAML document.

    Parameters
    ----------
    text
        The file's text.

    Returns
    -------
    Tree
        The data; a value that has a problem stands there as the text that was written.

    Raises
    ------
    MalformedYaml
        The text is not YAML, is empty, nests too deeply or holds more than one document.
    """
    try:
        loader = yaml.SafeLoader(text)
    except yaml.reader.ReaderError as error:
        what = f"the character U+{int(error.character):04X} may not stand in a YAML file; remove it"
        raise MalformedYaml(Problem(mark_at(text, error.position), (), what)) from error
    try:
        return _Builder(loader).build()
    except yaml.MarkedYAMLError as error:
        raise MalformedYaml(Problem(_mark(error.problem_mark), (), _syntax_error(error))) from error
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # an escape or a version beyond all bounds
        problem = Problem(_mark(loader.get_mark()), (), f"is not YAML: {error}")
        raise MalformedYaml(problem) from error


def mark_at(text: str, position: int) -> Mark:
    """Return the line and column of a position in a text."""
    before = text[:position]
    return Mark(before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1)


class _Builder:
    """Turns the parser's events into a tree."""

    def __init__(self, loader: yaml.SafeLoader) -> None:
        self._loader = loader
        self._tree = Tree()

    def build(self) -> Tree:
        self._next()  # the stream's start
        if isinstance(self._next(), yaml.StreamEndEvent):
            raise MalformedYaml(Problem(Mark(1, 1), (), "the file is empty"))
        self._tree.data = self._value(self._next(), ())
        self._next()  # the document's end
        further = self._next()
        if not isinstance(further, yaml.StreamEndEvent):
            what = "a second document starts here; one file holds one document, remove the '---'"
            raise MalformedYaml(Problem(_mark(further.start_mark), (), what))
        return self._tree

    def _next(self) -> yaml.Event:
        return cast(yaml.Event, self._loader.get_event())  # type: ignore[no-untyped-call]

    def _value(self, event: yaml.Event, path: Path) -> Any:
        mark = _mark(event.start_mark)
        self._tree.value_marks[path] = mark
        if len(path) > DEEPEST:
            raise MalformedYaml(Problem(mark, path[:3], f"nested more than {DEEPEST} levels deep"))
        self._refuse_indirection(event, path)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(path)
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, path)
        return None

    def _refuse_indirection(self, event: yaml.Event, path: Path) -> None:
        if isinstance(event, yaml.AliasEvent):
            self._problem(event, path, f"the alias *{event.anchor} is not allowed; write the value out")
        elif getattr(event, "anchor", None) is not None:
            self._problem(event, path, "anchors (&) are not allowed; write the value out where it is needed")
        if getattr(event, "tag", None) is not None:
            self._problem(event, path, "tags (!) are not allowed; remove it")

    def _mapping(self, path: Path) -> dict[str, Any]:
        mapping: dict[str, Any] = {}
        while not isinstance(event := self._next(), yaml.MappingEndEvent):
            key = self._key(event, path)
            child = (*path, key)
            if key in mapping:
                first = self._tree.key_marks[child].line
                self._problem(event, child, f"this key was given already in line {first}; keep one of them")
                self._discard(self._next(), child)
                continue
            self._tree.key_marks[child] = _mark(event.start_mark)
            mapping[key] = self._value(self._next(), child)
        return mapping

    def _key(self, event: yaml.Event, path: Path) -> str:
        """Return a key as it is written: a key is text, also where it looks like a number."""
        self._refuse_indirection(event, path)
        if isinstance(event, yaml.ScalarEvent):
            if flaw := _control_character(event.value):
                self._problem(event, path, f"this key {flaw}")
            return event.value
        self._problem(event, (*path, ""), "a key must be a word")
        self._discard(event, path)
        return ""

    def _discard(self, event: yaml.Event, path: Path) -> None:
        """Read a value that counts for nothing, to find where it ends."""
        discarding = _Builder(self._loader)
        discarding._value(event, path)

    def _sequence(self, path: Path) -> list[Any]:
        sequence: list[Any] = []
        while not isinstance(event := self._next(), yaml.SequenceEndEvent):
            sequence.append(self._value(event, (*path, len(sequence))))
        return sequence

    def _scalar(self, event: yaml.ScalarEvent, path: Path) -> Any:
        text = event.value
        if flaw := _control_character(text):
            self._problem(event, path, f"this text {flaw}")
            return ""
        if event.style is not None:
            return text
        if _DECIMAL.fullmatch(text):
            return self._number(event, path)
        if text in _NOTHING:
            return None
        if text in _TRUTH:
            return _TRUTH[text]
        resolved = self._loader.resolve(yaml.ScalarNode, text, (True, False))  # type: ignore[no-untyped-call]
        tag = str(resolved).rpartition(":")[2]
        if tag != "str":
            read_as = _READ_AS.get(tag, "a special sign")
            what = f"{text[:40]!r} is {read_as} to some YAML readers"
            self._problem(event, path, f"{what}; put it in quotes if it is text, else write it plainly")
        return text

    def _number(self, event: yaml.ScalarEvent, path: Path) -> int | float | str:
        text = event.value
        if _INTEGER.fullmatch(text) and len(text) <= _LONGEST_INTEGER:
            return int(text)
        number = float(text)
        if not math.isfinite(number):
            self._problem(event, path, "this number is too large")
            return ""
        return number

    def _problem(self, event: yaml.Event, path: Path, what: str) -> None:
        self._tree.problems.append(Problem(_mark(event.start_mark), path, what))


def _mark(mark: Any) -> Mark:
    return Mark(mark.line + 1, mark.column + 1)


def _control_character(text: str) -> str | None:
    """Say which character of a text no table and no terminal could show."""
    for character in text:
        if unicodedata.category(character) in {"Cc", "Cs"} and character not in "\n\t":
            return f"contains the control character U+{ord(character):04X}; remove it"
    return None


def _syntax_error(error: yaml.MarkedYAMLError) -> str:
    problem = error.problem or "is not YAML"
    if r"'\t'" in problem:
        return "a tab stands here; indent with spaces"
    if error.context:
        return f"not YAML {error.context}: {problem}"
    return f"not YAML: {problem}"
