"""Kernel of the layered section: plane-stress plasticity at every layer, equilibrium at every station.

One file on purpose: numba notices a change of the file in which a compiled function stands, and of no other.
SI units. ``y`` runs across the crease, ``x`` along it; layers lie at ``zeta`` above the middle, the laser
side positive.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner._kernels.compiled import entry, inner

__all__ = ["fold_section"]

_NEWTON_STEPS = 40
_DAMPED_AFTER = 12
_MOST_HALVINGS = 7
_TOLERANCE_PA = 1e3
"""Largest stress that may stay out of balance, averaged over the thickness."""

_YOUNG, _YIELD, _LEAD, _HARDENING, _STRAIN, _ANNEALED = 0, 1, 2, 3, 4, 5
"""Rows of the property table: E, yield stress of annealed metal, lead of the temper over it, saturation stress
of the hardening, thermal strain, and 1 where metal anneals at once."""


@inner
def _layer(  # type: ignore[no-untyped-def]
    across, plastic_x, plastic_y, hardening, cold, young, annealed_yield, lead, saturation, strain, poisson, rate,
):  # fmt: skip
    """Stress across the crease, its tangent, and the new plastic strains and hardening of one layer.

    Closest-point return in the plane-stress eigenbasis (Simo and Hughes, Computational Inelasticity, 1998,
    sect. 3.4); the strain along the crease is 0.
    """
    root = math.sqrt(0.5)
    ex, ey = -plastic_x - strain, across - plastic_y - strain
    ka, kb = young / (1.0 - poisson), young / (1.0 + poisson)
    a_trial, b_trial = ka * (ex + ey) * root, kb * (ex - ey) * root
    equivalent = math.sqrt(0.5 * a_trial * a_trial + 1.5 * b_trial * b_trial)
    fade = math.exp(-rate * hardening)
    limit = annealed_yield + lead * cold + saturation * (1.0 - fade)
    if equivalent <= limit:
        tangent = young / (1.0 - poisson * poisson)
        return (a_trial - b_trial) * root, tangent, plastic_x, plastic_y, hardening
    ca, cb = ka / 3.0, kb
    gamma, slope, hard, p = 0.0, 1.0, 0.0, hardening
    a, b = a_trial, b_trial
    for _ in range(60):
        da, db = 1.0 + ca * gamma, 1.0 + cb * gamma
        a, b = a_trial / da, b_trial / db
        equivalent = math.sqrt(0.5 * a * a + 1.5 * b * b)
        p = hardening + gamma * equivalent / 1.5
        fade = math.exp(-rate * p)
        limit = annealed_yield + lead * cold + saturation * (1.0 - fade)
        hard = saturation * rate * fade
        fall = -(a * a * ca / da + 3.0 * b * b * cb / db) / (2.0 * equivalent)
        slope = fall - hard / 1.5 * (equivalent + gamma * fall)
        excess = equivalent - limit
        if abs(excess) <= 1e-9 * (limit + 1.0):
            break
        gamma -= excess / slope
    da, db = 1.0 + ca * gamma, 1.0 + cb * gamma
    a1, b1 = ka * root, -kb * root
    direct = (a * a1 / da + 3.0 * b * b1 / db) / (2.0 * equivalent)
    gamma_rate = -direct * (1.0 - hard / 1.5 * gamma) / slope
    tangent = ((a1 - a * ca * gamma_rate) / da - (b1 - b * cb * gamma_rate) / db) * root
    flow_a, flow_b = gamma * a / 3.0, gamma * b
    return (
        (a - b) * root, tangent, plastic_x + (flow_a + flow_b) * root, plastic_y + (flow_a - flow_b) * root, p,
    )  # fmt: skip


@inner
def _properties(temperature, first, step, table, out):  # type: ignore[no-untyped-def]
    """Rows of ``table`` at the temperatures of all stations and layers, linear between its columns."""
    rows, columns = table.shape
    for i in range(temperature.shape[0]):
        for j in range(temperature.shape[1]):
            place = (temperature[i, j] - first) / step
            place = min(max(place, 0.0), columns - 1.000001)
            left = int(place)
            share = place - left
            for r in range(rows):
                out[r, i, j] = table[r, left] * (1.0 - share) + table[r, left + 1] * share


@inner
def _balance(  # type: ignore[no-untyped-def]
    mid, bend, plastic, here, widths, zeta, depth, poisson, rate, spring_n, spring_m, rest, moment, trial,
):  # fmt: skip
    """Newton iteration for the middle strains and curvatures of all stations; True if it converged."""
    stations, layers = here.shape[1], here.shape[2]
    thickness = 0.0
    for j in range(layers):
        thickness += depth[j]
    gap = np.empty((stations, 2))
    inverse = np.empty((stations, 3))
    for step in range(_NEWTON_STEPS):
        extension, angle = 0.0, 0.0
        for i in range(stations):
            extension += widths[i] * mid[i]
            angle += widths[i] * bend[i]
        force = -spring_n * (extension - rest[0])
        torque = moment - spring_m * (angle - rest[1])
        worst = 0.0
        s11, s12, s22, d1, d2 = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(stations):
            n, m, k11, k12, k22 = 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(layers):
                stress, tangent, px, py, p = _layer(
                    mid[i] + bend[i] * zeta[j], plastic[0, i, j], plastic[1, i, j], plastic[2, i, j],
                    plastic[3, i, j], here[_YOUNG, i, j], here[_YIELD, i, j], here[_LEAD, i, j],
                    here[_HARDENING, i, j], here[_STRAIN, i, j], poisson, rate,
                )  # fmt: skip
                trial[0, i, j], trial[1, i, j], trial[2, i, j] = px, py, p
                n += depth[j] * stress
                m += depth[j] * zeta[j] * stress
                k11 += depth[j] * tangent
                k12 += depth[j] * zeta[j] * tangent
                k22 += depth[j] * zeta[j] * zeta[j] * tangent
            gap[i, 0], gap[i, 1] = force - n, torque - m
            off = max(abs(gap[i, 0]) / thickness, 6.0 * abs(gap[i, 1]) / thickness**2)
            if not math.isfinite(gap[i, 0] + gap[i, 1]):
                return False
            worst = max(worst, off)
            determinant = k11 * k22 - k12 * k12
            i11, i12, i22 = k22 / determinant, -k12 / determinant, k11 / determinant
            inverse[i, 0], inverse[i, 1], inverse[i, 2] = i11, i12, i22
            w = widths[i]
            s11 += w * i11
            s12 += w * i12
            s22 += w * i22
            d1 += w * (i11 * gap[i, 0] + i12 * gap[i, 1])
            d2 += w * (i12 * gap[i, 0] + i22 * gap[i, 1])
        if worst < _TOLERANCE_PA:
            return True
        # change of force and torque: (1 + K S) dF = -K d
        a11, a12 = 1.0 + spring_n * s11, spring_n * s12
        a21, a22 = spring_m * s12, 1.0 + spring_m * s22
        determinant = a11 * a22 - a12 * a21
        r1, r2 = -spring_n * d1, -spring_m * d2
        force_change = (r1 * a22 - a12 * r2) / determinant
        torque_change = (a11 * r2 - a21 * r1) / determinant
        pace = 1.0 if step < _DAMPED_AFTER else 0.5
        for i in range(stations):
            g1, g2 = gap[i, 0] + force_change, gap[i, 1] + torque_change
            mid[i] += pace * (inverse[i, 0] * g1 + inverse[i, 1] * g2)
            bend[i] += pace * (inverse[i, 1] * g1 + inverse[i, 2] * g2)
    return False


@entry
def fold_section(
    temperature: NDArray[np.float64],
    springs: NDArray[np.float64],
    start_c: float,
    first_c: float,
    step_c: float,
    table: NDArray[np.float64],
    widths: NDArray[np.float64],
    zeta: NDArray[np.float64],
    depth: NDArray[np.float64],
    poisson: float,
    rate: float,
    moment: float,
    plastic: NDArray[np.float64],
    history: NDArray[np.float64],
) -> Any:
    """Angle of a section through passes that all have the same temperatures.

    Args:
        temperature: (T, S, Z) of every time, station and layer, °C.
        springs: (T, 2) stiffness against extension, N/m per m, and against bending, N, of every time.
        start_c: temperature before and after each pass.
        first_c: temperature of the first column of ``table``.
        step_c: temperature from column to column.
        table: (6, C) properties, see the rows above.
        widths: (S,) quadrature over the stations of the whole section, m.
        zeta: (Z,) places of the layers, m.
        depth: (Z,) quadrature over the layers, m.
        poisson: Poisson's ratio.
        rate: of the hardening, per plastic strain.
        moment: that the hinge carries, N m per m, positive bends away from the laser.
        plastic: (4, S, Z) plastic strain along and across, hardening strain, share of the cold work that is
            left; changed in place.
        history: (P, T + 1) angle during and after each pass, rad, towards the laser; filled.

    Returns:
        How many time steps did not converge even in the smallest parts (0: all is well).
    """
    times, stations, layers = temperature.shape
    passes = history.shape[0]
    mid, bend = np.zeros(stations), np.zeros(stations)
    kept_mid, kept_bend = np.zeros(stations), np.zeros(stations)
    here = np.empty((table.shape[0], stations, layers))
    trial = np.empty((3, stations, layers))
    cold = np.full((stations, layers), start_c)
    before = np.empty((stations, layers))
    now = np.empty((stations, layers))
    rest = np.zeros(2)
    failures = 0
    _properties(cold, first_c, step_c, table, here)
    if not _balance(
        mid, bend, plastic, here, widths, zeta, depth, poisson, rate, 0.0, 0.0, rest, moment, trial
    ):
        failures += 1
    for turn in range(passes):
        rest[0], rest[1] = 0.0, 0.0
        for i in range(stations):
            rest[0] += widths[i] * mid[i]
            rest[1] += widths[i] * bend[i]
        before[:] = cold
        spring_before_n, spring_before_m = springs[0, 0], springs[0, 1]
        for k in range(times + 1):
            last = k == times
            target_n = 0.0 if last else springs[k, 0]
            target_m = 0.0 if last else springs[k, 1]
            done, part, halvings = 0.0, 1.0, 0
            while done < 1.0 - 1e-12:
                share = min(done + part, 1.0)
                for i in range(stations):
                    kept_mid[i], kept_bend[i] = mid[i], bend[i]
                    for j in range(layers):
                        target = start_c if last else temperature[k, i, j]
                        now[i, j] = before[i, j] + share * (target - before[i, j])
                _properties(now, first_c, step_c, table, here)
                for i in range(stations):
                    for j in range(layers):
                        if here[_ANNEALED, i, j] > 0.5:
                            plastic[2, i, j], plastic[3, i, j] = 0.0, 0.0
                spring_n = spring_before_n + share * (target_n - spring_before_n)
                spring_m = spring_before_m + share * (target_m - spring_before_m)
                good = _balance(
                    mid, bend, plastic, here, widths, zeta, depth, poisson, rate, spring_n, spring_m, rest,
                    moment, trial,
                )  # fmt: skip
                if not good and halvings < _MOST_HALVINGS:
                    halvings += 1
                    part *= 0.5
                    for i in range(stations):
                        mid[i], bend[i] = kept_mid[i], kept_bend[i]
                    continue
                if not good:
                    failures += 1
                    for i in range(stations):
                        if not (math.isfinite(mid[i]) and math.isfinite(bend[i])):
                            mid[i], bend[i] = kept_mid[i], kept_bend[i]
                for i in range(stations):
                    for j in range(layers):
                        for r in range(3):
                            if math.isfinite(trial[r, i, j]):
                                plastic[r, i, j] = trial[r, i, j]
                done = share
            before[:] = temperature[k] if not last else cold
            spring_before_n, spring_before_m = target_n, target_m
            angle = 0.0
            for i in range(stations):
                angle += widths[i] * bend[i]
            history[turn, k] = rest[1] - angle
    return failures
