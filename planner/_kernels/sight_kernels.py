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
END_SHARE = 0.02
"""Share of a crease at each end that does not count: neighbours at the shared corners always touch it."""


@inner
def covered_interval(tri, ax, ay, bx, by, beam, thin, out):  # type: ignore[no-untyped-def]
    """Part of the segment a-b (z = 0) that the triangle covers.

    Args:
        tri: (3, 3) corners in the sheet frame.
        ax, ay, bx, by: the segment.
        beam: where the light comes from, see ``beam_kernels``; the triangle is widened by its radius where it
            passes the highest corner.
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
    radius = 0.0 if thin else beam[RADIUS] + beam[SPREAD] * max(h0, h1, h2)
    kx, ky = beam[KX], beam[KY]
    length = math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
    ux, uy = (bx - ax) / length, (by - ay) / length
    # in the frame of the segment: s along it, w across it
    s0, w0 = _along(tri[0], ax, ay, ux, uy, kx, ky, d0)
    s1, w1 = _along(tri[1], ax, ay, ux, uy, kx, ky, d1)
    s2, w2 = _along(tri[2], ax, ay, ux, uy, kx, ky, d2)
    if min(w0, w1, w2) > radius or max(w0, w1, w2) < -radius:
        return False
    lo, hi = max(0.0, min(s0, s1, s2) - radius), min(length, max(s0, s1, s2) + radius)
    if lo >= hi:
        return False
    area = (s1 - s0) * (w2 - w0) - (s2 - s0) * (w1 - w0)
    if abs(area) > 1e-9:
        turn = 1.0 if area > 0.0 else -1.0
        for k in range(3):
            if k == 0:
                ps, pw, qs, qw = s0, w0, s1, w1
            elif k == 1:
                ps, pw, qs, qw = s1, w1, s2, w2
            else:
                ps, pw, qs, qw = s2, w2, s0, w0
            es, ew = qs - ps, qw - pw
            size = math.sqrt(es * es + ew * ew)
            if size < 1e-12:
                continue
            # inside: turn * cross(e, x - p) >= -radius * |e| with x = (s, 0)
            slope = -turn * ew
            rest = turn * (-es * pw + ew * ps) + radius * size
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
def hidden_share(  # type: ignore[no-untyped-def]
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
    ox, oy, ux, uy, length, sign, angle, beam, intervals, turned,
):  # fmt: skip
    """Hidden share of the crease of ``face`` when its subtree stands turned by ``angle`` from now.

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
    bx, by = ox + ux * length, oy + uy * length
    mx, my = 0.5 * (ox + bx), 0.5 * (oy + by)
    c, s = math.cos(angle), math.sin(angle) * sign
    count, worst, who = np.int64(0), 0.0, -1
    pair = np.empty(2)
    kx, ky, up, near = beam[KX], beam[KY], beam[UP], beam[NEAR]
    radius, spread = beam[RADIUS], beam[SPREAD]
    for g in range(len(solids)):
        if panel[g] == panel_a or panel[g] == panel_b or not present[g]:
            continue
        cx, cy, cz = centres[g, 0], centres[g, 1], centres[g, 2]
        moving = moving_mask[g]
        if moving:
            dx, dy = cx - ox, cy - oy
            a, w = dx * ux + dy * uy, dy * ux - dx * uy
            w2, cz = w * c - cz * s, w * s + cz * c
            cx, cy = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux
        elif flat[g]:
            continue
        if cz * up < -radii[g] - 1.0:
            continue
        depth = 1.0 - near * cz
        if depth > 0.0:
            sx, sy = (cx + kx * cz) / depth, (cy + ky * cz) / depth
            # how far the shadow of the sphere reaches: the slope of the projection, the beam's width
            slope = 1.0 + abs(kx + near * sx) + abs(ky + near * sy)
            high = abs(cz * up) + radii[g]
            reach = radii[g] * slope + radius + spread * high
            if near != 0.0:
                reach = 2.0 * reach / max(1e-3, depth - abs(near) * radii[g]) + spread * high
            reach += 0.5 * length + 1.0
            px, py = sx - mx, sy - my
            if px * px + py * py > reach * reach:
                continue
        if moving:
            for k in range(3):
                dx, dy, dz = solids[g, 9 + k, 0] - ox, solids[g, 9 + k, 1] - oy, solids[g, 9 + k, 2]
                a, w = dx * ux + dy * uy, dy * ux - dx * uy
                w2 = w * c - dz * s
                turned[k, 0], turned[k, 1] = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux
                turned[k, 2] = w * s + dz * c
        else:
            for k in range(3):
                for d in range(3):
                    turned[k, d] = solids[g, 9 + k, d]
        if covered_interval(turned, ox, oy, bx, by, beam, moving and angle > 0.0, pair):
            intervals[count, 0], intervals[count, 1] = pair[0], pair[1]
            count += 1
            if pair[1] - pair[0] > worst:
                worst, who = pair[1] - pair[0], g
    if count == 0:
        return 0.0, -1, 0.0
    return union_share(intervals, count), who, worst


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
    count = SIGHT_SUBSTEPS * max(1, math.ceil(limit / SIGHT_STEP_RAD - 1e-9))
    end, by = count, -1  # the first sample known to be hidden is end + 1
    for coarse in (True, False):
        k = 0
        while k <= end:
            if coarse == (k % SIGHT_SUBSTEPS == 0):
                share, who, _ = hidden_share(
                    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
                    ox, oy, ux, uy, length, sign, limit * k / count, beam, intervals, turned,
                )  # fmt: skip
                if share > hidden_max:
                    end, by = k - 1, who
                    break
            k += 1
    if by < 0:
        return limit, -1
    if end < 0:
        return -1.0, by
    low, high = limit * end / count, limit * (end + 1) / count
    while refine and high - low > REFINED_RAD:
        middle = 0.5 * (low + high)
        share, who, _ = hidden_share(
            panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
            ox, oy, ux, uy, length, sign, middle, beam, intervals, turned,
        )  # fmt: skip
        if share > hidden_max:
            high, by = middle, who
        else:
            low = middle
    return low, by
