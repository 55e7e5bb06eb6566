"""Tables as people save them: read whole, or refused with the place."""

from pathlib import Path

import pytest

from analysis.delimited import read_delimited
from autd_trials.errors import UsageError


def write(tmp_path: Path, content: bytes, name: str = "t.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (b"a,b\n1,x y\n2,z\n", "t.csv"),
        (b"\xef\xbb\xbfa,b\r\n1,x y\r\n2,z", "t.csv"),
        (b" a , b\n1, x y \n\n2,z\n\n", "t.csv"),
        (b'"a","b"\n"1","x y"\n2,"z"\n', "t.csv"),
        (b"a\tb\n1\tx y\n2\tz\n", "t.TSV"),
    ],
)
def test_ways_of_saving_the_same(tmp_path: Path, content: bytes, name: str) -> None:
    file = read_delimited(write(tmp_path, content, name))
    assert file.header == ("a", "b")
    assert [cells for _, cells in file.rows] == [{"a": "1", "b": "x y"}, {"a": "2", "b": "z"}]


def test_line_breaks_within_quotes_do_not_shift_places(tmp_path: Path) -> None:
    file = read_delimited(write(tmp_path, b'a,b\n1,"two\nlines, a comma and ""quotes"""\n2,\xe2\x80\xa8\n'))
    assert [cells["b"] for _, cells in file.rows] == ['two\nlines, a comma and "quotes"', ""]
    assert [place.rpartition(":")[2] for place, _ in file.rows] == ["3", "4"]


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (b"", "t.csv", "t.csv:1: the table is empty"),
        (b"\n\n", "t.csv", "the table is empty"),
        (b"a;b\n1;2\n", "t.csv", "separated by semicolons, not by commas"),
        (b"a\tb\n1\t2\n", "t.csv", "separated by tabs, not by commas"),
        (b"a,b\n1,2\n", "t.tsv", "separated by commas, not by tabs"),
        (b"a,b,a\n1,2,3\n", "t.csv", "t.csv:1: these columns are there more than once: a"),
        (b"a,b\n1,2\n1,2,3\n", "t.csv", "t.csv:3: 3 cells under 2 column names"),
        (b"a,b\n1\n", "t.csv", "t.csv:2: 1 cells under 2 column names"),
        (b'a,b\n1,"2\n', "t.csv", "no proper table"),
        (b"a,b\n1,2\x00\n", "t.csv", "t.csv:2: the table has a control character"),
        ("a,b\n1,\u5185".encode("shift_jis"), "t.csv", "no text in UTF-8"),
        ("a,b\n1,2\n".encode("utf-16"), "t.csv", "no text in UTF-8"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, content: bytes, name: str, message: str) -> None:
    with pytest.raises(UsageError) as refused:
        read_delimited(write(tmp_path, content, name))
    assert message in str(refused.value)
