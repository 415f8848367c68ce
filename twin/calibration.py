"""Fits the heating model to burnt creases: absorptivity, threshold and fall-off, with what they are worth.

Robust least squares on the logarithms of the parameters, each row weighed by 0.1 degrees plus 6 % of its
angle.
What a table does not determine keeps its default, and is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigs.material import Calibration, Material
from rigs.rig import Grade
from twin.calibration_table import BurntCrease, CalibrationTable
from twin.errors import CalibrationError
from twin.heating import fold_passes, start_factor

__all__ = ["Fit", "LeaveOut", "LeftOut", "Parameter", "calibrate", "calibrated_material", "predict"]

LeaveOut = Literal["setting", "speed", "thickness"]

ANGLE_FLOOR_DEG, ANGLE_SHARE = 0.1, 0.06
"""How well a row is trusted: this many degrees plus this share of its angle."""

_MOST_SIGMA = 0.6
"""A parameter that is less certain than this (in its logarithm) keeps its default."""

_BOUNDS = {"absorptivity": (0.01, 1.0), "threshold": (0.05, 20.0), "half_passes": (0.5, 1e4)}


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


@dataclass(frozen=True)
class LeftOut:
    """How well what was left out is predicted by the rest.

    Attributes:
        by: what was left out together.
        groups: how many groups there are.
        rms: relative error, root mean square; NaN with one group.
        worst: largest relative error of a row.
    """

    by: LeaveOut
    groups: int
    rms: float
    worst: float


@dataclass(frozen=True, eq=False)
class Fit:
    """A calibration.

    Attributes:
        table: what was fitted.
        thickness_mm: of the sheet where the table does not say.
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


def predict(
    material: Material,
    rows: Sequence[BurntCrease],
    thickness_mm: float,
    absorptivity: float,
    threshold: float,
    half_passes: float,
) -> NDArray[np.float64]:
    """(N,) fold angle of every row in degrees by the fast model with the given parameters.

    Raises:
        SettingError: if a row is no possible setting.
    """
    forming = msgspec.structs.replace(
        material.forming, threshold=threshold, half_passes=half_passes, gain=1.0
    )
    metal = msgspec.structs.replace(material, forming=forming)
    out = np.zeros(len(rows))
    groups: dict[tuple[float, float, float], list[int]] = {}
    for n, row in enumerate(rows):
        groups.setdefault((row.thickness_mm or thickness_mm, row.spot_mm, row.start_c), []).append(n)
    for (thickness, spot, start), members in groups.items():
        table = fold_passes(
            metal, thickness, [rows[n].power_w for n in members], [rows[n].speed_mm_s for n in members],
            across_mm=spot / 2.0, absorptivity=absorptivity, start_c=20.0,
        )  # fmt: skip
        for k, n in enumerate(members):
            count = np.arange(rows[n].passes)
            law = (1.0 + count / float(table.half_passes[k])) ** -material.forming.fall_off
            first = float(table.angle_rad[k]) * float(start_factor(start))
            out[n] = math.degrees(first * float(law.sum()))
    return out


def calibrate(
    table: CalibrationTable, material: Material, thickness_mm: float, *, leave_out: LeaveOut = "setting"
) -> Fit:
    """Fit the fast heating model to a table.

    Args:
        table: burnt creases.
        material: the sheet metal as it is in the profile, in the temper that was burnt.
        thickness_mm: of the sheet, where a row does not say.
        leave_out: what is left out together for the error of prediction: a whole setting (power, speed and
            spot), a
            whole speed, or a whole thickness; never single rows, which would look too good.

    Raises:
        CalibrationError: if nothing can be fitted.
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
        "absorptivity": material.absorptivity.at_1064nm, "threshold": material.forming.threshold,
        "half_passes": material.forming.half_passes,
    }  # fmt: skip
    free, why = _free(rows)
    fitted, sigma, correlation = _fit(rows, angles, material, thickness_mm, defaults, free)
    while True:
        vague = [name for name in free if name != "absorptivity" and not sigma[name] <= _MOST_SIGMA]
        if not vague:
            break
        worst = max(vague, key=lambda name: sigma[name])
        why[worst] = "the table hardly determines it: burn powers nearer to the first fold, or more passes"
        free = tuple(name for name in free if name != worst)
        fitted, sigma, correlation = _fit(rows, angles, material, thickness_mm, defaults, free)
    predicted = predict(material, rows, thickness_mm, **fitted)
    relative = (predicted - angles) / np.maximum(angles, 1.0)
    left = _left_out(rows, angles, material, thickness_mm, defaults, free, leave_out)
    notes = list(table.notes)
    error = left.rms if math.isfinite(left.rms) else math.inf
    grade: Literal["A", "B", "C"] = "A" if error <= 0.10 else "B" if error <= 0.20 else "C"
    if left.groups < 2:
        notes.append(
            f"the table has one {leave_out} only, so nothing says how well others are predicted: graded C"
        )
    if fitted["absorptivity"] >= 0.99 * _BOUNDS["absorptivity"][1]:
        notes.append(
            "absorptivity ran to 1: the power at the metal, the spot or the thickness is not what "
            "the table says"
        )
    high = [n for n in range(len(rows)) if abs(relative[n]) > 0.5 and angles[n] > 1.0]
    notes += [
        f"line {rows[n].line} stands alone: {angles[n]:.1f}° measured, {predicted[n]:.1f}° by the fit"
        for n in high[:5]
    ]
    if len(free) > 1:
        pairs = [(abs(correlation[i, j]), i, j) for i in range(len(free)) for j in range(i)]
        most, i, j = max(pairs)
        if most > 0.95:
            notes.append(
                f"{free[i]} and {free[j]} cannot be told apart well (correlation {correlation[i, j]:.2f})"
            )
    return Fit(
        table=table,
        thickness_mm=thickness_mm,
        parameters=tuple(
            Parameter(name, fitted[name], sigma.get(name, 0.0), name in free, why.get(name, ""))
            for name in defaults
        ),
        correlation=correlation,
        predicted_deg=predicted,
        rms=float(np.sqrt(np.mean(relative**2))),
        scatter_crease=_scatter(rows, angles),
        left_out=left,
        grade=grade,
        notes=tuple(notes),
    )


def _free(rows: Sequence[BurntCrease]) -> tuple[tuple[str, ...], dict[str, str]]:
    """Parameters that the table may determine, and why it cannot determine the others."""
    free, why = ["absorptivity"], {}
    if len({row.setting for row in rows}) > 1:
        free.append("threshold")
    else:
        why["threshold"] = "one setting cannot tell it from absorptivity: burn other powers and speeds"
    if len({row.passes for row in rows}) > 1:
        free.append("half_passes")
    else:
        why["half_passes"] = "all rows have the same number of passes: burn others too"
    kinds = len({(row.setting, row.passes) for row in rows})
    for name in ("threshold", "half_passes"):
        if name in free and kinds < len(free):
            free.remove(name)
            why[name] = "too few rows"
    return tuple(free), why


def _fit(
    rows: Sequence[BurntCrease],
    angles: NDArray[np.float64],
    material: Material,
    thickness_mm: float,
    defaults: dict[str, float],
    free: tuple[str, ...],
) -> tuple[dict[str, float], dict[str, float], NDArray[np.float64]]:
    from scipy.optimize import least_squares

    weight = ANGLE_FLOOR_DEG + ANGLE_SHARE * angles

    def values(logs: NDArray[np.float64]) -> dict[str, float]:
        return {**defaults, **{name: math.exp(x) for name, x in zip(free, logs, strict=True)}}

    def residual(logs: NDArray[np.float64]) -> NDArray[np.float64]:
        out: NDArray[np.float64] = (predict(material, rows, thickness_mm, **values(logs)) - angles) / weight
        return out

    low = np.array([math.log(_BOUNDS[name][0]) for name in free])
    high = np.array([math.log(_BOUNDS[name][1]) for name in free])
    best = None
    for factor in (1.0, 0.6, 1.6):  # a cold start may sit below the threshold, where nothing changes
        start = np.array(
            [math.log(defaults[name] * (factor if name == "absorptivity" else 1.0)) for name in free]
        )
        start = np.clip(start, low + 1e-6, high - 1e-6)
        found = least_squares(
            residual, start, bounds=(low, high), loss="soft_l1", x_scale=0.2, diff_step=[1e-4] * len(free)
        )
        if best is None or found.cost < best.cost - 1e-12:
            best = found
    assert best is not None  # noqa: S101  three starts
    jacobian: NDArray[np.float64] = np.asarray(best.jac, dtype=np.float64)
    curvature = jacobian.T @ jacobian
    spread = max(1.0, 2.0 * float(best.cost) / max(len(rows) - len(free), 1))
    try:
        covariance = np.linalg.inv(curvature) * spread
    except np.linalg.LinAlgError:
        covariance = np.full_like(curvature, np.inf)
    variance = np.diag(covariance)
    sigma = np.where(variance >= 0.0, np.sqrt(np.abs(variance)), np.inf)
    scale = np.outer(sigma, sigma)
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = np.nan_to_num(covariance / scale)
    return values(best.x), dict(zip(free, sigma.tolist(), strict=True)), correlation


def _left_out(
    rows: Sequence[BurntCrease],
    angles: NDArray[np.float64],
    material: Material,
    thickness_mm: float,
    defaults: dict[str, float],
    free: tuple[str, ...],
    by: LeaveOut,
) -> LeftOut:
    key: Callable[[BurntCrease], object] = {
        "setting": lambda row: row.setting,
        "speed": lambda row: row.speed_mm_s,
        "thickness": lambda row: row.thickness_mm or thickness_mm,
    }[by]
    names = list(dict.fromkeys(key(row) for row in rows))
    if len(names) < 2:
        return LeftOut(by, len(names), math.nan, math.nan)
    errors: list[float] = []
    for name in names:
        kept = [n for n, row in enumerate(rows) if key(row) != name]
        out = [n for n, row in enumerate(rows) if key(row) == name]
        some = [rows[n] for n in kept]
        usable, _ = _free(some)
        usable = tuple(p for p in usable if p in free)
        fitted, _, _ = _fit(some, angles[kept], material, thickness_mm, defaults, usable)
        predicted = predict(material, [rows[n] for n in out], thickness_mm, **fitted)
        errors += ((predicted - angles[out]) / np.maximum(angles[out], 1.0)).tolist()
    return LeftOut(by, len(names), float(np.sqrt(np.mean(np.square(errors)))), float(np.abs(errors).max()))


def _scatter(rows: Sequence[BurntCrease], angles: NDArray[np.float64]) -> float | None:
    """Relative standard deviation between repeats, pooled."""
    groups: dict[object, list[float]] = {}
    for row, angle in zip(rows, angles.tolist(), strict=True):
        groups.setdefault((row.setting, row.passes, row.start_c), []).append(angle)
    squares, free = 0.0, 0
    for members in groups.values():
        mean = sum(members) / len(members)
        if len(members) > 1 and mean > 0.5:
            squares += sum((m / mean - 1.0) ** 2 for m in members)
            free += len(members) - 1
    return math.sqrt(squares / free) if free >= 2 else None


def calibrated_material(fit: Fit, material: Material, wavelength_nm: float = 1064.0) -> Material:
    """The material with the fitted values, graded, its calibration marked.

    Args:
        fit: the calibration.
        material: what was fitted.
        wavelength_nm: of the laser that burnt the table.
    """
    absorptivity = fit.value("absorptivity")
    infrared = wavelength_nm > 5000.0
    light = msgspec.structs.replace(
        material.absorptivity, **{"at_10600nm" if infrared else "at_1064nm": round(absorptivity, 6)}
    )
    more = {} if fit.scatter_crease is None else {"scatter_crease": round(max(fit.scatter_crease, 0.005), 4)}
    forming = msgspec.structs.replace(
        material.forming, gain=1.0, threshold=round(fit.value("threshold"), 6),
        half_passes=round(fit.value("half_passes"), 4), **more,
    )  # fmt: skip
    error = f"{100.0 * fit.left_out.rms:.0f} %" if math.isfinite(fit.left_out.rms) else "not known"
    source = (
        f"{len(fit.table.rows)} creases of {fit.table.name}, {fit.thickness_mm:g} mm; error of a left-out "
        f"{fit.left_out.by}: {error}"
    )
    grade = Grade(grade=fit.grade, source=f"fitted to {source}")
    return msgspec.structs.replace(
        material,
        absorptivity=light,
        forming=forming,
        calibration=Calibration(status="fitted", source=source),
        grades={**material.grades, "absorptivity": grade, "forming": grade},
    )
