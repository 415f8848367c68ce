"""Hidden share of a crease: which part of a segment in the sheet plane lies under triangles, seen along the beam."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.beam_kernels import KX, KY, NEAR, RADIUS, SPREAD, UP
from planner._kernels.compiled import inner
from planner._kernels.cover_kernels import covered_interval, union_share

SIGHT_STEP_RAD = math.radians(5.0)
SIGHT_SUBSTEPS, FINE_SUBSTEPS = 3, 20
"""Samples in each step of SIGHT_STEP_RAD: while nets are searched, and for the plan of a net on its sheet."""
REFINED_RAD = math.radians(0.05)
SLACK_MM = 1e-3
"""What bounds are widened by against rounding."""


@inner
def _sphere_is_clear(cx, cy, cz, r, mx, my, half, beam):  # type: ignore[no-untyped-def]
    """True if the shadow of a ball stays clear of the crease with the middle (mx, my) and the ``half`` length."""
    up, near = beam[UP], beam[NEAR]
    if cz * up < -r - 1.0:
        return True
    depth = 1.0 - near * cz
    if depth <= 0.0:
        return False
    sx, sy = cx + beam[KX] * cz, cy + beam[KY] * cz
    # how far the shadow of the sphere reaches: the slope of the projection, the beam's width
    if near != 0.0:
        sx, sy = sx / depth, sy / depth
    slope = 1.0 + abs(beam[KX] + near * sx) + abs(beam[KY] + near * sy)
    wider = beam[SPREAD] * (abs(cz * up) + r)
    reach = r * slope + beam[RADIUS] + wider
    if near != 0.0:
        reach = 2.0 * reach / max(1e-3, depth - abs(near) * r) + wider
    reach += half + 1.0
    px, py = sx - mx, sy - my
    return px * px + py * py > reach * reach


@inner
def watch(  # type: ignore[no-untyped-def]
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, suspects,
    ox, oy, ux, uy, length, sign, start, end, beam, which, slab, sides, intervals, turned,
):  # fmt: skip
    """List the solids that may hide a crease during its turn from ``start`` to ``end``, in the order of ``suspects``.

    All rays to the crease lie in the half-plane of the crease and the light. A moving solid can hide only while
    its bounding sphere, wider by the beam, meets this half-plane, so seen from the moving part only if it meets
    the wedge that the half-plane sweeps. A solid that stands still hides the same part at every angle: it is
    listed only if it hides something.

    Args:
        panel_a ... sign: as in ``hidden_share``.
        start, end: 0 <= start <= end <= pi.
        beam: as in ``covered_interval``.
        which: (N,) the solids that are found.
        slab: (N,) of those that move: how near to the half-plane they must be to hide anything; of those that
            stand still: -1.
        sides: (N, 3, 2) of those that move: the distance of each corner from the half-plane is
            sides[0] cos(angle) - sides[1] sin(angle), with the sign of the turn.
        intervals: (N, 2) the parts that are hidden by those that stand still.
        turned: (3, 3) work space.

    Returns:
        (number of solids found, how many of them move)
    """
    bx, by, half = ox + ux * length, oy + uy * length, 0.5 * length
    mx, my = 0.5 * (ox + bx), 0.5 * (oy + by)
    radius, spread, up, near = beam[RADIUS], beam[SPREAD], beam[UP], abs(beam[NEAR])
    grade, ly, lz = half_plane(ox, oy, ux, uy, beam)
    grade = math.copysign(grade, grade * up)
    cs, ss, ce, se = math.cos(start), math.sin(start) * sign, math.cos(end), math.sin(end) * sign
    # the half-plane at both ends of the turn as the moving part sees it; times sign: the turn is right-handed
    sy, sz = sign * (ly * cs + lz * ss), sign * (lz * cs - ly * ss)
    ey, ez = sign * (ly * ce + lz * se), sign * (lz * ce - ly * se)
    count, moves = np.int64(0), np.int64(0)
    for g in suspects:
        moving = moving_mask[g]
        if (flat[g] and not moving) or panel[g] == panel_a or panel[g] == panel_b:
            continue
        r = radii[g]
        if not moving:
            if _sphere_is_clear(centres[g, 0], centres[g, 1], centres[g, 2], r, mx, my, half, beam):
                continue
            for k in range(3):
                for d in range(3):
                    turned[k, d] = solids[g, 9 + k, d]
            lo, hi = covered_interval(turned, ox, oy, bx, by, beam, False)
            if lo < hi:
                which[count], slab[count], intervals[count, 0], intervals[count, 1] = g, -1.0, lo, hi
                count += 1
            continue
        dx, dy, z = centres[g, 0] - ox, centres[g, 1] - oy, centres[g, 2]
        y = dy * ux - dx * uy
        wide = r + radius + SLACK_MM
        if near != 0.0 or spread != 0.0:
            top = abs(y) + abs(z) + r  # no corner comes higher
            least = 1.0 - near * top
            if least < 0.5:  # up to the light itself: no bound
                which[count], slab[count] = g, np.inf
                count += 1
                moves += 1
                continue
            wide = r + (radius + spread * top * abs(up) / least) * (1.0 + near * top) + SLACK_MM
        # outside of the wedge, and not so near to the crease that a corner could rise behind the half-plane
        if sy * z - sz * y > wide or ey * z - ez * y < -wide:
            rim = wide + (r + wide * abs(ly)) / abs(lz)
            if y * y + z * z > rim * rim:
                continue
        if near == 0.0:  # as high as it may rise, its shadow goes by no more than this along the crease
            x, shift = dx * ux + dy * uy, grade * (math.sqrt(y * y + z * z) + wide)
            if x + max(0.0, shift) < -wide or x + min(0.0, shift) > length + wide:
                continue
        which[count], slab[count] = g, wide - r
        for k in range(3):
            dx, dy, z = solids[g, 9 + k, 0] - ox, solids[g, 9 + k, 1] - oy, solids[g, 9 + k, 2]
            y = dy * ux - dx * uy
            sides[count, k, 0], sides[count, k, 1] = y * lz - z * ly, y * ly + z * lz
        count += 1
        moves += 1
    return count, moves


@inner
def half_plane(ox, oy, ux, uy, beam):  # type: ignore[no-untyped-def]
    """The half-plane through a crease and the light, in the frame of the crease.

    Returns:
        (slope along the crease of the shadow per mm of height, unit direction across and up to the light)
    """
    kx, ky = beam[KX] + beam[NEAR] * ox, beam[KY] + beam[NEAR] * oy
    across = ky * ux - kx * uy
    size = math.copysign(math.sqrt(1.0 + across * across), beam[UP])
    return kx * ux + ky * uy, -across / size, 1.0 / size


@inner
def _turn(solids, g, ox, oy, ux, uy, c, s, turned):  # type: ignore[no-untyped-def]
    """The full triangle of solid ``g`` turned about a crease by an angle with the cosine ``c`` and the sine ``s``."""
    for k in range(3):
        dx, dy, dz = solids[g, 9 + k, 0] - ox, solids[g, 9 + k, 1] - oy, solids[g, 9 + k, 2]
        a, w = dx * ux + dy * uy, dy * ux - dx * uy
        w2 = w * c - dz * s
        turned[k, 0], turned[k, 1] = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux
        turned[k, 2] = w * s + dz * c


@inner
def watched_share(  # type: ignore[no-untyped-def]
    count, which, slab, sides, still, solids, centres, radii, ox, oy, ux, uy, length, sign, angle, beam, intervals, turned,
):  # fmt: skip
    """Hidden share of a crease at an ``angle`` within the turn for which ``watch`` listed the solids.

    Args:
        count, which, slab, sides: what ``watch`` found.
        still: (count, 2) the intervals that ``watch`` found.
        solids ... turned: as in ``hidden_share``.

    Returns:
        (share, solid that hides most, -1 if none, what it hides alone)
    """
    bx, by, half = ox + ux * length, oy + uy * length, 0.5 * length
    mx, my = 0.5 * (ox + bx), 0.5 * (oy + by)
    c, s = math.cos(angle), math.sin(angle) * sign
    used, worst, who = np.int64(0), 0.0, -1
    for j in range(count):
        g = which[j]
        if slab[j] < 0.0:
            lo, hi = still[j, 0], still[j, 1]
        else:
            d0 = sides[j, 0, 0] * c - sides[j, 0, 1] * s
            d1 = sides[j, 1, 0] * c - sides[j, 1, 1] * s
            d2 = sides[j, 2, 0] * c - sides[j, 2, 1] * s
            if min(d0, d1, d2) > slab[j] or max(d0, d1, d2) < -slab[j]:
                continue
            dx, dy, z = centres[g, 0] - ox, centres[g, 1] - oy, centres[g, 2]
            w = dy * ux - dx * uy
            w2, cz = w * c - z * s, w * s + z * c
            a = dx * ux + dy * uy
            cx, cy = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux
            if _sphere_is_clear(cx, cy, cz, radii[g], mx, my, half, beam):
                continue
            _turn(solids, g, ox, oy, ux, uy, c, s, turned)
            lo, hi = covered_interval(turned, ox, oy, bx, by, beam, angle > 0.0)
            if lo >= hi:
                continue
        intervals[used, 0], intervals[used, 1] = lo, hi
        used += 1
        if hi - lo > worst:
            worst, who = hi - lo, g
    if used == 0:
        return 0.0, -1, 0.0
    return union_share(intervals, used), who, worst


@inner
def hides_alone(  # type: ignore[no-untyped-def]
    solid, moving, solids, ox, oy, ux, uy, length, sign, angle, beam, hidden_max, intervals, turned,
):  # fmt: skip
    """True if one solid, that neither lies flat nor is of the panels beside, hides more than ``hidden_max``.

    Args:
        solid: its number.
        moving: True if it turns.
        solids ... beam: as in ``hidden_share``.
        hidden_max: sight rule.
        intervals: (1, 2) or larger and
        turned: (3, 3) work space.
    """
    c, s = 1.0, 0.0
    if moving:
        c, s = math.cos(angle), math.sin(angle) * sign
    _turn(solids, solid, ox, oy, ux, uy, c, s, turned)
    thin = moving and angle > 0.0
    bx, by = ox + ux * length, oy + uy * length
    intervals[0, 0], intervals[0, 1] = covered_interval(turned, ox, oy, bx, by, beam, thin)
    return union_share(intervals, 1) > hidden_max


@inner
def hidden_share(  # type: ignore[no-untyped-def]
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, suspects,
    ox, oy, ux, uy, length, sign, angle, beam, intervals, turned,
):  # fmt: skip
    """Hidden share of a crease when its subtree stands turned by ``angle`` from now.

    Args:
        panel_a, panel_b: the flat panels on both sides of the crease, which never count.
        panel: (N,) number of the panel (faces joined by flat joints) of each solid, -1 for obstacles.
        moving_mask: (N,) the solids that turn.
        flat: (N,) the solids that lie in the sheet plane and so hide nothing.
        solids, centres, radii: as in ``turn_contact``; rows 9-11 of a solid are its full triangle.
        suspects: (K,) the solids that are looked at.
        ox, oy, ux, uy, length: the crease: start, unit direction, length.
        sign: +1 if the turn is right-handed about (ux, uy), else -1.
        angle: >= 0.
        beam: as in ``covered_interval``; once it turns, the moving part is tested with a thin beam, since it
            may end upright exactly beside the crease.
        intervals: (N, 2) and
        turned: (3, 3) work space.

    Returns:
        (share, solid that hides most, -1 if none, what it hides alone)
    """
    total = len(suspects)
    which, slab, sides = np.empty(total, np.int64), np.empty(total), np.empty((total, 3, 2))
    count, _ = watch(
        panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, suspects,
        ox, oy, ux, uy, length, sign, angle, angle, beam, which, slab, sides, intervals, turned,
    )  # fmt: skip
    return watched_share(
        count, which, slab, sides, intervals[:count].copy(), solids, centres, radii,
        ox, oy, ux, uy, length, sign, angle, beam, intervals, turned,
    )  # fmt: skip


@inner
def sight_limit(  # type: ignore[no-untyped-def]
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, suspects,
    ox, oy, ux, uy, length, sign, limit, beam, hidden_max, intervals, turned, substeps, refine,
):  # fmt: skip
    """Largest angle up to which the crease stays in sight; -1 if it is hidden at the start.

    Samples every SIGHT_STEP_RAD / ``substeps`` or finer, in coarse steps first: most failures show there.
    With ``refine`` the end is then found to within REFINED_RAD.

    Returns:
        (angle, blocker, -1 if none)
    """
    total = len(suspects)
    which, slab, sides = np.empty(total, np.int64), np.empty(total), np.empty((total, 3, 2))
    listed, moves = watch(
        panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, suspects,
        ox, oy, ux, uy, length, sign, 0.0, limit, beam, which, slab, sides, intervals, turned,
    )  # fmt: skip
    if listed == 0:
        return limit, -1
    still = intervals[:listed].copy()
    count = substeps * max(1, math.ceil(limit / SIGHT_STEP_RAD - 1e-9))
    end, by = count, -1  # the first sample known to be hidden is end + 1
    for coarse in (True, False):
        k = 0
        while k <= end:
            if coarse == (k % substeps == 0):
                share, who, _ = watched_share(
                    listed, which, slab, sides, still, solids, centres, radii,
                    ox, oy, ux, uy, length, sign, limit * k / count, beam, intervals, turned,
                )  # fmt: skip
                if share > hidden_max:
                    end, by = k - 1, who
                    break
                if moves == 0:
                    return limit, -1  # the same at every angle
            k += 1
    if by < 0:
        return limit, -1
    if end < 0:
        return -1.0, by
    low, high = limit * end / count, limit * (end + 1) / count
    while refine and high - low > REFINED_RAD:
        middle = 0.5 * (low + high)
        share, who, _ = watched_share(
            listed, which, slab, sides, still, solids, centres, radii,
            ox, oy, ux, uy, length, sign, middle, beam, intervals, turned,
        )  # fmt: skip
        if share > hidden_max:
            high, by = middle, who
        else:
            low = middle
    return low, by
