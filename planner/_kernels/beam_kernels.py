"""The beam as seen from the sheet: where it comes from at a rotary angle, and how wide it is."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import inner

KX, KY, UP, NEAR, TO_X, TO_Y, TO_Z, FINITE, RADIUS, SPREAD, BEAM_SIZE = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
"""Places in a beam: a point at height z lands at ((x + KX z) / (1 - NEAR z), …) on the plane z = 0; z UP /
(1 - NEAR z) is its distance towards the light; TO is the direction to the light, or with FINITE the point that
it comes from; RADIUS at the crease, and how much wider (SPREAD) it is per mm above."""

HEAD_FINITE, HEAD_ALONG, HEAD_ACROSS, HEAD_HEIGHT, HEAD_OX, HEAD_OY, HEAD_RADIUS, HEAD_SPREAD = range(8)
"""Places in a head: parallel light (0) or from a point (1); that point from the origin on the rotary axis, along
it, across and above; the origin in the plane of the net; the beam's radius and spread."""

MOST_TILT_RAD, HALVES = 1.25, 40
"""Under light from a point a tilt is looked for up to this, and the range is halved so often."""

OVERHANG_RAD = math.radians(0.5)
"""A face may lean over its crease by this much, seen along the beam."""


@inner
def aim(angle, ex, ey, head, beam):  # type: ignore[no-untyped-def]
    """The ``beam`` (10,) at a rotary angle.

    Args:
        angle: rotary angle, rad; not 90 degrees.
        ex, ey: direction of the rotary axis in the plane of the net.
        head: (8,) where the light comes from.
        beam: the result.
    """
    c, s = math.cos(angle), math.sin(angle)
    if head[HEAD_FINITE] == 0.0:
        beam[KX], beam[KY], beam[UP], beam[NEAR] = s / c * ey, -s / c * ex, 1.0 / c, 0.0
        beam[TO_X], beam[TO_Y], beam[TO_Z] = -s * ey, s * ex, c
    else:
        across = head[HEAD_ACROSS] * c + head[HEAD_HEIGHT] * s
        z = head[HEAD_HEIGHT] * c - head[HEAD_ACROSS] * s
        x = head[HEAD_OX] + head[HEAD_ALONG] * ex - across * ey
        y = head[HEAD_OY] + head[HEAD_ALONG] * ey + across * ex
        beam[KX], beam[KY], beam[NEAR] = -x / z, -y / z, 1.0 / z
        dx, dy = x - head[HEAD_OX], y - head[HEAD_OY]
        beam[UP] = math.sqrt(dx * dx + dy * dy + z * z) / z
        beam[TO_X], beam[TO_Y], beam[TO_Z] = x, y, z
    beam[FINITE], beam[RADIUS], beam[SPREAD] = head[HEAD_FINITE], head[HEAD_RADIUS], head[HEAD_SPREAD]


@inner
def lean(beam, mx, my, ux, uy, sign):  # type: ignore[no-untyped-def]
    """Angle by which a face may turn about a crease until it stands along the beam, rad.

    Args:
        beam: see ``aim``.
        mx, my: middle of the crease.
        ux, uy: its direction.
        sign: +1 if the turn is right-handed about it, else -1.
    """
    dx, dy, dz = beam[TO_X], beam[TO_Y], beam[TO_Z]
    if beam[FINITE] != 0.0:
        dx, dy = dx - mx, dy - my
    return math.atan2(sign * dz, dy * ux - dx * uy)


@inner
def tilt_for_lean(wanted, upright, ex, ey, head, mx, my, ux, uy, sign, beam):  # type: ignore[no-untyped-def]
    """Tilt at which ``lean`` is as wanted: the beam then lies in the plane of a face that has turned so far.

    Args:
        wanted: angle, rad, in (0, pi).
        upright: rotary angle of the straight beam, 0 or pi.
        ex, ey, head, beam: as in ``aim``; ``beam`` is overwritten.
        mx, my, ux, uy, sign: as in ``lean``.

    Returns:
        tilt away from ``upright``, rad; inf if no tilt does it.
    """
    along = sign * (ex * ux + ey * uy)
    if abs(along) < 1e-9:
        return np.inf
    tilt = math.atan(math.cos(wanted) / (math.sin(wanted) * along))
    if head[HEAD_FINITE] != 0.0:
        # where the light comes from changes with the tilt: by halves
        low, high = -MOST_TILT_RAD, MOST_TILT_RAD
        aim(upright + low, ex, ey, head, beam)
        rising = lean(beam, mx, my, ux, uy, sign) < wanted
        aim(upright + high, ex, ey, head, beam)
        if rising == (lean(beam, mx, my, ux, uy, sign) < wanted):
            return np.inf
        for _ in range(HALVES):
            tilt = 0.5 * (low + high)
            aim(upright + tilt, ex, ey, head, beam)
            if (lean(beam, mx, my, ux, uy, sign) < wanted) == rising:
                low = tilt
            else:
                high = tilt
    return tilt
