"""Layered elasto-plastic section of a crease under a moving laser spot: the slow heating model.

The section across the crease is cut into stations and layers. The temperature of each follows from the
Green's function of the moving spot; each layer yields in plane stress (J2, temperature-dependent yield
stress, Voce hardening that is lost above the anneal temperature); stretch and curvature of each station
follow from the balance of force and moment; and the cold sheet around the spot holds the hot section back
through two springs of stiffness ``beta E h / L`` and ``beta E h³ / 12 L`` with ``L = w + v |t|``. See
docs/heating.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.errors import SettingError
from twin.heating import PassResult, bend
from twin.hot_metal import mean_properties, peak_temperatures, spot_rises
from twin.moving_spot import cross_section_rise
from twin.section_grid import Resolution, section_grid

__all__ = [
    "HARDENING_MPA", "HARDENING_RATE", "MODEL_NAME", "RESTRAINT", "SectionCase", "SectionResult",
    "section_bend", "section_passes",
]  # fmt: skip

MODEL_NAME = "section/1"

RESTRAINT = 0.35
"""Constraint constant beta of the cold sheet around the spot, from 3-D finite elements (grade C)."""

HARDENING_MPA, HARDENING_RATE = 200.0, 10.0
"""Voce hardening ``Q (1 - exp(-b p))`` of cold annealed metal; Q shrinks with the yield stress (grade C)."""

_TABLE_STEP_C = 2.0
_LEAST_YIELD = 0.1
"""A soft temper keeps at least this share of the yield stress of the table."""


@dataclass(frozen=True)
class SectionCase:
    """One setting on one sheet.

    Attributes:
        material: what the sheet is made of, in the temper that is used.
        thickness_mm: of the sheet.
        power_w: laser power.
        speed_mm_s: speed along the crease.
        spot_mm: 1/e² diameter of the beam where it meets the metal, measured across the beam.
        absorptivity: absorbed share of the light; that of the material near 1.06 µm when None.
        start_c: temperature before each pass.
        tilt_rad: angle between beam and sheet normal, the beam leaning across the crease.
        moment_n: moment per length of crease that the hinge carries, N mm/mm, positive away from the laser
            (such as the weight of the part below a crease that is lit from above).
        restraint: constraint constant beta; 0 is a free strip.
        hardening_mpa: saturation stress Q of the hardening.
        along_mm: length of the crease, for the angle of the flange over time.
    """

    material: Material
    thickness_mm: float
    power_w: float
    speed_mm_s: float
    spot_mm: float
    absorptivity: float | None = None
    start_c: float = 20.0
    tilt_rad: float = 0.0
    moment_n: float = 0.0
    restraint: float = RESTRAINT
    hardening_mpa: float = HARDENING_MPA
    along_mm: float = 10.0

    @property
    def absorbed_share(self) -> float:
        """Absorptivity that is used."""
        given = self.absorptivity
        return self.material.absorptivity.at_1064nm if given is None else given


@dataclass(frozen=True, eq=False)
class SectionResult:
    """What the passes of one setting do.

    Attributes:
        angle_rad: (P,) bend of each pass towards the laser.
        time_s: (T + 1,) times of one pass, 0 when the beam is at the section; at the last all is cold again.
        local_rad: (P, T + 1) angle of the section during each pass, since that pass began.
        flange_time_s: (F,) times since the beam entered the crease.
        flange_rad: (F,) angle of the rigid flange during the first pass: the mean over the crease.
        peak_top_c: hottest temperature of the lit face.
        peak_bottom_c: hottest temperature of the other face.
        hardening: largest plastic strain that still hardens after the last pass.
        converged: every time step found its balance.
        valid: the angles may be used.
        fast: what the fast model says of the same setting: regime, threshold and flags.
        flags: what is doubtful or wrong, in words.
    """

    angle_rad: NDArray[np.float64]
    time_s: NDArray[np.float64]
    local_rad: NDArray[np.float64]
    flange_time_s: NDArray[np.float64]
    flange_rad: NDArray[np.float64]
    peak_top_c: float
    peak_bottom_c: float
    hardening: float
    converged: bool
    valid: bool
    fast: PassResult
    flags: tuple[str, ...] = field(default=())


def section_bend(
    material: Material,
    thickness_mm: float,
    power_w: float,
    speed_mm_s: float,
    spot_mm: float,
    *,
    absorptivity: float | None = None,
    start_c: float = 20.0,
    tilt_rad: float = 0.0,
    moment_n: float = 0.0,
    passes: int = 1,
    restraint: float = RESTRAINT,
    hardening_mpa: float = HARDENING_MPA,
    along_mm: float = 10.0,
    resolution: Resolution | None = None,
) -> SectionResult:
    """Angle of each of ``passes`` equal passes; the arguments are those of ``SectionCase``.

    Raises:
        SettingError: if a value is not finite or out of range.
    """
    case = SectionCase(
        material, thickness_mm, power_w, speed_mm_s, spot_mm, absorptivity, start_c, tilt_rad, moment_n,
        restraint, hardening_mpa, along_mm,
    )  # fmt: skip
    return section_passes([case], passes, resolution)[0]


def section_passes(
    cases: Sequence[SectionCase], passes: int = 1, resolution: Resolution | None = None
) -> tuple[SectionResult, ...]:
    """Results of many settings, ``passes`` equal passes each, cooled to the start temperature in between.

    Args:
        cases: settings.
        passes: how many, at least 1.
        resolution: how finely; the usual one when None.

    Raises:
        SettingError: if a value is not finite or out of range.
    """
    if passes < 1:
        raise SettingError(f"expected at least one pass, got {passes}")
    return tuple(_fold(case, passes, resolution or Resolution()) for case in cases)


def _fold(case: SectionCase, passes: int, resolution: Resolution) -> SectionResult:
    from twin.section_kernel import fold_section

    for name, value, low, high in (
        ("restraint", case.restraint, 0.0, 1.0), ("hardening", case.hardening_mpa, 0.0, math.inf),
        ("moment", case.moment_n, -math.inf, math.inf),
        ("length of the crease", case.along_mm, 0.0, math.inf),
    ):  # fmt: skip
        if not (math.isfinite(value) and low <= value <= high):
            raise SettingError(
                f"{name} of a section must be finite and from {low:g} to {high:g}, got {value:g}"
            )
    if resolution.stations < 2 or resolution.layers < 2 or resolution.times < 10:
        raise SettingError(f"too coarse for a section: {resolution}")
    share = case.absorbed_share
    fast = bend(
        case.material, case.thickness_mm, case.power_w, case.speed_mm_s, spot_mm=case.spot_mm,
        absorptivity=share, tilt_rad=case.tilt_rad, start_c=case.start_c,
    )  # fmt: skip
    metal = case.material
    h, v, along = 1e-3 * case.thickness_mm, 1e-3 * case.speed_mm_s, 0.5e-3 * case.spot_mm
    across = along / math.cos(case.tilt_rad)
    absorbed = share * case.power_w
    capacity, conductivity = _heating_means(case, h, v, along, across, absorbed)
    grid = section_grid(h, across, along, v, conductivity / capacity, resolution)
    rise = cross_section_rise(
        grid.times, grid.places, 0.5 * h - grid.zeta, speed=v, thickness=h, along=along, across=across,
        diffusivity=conductivity / capacity, heat_capacity=capacity,
    )  # fmt: skip
    young = metal.young_pa
    held = along + v * np.abs(grid.times)
    springs = case.restraint * young * np.stack([h / held, h**3 / (12.0 * held)], axis=-1)
    first, table = _property_table(case)
    plastic = np.zeros((4, *rise.shape[1:]))
    plastic[3] = 1.0
    history = np.zeros((passes, len(grid.times) + 1))
    failures = fold_section(
        case.start_c + absorbed * rise, springs, float(case.start_c), float(first), _TABLE_STEP_C, table,
        grid.widths, grid.zeta, grid.depth, metal.poisson, HARDENING_RATE, float(case.moment_n),
        plastic, history,
    )  # fmt: skip
    angle = history[:, -1].copy()
    flags = list(fast.flags)
    if failures:
        flags.append(
            f"{failures} of {history.size} time steps did not find their balance: the angle is not to be "
            "trusted; take another power or speed"
        )
    times = np.append(grid.times, grid.times[-1] + (grid.times[-1] - grid.times[-2]))
    flange_time, flange = _flange(times, history[0], 1e-3 * case.along_mm, v)
    return SectionResult(
        angle_rad=angle,
        time_s=times,
        local_rad=history,
        flange_time_s=flange_time,
        flange_rad=flange,
        peak_top_c=fast.peak_top_c,
        peak_bottom_c=fast.peak_bottom_c,
        hardening=float(plastic[2].max()),
        converged=failures == 0,
        valid=fast.regime in ("tgm", "mixed") and failures == 0 and bool(np.all(np.abs(angle) < 0.0524)),
        fast=fast,
        flags=tuple(flags),
    )


def _heating_means(
    case: SectionCase, h: float, v: float, along: float, across: float, absorbed: float
) -> tuple[float, float]:
    """Heat capacity per volume and conductivity, means between start and peak of the lit face."""
    rises = spot_rises(case.material, np.array([v]), h, along, across)
    top, _ = peak_temperatures(case.material, rises, np.array([absorbed]), case.start_c)
    peak = np.minimum(top, case.material.constants.solidus_c)
    capacity, conductivity = mean_properties(case.material, np.array([case.start_c]), peak)
    return float(capacity[0]), float(conductivity[0])


def _property_table(case: SectionCase) -> tuple[float, NDArray[np.float64]]:
    """First temperature and the rows that the kernel reads; beyond the ends their values hold."""
    metal = case.material
    x = np.asarray(metal.table.temperature_c)
    first = min(float(x[0]), case.start_c, 20.0)
    t = np.arange(first, float(x[-1]) + _TABLE_STEP_C, _TABLE_STEP_C)
    young, annealed, expansion = (
        np.interp(t, x, np.asarray(column))
        for column in (metal.table.young_gpa, metal.table.yield_mpa, metal.table.expansion_1e6_k)
    )
    anneal = metal.constants.anneal_c
    cold = 1e-6 * metal.yield_pa - metal.value("yield_mpa", 20.0)
    fade = np.clip((anneal - t) / (anneal - 20.0), 0.0, 1.0)
    lead = np.maximum(cold * fade, (_LEAST_YIELD - 1.0) * annealed)
    saturation = np.where(t < anneal, case.hardening_mpa * annealed / metal.value("yield_mpa", 20.0), 0.0)
    strain = 1e-6 * expansion * (t - 20.0)
    start = 1e-6 * metal.value("expansion_1e6_k", case.start_c) * (case.start_c - 20.0)
    hot = (t >= anneal).astype(np.float64)
    rows = np.stack([1e9 * young, 1e6 * annealed, 1e6 * lead, 1e6 * saturation, strain - start, hot])
    return first, rows


def _flange(
    times: NDArray[np.float64], local: NDArray[np.float64], length: float, speed: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times and angles of a rigid flange: the mean of the sections that the beam passes in turn."""
    crossing = length / speed
    at = np.linspace(times[0], times[-1] + crossing, 200)
    # mean over the crease = difference of the integral of the local angle over the time of crossing
    area = np.concatenate([[0.0], np.cumsum(0.5 * (local[1:] + local[:-1]) * np.diff(times))])

    def integral(t: NDArray[np.float64]) -> NDArray[np.float64]:
        whole: NDArray[np.float64] = np.interp(t, times, area) + np.maximum(t - times[-1], 0.0) * local[-1]
        return whole

    mean: NDArray[np.float64] = (integral(at) - integral(at - crossing)) / crossing
    return at, mean
