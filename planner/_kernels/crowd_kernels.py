"""Which solids are near enough to a crease to matter: balls around blocks of neighbours in the net come first."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.beam_kernels import KX, KY, NEAR, RADIUS, SPREAD, UP
from planner._kernels.compiled import inner
from planner._kernels.sight_kernels import SLACK_MM, half_plane

CROWD_BLOCK = 8
"""Solids in a block."""

X, Y, Z, SIZE, STANDS = 0, 1, 2, 3, 4
"""Places in the row of a block: the middle of its ball, the radius, and whether any of its solids stands."""

ANY_SLOPE = 1e9
"""Slope of light from a point, which has no bound."""


@inner
def crowd_order(preorder, total):  # type: ignore[no-untyped-def]
    """(N,) solids in the order of the blocks: the faces of the net depth first, then all others."""
    order = np.empty(total, np.int64)
    for k in range(total):
        order[k] = preorder[k] if k < len(preorder) else k
    return order


@inner
def bound_blocks(order, start, stop, centres, radii, flat, present, blocks):  # type: ignore[no-untyped-def]
    """Work out the rows of ``blocks`` (B, 5) with the solids ``order[start:stop]``."""
    for b in range(start // CROWD_BLOCK, (stop + CROWD_BLOCK - 1) // CROWD_BLOCK):
        first, last = b * CROWD_BLOCK, min(len(order), (b + 1) * CROWD_BLOCK)
        x, y, z, count, stands = 0.0, 0.0, 0.0, 0, 0.0
        for p in range(first, last):
            s = order[p]
            if present[s]:
                x, y, z, count = x + centres[s, 0], y + centres[s, 1], z + centres[s, 2], count + 1
                if not flat[s]:
                    stands = 1.0
        size = -np.inf
        if count > 0:
            x, y, z = x / count, y / count, z / count
        for p in range(first, last):
            s = order[p]
            if present[s]:
                dx, dy, dz = centres[s, 0] - x, centres[s, 1] - y, centres[s, 2] - z
                size = max(size, math.sqrt(dx * dx + dy * dy + dz * dz) + radii[s])
        blocks[b, X], blocks[b, Y], blocks[b, Z], blocks[b, SIZE], blocks[b, STANDS] = x, y, z, size, stands


@inner
def near_turn(order, blocks, first, last, centres, radii, present, ox, oy, ux, uy, out):  # type: ignore[no-untyped-def]
    """List the solids that ``order[first:last]`` may come near when they turn by any angle about an axis.

    Args:
        order, blocks: see ``crowd_order`` and ``bound_blocks``.
        centres, radii, present: as in ``turn_contact``.
        ox, oy, ux, uy: the axis, as there.
        out: (N,) the solids.

    Returns:
        how many there are
    """
    x_lo, x_hi, r_lo, r_hi = np.inf, -np.inf, np.inf, 0.0
    for p in range(first, last):
        m = order[p]
        dx, dy, z, size = centres[m, 0] - ox, centres[m, 1] - oy, centres[m, 2], radii[m] + SLACK_MM
        x, y = dx * ux + dy * uy, dy * ux - dx * uy
        r = math.sqrt(y * y + z * z)
        x_lo, x_hi = min(x_lo, x - size), max(x_hi, x + size)
        r_lo, r_hi = min(r_lo, r - size), max(r_hi, r + size)
    count, tube = 0, (x_lo, x_hi, r_lo, r_hi)
    for b in range(len(blocks)):
        start, stop = b * CROWD_BLOCK, min(len(order), (b + 1) * CROWD_BLOCK)
        x, y, z, size = blocks[b, X] - ox, blocks[b, Y] - oy, blocks[b, Z], blocks[b, SIZE]
        if (first <= start and stop <= last) or _is_beyond(x, y, z, size, ux, uy, tube):
            continue
        for p in range(start, stop):
            s = order[p]
            if not present[s] or first <= p < last:
                continue
            if not _is_beyond(centres[s, 0] - ox, centres[s, 1] - oy, centres[s, 2], radii[s], ux, uy, tube):
                out[count] = s
                count += 1
    return count


@inner
def _is_beyond(dx, dy, z, size, ux, uy, tube):  # type: ignore[no-untyped-def]
    """True if a ball at (dx, dy, z) from the axis is outside of the ``tube``: x from, to, radius from, to."""
    x_lo, x_hi, r_lo, r_hi = tube
    x = dx * ux + dy * uy
    if x + size < x_lo or x - size > x_hi:
        return True
    y = dy * ux - dx * uy
    square, most, least = y * y + z * z, r_hi + size, r_lo - size
    return square > most * most or (least > 0.0 and square < least * least)


@inner
def near_sight(  # type: ignore[no-untyped-def]
    order, blocks, first, last, panel_a, panel_b, panel, flat, centres, radii, present,
    hinge, length, sign, turn, beam, most_tilt, out,
):  # fmt: skip
    """List the solids that may hide a crease while ``order[first:last]`` turn about it: those that turn first.

    All rays to a crease lie in a half-plane, see ``watch``, whose rules these are.

    Args:
        order, blocks: see ``crowd_order`` and ``bound_blocks``.
        panel_a, panel_b, panel, flat, centres, radii: as in ``hidden_share``; present: solids that exist.
        hinge: (4,) start and unit direction of the crease, and its ``length``.
        sign: +1 if the turn is right-handed, else -1.
        turn: how far it goes, rad.
        beam: one of those that come into question.
        most_tilt: all tilts up to this one do, rad; 0: only that of the ``beam``.
        out: (N,) the solids.

    Returns:
        (number of solids that turn, number of all)
    """
    ox, oy, ux, uy = hinge[0], hinge[1], hinge[2], hinge[3]
    parallel, side = beam[NEAR] == 0.0, math.copysign(1.0, beam[UP])
    slope = max(math.hypot(beam[KX], beam[KY]), math.tan(most_tilt)) if parallel else ANY_SLOPE
    rise = math.sqrt(1.0 + slope * slope)
    # the half-planes as the turning part sees them lie between two angles about the crease, from its front
    if most_tilt == 0.0:
        least_grade = most_grade = side * (beam[KX] * ux + beam[KY] * uy)
        _, ly, lz = half_plane(ox, oy, ux, uy, beam)
        low = high = math.atan2(sign * lz, ly)
    else:
        least_grade, most_grade = -slope, slope
        low, high = 0.5 * math.pi - math.atan(slope), 0.5 * math.pi + math.atan(slope)
    low -= turn
    convex, lc, ls, hc, hs = (
        high - low <= math.pi,
        math.cos(low),
        math.sin(low),
        math.cos(high),
        math.sin(high),
    )
    count = 0
    for p in range(first, last):
        m = order[p]
        if panel[m] == panel_a:
            continue
        if parallel:
            dx, dy, z, r = centres[m, 0] - ox, centres[m, 1] - oy, sign * centres[m, 2], radii[m]
            x, y = dx * ux + dy * uy, dy * ux - dx * uy
            wide = r + beam[RADIUS] + 2.0 * SLACK_MM + beam[SPREAD] * (abs(y) + abs(z) + r) * rise
            before, behind = ls * y - lc * z > wide, hc * z - hs * y > wide
            square = y * y + z * z
            outside = (before or behind) if convex else (before and behind)
            if outside and square > 9.0 * wide * wide * rise * rise:
                continue
            height = math.sqrt(square) + wide
            if (
                x + max(0.0, most_grade) * height < -wide
                or x + min(0.0, least_grade) * height > length + wide
            ):
                continue
        out[count] = m
        count += 1
    turning = count
    mx, my, reach = ox + 0.5 * length * ux, oy + 0.5 * length * uy, 0.5 * length + beam[RADIUS] + SLACK_MM
    light = (reach, side, beam[KX], beam[KY], 0.0, rise, beam[SPREAD] * rise)
    if most_tilt > 0.0 or not parallel:
        light = (reach, side, 0.0, 0.0, slope, rise, beam[SPREAD] * rise)
    for b in range(len(blocks)):
        x, y, z, size = blocks[b, X] - mx, blocks[b, Y] - my, blocks[b, Z], blocks[b, SIZE]
        if blocks[b, STANDS] == 0.0 or _is_clear(x, y, z, size, light):
            continue
        for p in range(b * CROWD_BLOCK, min(len(order), (b + 1) * CROWD_BLOCK)):
            s = order[p]
            if flat[s] or not present[s] or panel[s] == panel_a or panel[s] == panel_b or first <= p < last:
                continue
            if not _is_clear(centres[s, 0] - mx, centres[s, 1] - my, centres[s, 2], radii[s], light):
                out[count] = s
                count += 1
    return turning, count


@inner
def _is_clear(dx, dy, z, size, light):  # type: ignore[no-untyped-def]
    """True if the shadow of a ball does not come near the middle of a crease.

    Args:
        dx, dy, z: its place seen from there, and its radius ``size``.
        light: how near it must come in the plane of the sheet, mm; side of the sheet, +1 or -1, that is lit; where
            the shadow goes per mm of height, in x and y, and by how much more in any direction; how much longer
            than the ball it is at most; how much wider the beam is per mm.
    """
    reach, side, kx, ky, drift, rise, spread = light
    if z * side < -size - SLACK_MM:
        return True
    high = abs(z) + size
    far = reach + size * rise + drift * high + spread * high
    px, py = dx + kx * z, dy + ky * z
    return px * px + py * py > far * far
