"""Least squares of the fast heating model to burnt creases: prediction, fit, and what was left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.calibration_table import BurntCrease
from twin.heating import REGIMES, fold_passes, start_factor

__all__ = [
    "LeaveOut", "LeftOut", "PassFit", "determinable", "fit_passes", "left_out", "predict", "unfit_rows",
]  # fmt: skip

LeaveOut = Literal["setting", "speed", "thickness"]

ANGLE_FLOOR_DEG, ANGLE_SHARE = 0.1, 0.06
"""How well a row is trusted: this many degrees plus this share of its angle."""

BOUNDS = {"absorptivity": (0.01, 1.0), "threshold": (0.05, 20.0), "half_passes": (0.5, 1e4)}

_LEAST_INFORMATION = 1e-6
"""Added to the curvature of the cost: a parameter on which nothing depends has a deviation of 1000."""

_STEP = 1e-3
"""Of the differences that stand for derivatives by the logarithms of the parameters."""


@dataclass(frozen=True, eq=False)
class PassFit:
    """Parameters that fit best.

    Attributes:
        values: of all parameters, those that were not free included.
        sigma: standard deviation of the logarithm of each free one.
        correlation: (K, K) of the free ones, in their order.
    """

    values: dict[str, float]
    sigma: dict[str, float]
    correlation: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LeftOut:
    """How well what was left out is predicted by the rest.

    Attributes:
        by: what was left out together.
        groups: how many groups there are.
        rms: relative error, root mean square; NaN with one group.
        worst: largest relative error of a row.
        predicted_deg: (N,) angle of every row by a fit to the other groups; NaN with one group.
    """

    by: LeaveOut
    groups: int
    rms: float
    worst: float
    predicted_deg: NDArray[np.float64]


def predict(
    material: Material,
    rows: Sequence[BurntCrease],
    thickness_mm: float,
    absorptivity: float,
    threshold: float,
    half_passes: float,
) -> NDArray[np.float64]:
    """(N,) fold angle of every row in degrees by the fast model with the given parameters.

    A row was burnt and measured, so it has an angle also where the model says that it is a cut.

    Raises:
        SettingError: if a row is no possible setting.
    """
    forming = msgspec.structs.replace(
        material.forming, threshold=threshold, half_passes=half_passes, gain=1.0
    )
    metal = msgspec.structs.replace(material, forming=forming)
    out = np.zeros(len(rows))
    for (thickness, spot, start), members in settings_of(rows, thickness_mm).items():
        table = fold_passes(
            metal, thickness, [rows[n].power_w for n in members], [rows[n].speed_mm_s for n in members],
            across_mm=spot / 2.0, absorptivity=absorptivity, smooth=True,
        )  # fmt: skip
        for k, n in enumerate(members):
            count = np.arange(rows[n].passes)
            law = (1.0 + count / float(table.half_passes[k])) ** -material.forming.fall_off
            first = float(table.angle_rad[k]) * float(start_factor(start))
            out[n] = math.degrees(first * float(law.sum()))
    return out


def settings_of(
    rows: Sequence[BurntCrease], thickness_mm: float
) -> dict[tuple[float, float, float], list[int]]:
    """Rows by thickness, spot and start temperature, which the model takes together."""
    groups: dict[tuple[float, float, float], list[int]] = {}
    for n, row in enumerate(rows):
        groups.setdefault((row.thickness_mm or thickness_mm, row.spot_mm, row.start_c), []).append(n)
    return groups


def unfit_rows(
    material: Material, rows: Sequence[BurntCrease], thickness_mm: float, absorptivity: float
) -> dict[int, str]:
    """Rows that by the model do not fold but melt, cut or buckle: index to regime."""
    found: dict[int, str] = {}
    for (thickness, spot, _start), members in settings_of(rows, thickness_mm).items():
        table = fold_passes(
            material, thickness, [rows[n].power_w for n in members], [rows[n].speed_mm_s for n in members],
            across_mm=spot / 2.0, absorptivity=absorptivity,
        )  # fmt: skip
        for k, n in enumerate(members):
            regime = REGIMES[int(table.regime[k])]
            if regime not in ("tgm", "mixed", "below yield"):
                found[n] = regime
    return found


def fit_passes(
    rows: Sequence[BurntCrease],
    material: Material,
    thickness_mm: float,
    defaults: Mapping[str, float],
    free: tuple[str, ...],
    *,
    starts: Sequence[float] = (1.0, 0.6, 1.6),
) -> PassFit:
    """Fit the free parameters to rows by robust least squares on their logarithms.

    Args:
        rows: burnt creases.
        material: the sheet metal.
        thickness_mm: of the sheet, where a row does not say.
        defaults: of all parameters.
        free: names of those that are fitted.
        starts: factors on the default absorptivity where the search begins; the best end counts. Below the
            threshold nothing changes, so that one start alone may end nowhere.
    """
    from scipy.optimize import least_squares

    angles = np.array([row.angle_deg for row in rows])
    weight = ANGLE_FLOOR_DEG + ANGLE_SHARE * angles

    def values(logs: NDArray[np.float64]) -> dict[str, float]:
        return {**defaults, **{name: math.exp(x) for name, x in zip(free, logs.tolist(), strict=True)}}

    def residual(logs: NDArray[np.float64]) -> NDArray[np.float64]:
        out: NDArray[np.float64] = (predict(material, rows, thickness_mm, **values(logs)) - angles) / weight
        return out

    low = np.array([math.log(BOUNDS[name][0]) for name in free])
    high = np.array([math.log(BOUNDS[name][1]) for name in free])

    def slopes(logs: NDArray[np.float64]) -> NDArray[np.float64]:
        columns = []
        for k in range(len(free)):
            up, down = logs.copy(), logs.copy()
            up[k], down[k] = min(logs[k] + _STEP, high[k]), max(logs[k] - _STEP, low[k])
            columns.append((residual(up) - residual(down)) / (up[k] - down[k]))
        return np.column_stack(columns)

    best = None
    for factor in starts:
        start = np.array(
            [math.log(defaults[name] * (factor if name == "absorptivity" else 1.0)) for name in free]
        )
        start = np.clip(start, low + 1e-6, high - 1e-6)
        found = least_squares(
            residual, start, jac=slopes, bounds=(low, high), loss="soft_l1", x_scale=0.2, max_nfev=60
        )
        if best is None or found.cost < best.cost - 1e-12:
            best = found
    assert best is not None  # noqa: S101  there is a start
    jacobian = np.asarray(best.jac, dtype=np.float64)
    spread = max(1.0, 2.0 * float(best.cost) / max(len(rows) - len(free), 1))
    least = _LEAST_INFORMATION * np.eye(len(free))  # what nothing depends on is unknown, the rest is not
    covariance = np.linalg.inv(jacobian.T @ jacobian + least) * spread
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    return PassFit(values(np.asarray(best.x)), dict(zip(free, sigma.tolist(), strict=True)), correlation)


def left_out(
    rows: Sequence[BurntCrease],
    material: Material,
    thickness_mm: float,
    defaults: Mapping[str, float],
    free: tuple[str, ...],
    by: LeaveOut,
) -> LeftOut:
    """Predict every group of rows by a fit to all others; the arguments are those of ``fit_passes``.

    The searches begin at the fit to all rows, which only makes them quicker.
    """
    near = fit_passes(rows, material, thickness_mm, defaults, free, starts=(1.0,)).values
    key: Callable[[BurntCrease], object] = {
        "setting": lambda row: row.setting,
        "speed": lambda row: row.speed_mm_s,
        "thickness": lambda row: row.thickness_mm or thickness_mm,
    }[by]
    angles = np.array([row.angle_deg for row in rows])
    predicted = np.full(len(rows), math.nan)
    names = list(dict.fromkeys(key(row) for row in rows))
    if len(names) < 2:
        return LeftOut(by, len(names), math.nan, math.nan, predicted)
    for name in names:
        some = [row for row in rows if key(row) != name]
        usable = tuple(p for p in determinable(some)[0] if p in free)
        begin = {**defaults, **{p: near[p] for p in usable}}
        fitted = fit_passes(some, material, thickness_mm, begin, usable, starts=(1.0,)).values
        out = [n for n, row in enumerate(rows) if key(row) == name]
        predicted[out] = predict(material, [rows[n] for n in out], thickness_mm, **fitted)
    errors = (predicted - angles) / np.maximum(angles, 1.0)
    return LeftOut(by, len(names), float(np.sqrt(np.mean(errors**2))), float(np.abs(errors).max()), predicted)


def determinable(rows: Sequence[BurntCrease]) -> tuple[tuple[str, ...], dict[str, str]]:
    """Parameters that a table may determine, and why it cannot determine the others."""
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
