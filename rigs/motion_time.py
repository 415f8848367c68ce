"""How long moves take: acceleration limits as GRBL's planner applies them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["JUNCTION_MM", "line_seconds", "line_time_at", "polyline_seconds"]

JUNCTION_MM = 0.01
"""Junction deviation ($11), GRBL's default: how much a corner may be rounded in the speed rule."""


def line_seconds(length: float, speed: float, accel: float) -> float:
    """Duration of a straight move from rest to rest: trapezoid or triangle of speed.

    Args:
        length: mm (or degrees).
        speed: nominal speed per second, > 0.
        accel: acceleration per second squared, > 0.
    """
    if length >= speed * speed / accel:
        return length / speed + speed / accel
    return 2.0 * math.sqrt(max(length, 0.0) / accel)


def line_time_at(place: float, length: float, speed: float, accel: float) -> float:
    """Time at which a straight move of ``length`` from rest to rest has gone ``place``."""
    place = min(max(place, 0.0), length)
    peak = min(speed, math.sqrt(accel * max(length, 0.0)))
    if peak <= 0.0:
        return 0.0
    ramp = peak * peak / (2.0 * accel)
    if place <= ramp:
        return math.sqrt(2.0 * place / accel)
    if place <= length - ramp:
        return peak / accel + (place - ramp) / peak
    return line_seconds(length, speed, accel) - math.sqrt(2.0 * (length - place) / accel)


def polyline_seconds(
    points: NDArray[np.float64],
    speed: float,
    accel: NDArray[np.float64],
    *,
    junction: float = JUNCTION_MM,
) -> float:
    """Duration of a polyline from rest to rest with GRBL's corner speeds.

    The corner speed is sqrt(a d s / (1 - s)) with d the junction deviation and s the sine of half the angle
    between the segments; a backward and a forward sweep then keep every segment within its acceleration.
    Source: GRBL 1.1, planner.c.

    Args:
        points: (N, 3) in mm.
        speed: nominal speed, mm/s.
        accel: (3,) acceleration of the axes, mm/s².
        junction: junction deviation, mm.
    """
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    keep = lengths > 1e-9
    steps, lengths = steps[keep], lengths[keep]
    if len(lengths) == 0:
        return 0.0
    units = steps / lengths[:, None]
    limit = _along(units, accel)
    top = np.full(len(lengths), speed)
    entry = np.zeros(len(lengths) + 1)
    if len(lengths) > 1:
        cosine = -np.einsum("ij,ij->i", units[:-1], units[1:])
        middle = units[1:] - units[:-1]
        norm = np.linalg.norm(middle, axis=1)
        a = _along(middle / np.maximum(norm, 1e-12)[:, None], accel)
        half = np.sqrt(np.clip(0.5 * (1.0 - cosine), 0.0, 1.0))
        straight = cosine < -0.999999
        with np.errstate(divide="ignore"):
            corner = np.sqrt(a * junction * half / np.maximum(1.0 - half, 1e-12))
        corner[straight] = np.inf
        corner[cosine > 0.999999] = 0.0
        entry[1:-1] = np.minimum(corner, speed)
    for i in range(len(lengths) - 1, -1, -1):
        entry[i] = min(entry[i], math.sqrt(entry[i + 1] ** 2 + 2.0 * limit[i] * lengths[i]))
    for i in range(len(lengths)):
        entry[i + 1] = min(entry[i + 1], math.sqrt(entry[i] ** 2 + 2.0 * limit[i] * lengths[i]))
    first, last = entry[:-1], entry[1:]
    peak = np.minimum(np.sqrt(limit * lengths + 0.5 * (first**2 + last**2)), top)
    ramps = (2.0 * peak - first - last) / limit
    cruise = lengths - (2.0 * peak**2 - first**2 - last**2) / (2.0 * limit)
    return float(np.sum(ramps + np.maximum(cruise, 0.0) / peak))


def _along(units: NDArray[np.float64], limits: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) largest value along unit vectors (N, 3) with which no axis exceeds its limit (3,)."""
    with np.errstate(divide="ignore"):
        along: NDArray[np.float64] = np.min(limits / np.abs(units), axis=1)
    return along
