"""Bounds of bodies about the axis of a turn: which of them a turning body cannot meet."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import inner


@inner
def to_axis_frame(solids, s, ox, oy, ux, uy, out):  # type: ignore[no-untyped-def]
    """Points (K, 3) of ``solids[s]`` into the frame whose origin is (ox, oy, 0), x along (ux, uy, 0) and z up."""
    for k in range(len(out)):
        x, y = solids[s, k, 0] - ox, solids[s, k, 1] - oy
        out[k, 0], out[k, 1], out[k, 2] = x * ux + y * uy, y * ux - x * uy, solids[s, k, 2]


@inner
def sector(points, out, row):  # type: ignore[no-untyped-def]
    """Bounds of a convex body (K, 3) about the x axis, into ``out[row]``: x from, to, radius from, to, angle from, to.

    The angles are (0, 2 pi) for a body that may contain the axis; else from < to, from in (-pi, pi].
    """
    x_lo, x_hi, r_hi = np.inf, -np.inf, 0.0
    cy, cz = 0.0, 0.0
    for k in range(len(points)):
        x_lo, x_hi = min(x_lo, points[k, 0]), max(x_hi, points[k, 0])
        r_hi = max(r_hi, points[k, 1] * points[k, 1] + points[k, 2] * points[k, 2])
        cy += points[k, 1]
        cz += points[k, 2]
    size = math.sqrt(cy * cy + cz * cz)
    out[row, 0], out[row, 1], out[row, 2], out[row, 3] = x_lo, x_hi, 0.0, math.sqrt(r_hi)
    out[row, 4], out[row, 5] = 0.0, 2.0 * math.pi
    if size < 1e-9:
        return
    cy, cz = cy / size, cz / size
    r_lo, t_lo, t_hi = np.inf, np.inf, -np.inf
    for k in range(len(points)):
        along = points[k, 1] * cy + points[k, 2] * cz
        across = points[k, 2] * cy - points[k, 1] * cz
        r_lo = min(r_lo, along)
        if along <= 1e-9:
            return
        t_lo, t_hi = min(t_lo, across / along), max(t_hi, across / along)
    middle = math.atan2(cz, cy)
    out[row, 2], out[row, 4], out[row, 5] = r_lo, middle + math.atan(t_lo), middle + math.atan(t_hi)


@inner
def sectors_apart(moving, m, still, limit):  # type: ignore[no-untyped-def]
    """True if a body with bounds ``moving[m]``, turned by 0 to ``limit``, cannot meet one with bounds ``still[0]``."""
    if (
        moving[m, 0] > still[0, 1]
        or still[0, 0] > moving[m, 1]
        or moving[m, 2] > still[0, 3]
        or still[0, 2] > moving[m, 3]
    ):
        return True
    span = (moving[m, 5] - moving[m, 4]) + limit
    gap = (still[0, 4] - moving[m, 4]) % (2.0 * math.pi)
    return gap > span and gap + (still[0, 5] - still[0, 4]) < 2.0 * math.pi


@inner
def is_far(bounds, k, x, r, radius):  # type: ignore[no-untyped-def]
    """True if a ball at (x, r) along and off the axis is outside of ``bounds[k]``: x from, to, radius from, to."""
    return (
        x + radius < bounds[k, 0]
        or x - radius > bounds[k, 1]
        or r - radius > bounds[k, 3]
        or r + radius < bounds[k, 2]
    )
