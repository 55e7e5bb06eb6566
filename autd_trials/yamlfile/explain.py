"""What pydantic found wrong, in a person's words and at a place in the file."""

import json
import re
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from autd_trials.yamlfile.suggest import did_you_mean
from autd_trials.yamlfile.tree import Mark, Path, Problem, Tree

_LONGEST_SHOWN = 60
_EXPECTED = {
    "bool_type": "true or false",
    "dict_type": "a mapping (lines of 'key: value')",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "list_type": "a list",
    "model_type": "a mapping (lines of 'key: value')",
    "string_type": "text",
    "tuple_type": "a list",
}


def problems(
    error: ValidationError, document: Tree, model: type[BaseModel], most: int
) -> tuple[list[Problem], int]:
    """Say what is wrong and where.

    Parameters
    ----------
    error
        What pydantic raised on the document's data.
    document
        Where everything stands in the file.
    model
        What the file should hold; its JSON Schema tells which keys are allowed.
    most
        How many are explained, as explaining takes time.

    Returns
    -------
    list[Problem]
        One for each key and each value, the first in the file; those that the document has a problem with
        already are left out.
    int
        How many further ones there are.
    """
    already = {problem.mark for problem in document.problems}
    found: dict[tuple[Path, Mark], list[ErrorDetails]] = {}
    for detail in map(_of_the_tag, error.errors(include_url=False)):
        if _is_of_wrong_items(detail):
            continue
        place = _place(detail, document)
        mark = _mark(place, detail, document)
        if mark not in already:
            found.setdefault((place, mark), []).append(detail)
    first = sorted(found.items(), key=lambda item: item[0][1])[:most]
    schema = model.model_json_schema()
    explained = [
        Problem(mark, place, _explanation(place, details, schema)) for (place, mark), details in first
    ]
    return explained, len(found) - len(first)


def spelled(path: Path) -> str:
    """Return a path as a person would write it, with a colon behind; nothing for the whole file."""
    spelling = ""
    for part in path:
        if isinstance(part, int):
            spelling += f"[{part}]"
        else:
            spelling += ("." if spelling else "") + (
                part if re.fullmatch(r"[\w-]{1,60}", part) else _shown(part)
            )
    return f"{spelling}: " if spelling else ""


def _is_of_wrong_items(detail: ErrorDetails) -> bool:
    """Whether a list is called too short because its items are wrong, which is reported for each of them."""
    return detail["type"] == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"]


def _of_the_tag(detail: ErrorDetails) -> ErrorDetails:
    """Return a fault of the key that tells a union's branches apart as one of an ordinary key."""
    context = detail.get("ctx", {})
    key = str(context.get("discriminator", "")).strip("'")
    location = (*detail["loc"], key)
    if detail["type"] == "union_tag_not_found":
        return {"type": "missing", "loc": location, "msg": "", "input": detail["input"]}
    if detail["type"] == "union_tag_invalid":
        expected = context["expected_tags"]
        return {
            "type": "literal_error",
            "loc": location,
            "msg": f"Input should be {expected}",
            "input": detail["input"][key],
            "ctx": {"expected": expected},
        }
    return detail


def _place(detail: ErrorDetails, document: Tree) -> Path:
    """Return the place in the file; pydantic's location also names branches of unions, which no file has.

    A missing key has no place of its own: it counts as a child of the mapping that lacks it.
    """
    location = detail["loc"]
    missing = detail["type"] == "missing"
    place: Path = ()
    for part in location[:-1] if missing else location:
        if (*place, part) in document.value_marks:
            place = (*place, part)
    return (*place, location[-1]) if missing else place


def _mark(place: Path, detail: ErrorDetails, document: Tree) -> Mark:
    if detail["type"] == "missing":
        parent = place[:-1]
        return document.key_marks.get(parent, document.value_marks[parent])
    if detail["type"] == "extra_forbidden" or detail["loc"][-1:] == ("[key]",):
        return document.key_marks.get(place, document.value_marks[place])
    return document.value_marks[place]


def _explanation(place: Path, details: list[ErrorDetails], schema: dict[str, Any]) -> str:
    kinds = {detail["type"] for detail in details}
    if "missing" in kinds:
        return "this key is missing; add it"
    if "extra_forbidden" in kinds:
        allowed = sorted(_allowed_keys(details[0]["loc"][:-1], schema))
        return f"unknown key; allowed: {', '.join(allowed) or 'none'}{did_you_mean(str(place[-1]), allowed)}"
    told = [detail["msg"].removeprefix("Value error, ") for detail in details if _says_all(detail)]
    expected = [_expectation(detail) for detail in details if not _says_all(detail)]
    if expected:
        told.append(f"is {_shown(details[0]['input'])}; allowed: {' or '.join(dict.fromkeys(expected))}")
    words = [word for detail in details for word in _literals(detail)]
    return "; ".join(dict.fromkeys(told)) + did_you_mean(str(details[0]["input"]), words)


def _says_all(detail: ErrorDetails) -> bool:
    """Whether the message is a validator's own, which names what it found."""
    return not detail["msg"].startswith(
        ("Input should ", "String should ", "Tuple should ", "List should ", "Dictionary should ")
    )


def _expectation(detail: ErrorDetails) -> str:
    if detail["type"] in _EXPECTED:
        return _EXPECTED[detail["type"]]
    if detail["type"].startswith(("greater_than", "less_than")):
        return detail["msg"].replace("Input should be", "a number")
    if detail["type"] in ("too_short", "too_long"):
        least = detail["type"] == "too_short"
        number = detail["ctx"]["min_length" if least else "max_length"]
        return f"at {'least' if least else 'most'} {number}"
    message = detail["msg"].replace("String should match pattern", "text that matches")
    return re.sub(r"^(Input|String|Tuple|List) should (be |have )?", "", message)


def _literals(detail: ErrorDetails) -> list[str]:
    if detail["type"] != "literal_error":
        return []
    return re.findall(r"'([^']*)'", detail["ctx"]["expected"])


def _shown(value: Any) -> str:
    if value is None:
        return "empty"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    text = json.dumps(value) if not isinstance(value, str) else repr(value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


def _allowed_keys(location: Path, root: dict[str, Any]) -> set[str]:
    """Return the keys that a schema allows in the mapping at one of pydantic's locations."""
    schemas = [root]
    for part in location:
        children = [child for schema in schemas for child in _children(schema, part, root)]
        schemas = children or schemas  # without children it names a branch of a union, not a key
    return {
        key
        for schema in schemas
        for branch in _branches(schema, root)
        for key in branch.get("properties", {})
    }


def _children(schema: dict[str, Any], part: str | int, root: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for branch in _branches(schema, root):
        if isinstance(part, int):
            candidates = [branch.get("items"), *branch.get("prefixItems", [])[part : part + 1]]
        elif part in branch.get("properties", {}):
            candidates = [branch["properties"][part]]
        elif part in (branches := branch.get("discriminator", {}).get("mapping", {})):
            candidates = [{"$ref": branches[part]}]
        else:
            candidates = [branch.get("additionalProperties"), *branch.get("patternProperties", {}).values()]
        yield from (candidate for candidate in candidates if isinstance(candidate, dict))


def _branches(schema: dict[str, Any], root: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Follow references and unions to the schemas that describe a value."""
    if "$ref" in schema:
        yield from _branches(root["$defs"][schema["$ref"].rpartition("/")[2]], root)
        return
    yield schema
    for branch in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from _branches(branch, root)
