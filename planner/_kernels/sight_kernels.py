"""Hidden share of a crease: which part of a segment in the sheet plane lies under triangles, seen along the beam."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.beam_kernels import KX, KY, NEAR, RADIUS, SPREAD, UP
from planner._kernels.compiled import inner

ABOVE_MM = 0.01
"""A triangle hides what lies at least this far under it."""
SIGHT_STEP_RAD = math.radians(5.0)
SIGHT_SUBSTEPS = 3
REFINED_RAD = math.radians(0.05)
SLACK_MM = 1e-3
"""What bounds are widened by against rounding."""
END_SHARE = 0.02
"""Share of a crease at each end that does not count: neighbours at the shared corners always touch it."""


@inner
def covered_interval(tri, ax, ay, bx, by, beam, thin, out):  # type: ignore[no-untyped-def]
    """Part of the segment a-b (z = 0) that the triangle covers.

    Args:
        tri: (3, 3) corners in the sheet frame.
        ax, ay, bx, by: the segment.
        beam: where the light comes from, see ``beam_kernels``; the triangle is widened by its radius, at each
            corner by that at the height of the corner.
        thin: leave the radius out.
        out: (2,) the interval as shares of the segment.

    Returns:
        True if something is covered.
    """
    near, up = beam[NEAR], beam[UP]
    d0, d1, d2 = 1.0 - near * tri[0, 2], 1.0 - near * tri[1, 2], 1.0 - near * tri[2, 2]
    if d0 <= 0.0 or d1 <= 0.0 or d2 <= 0.0:
        return False  # above the light
    h0, h1, h2 = tri[0, 2] * up / d0, tri[1, 2] * up / d1, tri[2, 2] * up / d2
    if h0 <= ABOVE_MM and h1 <= ABOVE_MM and h2 <= ABOVE_MM:
        return False
    r0, r1, r2 = 0.0, 0.0, 0.0
    if not thin:
        radius, spread = beam[RADIUS], beam[SPREAD]
        r0, r1, r2 = (
            radius + spread * max(0.0, h0),
            radius + spread * max(0.0, h1),
            radius + spread * max(0.0, h2),
        )
    kx, ky = beam[KX], beam[KY]
    length = math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
    ux, uy = (bx - ax) / length, (by - ay) / length
    # in the frame of the segment: s along it, w across it
    s0, w0 = _along(tri[0], ax, ay, ux, uy, kx, ky, d0)
    s1, w1 = _along(tri[1], ax, ay, ux, uy, kx, ky, d1)
    s2, w2 = _along(tri[2], ax, ay, ux, uy, kx, ky, d2)
    if min(w0 - r0, w1 - r1, w2 - r2) > 0.0 or max(w0 + r0, w1 + r1, w2 + r2) < 0.0:
        return False
    lo, hi = max(0.0, min(s0 - r0, s1 - r1, s2 - r2)), min(length, max(s0 + r0, s1 + r1, s2 + r2))
    if lo >= hi:
        return False
    area = (s1 - s0) * (w2 - w0) - (s2 - s0) * (w1 - w0)
    if abs(area) > 1e-9:
        turn = 1.0 if area > 0.0 else -1.0
        for k in range(3):
            if k == 0:
                ps, pw, qs, qw, pr, qr = s0, w0, s1, w1, r0, r1
            elif k == 1:
                ps, pw, qs, qw, pr, qr = s1, w1, s2, w2, r1, r2
            else:
                ps, pw, qs, qw, pr, qr = s2, w2, s0, w0, r2, r0
            es, ew = qs - ps, qw - pw
            size = math.sqrt(es * es + ew * ew)
            if size < 1e-12:
                continue
            # both ends move outwards by their radius; inside: turn * cross(e, x - p) >= 0 with x = (s, 0)
            ns, nw = turn * ew / size, -turn * es / size
            ps, pw = ps + pr * ns, pw + pr * nw
            es, ew = es + (qr - pr) * ns, ew + (qr - pr) * nw
            slope = -turn * ew
            rest = turn * (-es * pw + ew * ps)
            if abs(slope) < 1e-12:
                if rest < 0.0:
                    return False
            elif slope > 0.0:
                lo = max(lo, -rest / slope)
            else:
                hi = min(hi, -rest / slope)
        if lo >= hi:
            return False
        # height over the segment is linear in s: keep the part where it is above the crease
        grade = ((h1 - h0) * (w2 - w0) - (h2 - h0) * (w1 - w0)) / area
        side = ((s1 - s0) * (h2 - h0) - (s2 - s0) * (h1 - h0)) / area
        at_zero = h0 - grade * s0 - side * w0 - ABOVE_MM
        if abs(grade) * length < 1e-12:
            if at_zero <= 0.0:
                return False
        elif grade > 0.0:
            lo = max(lo, -at_zero / grade)
        else:
            hi = min(hi, -at_zero / grade)
    if lo >= hi:
        return False
    out[0], out[1] = lo / length, hi / length
    return True


@inner
def _along(p, ax, ay, ux, uy, kx, ky, d):  # type: ignore[no-untyped-def]
    """Coordinates along and across a segment of a point projected along the beam."""
    x, y = (p[0] + kx * p[2]) / d - ax, (p[1] + ky * p[2]) / d - ay
    return x * ux + y * uy, y * ux - x * uy


@inner
def union_share(intervals, count):  # type: ignore[no-untyped-def]
    """Share of [END_SHARE, 1 - END_SHARE] covered by ``intervals[:count]`` (K, 2), which get sorted."""
    lo_end, hi_end = END_SHARE, 1.0 - END_SHARE
    for k in range(1, count):  # insertion sort: there are few intervals
        lo, hi = intervals[k, 0], intervals[k, 1]
        j = k - 1
        while j >= 0 and intervals[j, 0] > lo:
            intervals[j + 1, 0], intervals[j + 1, 1] = intervals[j, 0], intervals[j, 1]
            j -= 1
        intervals[j + 1, 0], intervals[j + 1, 1] = lo, hi
    covered, reach = 0.0, lo_end
    for k in range(count):
        lo, hi = max(intervals[k, 0], reach), min(intervals[k, 1], hi_end)
        if hi > lo:
            covered += hi - lo
            reach = hi
    return covered / (hi_end - lo_end)


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
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
    ox, oy, ux, uy, length, sign, start, end, beam, which, slab, intervals, turned,
):  # fmt: skip
    """List the solids that may hide a crease during its turn from ``start`` to ``end``, in order of their numbers.

    All rays to the crease lie in the half-plane of the crease and the light. A moving solid can hide only while
    its bounding sphere, wider by the beam, meets this half-plane, so seen from the moving part only if it meets
    the wedge that the half-plane sweeps. A solid that stands still hides the same part at every angle: it is
    listed only if it hides something.

    Args:
        panel_a ... sign: as in ``hidden_share``.
        start, end: 0 <= start <= end <= pi.
        beam: as in ``covered_interval``.
        which: (N,) the solids that are found.
        slab: (N,) of those that move: how near to the half-plane their centres must be to hide anything; of
            those that stand still: -1.
        intervals: (N, 2) the parts that are hidden by those that stand still.
        turned: (3, 3) work space.

    Returns:
        (number of solids found, how many of them move)
    """
    bx, by, half = ox + ux * length, oy + uy * length, 0.5 * length
    mx, my = 0.5 * (ox + bx), 0.5 * (oy + by)
    radius, spread, up, near = beam[RADIUS], beam[SPREAD], beam[UP], abs(beam[NEAR])
    _, ly, lz = _half_plane(ox, oy, ux, uy, beam)
    cs, ss, ce, se = math.cos(start), math.sin(start) * sign, math.cos(end), math.sin(end) * sign
    # the half-plane at both ends of the turn as the moving part sees it; times sign: the turn is right-handed
    sy, sz = sign * (ly * cs + lz * ss), sign * (lz * cs - ly * ss)
    ey, ez = sign * (ly * ce + lz * se), sign * (lz * ce - ly * se)
    count, moves = np.int64(0), np.int64(0)
    for g in range(len(solids)):
        moving = moving_mask[g]
        if (flat[g] and not moving) or not present[g] or panel[g] == panel_a or panel[g] == panel_b:
            continue
        r = radii[g]
        if not moving:
            if _sphere_is_clear(centres[g, 0], centres[g, 1], centres[g, 2], r, mx, my, half, beam):
                continue
            for k in range(3):
                for d in range(3):
                    turned[k, d] = solids[g, 9 + k, d]
            if covered_interval(turned, ox, oy, bx, by, beam, False, intervals[count]):
                which[count], slab[count] = g, -1.0
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
        which[count], slab[count] = g, wide
        count += 1
        moves += 1
    return count, moves


@inner
def _half_plane(ox, oy, ux, uy, beam):  # type: ignore[no-untyped-def]
    """The half-plane through a crease and the light, in the frame of the crease.

    Returns:
        (slope along the crease of the shadow per mm of height, unit direction across and up to the light)
    """
    kx, ky = beam[KX] + beam[NEAR] * ox, beam[KY] + beam[NEAR] * oy
    across = ky * ux - kx * uy
    size = math.copysign(math.sqrt(1.0 + across * across), beam[UP])
    return kx * ux + ky * uy, -across / size, 1.0 / size


@inner
def watched_share(  # type: ignore[no-untyped-def]
    count, which, slab, still, solids, centres, radii, ox, oy, ux, uy, length, sign, angle, beam, intervals, turned,
):  # fmt: skip
    """Hidden share of a crease at an ``angle`` within the turn for which ``watch`` listed the solids.

    Args:
        count, which, slab: what ``watch`` found.
        still: (count, 2) the intervals that ``watch`` found.
        solids ... turned: as in ``hidden_share``.

    Returns:
        (share, solid that hides most, -1 if none, what it hides alone)
    """
    bx, by, half = ox + ux * length, oy + uy * length, 0.5 * length
    mx, my = 0.5 * (ox + bx), 0.5 * (oy + by)
    c, s = math.cos(angle), math.sin(angle) * sign
    _, ly, lz = _half_plane(ox, oy, ux, uy, beam)
    used, worst, who = np.int64(0), 0.0, -1
    for j in range(count):
        g = which[j]
        if slab[j] < 0.0:
            lo, hi = still[j, 0], still[j, 1]
        else:
            dx, dy, z = centres[g, 0] - ox, centres[g, 1] - oy, centres[g, 2]
            w = dy * ux - dx * uy
            w2, cz = w * c - z * s, w * s + z * c
            if abs(w2 * lz - cz * ly) > slab[j]:
                continue
            a = dx * ux + dy * uy
            cx, cy = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux
            if _sphere_is_clear(cx, cy, cz, radii[g], mx, my, half, beam):
                continue
            for k in range(3):
                dx, dy, dz = solids[g, 9 + k, 0] - ox, solids[g, 9 + k, 1] - oy, solids[g, 9 + k, 2]
                a, w = dx * ux + dy * uy, dy * ux - dx * uy
                w2 = w * c - dz * s
                turned[k, 0], turned[k, 1] = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux
                turned[k, 2] = w * s + dz * c
            if not covered_interval(turned, ox, oy, bx, by, beam, angle > 0.0, intervals[used]):
                continue
            lo, hi = intervals[used, 0], intervals[used, 1]
        intervals[used, 0], intervals[used, 1] = lo, hi
        used += 1
        if hi - lo > worst:
            worst, who = hi - lo, g
    if used == 0:
        return 0.0, -1, 0.0
    return union_share(intervals, used), who, worst


@inner
def hides_alone(  # type: ignore[no-untyped-def]
    solid, moving, solids, ox, oy, ux, uy, length, sign, angle, beam, hidden_max, interval, turned,
):  # fmt: skip
    """True if one solid, that neither lies flat nor is of the panels beside, hides more than ``hidden_max``.

    Args:
        solid: its number.
        moving: True if it turns.
        solids ... beam: as in ``hidden_share``.
        hidden_max: sight rule.
        interval: (2,) and
        turned: (3, 3) work space.
    """
    c, s = math.cos(angle), math.sin(angle) * sign
    for k in range(3):
        if moving:
            dx, dy, dz = solids[solid, 9 + k, 0] - ox, solids[solid, 9 + k, 1] - oy, solids[solid, 9 + k, 2]
            a, w = dx * ux + dy * uy, dy * ux - dx * uy
            w2 = w * c - dz * s
            turned[k, 0], turned[k, 1] = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux
            turned[k, 2] = w * s + dz * c
        else:
            for d in range(3):
                turned[k, d] = solids[solid, 9 + k, d]
    thin = moving and angle > 0.0
    if not covered_interval(turned, ox, oy, ox + ux * length, oy + uy * length, beam, thin, interval):
        return False
    lo, hi = max(END_SHARE, interval[0]), min(1.0 - END_SHARE, interval[1])
    return hi - lo > hidden_max * (1.0 - 2.0 * END_SHARE)


@inner
def hidden_share(  # type: ignore[no-untyped-def]
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
    ox, oy, ux, uy, length, sign, angle, beam, intervals, turned,
):  # fmt: skip
    """Hidden share of a crease when its subtree stands turned by ``angle`` from now.

    Args:
        panel_a, panel_b: the flat panels on both sides of the crease, which never count.
        panel: (N,) number of the panel (faces joined by flat joints) of each solid, -1 for obstacles.
        moving_mask: (N,) the solids that turn.
        flat: (N,) the solids that lie in the sheet plane and so hide nothing.
        solids, centres, radii, present: as in ``turn_contact``; rows 9-11 of a solid are its full triangle.
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
    total = len(solids)
    which, slab = np.empty(total, np.int64), np.empty(total)
    count, _ = watch(
        panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
        ox, oy, ux, uy, length, sign, angle, angle, beam, which, slab, intervals, turned,
    )  # fmt: skip
    return watched_share(
        count, which, slab, intervals[:count].copy(), solids, centres, radii,
        ox, oy, ux, uy, length, sign, angle, beam, intervals, turned,
    )  # fmt: skip


@inner
def sight_limit(  # type: ignore[no-untyped-def]
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
    ox, oy, ux, uy, length, sign, limit, beam, hidden_max, intervals, turned, refine,
):  # fmt: skip
    """Largest angle up to which the crease stays in sight; -1 if it is hidden at the start.

    Samples every SIGHT_STEP_RAD / SIGHT_SUBSTEPS or finer, in coarse steps first: most failures show there.
    With ``refine`` the end is then found to within REFINED_RAD.

    Returns:
        (angle, blocker, -1 if none)
    """
    total = len(solids)
    which, slab = np.empty(total, np.int64), np.empty(total)
    listed, moves = watch(
        panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
        ox, oy, ux, uy, length, sign, 0.0, limit, beam, which, slab, intervals, turned,
    )  # fmt: skip
    if listed == 0:
        return limit, -1
    still = intervals[:listed].copy()
    count = SIGHT_SUBSTEPS * max(1, math.ceil(limit / SIGHT_STEP_RAD - 1e-9))
    end, by = count, -1  # the first sample known to be hidden is end + 1
    for coarse in (True, False):
        k = 0
        while k <= end:
            if coarse == (k % SIGHT_SUBSTEPS == 0):
                share, who, _ = watched_share(
                    listed, which, slab, still, solids, centres, radii,
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
            listed, which, slab, still, solids, centres, radii,
            ox, oy, ux, uy, length, sign, middle, beam, intervals, turned,
        )  # fmt: skip
        if share > hidden_max:
            high, by = middle, who
        else:
            low = middle
    return low, by
