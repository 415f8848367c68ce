"""The table of cut windows: which settings cut through, and how wide."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from twin.errors import CalibrationError
from twin.filled_table import heading, read_filled

__all__ = ["KERF_COLUMNS", "Kerf", "is_kerf_table", "read_kerfs"]

KERF_COLUMNS = ("id", "power_w", "speed_mm_s", "passes", "nominal_mm", "piece_mm", "hole_mm", "note")
_NEEDED = ("power_w", "speed_mm_s", "passes", "nominal_mm", "piece_mm", "hole_mm")


@dataclass(frozen=True)
class Kerf:
    """What one setting cut.

    Attributes:
        power_w: laser power.
        speed_mm_s: speed.
        passes: how often.
        windows: how many were tried.
        through: how many were cut through, that is measured.
        kerf_mm: mean width of the cut, NaN where none was cut through.
        sigma_mm: standard deviation between windows, NaN with fewer than two.
    """

    power_w: float
    speed_mm_s: float
    passes: int
    windows: int
    through: int
    kerf_mm: float
    sigma_mm: float


def is_kerf_table(path: Path) -> bool:
    """Whether a table is one of windows and not of creases."""
    return "nominal_mm" in heading(path)


def read_kerfs(path: Path) -> tuple[Kerf, ...]:
    """Kerf of every setting, in the order of the table.

    The width is that of the hole less that of the piece, halved, where both were measured: then it does not
    depend on the scale of the machine. A window of which neither was measured was not cut through.

    Raises:
        CalibrationError: naming file, line and column of the first mistake.
    """
    table = read_filled(path, KERF_COLUMNS, _NEEDED)
    found: dict[tuple[float, float, int], list[float]] = {}
    for line, cells in table.rows:
        values = {}
        for column, low, high in (
            ("power_w", 1e-3, 1e5), ("speed_mm_s", 1e-3, 1e5), ("passes", 1.0, 1e4), ("nominal_mm", 0.1, 1e3),
        ):  # fmt: skip
            if not cells[column]:
                raise CalibrationError(f"{table.path}, line {line}, column {column}: is empty")
            values[column] = table.number(line, column, cells[column], low, high)
        nominal = values["nominal_mm"]
        sizes = {
            column: table.number(line, column, cells[column], 0.5 * nominal, 1.5 * nominal)
            for column in ("piece_mm", "hole_mm")
            if cells[column]
        }
        kerf = math.nan
        if len(sizes) == 2:
            kerf = 0.5 * (sizes["hole_mm"] - sizes["piece_mm"])
        elif sizes:
            kerf = abs(nominal - next(iter(sizes.values())))
        if kerf <= 0.0:
            raise CalibrationError(
                f"{table.path}, line {line}: the hole is no wider than the piece: measure them again"
            )
        key = (values["power_w"], values["speed_mm_s"], int(values["passes"]))
        found.setdefault(key, []).append(kerf)
    if not any(math.isfinite(kerf) for kerfs in found.values() for kerf in kerfs):
        raise CalibrationError(f"{path}: no piece and no hole was measured: fill in piece_mm or hole_mm")
    return tuple(_kerf(key, kerfs) for key, kerfs in found.items())


def _kerf(key: tuple[float, float, int], kerfs: list[float]) -> Kerf:
    known = [kerf for kerf in kerfs if math.isfinite(kerf)]
    mean = sum(known) / len(known) if known else math.nan
    spread = math.nan
    if len(known) > 1:
        spread = math.sqrt(sum((k - mean) ** 2 for k in known) / (len(known) - 1))
    return Kerf(*key, len(kerfs), len(known), mean, spread)
