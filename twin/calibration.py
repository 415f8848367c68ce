"""Fits the heating model to burnt creases: absorptivity, threshold and fall-off, with what they are worth.

Robust least squares on the logarithms of the parameters, each row weighed by 0.1 degrees plus 6 % of its
angle. What a table does not determine keeps its default, and is named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.calibration_table import CalibrationTable
from twin.errors import CalibrationError
from twin.pass_fit import LeaveOut, LeftOut, determinable, fit_passes, left_out, predict, unfit_rows

__all__ = ["Fit", "Parameter", "calibrate"]

_MOST_SIGMA = 1.0
"""A parameter that is less certain than this (in its logarithm) keeps its default."""

_GRADES: tuple[tuple[Literal["A", "B"], float, int], ...] = (("A", 0.10, 4), ("B", 0.20, 3))
"""Grade, largest error of what was left out, and fewest groups that were left out in turn."""


@dataclass(frozen=True)
class Parameter:
    """One fitted parameter.

    Attributes:
        name: ``absorptivity``, ``threshold`` or ``half_passes``.
        value: fitted, or the default.
        sigma: standard deviation of its logarithm; 0 where it was not fitted.
        fitted: False where the table does not determine it.
        why: why it was not fitted, in words.
    """

    name: str
    value: float
    sigma: float
    fitted: bool
    why: str = ""


@dataclass(frozen=True, eq=False)
class Fit:
    """A calibration.

    Attributes:
        table: what was fitted.
        thickness_mm: of the sheet where the table does not say.
        wavelength_nm: of the laser that burnt the table.
        parameters: absorptivity, threshold, half_passes.
        correlation: (K, K) of the fitted ones, in their order.
        predicted_deg: (N,) angle of every row by the fit.
        rms: relative error of the rows.
        scatter_crease: relative scatter between repeats, None without repeats.
        left_out: how well left-out rows are predicted.
        grade: of the angles: A (left-out error up to 10 %), B (20 %) or C.
        notes: what a person should know, in words.
    """

    table: CalibrationTable
    thickness_mm: float
    wavelength_nm: float
    parameters: tuple[Parameter, ...]
    correlation: NDArray[np.float64]
    predicted_deg: NDArray[np.float64]
    rms: float
    scatter_crease: float | None
    left_out: LeftOut
    grade: Literal["A", "B", "C"]
    notes: tuple[str, ...]

    def value(self, name: str) -> float:
        """Value of a parameter."""
        return next(p.value for p in self.parameters if p.name == name)

    @property
    def thicknesses_mm(self) -> tuple[float, ...]:
        """Thicknesses that were burnt, thinnest first."""
        return tuple(sorted({row.thickness_mm or self.thickness_mm for row in self.table.rows}))


def calibrate(
    table: CalibrationTable,
    material: Material,
    thickness_mm: float,
    *,
    wavelength_nm: float = 1064.0,
    leave_out: LeaveOut = "setting",
) -> Fit:
    """Fit the fast heating model to a table.

    Args:
        table: burnt creases.
        material: the sheet metal as it is in the profile, in the temper that was burnt.
        thickness_mm: of the sheet, where a row does not say.
        wavelength_nm: of the laser.
        leave_out: what is left out together for the error of prediction: a whole setting (power, speed and
            spot), a whole speed, or a whole thickness; never single rows, which would look too good.

    Raises:
        CalibrationError: if nothing can be fitted.
        ProfileError: if the profile has no absorptivity near the wavelength.
    """
    rows = table.rows
    angles = np.array([row.angle_deg for row in rows])
    if not (angles > 0.0).any():
        raise CalibrationError(
            f"{table.name}: every angle is 0: nothing folded, so nothing can be fitted. Raise the "
            "power or the passes"
        )
    if not (math.isfinite(thickness_mm) and thickness_mm > 0.0):
        raise CalibrationError(f"thickness must be a finite figure above 0, got {thickness_mm:g}")
    defaults = {
        "absorptivity": material.absorptivity_at(wavelength_nm), "threshold": material.forming.threshold,
        "half_passes": material.forming.half_passes,
    }  # fmt: skip
    free, why = determinable(rows)
    fit = fit_passes(rows, material, thickness_mm, defaults, free)
    while vague := [name for name in free if name != "absorptivity" and not fit.sigma[name] <= _MOST_SIGMA]:
        worst = max(vague, key=lambda name: fit.sigma[name])
        why[worst] = "the table hardly determines it: burn powers nearer to the first fold, or more passes"
        free = tuple(name for name in free if name != worst)
        fit = fit_passes(rows, material, thickness_mm, defaults, free)
    if not fit.sigma["absorptivity"] <= _MOST_SIGMA:
        least = " although absorptivity ran to 1" if fit.values["absorptivity"] >= 0.99 else ""
        raise CalibrationError(
            f"{table.name}: the model does not follow these angles{least}: power at the metal, speed, "
            "spot or thickness are not what the table says, or something else was measured"
        )
    predicted = predict(material, rows, thickness_mm, **fit.values)
    relative = (predicted - angles) / np.maximum(angles, 1.0)
    left = left_out(rows, material, thickness_mm, defaults, free, leave_out)
    notes = list(table.notes)
    error = left.rms if math.isfinite(left.rms) else math.inf
    grade: Literal["A", "B", "C"] = next(
        (g for g, most, groups in _GRADES if error <= most and left.groups >= groups), "C"
    )
    if left.groups < 2:
        notes.append(
            f"the table has one {leave_out} only, so nothing says how well others are predicted: graded C"
        )
    if fit.values["absorptivity"] >= 0.99:
        notes.append(
            "absorptivity ran to 1: the power at the metal, the spot or the thickness is not what "
            "the table says"
        )
    notes += _unfit(unfit_rows(material, rows, thickness_mm, fit.values["absorptivity"]), table)
    high = [n for n in range(len(rows)) if abs(relative[n]) > 0.5 and angles[n] > 1.0]
    notes += [
        f"line {rows[n].line} stands alone: {angles[n]:.1f}° measured, {predicted[n]:.1f}° by the fit"
        for n in high[:5]
    ]
    notes += _inseparable(free, fit.correlation)
    return Fit(
        table=table,
        thickness_mm=thickness_mm,
        wavelength_nm=wavelength_nm,
        parameters=tuple(
            Parameter(name, fit.values[name], fit.sigma.get(name, 0.0), name in free, why.get(name, ""))
            for name in defaults
        ),
        correlation=fit.correlation,
        predicted_deg=predicted,
        rms=float(np.sqrt(np.mean(relative**2))),
        scatter_crease=_scatter(table, angles),
        left_out=left,
        grade=grade,
        notes=tuple(notes),
    )


_REGIME_WORDS = {
    "melts": "melt the surface: leave them out if the creases look molten",
    "cuts": "cut the sheet: was the power at the metal what the table says?",
    "buckling": "are too slow for a gradient (buckling): angles there are luck",
    "upsetting": "are too slow for a gradient (upsetting): angles there are luck",
}


def _unfit(regimes: dict[int, str], table: CalibrationTable) -> list[str]:
    """Rows that by the model do not fold, in words, one note for each regime."""
    out = []
    for regime, words in _REGIME_WORDS.items():
        lines = [table.rows[n].line for n, found in regimes.items() if found == regime]
        if lines:
            shown = ", ".join(map(str, lines[:8])) + (" and more" if len(lines) > 8 else "")
            out.append(f"by the model {len(lines)} rows (lines {shown}) {words}")
    return out


def _inseparable(free: tuple[str, ...], correlation: NDArray[np.float64]) -> list[str]:
    """The pair of parameters that is hardest to tell apart, if it is hard."""
    pairs = [(abs(float(correlation[i, j])), i, j) for i in range(len(free)) for j in range(i)]
    most, i, j = max(pairs, default=(0.0, 0, 0))
    if most <= 0.95:
        return []
    return [f"{free[i]} and {free[j]} cannot be told apart well (correlation {correlation[i, j]:.2f})"]


def _scatter(table: CalibrationTable, angles: NDArray[np.float64]) -> float | None:
    """Relative standard deviation between repeats, pooled."""
    groups: dict[object, list[float]] = {}
    for row, angle in zip(table.rows, angles.tolist(), strict=True):
        groups.setdefault((row.setting, row.passes, row.start_c), []).append(angle)
    squares, free = 0.0, 0
    for members in groups.values():
        mean = sum(members) / len(members)
        if len(members) > 1 and mean > 0.5:
            squares += sum((m / mean - 1.0) ** 2 for m in members)
            free += len(members) - 1
    return math.sqrt(squares / free) if free >= 2 else None
