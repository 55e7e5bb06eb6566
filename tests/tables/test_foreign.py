"""Tables of others are forgiven what they cannot be asked to mend, and it is said; our own are not."""

import gzip
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from autd_trials.errors import UsageError
from autd_trials.tables import quantity, read_table


def write(folder: Path, content: bytes | str, name: str = "t.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


FORGIVEN: list[tuple[bytes, str]] = [
    (gzip.compress(b"a,b\n1,x y\n2,z\n", mtime=0), ""),
    (gzip.compress(b"a,b\n1,x y\n", mtime=0) + gzip.compress(b"2,z\n", mtime=0), ""),
    ("a;b\n1;x y\n2;z\n".encode("utf-16-le"), "in UTF-16, without a mark"),
    ("a;b\n1;x y\n2;z\n".encode("utf-16-be"), "in UTF-16, without a mark"),
    (b"a,b\n1,x y\n2,z\n\x1a", ""),
    (b"C:\\data, of today\n\na\tb\n1\tx y\n2\tz\n", "1 line(s) before the names of the columns skipped: C:"),
    (b"Study 1;;\nby me;;\na;b;\n1;x y;\n2;z;\n;;\n", "2 line(s) before the names of the columns skipped"),
    (b"a,b\n1,x y\na,b\n2,z\nA , B\n", "2 line(s) that name the columns once more skipped: 3, 5"),
    (b"a,b\n1,x y\n" + b"\xef\xbb\xbfa,b\n2,z\n", "1 line(s) that name the columns once more skipped: 3"),
    (b"a,b,,\n1,x y,,\n2,z,,\n", ""),
    (b"a,b\n1,x y,,\n2,z\n", ""),
    (b'"a";"b"\n"1";"x y"\n"2";"z"\n', ""),
    (b'"a,b"\n"1,x y"\n"2,z"\n', ""),
    (b'a b\n1 "x y"\n2 z\n', ""),
    (b"a|b\n1|x y\n2|z\n", ""),
    (b"sep=|\na|b\n1|x y\n2|z\n", ""),
    (b"sep=;\nTitle;\na;b\n1;x y\n2;z\n", "1 line(s) before the names of the columns skipped: Title"),
]


@pytest.mark.parametrize(("content", "remark"), FORGIVEN)
def test_what_is_forgiven_is_said(tmp_path: Path, content: bytes, remark: str) -> None:
    table = read_table(write(tmp_path, content), "table", foreign=True)
    assert table.header == ("a", "b")
    assert [cells for _, cells in table.records()] == [{"a": "1", "b": "x y"}, {"a": "2", "b": "z"}]
    assert any(remark in each for each in table.remarks) if remark else not table.remarks


@pytest.mark.parametrize("content", [content for content, _ in FORGIVEN if b'"a"' not in content])
def test_our_own_files_are_read_strictly(tmp_path: Path, content: bytes) -> None:
    path = write(tmp_path, content)
    try:
        table = read_table(path, "table")
    except UsageError:
        return
    assert table.remarks == ()
    assert [cells for _, cells in table.records()] != [{"a": "1", "b": "x y"}, {"a": "2", "b": "z"}]


def test_columns_without_a_name_get_one_or_are_left_out(tmp_path: Path) -> None:
    table = read_table(write(tmp_path, b",a,,b,column 1\n0,1,,x,7\n1,2,,z,8\n"), "table", foreign=True)
    assert table.header == ("column 2", "a", "b", "column 1")
    assert table.column("b") == ["x", "z"]


def test_commas_that_only_the_rows_tell_from_separators(tmp_path: Path) -> None:
    table = read_table(write(tmp_path, b"rate, in Hz;felt\n25;1\n50,5;0\n"), "table", foreign=True)
    assert table.separator == ";"
    assert table.with_decimal_points().column("rate, in Hz") == ["25", "50.5"]


@pytest.mark.parametrize(
    "text",
    ["d\u00fcnn", "Gr\u00f6\u00dfe", "25 \u00b5m", "20 \u00b0C", "l\u2019eau", "pr\u00e9cis", "\u00c4rmel"],
)
def test_windows_1252_is_read_and_said(tmp_path: Path, text: str) -> None:
    table = read_table(write(tmp_path, f"a,b\n1,{text}\n".encode("cp1252")), "table", foreign=True)
    assert table.column("b") == [text]
    assert "Windows-1252 (Latin-1)" in table.remarks[0]


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("\u5185\u5074", "cp932"),
        ("\u306f\u3044", "cp932"),
        ("\u7537", "cp932"),
        ("\u4f60\u597d", "gbk"),
        ("\u7537,\u5973", "gbk"),
        ("\u043f\u0430\u043b\u0435\u0446", "cp1251"),
        ("\u0434\u0430", "koi8-r"),
    ],
)
def test_other_encodings_are_refused_and_read_if_they_are_named(
    tmp_path: Path, text: str, encoding: str
) -> None:
    path = write(tmp_path, f'a,b\n1,"{text}"\n'.encode(encoding))
    with pytest.raises(UsageError, match="neither in UTF-8 nor in Windows-1252") as refused:
        read_table(path, "table", foreign=True)
    assert "save it again as CSV in UTF-8" in str(refused.value.do)
    assert read_table(path, "table", foreign=True, encoding=encoding).column("b") == [text]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"PK\x03\x04rest", "a spreadsheet's own file"),
        (b"\xd0\xcf\x11\xe0rest", "an old spreadsheet's own file"),
        (gzip.compress(b"a,b\n1,2\n", mtime=0)[:-9], "gzip packed"),
        (b"\x1f\x8b" + bytes(range(20)), "it begins as gzip and does not go on so"),
        (gzip.compress(b"1,2\n" * 9_000_000, mtime=0), "larger than 32 MB"),
        (b"a,b\n1,2\nb,a\n2,1\n", "t.csv:3: this line names the columns once more, in another order"),
        (b"a,b\n1,2,3\n", "3 cells under 2 column names"),
        (b"a,a\n1,2\n", "these columns are there more than once: a"),
        (b"", "the table is empty"),
    ],
)
def test_what_cannot_be_forgiven_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(UsageError) as refused:
        read_table(write(tmp_path, content), "table", foreign=True)
    assert message in str(refused.value)


def test_an_encoding_that_is_none_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, b"a,b\n1,2\n")
    for name in ("klingon", "rot13", "zlib"):
        with pytest.raises(UsageError, match="is no encoding"):
            read_table(path, "table", foreign=True, encoding=name)


@given(st.binary(max_size=200))
@example(b"\xff\xfe")
@example(b"\x1f\x8b")
@example(b"a\x00,\x00b\x00\n\x00")
@example(b"sep=,\n")
@example(b",\n,\n")
def test_any_bytes_are_a_table_or_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = write(tmp_path_factory.mktemp("t"), content)
    refused = None
    try:
        table = read_table(path, "table", foreign=True).with_decimal_points()
    except UsageError as error:
        refused = str(error)
    if refused is not None:
        assert len(refused) < 1000 + len(str(path))
    else:
        assert all(len(row) == len(table.header) for row in table.rows)
        assert all(table.header)


def test_columns_are_judged_each_for_itself(tmp_path: Path) -> None:
    rows = "0,5\t0.25\t1,234\t1,5 mm\t-2,5\n10\t0.5\tn/a\t2 mm\t1.5\n"
    table = read_table(write(tmp_path, "a\tb\tc\td\te\n" + rows), "table", foreign=True).with_decimal_points()
    assert table.column("a") == ["0.5", "10"]
    assert table.column("b") == ["0.25", "0.5"]
    assert table.column("c") == ["1,234", "n/a"]  # a thousand or one: other columns have points
    assert table.column("d") == ["1.5 mm", "2 mm"]
    assert table.column("e") == ["-2.5", "1.5"]


@pytest.mark.parametrize("text", ["", "Hz", "1. Mai", "1-2", "12h30", "1,5", "1 Hz and much more", "--5"])
def test_what_is_no_quantity(text: str) -> None:
    assert quantity(text) is None
