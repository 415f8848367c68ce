"""How long a crease must rest between passes: superposed line sources in a plate that loses heat."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.errors import HeatingError
from twin.hot_metal import HotMetal

__all__ = ["CONVECTION_W_M2K", "PassTimes", "crease_rise", "loss_time_s", "pass_times"]

CONVECTION_W_M2K = 10.0
"""Natural convection per face. Grade C: usual for small horizontal plates in still air."""

STEFAN_BOLTZMANN = 5.670374e-8
AMBIENT_C = 20.0


@dataclass(frozen=True, eq=False)
class PassTimes:
    """When the passes along one crease begin.

    Attributes:
        interval_s: (N,) time from the beginning of each pass to the beginning of the next.
        start_c: (N,) mean temperature of the crease when each pass begins.
    """

    interval_s: NDArray[np.float64]
    start_c: NDArray[np.float64]


def loss_time_s(material: Material, thickness_mm: float, mean_c: float = 80.0) -> float:
    """Time constant of heat loss of a sheet through both faces, s: rho c h / (2 (h_c + h_r))."""
    metal = HotMetal.at(material, mean_c)
    mean_k = 0.5 * (mean_c + AMBIENT_C) + 273.15
    radiation = 4.0 * material.constants.emissivity * STEFAN_BOLTZMANN * mean_k**3
    return metal.heat_capacity * 1e-3 * thickness_mm / (2.0 * (CONVECTION_W_M2K + radiation))


def crease_rise(
    after_s: NDArray[np.float64], line_j_m: float, thickness_mm: float, material: Material
) -> NDArray[np.float64]:
    """Mean temperature rise on a crease ``after_s`` seconds after a pass of ``line_j_m`` absorbed J/m.

    Instant line source in a plate: ``Q' / (rho c h sqrt(4 pi a t)) exp(-t / tau)``. Source: Carslaw and
    Jaeger, Conduction of Heat in Solids, 1959, §10.3.
    """
    metal = HotMetal.at(material, 100.0)
    spread = np.sqrt(4.0 * math.pi * metal.diffusivity * after_s)
    rise: NDArray[np.float64] = (
        line_j_m
        / (metal.heat_capacity * 1e-3 * thickness_mm * spread)
        * np.exp(-after_s / loss_time_s(material, thickness_mm))
    )
    return rise


def pass_times(
    material: Material,
    thickness_mm: float,
    line_j_m: float,
    count: int,
    *,
    allowed_c: float,
    shortest_s: float,
) -> PassTimes:
    """The earliest beginnings of ``count`` passes so that each finds the crease at ``allowed_c`` or colder.

    Args:
        material: what the sheet is made of.
        thickness_mm: of the sheet.
        line_j_m: absorbed energy per metre of one pass.
        count: number of passes.
        allowed_c: highest mean temperature of the crease when a pass begins.
        shortest_s: shortest interval, > 0.

    Raises:
        HeatingError: if ``allowed_c`` is not above the ambient temperature.
    """
    allowed = allowed_c - AMBIENT_C
    if not allowed > 0.0:
        raise HeatingError(
            f"allowed start temperature {allowed_c:g} °C must be above ambient ({AMBIENT_C:g} °C)"
        )
    tau = loss_time_s(material, thickness_mm)
    scale = float(crease_rise(np.ones(1), line_j_m, thickness_mm, material)[0]) * math.exp(1.0 / tau)
    memory = 7.0 * tau
    begun = np.zeros(count)
    start = np.full(count, AMBIENT_C)
    intervals = np.full(count, shortest_s)
    steady = 0
    oldest = 0
    for n in range(1, count):
        while begun[n - 1] - begun[oldest] > memory:
            oldest += 1
        ages = begun[n - 1] - begun[oldest:n]
        wait, rise = _rest(ages, scale, tau, allowed, shortest_s, float(intervals[n - 2]) if n > 1 else 0.0)
        begun[n] = begun[n - 1] + wait
        start[n] = AMBIENT_C + rise
        intervals[n - 1] = wait
        steady = steady + 1 if n > 1 and wait <= intervals[n - 2] * 1.001 else 0
        if steady >= 5 and begun[n] > memory:  # what is added is what is lost: the rest is the same
            intervals[n:] = intervals[n - 1]
            start[n + 1 :] = start[n]
            break
    else:
        intervals[count - 1 :] = intervals[count - 2] if count > 1 else shortest_s
    return PassTimes(intervals, start)


def _rest(
    ages: NDArray[np.float64], scale: float, tau: float, allowed: float, shortest: float, guess: float
) -> tuple[float, float]:
    """Shortest wait in whole ms after which the rise is at most ``allowed``, and the rise then.

    The rise falls and is convex, so Newton's method climbs to the root from below and never passes it.
    """

    def rise_and_slope(wait: float) -> tuple[float, float]:
        after = ages + wait
        parts = scale * np.exp(-after / tau) / np.sqrt(after)
        return float(parts.sum()), -float((parts * (0.5 / after + 1.0 / tau)).sum())

    wait = shortest
    rise, slope = rise_and_slope(wait)
    if rise <= allowed:
        return wait, rise
    if guess > shortest:
        there = rise_and_slope(guess)
        if there[0] > allowed:
            wait, (rise, slope) = guess, there
    for _ in range(50):
        step = (allowed - rise) / slope
        wait += step
        if step < 1e-5:
            break
        rise, slope = rise_and_slope(wait)
    wait = math.ceil(wait * 1000.0 + 0.01) / 1000.0
    return wait, rise_and_slope(wait)[0]
