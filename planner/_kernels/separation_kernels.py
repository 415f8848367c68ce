"""A quick no: one plane that keeps two convex solids apart for a whole turn.

While a point turns by less than half a turn it stays in the triangle of its two end positions and the point where the
tangents at them meet. A plane that has those of every corner of one solid on one side, and the other solid on the
other, rules the pair out for a fraction of the cost of all its events.
"""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import inner

LARGEST_TURN_RAD = 2.5
"""Longer turns are not tried: the tangents meet too far out."""
LEAST_GAP_MM = 1e-6
"""The gap that a plane must have: more than the distance within which two solids count as in contact."""


@inner
def gap_along(x, y, z, hull, still, count):  # type: ignore[no-untyped-def]
    """Gap along (x, y, z) between hull[: 3 * count] and still[:count]; negative if they overlap along it."""
    lo, hi, other_lo, other_hi = np.inf, -np.inf, np.inf, -np.inf
    for k in range(count):
        d = x * still[k, 0] + y * still[k, 1] + z * still[k, 2]
        other_lo, other_hi = min(other_lo, d), max(other_hi, d)
    for k in range(3 * count):
        d = x * hull[k, 0] + y * hull[k, 1] + z * hull[k, 2]
        lo, hi = min(lo, d), max(hi, d)
    return max(other_lo - hi, lo - other_hi)


@inner
def plane_between(moving, still, count, limit, hull):  # type: ignore[no-untyped-def]
    """True if a plane keeps the solid ``moving``, turned about x by 0 to ``limit``, away from ``still``.

    Nine planes are tried: across the line between the middles, and along the sides of both solids.

    Args:
        moving, still: (count, 3) corners, the first three those of a triangle.
        count: corners that count.
        limit: at most ``LARGEST_TURN_RAD``.
        hull: (3 * count, 3) or larger work space.
    """
    half = 0.5 * limit
    c, s, cm, sm = math.cos(limit), math.sin(limit), math.cos(half), math.sin(half)
    tx, ty, tz = 0.0, 0.0, 0.0
    for k in range(count):
        x, y, z = moving[k, 0], moving[k, 1], moving[k, 2]
        my, mz = (y * cm - z * sm) / cm, (y * sm + z * cm) / cm
        hull[k, 0], hull[k, 1], hull[k, 2] = x, y, z
        at = count + k
        hull[at, 0], hull[at, 1], hull[at, 2] = x, y * c - z * s, y * s + z * c
        at = 2 * count + k
        hull[at, 0], hull[at, 1], hull[at, 2] = x, my, mz
        tx, ty, tz = tx + x - still[k, 0], ty + my * cm - still[k, 1], tz + mz * cm - still[k, 2]
    for k in range(9):
        if k == 0:
            x, y, z = tx, ty, tz
        else:
            # normals of the still triangle and of the walls over its sides, then of the moving one half way
            side = (k - 1) % 4
            body, at, squeeze = (still, 0, 1.0) if k < 5 else (hull, 2 * count, cm)
            ax, ay, az = (
                body[at + 1, 0] - body[at, 0],
                body[at + 1, 1] - body[at, 1],
                body[at + 1, 2] - body[at, 2],
            )
            bx, by, bz = (
                body[at + 2, 0] - body[at, 0],
                body[at + 2, 1] - body[at, 1],
                body[at + 2, 2] - body[at, 2],
            )
            ay, az, by, bz = ay * squeeze, az * squeeze, by * squeeze, bz * squeeze
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            if side > 0:
                if side == 2:
                    ax, ay, az = bx, by, bz
                elif side == 3:
                    ax, ay, az = bx - ax, by - ay, bz - az
                x, y, z = ay * z - az * y, az * x - ax * z, ax * y - ay * x
        size = math.sqrt(x * x + y * y + z * z)
        if size > 0.0 and gap_along(x / size, y / size, z / size, hull, still, count) > LEAST_GAP_MM:
            return True
    return False
