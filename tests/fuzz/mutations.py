"""Random mistakes: in the data of a YAML file, in the cells of a table, in any text or bytes."""

import copy
import random
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import yaml

HOSTILE: list[Any] = [
    *(None, True, False, 0, -1, 1, 2, 17, 0.5, 1e-9, -0.0, 1e18, 10**30, 1e308, float("nan"), float("inf")),
    *("", " ", "x", "inner", "chest", "sine", "no", "1:30", "010", "2026-11-22", "null", "NaN", "../../etc"),
    *("9999-12-31T23:59:59+00:00", "0001-01-01T00:00:00+00:00", "a" * 3000, "\x07", "\u202e", "\u0000"),
    *(
        "{",
        "- -",
        "!!python/object/apply:os.system ['true']",
        "&a *a",
        "%s%n",
        "💥",
        "rate",
        "=1+1",
        "1e-320",
    ),
    *([], {}, [[]], [1, "a"], ["inner"], {"x_mm": 1}, {"levels": [1, 2]}, {"levels": []}, [None], {"": 1}),
    [25, 50],
    list(range(300)),
]
CELLS = [
    *(
        "",
        " ",
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1e308",
        "1e-320",
        "0",
        "-0",
        "0,5",
        "1.000,5",
        "1 000",
        "0x10",
    ),
    *(
        "n/a",
        "NA",
        "x",
        "١٢",
        "9" * 400,
        "a" * 140_000,
        '"',
        "'",
        "=1+1",
        "\x00",
        "\ufeff",
        "\u202e",
        "\x1b[2J",
    ),
]
SPLINTERS = [
    *(
        "\t",
        "  ",
        "\n",
        "\r",
        ":",
        "- ",
        "#",
        "'",
        '"',
        "{",
        "]",
        "&x ",
        "*x",
        "? ",
        "? ? ? ",
        "!!int ",
        "---\n",
    ),
    *("\x00", "é", "\ufeff", ",", ";", "\u2028", "\x85", "|", ">", "%", "@", "`", "<<: *x\n", "1e999"),
]
Change = Callable[[random.Random, Any], None]

_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # libyaml's, twenty times as fast, where it is there


def mutated_yaml(chance: random.Random, text: str) -> str:
    """Return a YAML file's text with one to three mistakes, in its data or in its text."""
    if chance.random() < 0.4:
        return mutated_text(chance, text)
    data = copy.deepcopy(_parsed(text))
    for _ in range(chance.randint(1, 3)):
        chance.choice(_CHANGES)(chance, data)
    return str(yaml.dump(data, Dumper=_DUMPER, sort_keys=False, allow_unicode=True))


def mutated_text(chance: random.Random, text: str) -> str:
    """Return a text with one to three mistakes: something put in, cut out, cut off, moved or repeated."""
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(text) + 1)
        lines = text.splitlines(keepends=True) or [""]
        line = chance.randrange(len(lines))
        match chance.randrange(5):
            case 0:
                text = text[:at] + chance.choice(SPLINTERS) + text[at:]
            case 1:
                text = text[:at] + text[at + chance.randint(1, 40) :]
            case 2:
                text = text[:at]
            case 3:
                lines.insert(chance.randrange(len(lines)), lines.pop(line))
                text = "".join(lines)
            case _:
                lines.insert(line, lines[line] * chance.choice([1, 1, 2, 500]))
                text = "".join(lines)
    return text


def mutated_table(chance: random.Random, text: str, separator: str = ",") -> str:
    """Return a table's text with one to three mistakes, in its cells or in its text."""
    if chance.random() < 0.3:
        return mutated_text(chance, text)
    rows = [line.split(separator) for line in text.splitlines()]
    for _ in range(chance.randint(1, 3)):
        row = rows[0] if chance.random() < 0.2 else chance.choice(rows)
        column = chance.randrange(len(row)) if row else 0
        match chance.randrange(5):
            case 0 | 1:
                row[column : column + 1] = [chance.choice(CELLS)]
            case 2:
                del row[column : column + 1]
            case 3:
                row.insert(column, chance.choice(CELLS))
            case _:
                for each in rows[1:]:  # a whole column
                    each[column : column + 1] = [chance.choice(CELLS[:20])]
    return "\n".join(separator.join(row) for row in rows) + "\n"


def mutated_bytes(chance: random.Random, data: bytes) -> bytes:
    """Return bytes of which some are changed, missing or doubled, now and then in another encoding."""
    if chance.random() < 0.1:
        encoding = chance.choice(["utf-16", "utf-16-le", "utf-32", "latin-1", "utf-8-sig"])
        return data.decode("utf-8", errors="replace").encode(encoding, errors="replace")
    changed = bytearray(data)
    for _ in range(chance.randint(0, 4)):
        at = chance.randrange(len(changed) + 1)
        match chance.randrange(3):
            case 0:
                changed[at:at] = chance.randbytes(chance.choice([1, 2, 8, 300]))
            case 1:
                del changed[at : at + chance.randint(1, 8)]
            case _:
                changed[at : at + 1] = chance.randbytes(1)
    return bytes(changed)


@cache
def _parsed(text: str) -> Any:
    return yaml.safe_load(text)


def _places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    children = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in children:
        yield (*path, key)
        yield from _places(value, (*path, key))


def _at(data: Any, path: tuple[Any, ...]) -> Any:
    for part in path:
        data = data[part]
    return data


def _parent_and_key(chance: random.Random, data: Any) -> tuple[Any, Any]:
    *way, key = chance.choice([*_places(data)] or [(None,)])
    return _at(data, (*way,)), key


def _replace(chance: random.Random, data: Any) -> None:
    parent, key = _parent_and_key(chance, data)
    if parent:
        parent[key] = copy.deepcopy(chance.choice(HOSTILE))


def _scale(chance: random.Random, data: Any) -> None:
    numbers = [path for path in _places(data) if type(_at(data, path)) in (int, float)]
    if numbers:
        *way, key = chance.choice(numbers)
        _at(data, (*way,))[key] *= chance.choice([-1, 0, 0.1, 0.5, 1.0001, 1 / 255, 2, 10, 1e6])


def _remove(chance: random.Random, data: Any) -> None:
    parent, key = _parent_and_key(chance, data)
    if parent:
        del parent[key]


def _rename(chance: random.Random, data: Any) -> None:
    parent, key = _parent_and_key(chance, data)
    if parent and isinstance(parent, dict):
        name = chance.choice(
            [f"{key}x", str(key)[:-1], "target", "name", "modulation_hz", "rate", "Trial", ""]
        )
        parent[name] = parent.pop(key)


def _swap(chance: random.Random, data: Any) -> None:
    first, one = _parent_and_key(chance, data)
    second, other = _parent_and_key(chance, data)
    if first and second:
        first[one], second[other] = copy.deepcopy(second[other]), copy.deepcopy(first[one])


def _repeat(chance: random.Random, data: Any) -> None:
    parent, key = _parent_and_key(chance, data)
    if parent and isinstance(parent, list):
        parent.append(copy.deepcopy(parent[key]))


_CHANGES: list[Change] = [_replace, _replace, _scale, _remove, _rename, _swap, _repeat]
