"""Tables are written from their declaration, and read back as they were written."""

from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.tables import (
    Column,
    Value,
    cell_text,
    cells,
    describe,
    of,
    read_table,
    require_reserved,
    tsv,
)


@dataclass(frozen=True)
class Pair:
    first: Value
    second: Value


COLUMNS: tuple[Column[Pair], ...] = (
    Column("first", "One value.", lambda pair: pair.first, units="mm"),
    Column("second", "Another.", lambda pair: pair.second, levels={"yes": "It is.", "no": "It is not."}),
)
VALUES = st.none() | st.booleans() | st.floats(allow_nan=False, allow_infinity=False) | st.text()


@given(st.lists(st.builds(Pair, VALUES, VALUES), max_size=5))
def test_what_is_written_is_read_back(tmp_path_factory: pytest.TempPathFactory, rows: list[Pair]) -> None:
    path = Path(tmp_path_factory.mktemp("tables") / "table.tsv")
    path.write_bytes(tsv(COLUMNS, rows).encode())
    table = read_table(path, "table", separator="\t")
    assert table.header == ("first", "second")
    assert [cells for _, cells in table.records()] == [
        {"first": cell_text(row.first), "second": cell_text(row.second)} for row in rows
    ]


def test_a_sidecar_says_what_is_declared_and_no_more() -> None:
    assert describe(COLUMNS) == {
        "first": {"Description": "One value.", "Units": "mm"},
        "second": {"Description": "Another.", "Levels": {"yes": "It is.", "no": "It is not."}},
    }


def test_a_part_that_is_not_there_gives_a_missing_value() -> None:
    column: Column[str | None] = Column("length", "Length.", of(lambda text: text, len))
    assert tsv([column], ["abc", None]) == "length\n3\nn/a\n"
    assert cells([column], "ab") == {"length": 2}


def test_a_column_beside_factors_must_be_reserved() -> None:
    with pytest.raises(ValueError, match="first_x, second_x: add to RESERVED_NAMES"):
        require_reserved([replace(column, name=f"{column.name}_x") for column in COLUMNS])
