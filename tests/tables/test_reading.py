"""Delimited text is read whole and right, or refused with its place."""

import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from autd_trials.errors import UsageError
from autd_trials.tables import Quantity, read_quantities, read_table

AB = (Quantity("a"), Quantity("b"))


def write(folder: Path, content: bytes | str, name: str = "t.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (b"a,b\n1,x y\n2,z\n", "t.csv"),
        (b"\xef\xbb\xbfa,b\r\n1,x y\r\n2,z", "t.csv"),
        (b"a,b\r1,x y\r2,z\r", "t.csv"),
        (b" a , b\n1, x y \n\n2,z\n\n", "t.csv"),
        (b'"a","b"\n"1","x y"\n2,"z"\n', "t.csv"),
        (b"a\tb\n1\tx y\n2\tz\n", "t.TSV"),
        (b"a\tb\n1\tx y\n2\tz\n", "t.csv"),
        (b"a,b\n1,x y\n2,z\n", "t.tsv"),
        (b"a;b\n1;x y\n2;z\n", "t.csv"),
        (b"sep=;\r\na;b\r\n1;x y\r\n2;z\r\n", "t.csv"),
        (b"\n,\na,b\n,\n1,x y\n , \n2,z\n,,,\n", "t.csv"),
        ("a;b\n1;x y\n2;z\n".encode("utf-16"), "t.csv"),
        (b"\xfe\xff" + "a\tb\n1\tx y\n2\tz\n".encode("utf-16-be"), "t.txt"),
    ],
)
def test_ways_of_saving_the_same(tmp_path: Path, content: bytes, name: str) -> None:
    table = read_table(write(tmp_path, content, name), "table")
    assert table.header == ("a", "b")
    assert [cells for _, cells in table.records()] == [{"a": "1", "b": "x y"}, {"a": "2", "b": "z"}]


def test_line_breaks_within_quotes_do_not_shift_places(tmp_path: Path) -> None:
    content = 'a,b\n1,"two\nlines, a comma and ""quotes"""\n2,\u2028\n3,x\n'
    table = read_table(write(tmp_path, content), "table")
    assert table.column("b") == ['two\nlines, a comma and "quotes"', "", "x"]
    assert table.lines == [2, 4, 5]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "t.csv:1: the table is empty"),
        (b"\n\n , \n", "t.csv:1: the table is empty"),
        (b"a,b,a\n1,2,3\n", "t.csv:1: these columns are there more than once: a"),
        (b"a,,b\n1,2,3\n", "t.csv:1: column 2 of 3 has no name"),
        (b"a,b,\n1,2,\n", "t.csv:1: column 3 of 3 has no name"),
        (b"a,b\n1,2\n1,2,3\n", "t.csv:3: 3 cells under 2 column names"),
        (b"a,b\n\n1\n", "t.csv:3: 1 cells under 2 column names"),
        (b"a,b\n1,5,2,5\n", "write numbers with a decimal point"),
        (b"a;b,c\n1;2\n", "t.csv:1: the first line has commas and semicolons"),
        (b"sep=|\na|b\n1|2\n", "t.csv:1: the cells are separated by '|'"),
        (b'a,b\n1,2\n1,"2\n3,4\n', "t.csv:3: the table cannot be read: unexpected end of data"),
        (b'a,b\n1,"2"3\n', "t.csv:2: the table cannot be read"),
        (b"a,b\n1,2\x00\n", "t.csv:2: the table cannot be read: it has the control character '\\x00'"),
        ("a,b\n1,\ufffe\n".encode(), "t.csv:2: the table cannot be read: it has the control character"),
        ("a,b\n1,\u5185".encode("shift_jis"), "t.csv:2: the table cannot be read: it is not text in UTF-8"),
        ("a,b\n1,2\n".encode("utf-16")[:-1], "t.csv: the table cannot be read: it begins as UTF-16"),
        ("a,b\n1,2\n".encode("utf-16-le"), "it has the control character"),
        (b"a,b\n1," + b"x" * 131_073 + b"\n", "t.csv:2: the table cannot be read: field larger"),
        (b"x" * 131_073 + b",b\n", "t.csv:1: the table cannot be read: field larger"),
        (b'a,b\n1,"' + b"x\n" * 70_000 + b'2"\n', "t.csv:2: the table cannot be read: field larger"),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "t.csv:1: the table cannot be read"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(UsageError) as refused:
        read_table(write(tmp_path, content), "table")
    assert message in str(refused.value)
    assert len(str(refused.value)) < 1000


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.csv", Path("/dev/zero"), tmp_path / ("x" * 300)):
        with pytest.raises(UsageError, match="the table cannot be read"):
            read_table(path, "table")


@pytest.mark.parametrize("content", [b"a\n" + b"1\n" * 2_000_000, b"x" * (32 * 2**20 + 1), b"," * 2**21])
def test_what_is_too_large_is_refused_with_bounded_memory(tmp_path: Path, content: bytes) -> None:
    path = write(tmp_path, content)
    tracemalloc.start()
    try:
        with pytest.raises(UsageError, match=r"over 2,000,000 cells|larger than 32 MB"):
            read_table(path, "table")
        assert tracemalloc.get_traced_memory()[1] < 150e6
    finally:
        tracemalloc.stop()


@given(
    st.lists(
        st.tuples(*[st.floats(-1e12, 1e12)] * 2),
        min_size=1,
        max_size=8,
    ),
    st.sampled_from([repr, str, "{:.17e}".format, " {!r} ".format, '"{!r}"'.format]),
    st.sampled_from(",;\t"),
)
def test_numbers_are_read_exactly(
    tmp_path_factory: pytest.TempPathFactory,
    rows: list[tuple[float, float]],
    spell: Callable[[float], str],
    separator: str,
) -> None:
    text = "".join(separator.join(map(spell, row)) + "\n" for row in rows)
    path = write(
        tmp_path_factory.mktemp("t"), f"b{separator}c{separator}a\n" + text.replace("\n", separator + "7\n")
    )
    found = read_quantities(path, "table", [Quantity("c"), Quantity("b")])
    assert found.tolist() == [[second, first] for first, second in rows]


@given(st.lists(st.floats(-1e9, 1e9).filter(lambda x: x % 1 != 0), min_size=1, max_size=8))
def test_decimal_commas_are_read_beside_semicolons(
    tmp_path_factory: pytest.TempPathFactory, values: list[float]
) -> None:
    lines = "".join(f"{value!r};7\n".replace(".", ",") for value in values)
    path = write(tmp_path_factory.mktemp("t"), f"a;b\n{lines}")
    assert read_quantities(path, "table", AB)[:, 0].tolist() == values
    pointed = read_table(path, "table").with_decimal_points()
    assert [float(text) for text in pointed.column("a")] == values


@pytest.mark.parametrize(
    ("content", "values"),
    [
        ("a\tb\n0,5\t1,234\n", [[0.5, 1.234]]),  # 0,5 can only be decimal
        ("a\tb\n1234,567\t1\n", [[1234.567, 1]]),
        ("a;b\n1,234;2\n", [[1.234, 2]]),
        ("a\tb\n1,234\t2\n", None),  # may be one thousand two hundred and thirty-four
        ("a\tb\n1,234\t0.5\n", None),
        ("a;b\n1,234;0.5\n", None),
        ("a;b\n1.234,5;2\n", None),
        ("a;b\n1,234,567;2\n", None),
        ('a,b\n"1,5",2\n', None),
    ],
)
def test_commas_in_numbers_are_read_only_where_they_can_be_nothing_else(
    tmp_path: Path, content: str, values: list[list[float]] | None
) -> None:
    path = write(tmp_path, content)
    if values is not None:
        assert read_quantities(path, "table", AB).tolist() == values
        return
    with pytest.raises(UsageError, match=r"t\.csv:2: . is '.*', which is not a finite.*\n.*decimal point"):
        read_quantities(path, "table", AB)


def test_words_keep_their_commas(tmp_path: Path) -> None:
    path = write(tmp_path, "who;what;how\nA, B;1,5;n/a\nC;2,25;0,5\n")
    assert [cells for _, cells in read_table(path, "table").with_decimal_points().records()] == [
        {"who": "A, B", "what": "1.5", "how": "n/a"},
        {"who": "C", "what": "2.25", "how": "0.5"},
    ]


@pytest.mark.parametrize(
    ("column", "cells", "message"),
    [
        (Quantity("a"), ["1", "", "2"], "t.csv:3: a is empty"),
        (Quantity("a"), ["1", "nan"], "t.csv:3: a is 'nan', which is not a finite number"),
        (Quantity("a"), ["1", "x", "nan"], "t.csv:3: a is 'x', which is not a finite number"),
        (Quantity("a"), ["1_000"], "t.csv:2: a is '1_000', which is not a finite number"),
        (Quantity("a"), ["\uff11"], "which is not a finite number"),
        (Quantity("a"), ["1e308"], "t.csv:2: a is 1e308, but must be at most 1000000000000"),
        (Quantity("a", least=0), ["0", "-1e-9"], "t.csv:3: a is -1e-9, but must be at least 0"),
        (Quantity("a", largest=5), ["5", "5.1"], "t.csv:3: a is 5.1, but must be at most 5"),
        (Quantity("a", rising=True), ["1", "2", "2"], "t.csv:4: a is 2 after 2, but must rise"),
        (Quantity("a", whole=True), ["1.0", "2.5"], "t.csv:3: a is 2.5, but must be a whole number"),
        (Quantity("a", gaps=True), ["nan", "inf"], "t.csv:3: a is 'inf', which is not a finite number"),
        (Quantity("a"), ["9" * 100_000], "t.csv:2: a is '9999999999"),
        (Quantity("c"), ["1"], "t.csv:1: the columns c are missing; there are a, b"),
    ],
)
def test_numbers_that_are_not_as_declared_are_refused(
    tmp_path: Path, column: Quantity, cells: list[str], message: str
) -> None:
    path = write(tmp_path, "a,b\n" + "".join(f"{cell},0\n" for cell in cells))
    with pytest.raises(UsageError) as refused:
        read_quantities(path, "table", [Quantity("b"), column])
    assert message in str(refused.value)
    assert len(str(refused.value)) < 500


def test_the_first_line_that_is_wrong_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"t\.csv:3: b is 'x'"):
        read_quantities(write(tmp_path, "a,b\n1,1\n1,x\ny,1\n"), "table", AB)


def test_gaps_and_a_last_line_that_was_cut_off(tmp_path: Path) -> None:
    path = write(tmp_path, "a,b\n1,nan\n2,3\n3,")
    found = read_quantities(path, "table", [Quantity("a"), Quantity("b", gaps=True)], unfinished=True)
    assert np.array_equal(found, np.array([[1, np.nan], [2, 3]]), equal_nan=True)
    assert read_quantities(write(tmp_path, "a,b\n1,2\n3,4"), "table", AB).shape == (2, 2)


GOOD = 't_s,x_mm,y_mm\r\n0.0,1.5,-2\r\n0.1,2.5,"3"\r\n0.2,3.5,4e1\r\n'
EDITS = st.lists(
    st.tuples(
        st.integers(0, 80),
        st.integers(0, 4),
        st.binary(max_size=4)
        | st.sampled_from([b",", b";", b"\t", b'"', b"\n", b"\r", b"\x00", b"e999", b"-"]),
    ),
    max_size=6,
)
ENCODINGS = st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-be", "latin-1"])


def mutated(encoding: str, edits: list[tuple[int, int, bytes]]) -> bytes:
    content = GOOD.encode(encoding)
    for place, removed, added in edits:
        content = content[:place] + added + content[place + removed :]
    return content


@given(st.binary(max_size=200) | st.builds(mutated, ENCODINGS, EDITS))
@example(b"\xff\xfe")
@example(b'"')
@example(b"sep=,")
@example(b"sep=\n")
def test_any_bytes_are_numbers_as_declared_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    path = write(tmp_path_factory.mktemp("t"), content)
    columns = [Quantity("t_s", least=0, rising=True), Quantity("x_mm"), Quantity("y_mm", largest=100)]
    found, refused = None, None
    try:
        found = read_quantities(path, "table", columns)
    except UsageError as error:
        refused = error
    if found is None:
        assert refused is not None
        assert refused.where is not None
        assert refused.where.startswith(str(path))
        assert len(str(refused)) < 1000 + len(str(path))
    else:
        assert np.isfinite(found).all()
        assert (np.diff(found[:, 0]) > 0).all()
        assert (found[:, 0] >= 0).all()
        assert (found[:, 2] <= 100).all()


def test_time_grows_in_proportion_to_the_rows(tmp_path: Path) -> None:
    paths = [write(tmp_path, "a,b\n" + "1.25,-7\n" * rows, f"{rows}.csv") for rows in (5_000, 50_000)]

    def cost_s(path: Path) -> float:
        started = time.process_time()
        read_quantities(path, "table", AB)
        return time.process_time() - started

    short_s, long_s = (min(cost_s(path) for _ in range(3)) for path in paths)
    assert long_s < 40 * short_s  # 10 in proportion, 100 if every row looked at every other
