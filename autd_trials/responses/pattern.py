"""Patterns of a box's messages: regular expressions in time that grows with the message's length alone.

The `re` module of Python tries one way after the other; an expression such as ``(a+)+b`` keeps it, and with
it every thread and Ctrl-C, for years over a line of 60 characters. Here all ways are followed at once, a
character at a time (Thompson's construction; captures after Pike), so that a match takes at most
`LARGEST_PROGRAM` steps a character. What would need more is refused when the pattern is read.
"""

import re
import string
from dataclasses import dataclass, field

LONGEST_PATTERN = 200
LARGEST_PROGRAM = 300
_DEEPEST = 10

_ALL = frozenset(map(chr, range(256)))
_CLASSES = {
    "d": frozenset(string.digits),
    "w": frozenset(string.ascii_letters + string.digits + "_"),
    "s": frozenset(" \t\n\r\f\v"),
}
_CLASSES |= {name.upper(): _ALL - members for name, members in _CLASSES.items()}
_CONTROLS = {"t": "\t", "n": "\n", "r": "\r", "f": "\f", "v": "\v", "0": "\0"}
_COUNT = re.compile(r"\{(?:(\d{1,4})?(,)(\d{1,4})?|(\d{1,4}))\}")
_NAME = re.compile(r"\?P<([A-Za-z_]\w*)>", re.ASCII)


class PatternError(ValueError):
    """The pattern is none, or not one that is matched in bounded time."""


@dataclass(frozen=True)
class _Char:
    members: frozenset[str]


@dataclass(frozen=True)
class _Sequence:
    parts: tuple["_Node", ...]


@dataclass(frozen=True)
class _Either:
    ways: tuple["_Node", ...]


@dataclass(frozen=True)
class _Group:
    inner: "_Node"
    name: str | None


@dataclass(frozen=True)
class _Repeat:
    inner: "_Node"
    least: int
    most: int | None
    lazy: bool


_Node = _Char | _Sequence | _Either | _Group | _Repeat


@dataclass
class _Step:
    """A step of a program: read a character, save a place, or go on in several ways, the first preferred."""

    members: frozenset[str] | None = None
    save: int | None = None
    ways: tuple[int, ...] = ()


class Pattern:
    r"""A pattern over latin-1 text, in the syntax of `re`, that must match a whole text.

    There are characters, ``.``, classes (``[a-z]``, ``[^,]``, ``\d \w \s`` and their opposites), groups
    (plain, ``(?:...)``, ``(?P<name>...)``), ``|`` and the repeats ``* + ? {m} {m,n}``, greedy or (with a
    ``?`` behind) lazy. Repeats of what may be empty, references, looks ahead and flags are refused.

    Parameters
    ----------
    text
        The pattern.

    Raises
    ------
    PatternError
        It is none of these.
    """

    def __init__(self, text: str) -> None:
        tree, self._names = _Reader(text).read()
        self._program = _program(tree)

    @property
    def names(self) -> frozenset[str]:
        """Names of the groups."""
        return frozenset(self._names)

    def fullmatch(self, text: str) -> dict[str, str] | None:
        """Return what the named groups matched (those that took part), None if the text does not match."""
        saved = (-1,) * (2 * len(self._names))
        threads = self._follow([(0, saved)], 0)
        for place, character in enumerate(text):
            went_on = [
                (at + 1, places)
                for at, places in threads
                if at < len(self._program) and character in (self._program[at].members or ())
            ]
            threads = self._follow(went_on, place + 1)
            if not threads:
                return None
        ends = [places for at, places in threads if at == len(self._program)]
        if not ends:
            return None
        spans = {name: ends[0][2 * slot : 2 * slot + 2] for slot, name in enumerate(self._names)}
        return {name: text[start:end] for name, (start, end) in spans.items() if min(start, end) >= 0}

    def _follow(
        self, threads: list[tuple[int, tuple[int, ...]]], place: int
    ) -> list[tuple[int, tuple[int, ...]]]:
        """Return the threads at the next characters to be read, in the order of preference, each once."""
        reached: list[tuple[int, tuple[int, ...]]] = []
        seen: set[int] = set()
        waiting = list(reversed(threads))
        while waiting:
            at, places = waiting.pop()
            if at in seen:
                continue
            seen.add(at)
            step = self._program[at] if at < len(self._program) else None
            if step is None or step.members is not None:
                reached.append((at, places))
            elif step.save is not None:
                waiting.append((at + 1, (*places[: step.save], place, *places[step.save + 1 :])))
            else:
                waiting += [(way, places) for way in reversed(step.ways)]
        return reached


@dataclass
class _Reader:
    """Reads a pattern into a tree."""

    text: str
    at: int = 0
    names: list[str] = field(default_factory=list)

    def read(self) -> tuple[_Node, list[str]]:
        if len(self.text) > LONGEST_PATTERN:
            raise PatternError(f"the expression is longer than {LONGEST_PATTERN} characters")
        self.text = self.text.removeprefix("^")  # it must match a whole message anyway
        if self.text.endswith("$") and not self.text.endswith("\\$"):
            self.text = self.text[:-1]
        tree = self._either(0)
        if self.at < len(self.text):
            raise PatternError("there is a ) too many")
        return tree, self.names

    def _either(self, depth: int) -> _Node:
        if depth > _DEEPEST:
            raise PatternError(f"groups are nested more than {_DEEPEST} deep")
        ways = [self._sequence(depth)]
        while self._take("|"):
            ways.append(self._sequence(depth))
        return ways[0] if len(ways) == 1 else _Either(tuple(ways))

    def _sequence(self, depth: int) -> _Node:
        parts: list[_Node] = []
        while self.at < len(self.text) and self.text[self.at] not in "|)":
            parts.append(self._repeated(self._atom(depth)))
        return _Sequence(tuple(parts))

    def _repeated(self, inner: _Node) -> _Node:
        counts = self._counts()
        if counts is None:
            return inner
        least, most = counts
        lazy = self._take("?")
        if self._counts() is not None or self._take("+"):
            raise PatternError("a repeat of a repeat")
        if most is not None and most < least:
            raise PatternError("a repeat whose most is less than its least")
        if (least, most) != (0, 1) and _may_be_empty(inner):
            raise PatternError("a repeat of what may be empty")
        return _Repeat(inner, least, most, lazy)

    def _counts(self) -> tuple[int, int | None] | None:
        for sign, counts in (("*", (0, None)), ("+", (1, None)), ("?", (0, 1))):
            if self._take(sign):
                return counts
        found = _COUNT.match(self.text, self.at)
        if found is None:
            return None
        self.at = found.end()
        if found[4]:
            return int(found[4]), int(found[4])
        return int(found[1] or 0), int(found[3]) if found[3] else None

    def _atom(self, depth: int) -> _Node:
        character = self._next()
        if character == "(":
            return self._group(depth)
        if character == "[":
            return _Char(self._class())
        if character == ".":
            return _Char(_ALL - {"\n"})
        if character == "\\":
            return _Char(self._escape())
        if character in "*+?^$":
            raise PatternError(
                f"{character!r} at a place where it repeats or marks nothing; write \\{character}"
            )
        return _Char(_one(character))

    def _group(self, depth: int) -> _Node:
        name = None
        if named := _NAME.match(self.text, self.at):
            name, self.at = named[1], named.end()
            if name in self.names:
                raise PatternError(f"two groups are called {name}")
            self.names.append(name)
        elif self._take("?") and not self._take(":"):
            raise PatternError("of groups that begin with (? only (?:...) and (?P<name>...) are known")
        inner = self._either(depth + 1)
        if not self._take(")"):
            raise PatternError("a ( without its )")
        return _Group(inner, name)

    def _class(self) -> frozenset[str]:
        negated = self._take("^")
        members: set[str] = set()
        first = True
        while first or not self._take("]"):
            first = False
            low = self._class_member()
            is_range = self.text[self.at : self.at + 1] == "-" and self.text[self.at + 1 : self.at + 2] != "]"
            if not is_range:
                members |= low
                continue
            self.at += 1
            high = self._class_member()
            if len(low) != 1 or len(high) != 1 or min(low) > min(high):
                raise PatternError("a range in [...] that is none")
            members |= set(map(chr, range(ord(min(low)), ord(min(high)) + 1)))
        return _ALL - members if negated else frozenset(members)

    def _class_member(self) -> frozenset[str]:
        character = self._next()
        return self._escape() if character == "\\" else _one(character)

    def _escape(self) -> frozenset[str]:
        character = self._next()
        if character in _CLASSES:
            return _CLASSES[character]
        if character == "x":
            digits = self._next() + self._next()
            if not re.fullmatch("[0-9a-fA-F]{2}", digits):
                raise PatternError("\\x needs two hexadecimal digits")
            return _one(chr(int(digits, 16)))
        if character in _CONTROLS:
            return _one(_CONTROLS[character])
        if character.isascii() and character.isalnum():
            raise PatternError(f"\\{character} is not known here")
        return _one(character)

    def _next(self) -> str:
        if self.at >= len(self.text):
            raise PatternError("the expression ends in the middle of something")
        self.at += 1
        return self.text[self.at - 1]

    def _take(self, wanted: str) -> bool:
        found = self.text.startswith(wanted, self.at)
        self.at += len(wanted) * found
        return found


def _one(character: str) -> frozenset[str]:
    if character not in _ALL:
        raise PatternError(f"{character!r} is no single byte: no box can send it as one")
    return frozenset(character)


def _may_be_empty(node: _Node) -> bool:
    match node:
        case _Char():
            return False
        case _Sequence():
            return all(map(_may_be_empty, node.parts))
        case _Either():
            return any(map(_may_be_empty, node.ways))
        case _Group():
            return _may_be_empty(node.inner)
        case _Repeat():
            return node.least == 0 or _may_be_empty(node.inner)


def _program(tree: _Node) -> list[_Step]:
    names: list[str] = []
    program: list[_Step] = []
    _emit(tree, program, names)
    return program


def _emit(node: _Node, program: list[_Step], names: list[str]) -> None:
    if len(program) > LARGEST_PROGRAM:
        raise PatternError("the expression repeats too much")
    match node:
        case _Char():
            program.append(_Step(members=node.members))
        case _Sequence():
            for part in node.parts:
                _emit(part, program, names)
        case _Either():
            _emit_either(node.ways, program, names)
        case _Group():
            _emit_group(node, program, names)
        case _Repeat():
            _emit_repeat(node, program, names)


def _emit_either(ways: tuple[_Node, ...], program: list[_Step], names: list[str]) -> None:
    ends = []
    for number, way in enumerate(ways):
        if number < len(ways) - 1:
            choice, inside = _Step(), len(program) + 1
            program.append(choice)
            _emit(way, program, names)
            ends.append(_Step())
            program.append(ends[-1])
            choice.ways = (inside, len(program))
        else:
            _emit(way, program, names)
    for end in ends:
        end.ways = (len(program),)


def _emit_group(group: _Group, program: list[_Step], names: list[str]) -> None:
    if group.name is None:
        _emit(group.inner, program, names)
        return
    if group.name not in names:  # a repeat has its groups several times
        names.append(group.name)
    slot = 2 * names.index(group.name)
    program.append(_Step(save=slot))
    _emit(group.inner, program, names)
    program.append(_Step(save=slot + 1))


def _emit_repeat(repeat: _Repeat, program: list[_Step], names: list[str]) -> None:
    for _ in range(repeat.least):
        _emit(repeat.inner, program, names)
    if repeat.most is None:
        start = len(program)
        choice = _Step()
        program.append(choice)
        _emit(repeat.inner, program, names)
        program.append(_Step(ways=(start,)))
        _choose(choice, start + 1, len(program), lazy=repeat.lazy)
        return
    choices = []
    for _ in range(repeat.most - repeat.least):
        choices.append((_Step(), len(program) + 1))
        program.append(choices[-1][0])
        _emit(repeat.inner, program, names)
    for choice, inside in choices:
        _choose(choice, inside, len(program), lazy=repeat.lazy)


def _choose(choice: _Step, inside: int, behind: int, *, lazy: bool) -> None:
    choice.ways = (behind, inside) if lazy else (inside, behind)
