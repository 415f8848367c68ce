"""The table of burnt creases."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from twin.errors import CalibrationError
from twin.filled_table import FilledTable, read_filled

__all__ = ["COLUMNS", "BurntCrease", "CalibrationTable", "read_table", "table_text"]

COLUMNS = ("id", "power_w", "speed_mm_s", "spot_mm", "thickness_mm", "passes", "start_c", "angle_deg", "note")
NEEDED = ("power_w", "speed_mm_s", "spot_mm", "passes", "angle_deg")
_LIMITS = {
    "power_w": (1e-3, 1e5), "speed_mm_s": (1e-3, 1e5), "spot_mm": (1e-3, 100.0),
    "thickness_mm": (1e-3, 20.0), "passes": (1.0, 1e4), "start_c": (-50.0, 500.0), "angle_deg": (0.0, 180.0),
}  # fmt: skip


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
    usual = {} if spot_mm is None else {"spot_mm": f"{spot_mm:.9g}"}
    table = read_filled(path, COLUMNS, NEEDED, usual)
    burnt = [_crease(table, line, cells) for line, cells in table.rows if cells["angle_deg"]]
    empty = [line for line, cells in table.rows if not cells["angle_deg"]]
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
    return CalibrationTable(table.name, tuple(burnt), tuple(notes))


def _crease(table: FilledTable, line: int, cells: dict[str, str]) -> BurntCrease:
    values: dict[str, float] = {}
    for column, (low, high) in _LIMITS.items():
        text = cells.get(column, "")
        if not text:
            if column in NEEDED:
                raise CalibrationError(f"{table.path}, line {line}, column {column}: is empty")
            continue
        values[column] = table.number(line, column, text, low, high)
    if values["passes"] != round(values["passes"]):
        raise CalibrationError(
            f"{table.path}, line {line}, column passes: {values['passes']:g} is not a whole number"
        )
    return BurntCrease(
        line, values["power_w"], values["speed_mm_s"], values["spot_mm"], values.get("thickness_mm"),
        int(values["passes"]), values.get("start_c", 20.0), values["angle_deg"],
    )  # fmt: skip


def table_text(rows: Iterable[Sequence[object]]) -> str:
    """CSV text of a table with all columns, to be filled in."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(rows)
    return out.getvalue()
