"""The table of burnt creases, as people and spreadsheets write CSV; every mistake with its place."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from twin.errors import CalibrationError

__all__ = ["COLUMNS", "BurntCrease", "CalibrationTable", "read_table", "table_text"]

COLUMNS = ("id", "power_w", "speed_mm_s", "spot_mm", "thickness_mm", "passes", "start_c", "angle_deg", "note")
NEEDED = ("power_w", "speed_mm_s", "spot_mm", "passes", "angle_deg")
_LIMITS = {
    "power_w": (0.0, 1e5), "speed_mm_s": (0.0, 1e5), "spot_mm": (0.0, 100.0), "thickness_mm": (0.0, 20.0),
    "passes": (0.0, 1e4), "start_c": (-50.0, 500.0), "angle_deg": (0.0, 180.0),
}  # fmt: skip
_MOST_ROWS = 100_000


@dataclass(frozen=True)
class BurntCrease:
    """One crease that was burnt and measured.

    Attributes:
        line: of the file, from 1.
        power_w: laser power.
        speed_mm_s: speed along the crease.
        spot_mm: 1/e² diameter of the beam on the metal.
        thickness_mm: of the sheet; None where the table does not say.
        passes: equal passes.
        start_c: temperature before each pass.
        angle_deg: measured fold angle towards the laser.
    """

    line: int
    power_w: float
    speed_mm_s: float
    spot_mm: float
    thickness_mm: float | None
    passes: int
    start_c: float
    angle_deg: float

    @property
    def setting(self) -> tuple[float, float, float, float | None]:
        """Power, speed, spot and thickness."""
        return self.power_w, self.speed_mm_s, self.spot_mm, self.thickness_mm


@dataclass(frozen=True)
class CalibrationTable:
    """A table that was read.

    Attributes:
        name: of the file.
        rows: the measured creases.
        notes: what was left out and why, in words.
    """

    name: str
    rows: tuple[BurntCrease, ...]
    notes: tuple[str, ...]


def read_table(path: Path, spot_mm: float | None = None) -> CalibrationTable:
    """Read a table; rows whose angle was not filled in are left out and told.

    Commas, semicolons and tabs separate columns; a decimal comma is understood where commas do not separate
    them.

    Args:
        path: the file.
        spot_mm: 1/e² diameter of the beam where the table does not say.

    Raises:
        CalibrationError: naming file, line and column of the first mistake.
    """
    try:
        text = path.read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CalibrationError(
            f"{path}: not UTF-8 text (byte {error.start}): save it as CSV in UTF-8"
        ) from error
    except (OSError, ValueError) as error:
        raise CalibrationError(
            f"{path}: cannot read the table: {getattr(error, 'strerror', None) or error}"
        ) from error
    if "\0" in text:
        raise CalibrationError(f"{path}: not a text file: save the table as CSV")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise CalibrationError(f"{path}: the table is empty: expected the columns {', '.join(NEEDED)}")
    separator = max(";\t,", key=lambda c: lines[0].count(c))
    try:
        rows = list(csv.reader(io.StringIO(text), delimiter=separator, strict=False))
    except csv.Error as error:
        raise CalibrationError(f"{path}: not a CSV table: {error}") from error
    if len(rows) > _MOST_ROWS:
        raise CalibrationError(f"{path}: {len(rows)} lines are more than any table of burnt creases")
    return _parse(path.name, str(path), rows, separator, spot_mm)


def _parse(
    name: str, path: str, rows: Sequence[Sequence[str]], separator: str, spot_mm: float | None
) -> CalibrationTable:
    head: dict[str, int] | None = None
    width = 0
    burnt: list[BurntCrease] = []
    empty: list[int] = []
    lines: dict[str, int] = {}
    for number, row in enumerate(rows, 1):
        if not any(cell.strip() for cell in row) or row[0].lstrip().startswith("#"):
            continue
        if head is None:
            head, width = _head(path, number, row, spot_mm), len(row)
            continue
        if any(cell.strip() for cell in row[width:]):
            raise CalibrationError(
                f"{path}, line {number}: {len(row)} cells under a heading of {width} columns"
                + (": were numbers written with a decimal comma? Then separate columns by semicolons"
                   if separator == "," else "")
            )  # fmt: skip
        cells = {column: row[place].strip() if place < len(row) else "" for column, place in head.items()}
        if spot_mm is not None and not cells.get("spot_mm"):
            cells["spot_mm"] = f"{spot_mm:.9g}"
        if mark := cells.get("id", ""):
            if mark in lines:
                raise CalibrationError(
                    f"{path}, line {number}: id {mark[:30]} was on line {lines[mark]} already"
                )
            lines[mark] = number
        if not cells["angle_deg"]:
            empty.append(number)
            continue
        burnt.append(_crease(path, number, cells, separator))
    if head is None:
        raise CalibrationError(f"{path}: the table has no heading: expected the columns {', '.join(NEEDED)}")
    if not burnt:
        raise CalibrationError(f"{path}: no row has a measured angle in column angle_deg: fill it in")
    notes = []
    if empty:
        shown = ", ".join(map(str, empty[:8])) + (" and more" if len(empty) > 8 else "")
        notes.append(f"{len(empty)} rows without an angle are left out (lines {shown})")
    repeats = len(burnt) - len({(*b.setting, b.passes, b.start_c) for b in burnt})
    if repeats:
        notes.append(f"{repeats} rows repeat a setting and count as repeats")
    copies = len(burnt) - len({(*b.setting, b.passes, b.start_c, b.angle_deg) for b in burnt})
    if copies:
        notes.append(f"{copies} of them have the same angle too: if they were copied, leave them out")
    return CalibrationTable(name, tuple(burnt), tuple(notes))


def _head(path: str, number: int, row: Sequence[str], spot_mm: float | None) -> dict[str, int]:
    names = [cell.strip().lower() for cell in row]
    missing = [c for c in NEEDED if c not in names and not (c == "spot_mm" and spot_mm is not None)]
    if missing:
        cure = " (or give --spot)" if missing[0] == "spot_mm" else ""
        raise CalibrationError(
            f"{path}, line {number}: column {missing[0]} is missing{cure}; the heading must name "
            f"{', '.join(NEEDED)} (found {', '.join(n[:20] or '(empty)' for n in names[:12])})"
        )
    twice = [column for column in COLUMNS if names.count(column) > 1]
    if twice:
        raise CalibrationError(f"{path}, line {number}: column {twice[0]} comes twice")
    return {column: names.index(column) for column in COLUMNS if column in names}


def _crease(path: str, number: int, cells: dict[str, str], separator: str) -> BurntCrease:
    values: dict[str, float] = {}
    for column, (low, high) in _LIMITS.items():
        text = cells.get(column, "")
        if not text:
            if column in NEEDED:
                raise CalibrationError(f"{path}, line {number}, column {column}: is empty")
            continue
        try:
            value = float(text.replace(",", ".") if separator != "," else text)
        except ValueError:
            raise CalibrationError(
                f"{path}, line {number}, column {column}: '{text[:30]}' is not a number"
            ) from None
        if (
            not math.isfinite(value)
            or not low <= value <= high
            or (value == low == 0.0 and column != "angle_deg")
        ):
            raise CalibrationError(
                f"{path}, line {number}, column {column}: {text[:30]} is out of range, expected "
                f"{low:g} to {high:g}" + (" and more than 0" if low == 0.0 and column != "angle_deg" else "")
            )
        values[column] = value
    if values["passes"] != round(values["passes"]):
        raise CalibrationError(
            f"{path}, line {number}, column passes: {values['passes']:g} is not a whole number"
        )
    return BurntCrease(
        number, values["power_w"], values["speed_mm_s"], values["spot_mm"], values.get("thickness_mm"),
        int(values["passes"]), values.get("start_c", 20.0), values["angle_deg"],
    )  # fmt: skip


def table_text(rows: Iterable[Sequence[object]]) -> str:
    """CSV text of a table with all columns, to be filled in."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(rows)
    return out.getvalue()
