"""Which part of a segment in the sheet plane a triangle covers, seen along the beam, and how much several do."""

from __future__ import annotations

import math

from planner._kernels.beam_kernels import KX, KY, NEAR, RADIUS, SPREAD, UP
from planner._kernels.compiled import inner

ABOVE_MM = 0.01
"""A triangle hides what lies at least this far under it."""
END_SHARE = 0.02
"""Share of a crease at each end that does not count: neighbours at the shared corners always touch it."""


@inner
def covered_interval(tri, ax, ay, bx, by, beam, thin):  # type: ignore[no-untyped-def]
    """Part of the segment a-b (z = 0) that the triangle covers.

    Args:
        tri: (3, 3) corners in the sheet frame.
        ax, ay, bx, by: the segment.
        beam: where the light comes from, see ``beam_kernels``; the triangle is widened by its radius, at each
            corner by that at the height of the corner.
        thin: leave the radius out.

    Returns:
        (from, to) as shares of the segment; nothing is covered if the first is not less
    """
    near, up = beam[NEAR], beam[UP]
    d0, d1, d2 = 1.0 - near * tri[0, 2], 1.0 - near * tri[1, 2], 1.0 - near * tri[2, 2]
    if d0 <= 0.0 or d1 <= 0.0 or d2 <= 0.0:
        return 0.0, 0.0  # above the light
    h0, h1, h2 = tri[0, 2] * up / d0, tri[1, 2] * up / d1, tri[2, 2] * up / d2
    if h0 <= ABOVE_MM and h1 <= ABOVE_MM and h2 <= ABOVE_MM:
        return 0.0, 0.0
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
        return 0.0, 0.0
    lo, hi = max(0.0, min(s0 - r0, s1 - r1, s2 - r2)), min(length, max(s0 + r0, s1 + r1, s2 + r2))
    if lo >= hi:
        return 0.0, 0.0
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
                    return 0.0, 0.0
            else:
                lo, hi = _not_negative(rest, slope, lo, hi)
        if lo >= hi:
            return 0.0, 0.0
        # height over the segment is linear in s: keep the part where it is above the crease
        grade = ((h1 - h0) * (w2 - w0) - (h2 - h0) * (w1 - w0)) / area
        side = ((s1 - s0) * (h2 - h0) - (s2 - s0) * (h1 - h0)) / area
        at_zero = h0 - grade * s0 - side * w0 - ABOVE_MM
        if abs(grade) * length < 1e-12:
            if at_zero <= 0.0:
                return 0.0, 0.0
        else:
            lo, hi = _not_negative(at_zero, grade, lo, hi)
    if lo >= hi:
        return 0.0, 0.0
    return lo / length, hi / length


@inner
def _not_negative(at_zero, slope, lo, hi):  # type: ignore[no-untyped-def]
    """The part of the interval from ``lo`` to ``hi`` in which ``at_zero + slope * s`` is not; slope is not 0."""
    root = -at_zero / slope
    return (max(lo, root), hi) if slope > 0.0 else (lo, min(hi, root))


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
