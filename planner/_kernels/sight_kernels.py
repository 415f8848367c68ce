"""Hidden share of a crease: which part of a segment in the sheet plane lies under triangles, seen along the beam."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import inner

ABOVE_MM = 0.01
"""A triangle hides what lies at least this far under it."""
END_SHARE = 0.02
"""Share of a crease at each end that does not count: neighbours at the shared corners always touch it."""


@inner
def covered_interval(tri, ax, ay, bx, by, kx, ky, up, radius, out):  # type: ignore[no-untyped-def]
    """Part of the segment a-b (z = 0) that the triangle covers.

    Args:
        tri: (3, 3) corners in the sheet frame.
        ax, ay, bx, by: the segment.
        kx, ky: where a point at height z lands on the plane z = 0 along the beam: (x + kx z, y + ky z).
        up: 1 / cosine of the rotary angle, so that ``z * up`` is the distance towards the beam.
        radius: of the beam; the triangle is widened by it.
        out: (2,) the interval as shares of the segment.

    Returns:
        True if something is covered.
    """
    h0, h1, h2 = tri[0, 2] * up, tri[1, 2] * up, tri[2, 2] * up
    if h0 <= ABOVE_MM and h1 <= ABOVE_MM and h2 <= ABOVE_MM:
        return False
    length = math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
    ux, uy = (bx - ax) / length, (by - ay) / length
    # in the frame of the segment: s along it, w across it
    s0, w0 = _along(tri[0], ax, ay, ux, uy, kx, ky)
    s1, w1 = _along(tri[1], ax, ay, ux, uy, kx, ky)
    s2, w2 = _along(tri[2], ax, ay, ux, uy, kx, ky)
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
def _along(p, ax, ay, ux, uy, kx, ky):  # type: ignore[no-untyped-def]
    """Coordinates along and across a segment of a point projected along the beam."""
    x, y = p[0] + kx * p[2] - ax, p[1] + ky * p[2] - ay
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
    ox, oy, ux, uy, length, sign, angle, kx, ky, up, radius, intervals, turned,
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
        kx, ky, up, radius: the beam, as in ``covered_interval``; once it turns, the moving part is tested with
            a thin beam, since it may end upright exactly beside the crease.
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
        reach = radii[g] * (1.0 + abs(kx) + abs(ky)) + 0.5 * length + radius + 1.0
        px, py = cx + kx * cz - mx, cy + ky * cz - my
        if px * px + py * py > reach * reach:
            continue
        if cz * up < -radii[g] - 1.0:
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
        if covered_interval(
            turned, ox, oy, bx, by, kx, ky, up, 0.0 if moving and angle > 0.0 else radius, pair
        ):
            intervals[count, 0], intervals[count, 1] = pair[0], pair[1]
            count += 1
            if pair[1] - pair[0] > worst:
                worst, who = pair[1] - pair[0], g
    if count == 0:
        return 0.0, -1, 0.0
    return union_share(intervals, count), who, worst
