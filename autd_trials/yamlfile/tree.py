"""YAML text to plain data that knows where each value stands.

Only what a person writes in a settings file is read: mappings, lists, text, decimal numbers, true, false
and nothing. Anchors, tags and several documents in one file are refused, and so is every word that YAML 1.1
and YAML 1.2 read differently (``no``, ``1:30``, ``2026-11-22``, ``010``): a level ``no`` must not turn into
``false`` in somebody else's program. ``1e3`` is the number that it looks like.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Any

import yaml

Path = tuple[str | int, ...]
"""Keys and list indices from the root to a value."""

DEEPEST = 20
MOST_EVENTS = 20_000
"""Starts and ends of mappings and lists, keys and values: settings files have a few hundred."""

_LONGEST_INTEGER = 18
_DECIMAL = re.compile(r"[-+]?(?:(?:0|[1-9][0-9]*)(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_INTEGER = re.compile(r"[-+]?[0-9]+")
_UNPRINTABLE = re.compile("[^\\t\\n\\r\\x20-\\x7e\\x85\\xa0-\\ud7ff\\ue000-\\ufffd\\U00010000-\\U0010ffff]")
"""What YAML forbids in a file."""
_CONTROL = re.compile("[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f\\ud800-\\udfff\\ufffe\\uffff]")
"""What no table and no terminal could show; a file may hold some of it as an escape."""
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml's is twenty times as fast
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
    if refused := _UNPRINTABLE.search(text):
        what = f"the character U+{ord(refused[0]):04X} may not stand in a YAML file; remove it"
        raise MalformedYaml(Problem(mark_at(text, refused.start()), (), what))
    builder = _Builder(_Loader(text))
    try:
        return builder.build()
    except yaml.MarkedYAMLError as error:
        problem = Problem(_mark(error.problem_mark), (), _syntax_error(error, text))
        raise MalformedYaml(problem) from error
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # an escape or a version beyond all bounds
        raise MalformedYaml(Problem(builder.reached, (), f"is not YAML: {error}")) from error


def mark_at(text: str, position: int) -> Mark:
    """Return the line and column of a position in a text."""
    before = text[:position]
    return Mark(before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1)


class _Builder:
    """Turns the parser's events into a tree."""

    def __init__(self, loader: Any) -> None:
        self._loader = loader
        self._tree = Tree()
        self._events = 0
        self.reached = Mark(1, 1)
        """Where the last event ended."""

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
        event: yaml.Event = self._loader.get_event()
        self.reached = _mark(event.end_mark)
        self._events += 1
        if self._events > MOST_EVENTS:
            what = f"the file goes on after {MOST_EVENTS:,} keys, values and brackets: no settings file does"
            raise MalformedYaml(Problem(self.reached, (), what))
        return event

    def _value(self, event: yaml.Event, path: Path) -> Any:
        mark = _mark(event.start_mark)
        self._tree.value_marks[path] = mark
        if len(path) > DEEPEST:
            raise _too_deep(event, path[:3])
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
                self._discard(self._next())
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
            return "" if flaw else str(event.value)
        self._problem(event, (*path, ""), "a key must be a word")
        self._discard(event)
        return ""

    def _discard(self, event: yaml.Event) -> None:
        """Read a value that counts for nothing, to find where it ends."""
        depth = 0
        while True:
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth == 0:
                return
            if depth > DEEPEST:
                raise _too_deep(event, ())
            event = self._next()

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
        if event.style:  # quoted or a block
            return text
        if _DECIMAL.fullmatch(text):
            return self._number(event, path)
        if text in _NOTHING:
            return None
        if text in _TRUTH:
            return _TRUTH[text]
        resolved = self._loader.resolve(yaml.ScalarNode, text, (True, False))
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


def _too_deep(event: yaml.Event, path: Path) -> MalformedYaml:
    return MalformedYaml(Problem(_mark(event.start_mark), path, f"nested more than {DEEPEST} levels deep"))


def _mark(mark: Any) -> Mark:
    return Mark(mark.line + 1, mark.column + 1)


def _control_character(text: str) -> str | None:
    """Say which character of a text is one."""
    refused = _CONTROL.search(text)
    return f"contains the control character U+{ord(refused[0]):04X}; remove it" if refused else None


def _syntax_error(error: yaml.MarkedYAMLError, text: str) -> str:
    problem = error.problem or "is not YAML"
    if error.problem_mark and text[error.problem_mark.index :].startswith("\t"):
        return "a tab stands here; indent with spaces"
    if error.context:
        return f"not YAML {error.context}: {problem}"
    return f"not YAML: {problem}"
