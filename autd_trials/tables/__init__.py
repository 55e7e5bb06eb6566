"""Delimited text: one strict reader, one strict writer, columns declared once, one spelling of a number."""

from autd_trials.tables.columns import Column, cells, describe, of, tsv
from autd_trials.tables.decimals import quantity
from autd_trials.tables.reading import Quantity, Table, read_quantities, read_table
from autd_trials.tables.reserved import RESERVED_NAMES, require_reserved
from autd_trials.tables.spelling import (
    FOREIGN_MISSING_WORDS,
    MISSING,
    MISSING_WORDS,
    Value,
    cell_text,
    level_text,
    number,
    shielded,
    spelled_levels,
)

__all__ = [
    "FOREIGN_MISSING_WORDS",
    "MISSING",
    "MISSING_WORDS",
    "RESERVED_NAMES",
    "Column",
    "Quantity",
    "Table",
    "Value",
    "cell_text",
    "cells",
    "describe",
    "level_text",
    "number",
    "of",
    "quantity",
    "read_quantities",
    "read_table",
    "require_reserved",
    "shielded",
    "spelled_levels",
    "tsv",
]
