"""Angle to passes: which setting folds a crease, how many passes it takes and when each may begin."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.cooling import AMBIENT_C, loss_time_s, pass_times
from twin.errors import HeatingError
from twin.heating import (
    LARGEST_PASS_RAD,
    LARGEST_WIDTH_RATIO,
    REGIMES,
    PassTable,
    fold_passes,
    setting_flags,
)
from twin.hot_metal import HotMetal
from twin.pass_law import FastLaw, HeatingModel, PassLaw

__all__ = ["MAX_PASSES", "Chain", "Conditions", "Objective", "Schedule", "SettingTable"]

Objective = Literal["joules", "seconds"]

MAX_PASSES = 3000
"""More passes on one crease are refused: the pass law was never seen there."""

DESIGN_PEAK_SHARE = 0.80
"""Share of the solidus (°C) that the lit face may reach: room for 25 % more absorption than assumed."""

WARM_PEAK_SHARE = 0.935
"""The same share for a pass that begins at the warmest temperature that is allowed."""

DESIGN_FOURIER = 1.0
"""Largest Fourier number that the search picks: the closed form is too kind to slower beams."""

THRESHOLD_RESERVE = 3.0
"""Least power over that of first yield: nearer to it, the angle hangs on the yield stress."""

_SPEED_STEPS, _SPEED_RATIO = 28, 1.15
_POWER_STEPS, _POWER_RATIO = 12, 1.08


@dataclass(frozen=True)
class Conditions:
    """What does not change from crease to crease with the same tilt and direction.

    Attributes:
        material: what the sheet is made of.
        thickness_mm: of the sheet.
        absorptivity: absorbed share of the light.
        across_mm: 1/e² beam radius across the crease.
        along_mm: the same along the crease.
        largest_w: power cap of the rig.
        largest_mm_s: fastest speed along the crease.
        allowed_c: highest mean temperature of a crease when a pass begins.
        shortest_wait_s: least dark time between two passes.
    """

    material: Material
    thickness_mm: float
    absorptivity: float
    across_mm: float
    along_mm: float
    largest_w: float
    largest_mm_s: float
    allowed_c: float
    shortest_wait_s: float

    @property
    def largest_peak_c(self) -> float:
        """Hottest peak of the lit face in a pass that begins on cold metal, °C."""
        solidus = self.material.constants.solidus_c
        return min(DESIGN_PEAK_SHARE * solidus, WARM_PEAK_SHARE * solidus - (self.allowed_c - AMBIENT_C))


@dataclass(frozen=True)
class Schedule:
    """Passes that fold a crease by a given angle.

    Attributes:
        power_w: laser power, lowered so that whole passes end at the wanted angle.
        increments_rad: angle of each pass, without sign.
        waits_s: dark time after each pass.
        short: the angle was too small for one pass with reserve over first yield.
        start_c: mean temperature of the crease when each pass begins.
    """

    power_w: float
    increments_rad: tuple[float, ...]
    waits_s: tuple[float, ...]
    short: bool = False
    start_c: tuple[float, ...] = ()


class Chain:
    """One setting, pass after pass: hardening, start temperatures and waits.

    Args:
        conditions: what the setting is used under.
        table: results of the settings.
        index: which of them.
        law: angles of its passes; those of the closed form if None.
    """

    def __init__(
        self, conditions: Conditions, table: PassTable, index: int, law: PassLaw | None = None
    ) -> None:
        self.conditions = conditions
        row = table.at(index)
        self.law = law or FastLaw(row, conditions.material.forming.fall_off)
        self.power_w = float(row.power_w)
        self.speed_mm_s = float(row.speed_mm_s)
        self.first_rad = self.law.first_rad
        self.threshold_w = float(row.threshold_w)
        self.fourier = float(row.fourier)
        self.peak_top_c = float(row.peak_top_c)
        self.peak_bottom_c = float(row.peak_bottom_c)
        self.half_passes = float(row.half_passes)
        self.regime = REGIMES[int(row.regime)]
        self.flags = setting_flags(
            row, conditions.material, conditions.thickness_mm, conditions.across_mm, conditions.absorptivity
        )
        self._intervals = np.zeros(0)
        self._start_c = np.zeros(0)

    def schedule(self, angle_rad: float, stroke_s: float, done: int = 0) -> Schedule:
        """Passes for a turn by ``angle_rad`` (without sign) after ``done`` earlier passes on the crease.

        The power of all passes is lowered alike, so that a whole number of them ends at the angle.

        Args:
            angle_rad: wanted change of the fold angle.
            stroke_s: duration of one stroke, which counts as cooling time.
            done: passes that the crease has seen.

        Raises:
            HeatingError: if more than ``MAX_PASSES`` would be needed.
        """
        if angle_rad <= 0.0:
            return Schedule(self.power_w, (), ())
        law = self._law(angle_rad, done)
        power = self.power_for(angle_rad / float(law.sum()))
        short = power < 2.0 * self.threshold_w
        if short:
            power = 2.0 * self.threshold_w
        increments = law * self.first_rad_at(power)
        waits = np.maximum(self._intervals[: len(law)] - stroke_s, self.conditions.shortest_wait_s)
        waits[-1] = 0.0
        rounded = np.round(np.ceil(waits * 1e3 - 1e-6) / 1e3, 3)
        start = np.round(self._start_c[: len(law)], 2)
        return Schedule(
            power, tuple(increments.tolist()), tuple(rounded.tolist()), short, tuple(start.tolist())
        )

    def factors(self, start_c: NDArray[np.float64], done: int = 0) -> NDArray[np.float64]:
        """(N,) angles of passes over that of the first one on cold metal, after ``done`` passes.

        Args:
            start_c: (N,) mean temperature of the crease when each begins.
            done: passes that the crease has seen.
        """
        return self.law.factors(start_c, done)

    def first_rad_at(self, power_w: float) -> float:
        """Angle of a first pass on cold metal at another power, rad."""
        return self.law.first_rad_at(power_w)

    def flags_after(self, passes: int) -> tuple[str, ...]:
        """What is doubtful when a crease gets so many passes, in words."""
        return (*self.flags, *self.law.flags_after(passes))

    def power_for(self, first_rad: float) -> float:
        """Least power, up to the setting's, at which a first pass on cold metal bends by ``first_rad``."""
        low, high = 0.0, self.power_w
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.first_rad_at(middle) >= first_rad else (middle, high)
        return high

    def _law(self, angle_rad: float, done: int) -> NDArray[np.float64]:
        """Factors of the passes that are needed at full power, the last one whole.

        The pass law goes on after ``done`` passes, the temperature starts anew: in between, other creases
        were folded and this one cooled.
        """
        wanted = angle_rad / self.first_rad * (1.0 - 1e-9)
        size = 64
        while True:
            count = min(size, MAX_PASSES)
            self._grow(count)
            factors = self.factors(self._start_c[:count], done)
            reached = np.cumsum(factors)
            if reached[-1] >= wanted:
                law: NDArray[np.float64] = factors[: int(np.searchsorted(reached, wanted)) + 1]
                return law
            if size >= MAX_PASSES:
                raise HeatingError(
                    f"{math.degrees(angle_rad):.1f} degrees need more than {MAX_PASSES} passes at "
                    f"{self.power_w:.3g} W and {self.speed_mm_s:.3g} mm/s: choose another material, "
                    "thickness or rig"
                )
            size *= 2

    def _grow(self, count: int) -> None:
        """Tabulate beginnings and start temperatures of ``count`` passes."""
        if len(self._intervals) >= count:
            return
        where = self.conditions
        line = where.absorptivity * self.power_w / self.speed_mm_s * 1e3
        times = pass_times(
            where.material, where.thickness_mm, line, count,
            allowed_c=where.allowed_c, shortest_s=where.shortest_wait_s,
        )  # fmt: skip
        self._intervals, self._start_c = times.interval_s, times.start_c


class SettingTable:
    """All settings under given conditions; the best one for an angle.

    Args:
        conditions: what the settings are used under.
        heating: where angles of passes come from; settings are chosen by the closed form in either case.

    Raises:
        HeatingError: if no setting folds, with the reason.
    """

    def __init__(self, conditions: Conditions, heating: HeatingModel = "fast") -> None:
        self.conditions, self.heating = conditions, heating
        speeds = conditions.largest_mm_s * _SPEED_RATIO ** -np.arange(_SPEED_STEPS)
        coarse = conditions.largest_w * 1.06 ** -np.arange(64.0)[::-1]
        limit = conditions.largest_peak_c
        peaks = self._passes(*np.meshgrid(coarse, speeds)).peak_top_c
        # The hottest allowed power of every speed, and weaker ones.
        hottest = [float(np.interp(limit, row, coarse)) for row in peaks]
        power = 0.995 * np.array(hottest)[:, None] * _POWER_RATIO ** -np.arange(_POWER_STEPS)
        table = self._passes(power, np.broadcast_to(speeds[:, None], power.shape))
        self.table = table.at(np.arange(power.size))
        self._usable = self._valid()
        self._chains: dict[int, Chain] = {}

    def best(self, angle_rad: float, length_mm: float, objective: Objective = "joules") -> Chain:
        """The setting that turns a crease by ``angle_rad`` for the least joules or seconds.

        Angles within a factor 1.25 share one setting, so that a job has few.
        """
        rungs = round(math.log(max(angle_rad, math.radians(5.0))) / math.log(1.25))
        angle = 1.25**rungs
        table, where = self.table, self.conditions
        usable = self._usable
        half, q = table.half_passes[usable], where.material.forming.fall_off
        passes = _passes_needed(angle / table.angle_rad[usable], half, q)
        line = table.power_w[usable] / table.speed_mm_s[usable]
        cost = passes * line
        if objective == "seconds":
            cost = _fold_seconds(where, passes, line) + passes * length_mm / table.speed_mm_s[usable]
        index = int(usable[np.argmin(cost)])
        if index not in self._chains:
            self._chains[index] = Chain(where, table, index, self._law(index))
        return self._chains[index]

    def _law(self, index: int) -> PassLaw | None:
        """The section model's answer for a setting; None for the closed form."""
        if self.heating == "fast":
            return None
        from twin.section_law import SectionLaw

        row = self.table.at(index)
        return SectionLaw(self.conditions, float(row.power_w), float(row.speed_mm_s))

    def _passes(self, power: NDArray[np.float64], speed: NDArray[np.float64]) -> PassTable:
        where = self.conditions
        return fold_passes(
            where.material, where.thickness_mm, power, speed, across_mm=where.across_mm,
            along_mm=where.along_mm, absorptivity=where.absorptivity,
        )  # fmt: skip

    def _valid(self) -> NDArray[np.int64]:
        """Settings that may be used."""
        table, where = self.table, self.conditions
        tests = {
            "the lit side gets too hot": table.peak_top_c <= where.largest_peak_c,
            "the beam would cut the sheet": table.regime != REGIMES.index("cuts"),
            f"heat spreads through the sheet too fast (Fourier number over {DESIGN_FOURIER:g})": (
                table.fourier <= DESIGN_FOURIER
            ),
            "the power is too near that of first yield": (
                table.power_w >= THRESHOLD_RESERVE * table.threshold_w
            ),
            "one pass bends too far": table.angle_rad <= LARGEST_PASS_RAD,
            "one pass bends less than 0.02 degrees": table.angle_rad >= math.radians(0.02),
        }
        passed = np.array(list(tests.values()))
        usable = np.flatnonzero(passed.all(axis=0))
        ratio = where.across_mm / where.thickness_mm
        if len(usable) and ratio <= LARGEST_WIDTH_RATIO:
            return usable
        if ratio > LARGEST_WIDTH_RATIO:
            reason = f"the beam is {ratio:.2g} thicknesses wide, the model ends at {LARGEST_WIDTH_RATIO:g}"
        else:
            nearest = int(np.lexsort((table.fourier, -passed.sum(axis=0)))[0])
            why = " and ".join(text for text, good in zip(tests, passed[:, nearest], strict=True) if not good)
            reason = f"even at {table.power_w[nearest]:.3g} W and {table.speed_mm_s[nearest]:.3g} mm/s {why}"
        raise HeatingError(
            f"no setting folds {where.material.name} {where.material.temper_name} of {where.thickness_mm:g} "
            f"mm with at most {where.largest_w:.3g} W and {where.largest_mm_s:.3g} mm/s (absorptivity "
            f"{where.absorptivity:g}): {reason}: choose another rig, material or thickness"
        )


def _passes_needed(ratio: NDArray[np.float64], half: NDArray[np.float64], q: float) -> NDArray[np.float64]:
    """Passes for an angle of ``ratio`` first passes: the integral of the pass law, inverted."""
    with np.errstate(over="ignore", invalid="ignore"):
        if abs(q - 1.0) < 1e-9:
            return np.asarray(half * np.expm1(np.minimum(ratio / half, 700.0)))
        inner = 1.0 + ratio * (1.0 - q) / half
        return np.asarray(np.where(inner > 0.0, half * (inner ** (1.0 / (1.0 - q)) - 1.0), np.inf))


def _fold_seconds(
    where: Conditions, passes: NDArray[np.float64], line_j_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Least time in which the heat of all passes leaves a crease held at ``allowed_c``.

    Constant temperature on a line that feeds a plate: ``t = (pi / (4 a)) (Q' / (rho c h dT))²``, and where
    the sheet loses heat, ``t = Q' / (2 dT k h sqrt(1 / (a tau)))``; the smaller counts.
    """
    metal = HotMetal.at(where.material, 100.0)
    heat = passes * where.absorptivity * line_j_mm * 1e3
    rise = where.allowed_c - 20.0
    h = 1e-3 * where.thickness_mm
    spread = math.pi / (4.0 * metal.diffusivity) * (heat / (metal.heat_capacity * h * rise)) ** 2
    tau = loss_time_s(where.material, where.thickness_mm)
    lost = heat / (2.0 * rise * metal.conductivity * h / math.sqrt(metal.diffusivity * tau))
    return np.asarray(np.minimum(spread, lost) + passes * where.shortest_wait_s)
