"""Tables that a person filled in, as people and spreadsheets write CSV; every mistake with its place."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from twin.errors import CalibrationError

__all__ = ["FilledTable", "heading", "read_filled"]

_MOST_ROWS = 100_000


@dataclass(frozen=True)
class FilledTable:
    """Cells of a table.

    Attributes:
        name: of the file.
        path: of the file, as it was given.
        decimal_comma: a comma in a number is a decimal one.
        rows: line of the file, from 1, and cells by column; remarks and empty lines are left out.
    """

    name: str
    path: str
    decimal_comma: bool
    rows: tuple[tuple[int, dict[str, str]], ...]

    def number(self, line: int, column: str, text: str, low: float, high: float) -> float:
        """A cell as a figure from ``low`` to ``high``.

        Raises:
            CalibrationError: if it is none, with its place.
        """
        try:
            value = float(text.replace(",", ".") if self.decimal_comma else text)
        except ValueError:
            raise CalibrationError(
                f"{self.path}, line {line}, column {column}: '{text[:30]}' is not a number"
            ) from None
        if not (math.isfinite(value) and low <= value <= high):
            raise CalibrationError(
                f"{self.path}, line {line}, column {column}: {text[:30]} is out of range, expected "
                f"{low:g} to {high:g}"
            )
        return value


def read_filled(
    path: Path, columns: Sequence[str], needed: Sequence[str], usual: Mapping[str, str] | None = None
) -> FilledTable:
    """Read the cells of a table with a heading.

    Commas, semicolons and tabs separate columns; a decimal comma is understood where commas do not separate
    them. Columns that are not asked for are left out; ids must differ.

    Args:
        path: the file.
        columns: names that are read.
        needed: those that must be there.
        usual: what stands for an empty cell or a missing column.

    Raises:
        CalibrationError: naming file, line and column of the first mistake.
    """
    text = _text(path, needed)
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    separator = max(";\t,", key=lambda c: lines[0].count(c))
    try:
        rows = list(csv.reader(io.StringIO(text), delimiter=separator, strict=False))
    except csv.Error as error:
        raise CalibrationError(f"{path}: not a CSV table: {error}") from error
    if len(rows) > _MOST_ROWS:
        raise CalibrationError(f"{path}: {len(rows)} lines are more than any table of test pieces")
    given = dict(usual or {})
    head: dict[str, int] | None = None
    width = 0
    found: list[tuple[int, dict[str, str]]] = []
    marks: dict[str, int] = {}
    for number, row in enumerate(rows, 1):
        if not any(cell.strip() for cell in row) or row[0].lstrip().startswith("#"):
            continue
        if head is None:
            head, width = _head(path, number, row, columns, [c for c in needed if c not in given]), len(row)
            continue
        if any(cell.strip() for cell in row[width:]):
            comma = ": were numbers written with a decimal comma? Then separate columns by semicolons"
            raise CalibrationError(
                f"{path}, line {number}: {len(row)} cells under a heading of {width} columns"
                + (comma if separator == "," else "")
            )
        cells = {column: row[place].strip() if place < len(row) else "" for column, place in head.items()}
        cells |= {column: value for column, value in given.items() if not cells.get(column)}
        if mark := cells.get("id", ""):
            if mark in marks:
                raise CalibrationError(
                    f"{path}, line {number}: id {mark[:30]} was on line {marks[mark]} already"
                )
            marks[mark] = number
        found.append((number, cells))
    return FilledTable(path.name, str(path), separator != ",", tuple(found))


def heading(path: Path) -> tuple[str, ...]:
    """Names of the columns of a table, lower case; empty if it cannot be read."""
    try:
        lines = path.read_text("utf-8-sig").splitlines()
    except (OSError, ValueError):
        return ()
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    for separator in ";\t":
        first = first.replace(separator, ",")
    return tuple(name.strip().strip('"').lower() for name in first.split(","))


def _text(path: Path, needed: Sequence[str]) -> str:
    try:
        text = path.read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CalibrationError(
            f"{path}: not UTF-8 text (byte {error.start}): save it as CSV in UTF-8"
        ) from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise CalibrationError(f"{path}: cannot read the table: {reason}") from error
    if "\0" in text:
        raise CalibrationError(f"{path}: not a text file: save the table as CSV")
    if not any(line.strip() and not line.lstrip().startswith("#") for line in text.splitlines()):
        raise CalibrationError(f"{path}: the table is empty: expected the columns {', '.join(needed)}")
    return text


def _head(
    path: Path, number: int, row: Sequence[str], columns: Sequence[str], needed: Sequence[str]
) -> dict[str, int]:
    names = [cell.strip().lower() for cell in row]
    missing = [column for column in needed if column not in names]
    if missing:
        cure = " (or give --spot)" if missing[0] == "spot_mm" else ""
        raise CalibrationError(
            f"{path}, line {number}: column {missing[0]} is missing{cure}; the heading must name "
            f"{', '.join(needed)} (found {', '.join(n[:20] or '(empty)' for n in names[:12])})"
        )
    twice = [column for column in columns if names.count(column) > 1]
    if twice:
        raise CalibrationError(f"{path}, line {number}: column {twice[0]} comes twice")
    return {column: names.index(column) for column in columns if column in names}
