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
    memory = 7.0 * loss_time_s(material, thickness_mm)
    begun = np.zeros(count)
    start = np.full(count, AMBIENT_C)
    intervals = np.full(count, shortest_s)
    steady = 0
    oldest = 0
    for n in range(1, count):
        while begun[n - 1] - begun[oldest] > memory:
            oldest += 1
        ages = begun[n - 1] - begun[oldest:n]

        def rise(wait: float, ages: NDArray[np.float64] = ages) -> float:
            return float(np.sum(crease_rise(ages + wait, line_j_m, thickness_mm, material)))

        wait = shortest_s
        if rise(wait) > allowed:
            low, high = wait, 2.0 * wait
            while rise(high) > allowed:
                low, high = high, 2.0 * high
            for _ in range(12):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if rise(middle) > allowed else (low, middle)
            wait = high
        wait = math.ceil(wait * 1000.0) / 1000.0
        begun[n] = begun[n - 1] + wait
        start[n] = AMBIENT_C + rise(wait)
        intervals[n - 1] = wait
        steady = steady + 1 if n > 1 and wait <= intervals[n - 2] * 1.001 else 0
        if steady >= 5 and begun[n] > memory:  # what is added is what is lost: the rest is the same
            intervals[n:] = intervals[n - 1]
            start[n + 1 :] = start[n]
            break
    else:
        intervals[count - 1 :] = intervals[count - 2] if count > 1 else shortest_s
    return PassTimes(intervals, start)
