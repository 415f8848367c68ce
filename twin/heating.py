"""Fast heating model: angle of one laser pass in closed form, its regime, and where it is not valid.

``theta_1 = [3 alpha A P / (rho c v h²)] * 0.674 (w/h)^0.05 / (1 + 2.90 Fo^1.09) * S`` with
``Fo = a 2 w / (v h²)`` and ``S`` a soft threshold at the power of first yield. The bracket is the two-layer
formula of Vollertsen (Lasers in Engineering 2, 1994); the factors were fitted to a layered elasto-plastic
section model over 299 settings (foils of 40 to 250 µm, w/h 0.25 to 3, 10 to 1000 mm/s; median error 17 to
20 %).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigs.material import Material
from twin.errors import HeatingError, SettingError
from twin.hot_metal import HotMetal, melting_heat, peak_temperatures, spot_rises

__all__ = [
    "LARGEST_FOURIER", "LARGEST_PASS_RAD", "LARGEST_WIDTH_RATIO", "MODEL_NAME", "REGIMES", "PassResult",
    "PassTable", "Regime", "bend", "fold_passes", "require_fold", "setting_flags", "soft_threshold",
    "start_factor",
]  # fmt: skip

MODEL_NAME = "fast/1"

Regime = Literal["tgm", "mixed", "buckling", "upsetting", "melts", "cuts", "below yield"]
"""Temperature gradient, mixed, buckling, upsetting mechanism; surface melts; cut; stays elastic."""

REGIMES: tuple[Regime, ...] = ("tgm", "mixed", "buckling", "upsetting", "melts", "cuts", "below yield")

WIDTH_FACTOR, WIDTH_EXPONENT, FOURIER_FACTOR, FOURIER_EXPONENT = 0.674, 0.05, 2.90, 1.09
THRESHOLD_SOFTNESS = 0.1
"""Width of the soft threshold, as a share of the power. Grade C."""

START_LOSS_PER_K = 0.08 / 180.0
"""Relative loss of angle per kelvin of start temperature over 20 °C. Grade C: section model, 75 µm 304."""

LARGEST_FOURIER = 2.0
LARGEST_PASS_RAD = math.radians(3.0)
LARGEST_WIDTH_RATIO = 5.0
SMALLEST_ABSORPTIVITY = 0.12


@dataclass(frozen=True, eq=False)
class PassTable:
    """Results of many settings, one array entry each.

    Attributes:
        power_w: laser power.
        speed_mm_s: speed.
        angle_rad: angle of the first pass, without sign.
        threshold_w: power of first yield.
        fourier: Fourier number.
        peak_top_c: hottest temperature of the lit face.
        peak_bottom_c: hottest temperature of the other face.
        half_passes: n_h of the pass law.
        regime: index into ``REGIMES``.
    """

    power_w: NDArray[np.float64]
    speed_mm_s: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    threshold_w: NDArray[np.float64]
    fourier: NDArray[np.float64]
    peak_top_c: NDArray[np.float64]
    peak_bottom_c: NDArray[np.float64]
    half_passes: NDArray[np.float64]
    regime: NDArray[np.int64]

    def at(self, index: int | NDArray[np.int64]) -> PassTable:
        """Some settings, counted along the last axis first; one alone gives arrays without dimensions."""
        rows = {f.name: np.asarray(getattr(self, f.name).flat[index]) for f in fields(self)}
        return PassTable(**rows)


@dataclass(frozen=True)
class PassResult:
    """What one pass does.

    Attributes:
        angle_rad: angle of the first pass towards the beam, 0 where nothing can be said.
        regime: the mechanism.
        valid: the angle may be used.
        fourier: Fourier number of the setting.
        threshold_w: power of first yield.
        peak_top_c: hottest temperature of the lit face.
        peak_bottom_c: hottest temperature of the other face.
        half_passes: n_h of the pass law ``(1 + (n - 1) / n_h) ** -q``.
        flags: what is doubtful or wrong, in words.
    """

    angle_rad: float
    regime: Regime
    valid: bool
    fourier: float
    threshold_w: float
    peak_top_c: float
    peak_bottom_c: float
    half_passes: float
    flags: tuple[str, ...]


def fold_passes(
    material: Material,
    thickness_mm: float,
    power_w: ArrayLike,
    speed_mm_s: ArrayLike,
    *,
    across_mm: float,
    along_mm: float | None = None,
    absorptivity: float,
    start_c: float = 20.0,
    smooth: bool = False,
) -> PassTable:
    """First-pass angles of many settings at once.

    Args:
        material: what the sheet is made of.
        thickness_mm: of the sheet.
        power_w: laser powers, broadcast with ``speed_mm_s``.
        speed_mm_s: speeds along the crease.
        across_mm: 1/e² beam radius across the crease on the metal.
        along_mm: the same along the crease; ``across_mm`` when None.
        absorptivity: absorbed share of the light, above 0 up to 1.
        start_c: temperature of the metal before the pass.
        smooth: leave the angle as it is where the sheet would be cut or not yield, in place of 0: for fits,
            which would be lost there.

    Raises:
        SettingError: if a value is not finite or out of range.
    """
    power, speed = np.broadcast_arrays(
        np.asarray(power_w, dtype=np.float64), np.asarray(speed_mm_s, dtype=np.float64)
    )
    along = across_mm if along_mm is None else along_mm
    for name, value in (
        ("power", power), ("speed", speed), ("thickness", thickness_mm), ("beam radius across", across_mm),
        ("beam radius along", along),
    ):  # fmt: skip
        if not np.all(np.isfinite(value) & (np.asarray(value) > 0.0)):
            raise SettingError(f"{name} of a laser pass must be a finite figure above 0, got {value}")
    if not 0.0 < absorptivity <= 1.0:
        raise SettingError(f"absorptivity must be above 0 and at most 1, got {absorptivity}")
    solidus = material.constants.solidus_c
    if not -50.0 <= start_c <= 0.5 * (solidus + 273.15) - 273.15:
        raise SettingError(
            f"start temperature {start_c:g} °C: expected -50 °C to half the absolute melting point of "
            f"{material.name} ({0.5 * (solidus + 273.15) - 273.15:.0f} °C): let it cool"
        )
    h, wy, wx, v = 1e-3 * thickness_mm, 1e-3 * across_mm, 1e-3 * along, 1e-3 * speed
    metal = HotMetal.reference(material)
    absorbed = absorptivity * power
    rises = spot_rises(material, v, h, wx, wy)
    top, bottom = peak_temperatures(material, rises, absorbed, start_c)
    fixed = np.full(v.shape, metal.heat_capacity), np.full(v.shape, metal.conductivity)
    per_watt = absorptivity * rises.per_watt(*fixed)[0]
    cold = HotMetal.at(material, 20.0)
    yield_rise = (
        1e6 * material.yield_mpa_at(start_c) * (1.0 - material.poisson) / (cold.young * cold.expansion)
    )
    threshold = material.forming.threshold * yield_rise / per_watt
    fourier = metal.diffusivity * 2.0 * wx / (v * h**2)
    vollertsen = 3.0 * metal.expansion * absorbed / (metal.heat_capacity * v * h**2)
    shape = WIDTH_FACTOR * (wy / h) ** WIDTH_EXPONENT / (1.0 + FOURIER_FACTOR * fourier**FOURIER_EXPONENT)
    start = start_factor(start_c)
    angle = material.forming.gain * vollertsen * shape * soft_threshold(power / threshold) * start
    share = np.maximum(bottom - 20.0, 1e-9) / (material.constants.anneal_c - 20.0)
    forming = material.forming
    half = np.clip(forming.half_passes * (share / forming.half_heat) ** forming.half_exponent, 5.0, 5000.0)
    cut_line = melting_heat(material) * h * 2.0 * wy  # J/m that melts a kerf as wide as the beam
    cuts = (bottom >= solidus) | (absorbed / v > cut_line)
    regime = np.select(
        [cuts, top >= solidus, power < threshold, fourier > LARGEST_FOURIER, fourier > 0.5],
        [5, 4, 6, 3 if 2.0 * wy <= h else 2, 1],
        0,
    )
    if not smooth:
        angle = np.where(cuts | (power < threshold), 0.0, angle)
    return PassTable(power, speed, angle, threshold, fourier, top, bottom, half, regime.astype(np.int64))


def bend(
    material: Material,
    thickness_mm: float,
    power_w: float,
    speed_mm_s: float,
    *,
    spot_mm: float,
    absorptivity: float,
    tilt_rad: float = 0.0,
    start_c: float = 20.0,
) -> PassResult:
    """One pass of one setting, with its regime and everything that makes it doubtful.

    Args:
        material: what the sheet is made of.
        thickness_mm: of the sheet.
        power_w: laser power.
        speed_mm_s: speed along the crease.
        spot_mm: 1/e² diameter of the beam.
        absorptivity: absorbed share of the light.
        tilt_rad: angle between beam and sheet normal, the beam leaning across the crease.
        start_c: temperature of the metal before the pass.

    Raises:
        SettingError: if a value is not finite or out of range.
    """
    if not 0.0 <= tilt_rad < math.radians(85.0):
        raise SettingError(f"tilt must be 0 to below 85 degrees, got {math.degrees(tilt_rad):g}")
    radius = spot_mm / 2.0
    across = radius / math.cos(tilt_rad)
    table = fold_passes(
        material, thickness_mm, power_w, speed_mm_s, across_mm=across, along_mm=radius,
        absorptivity=absorptivity, start_c=start_c,
    )  # fmt: skip
    regime = REGIMES[int(table.regime)]
    flags = list(setting_flags(table, material, thickness_mm, across, absorptivity))
    return PassResult(
        angle_rad=float(table.angle_rad),
        regime=regime,
        valid=regime in ("tgm", "mixed") and float(table.angle_rad) <= LARGEST_PASS_RAD,
        fourier=float(table.fourier),
        threshold_w=float(table.threshold_w),
        peak_top_c=float(table.peak_top_c),
        peak_bottom_c=float(table.peak_bottom_c),
        half_passes=float(table.half_passes),
        flags=tuple(flags),
    )


def require_fold(result: PassResult) -> PassResult:
    """``result`` if it is a fold that the model can answer for.

    Raises:
        HeatingError: if the setting cuts, melts, does not yield, or lies outside the model.
    """
    if result.valid:
        return result
    reason = "; ".join(result.flags) or "the angle of one pass is outside the small-strain model"
    raise HeatingError(
        f"this setting does not fold in a way that the model knows ({result.regime}): {reason}"
    )


def setting_flags(
    table: PassTable, material: Material, thickness_mm: float, across_mm: float, absorptivity: float
) -> tuple[str, ...]:
    """What is doubtful about the one setting in ``table``, in words."""
    flags = []
    regime = REGIMES[int(table.regime)]
    solidus = material.constants.solidus_c
    if regime == "cuts":
        flags.append("this is a cut: the beam melts through; lower the power or raise the speed")
    elif regime == "melts":
        flags.append(
            f"the surface melts ({float(table.peak_top_c):.0f} °C, solidus {solidus:g} °C): the angle is not "
            "to be trusted; lower the power or raise the speed"
        )
    elif regime == "below yield":
        flags.append(
            f"below yield: {float(table.power_w):.3g} W do not strain the metal plastically "
            f"(from {float(table.threshold_w):.3g} W on): 0 degrees; raise the power"
        )
    elif regime in ("buckling", "upsetting"):
        flags.append(
            f"Fourier number {float(table.fourier):.2g} is over {LARGEST_FOURIER:g}: no gradient through the "
            "sheet, buckling or upsetting with a sign that is not known; raise the speed"
        )
    if float(table.angle_rad) > LARGEST_PASS_RAD:
        flags.append("more than 3 degrees in one pass: outside the small-strain model; lower the power")
    if across_mm / thickness_mm > LARGEST_WIDTH_RATIO:
        flags.append(f"the beam is {across_mm / thickness_mm:.2g} thicknesses wide: outside the fitted range")
    if absorptivity < SMALLEST_ABSORPTIVITY:
        flags.append(f"absorptivity {absorptivity:g}: bare metal reflects this light; coat it and calibrate")
    if not 0.04 <= thickness_mm <= 0.25:
        flags.append(f"thickness {thickness_mm:g} mm is outside the fitted 0.04 to 0.25 mm")
    if material.temper_name not in ("annealed", "t6"):
        flags.append(f"temper {material.temper_name}: the pass law was derived for annealed metal")
    return tuple(flags)


def soft_threshold(ratio: ArrayLike) -> NDArray[np.float64]:
    """Softplus of ``1 - 1 / ratio`` with ``ratio`` = power over power of first yield; 1 far above it."""
    x = (1.0 - 1.0 / np.asarray(ratio, dtype=np.float64)) / THRESHOLD_SOFTNESS
    soft: NDArray[np.float64] = np.logaddexp(0.0, x) / np.logaddexp(0.0, 1.0 / THRESHOLD_SOFTNESS)
    return soft


def start_factor(start_c: ArrayLike) -> NDArray[np.float64]:
    """Share of the angle that is left when the metal is at ``start_c`` °C before the pass."""
    factor: NDArray[np.float64] = 1.0 - START_LOSS_PER_K * np.maximum(np.asarray(start_c) - 20.0, 0.0)
    return factor
