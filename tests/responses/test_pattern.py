"""Patterns match what `re` matches, in time that cannot grow out of hand."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.responses.pattern import LARGEST_PROGRAM, LONGEST_PATTERN, Pattern, PatternError

atoms = st.sampled_from(
    ["a", "b", "B", "1", " ", ".", r"\d", r"\w", r"\s", r"\S", "[ab]", "[^a1]", r"\.", "[a-c1]"]
)
repeats = st.sampled_from(["", "", "*", "+", "?", "*?", "+?", "??", "{2}", "{1,3}", "{,2}", "{2,}"])


def _joined(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    groups = st.tuples(st.sampled_from(["(", "(?:"]), inner, st.just(")"), repeats).map("".join)
    either = st.lists(inner, min_size=1, max_size=3).map("|".join).map("(?:{})".format)
    return st.lists(st.one_of(inner, groups, either), min_size=1, max_size=3).map("".join)


expressions = st.recursive(st.tuples(atoms, repeats).map("".join), _joined, max_leaves=8)
texts = st.text(st.sampled_from("abB1. c\t\xe4"), max_size=12)


def named(expression: str) -> str:
    """Name every plain group, so that what it matched can be compared."""
    parts = re.split(r"(\((?!\?))", expression)
    return "".join(f"(?P<g{number}>" if part == "(" else part for number, part in enumerate(parts))


@given(expressions.map(named), st.lists(texts, min_size=1, max_size=5))
def test_it_matches_what_re_matches_with_the_same_groups(expression: str, lines: list[str]) -> None:
    try:
        pattern = Pattern(expression)
    except PatternError as error:
        refusal: str | None = str(error)
    else:
        refusal = None
    if refusal is not None:
        assert refusal in ("a repeat of what may be empty", "the expression repeats too much")
        return
    reference = re.compile(expression, re.ASCII)
    assert pattern.names == set(reference.groupindex)
    for line in lines:
        found, expected = pattern.fullmatch(line), reference.fullmatch(line)
        assert (found is None) == (expected is None)
        if found is not None and expected is not None:
            assert found == {name: text for name, text in expected.groupdict().items() if text is not None}


@given(st.text(st.sampled_from(r"ab1()[]{}|*+?\^$.,-<>P:dwsx"), max_size=30))
def test_whatever_is_taken_is_an_expression_of_re_too(expression: str) -> None:
    try:
        Pattern(expression)
    except PatternError:
        return
    re.compile(expression)


@pytest.mark.parametrize("expression", ["(a+)+b", "(a|a)*b", "(a|ab)*c", r"(\w+\s?)*x", "a*a*a*a*a*a*a*a*b"])
def test_what_keeps_re_for_ever_takes_steps_in_proportion(
    expression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Counted in steps, not in seconds."""
    steps = []
    follow = Pattern._follow

    def counted(self: Pattern, threads: list[tuple[int, tuple[int, ...]]], place: int) -> object:
        reached = follow(self, threads, place)
        steps.append(len(reached))
        return reached

    monkeypatch.setattr(Pattern, "_follow", counted)
    pattern = Pattern(expression)
    assert pattern.fullmatch("a" * 256) is None
    assert len(steps) <= 257
    assert max(steps) <= len(pattern._program) + 1


@pytest.mark.parametrize(
    ("expression", "says"),
    [
        ("(a", r"without its \)"),
        ("a)", "too many"),
        ("[a", "in the middle"),
        ("a\\", "in the middle"),
        ("*a", "repeats or marks nothing"),
        ("a**", "a repeat of a repeat"),
        ("a*+", "a repeat of a repeat"),
        ("(a*)*", "may be empty"),
        (r"(a)\1", r"\\1 is not known"),
        (r"\bword", r"\\b is not known"),
        ("(?=a)", r"only \(\?:"),
        ("(?i)a", r"only \(\?:"),
        ("(?P<x>a)(?P<x>b)", "two groups"),
        ("a{3,2}", "most is less"),
        ("[z-a]", "range"),
        ("日", "no single byte"),
        ("a{199}b{199}", "repeats too much"),
        ("(" * 60 + "a" + ")" * 60, "nested"),
        ("a" * (LONGEST_PATTERN + 1), "longer than"),
        ("((((a{9}){9}){9}){9}){9}", "repeats too much"),
    ],
)
def test_what_is_not_matched_in_bounded_time_is_refused(expression: str, says: str) -> None:
    with pytest.raises(PatternError, match=says):
        Pattern(expression)


def test_a_program_is_bounded() -> None:
    assert len(Pattern("a{299}")._program) <= LARGEST_PROGRAM
