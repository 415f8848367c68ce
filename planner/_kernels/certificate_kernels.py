"""Proof that convex solids keep apart while some of them turn about a line: bisection and separating planes.

Nothing here is shared with the search for first contacts. While a point turns from angle a to angle b, less than
half a turn, it stays in the triangle of its two end positions and the point where the tangents at them meet. So a
plane that has these three points of every corner of the moving solid on one side and the still solid on the other
proves the whole interval free. Where no such plane is found, the interval is halved.

Rounding: coordinates of size C are known within ``error``. Turning, projecting and comparing them adds less than
100 u C with u = 2**-53, counted term by term; ``ROUNDING`` allows 512 u C. A plane counts only by what its gap
exceeds all of that.
"""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import entry, inner

ROUNDING = 2.0**-44
"""Bound of the rounding error of one comparison as a share of the largest coordinate: 512 units of 2**-53."""
LEAST_INTERVAL_RAD = 1e-6
"""Shorter intervals are not halved again: they stay open."""
MOST_INTERVALS = 4000
"""A pair that needs more intervals than this stays open from there on."""
TIGHT, MOST_FOR_TIGHT = 0.8, 300
"""A free interval is halved all the same until its gap is at least this share of the least gap at any middle so
far, for better margins; but not once a pair has taken this many intervals."""
FREE, OPEN, CONTACT = 0, 1, 2

MID, STILL, MOVING, AXIS = 18, 24, 28, 32
"""Rows of the work space after those of the swept corners: corners at the middle, directions, the axis tried."""
AXES = np.array(
    # the normals of both triangles first (across two sides), then of the side walls, then across two edges
    [(STILL, STILL + 1), (MOVING, MOVING + 1)]
    + [(side + k, side + 3) for side in (STILL, MOVING) for k in range(3)]
    + [(STILL + i, MOVING + j) for i in range(4) for j in range(4)],
    dtype=np.int64,
)
"""Pairs of rows of directions: what lies across them separates two convex prisms if anything does."""


@inner
def unit_directions(points, out, at):  # type: ignore[no-untyped-def]
    """Unit directions of the sides and the normal of the triangle points[:3] into out[at : at + 4]."""
    for k in range(3):
        j = (k + 1) % 3
        x, y, z = points[j, 0] - points[k, 0], points[j, 1] - points[k, 1], points[j, 2] - points[k, 2]
        size = math.sqrt(x * x + y * y + z * z)
        scale = 1.0 / size if size > 0.0 else 0.0
        out[at + k, 0], out[at + k, 1], out[at + k, 2] = x * scale, y * scale, z * scale
    cross(out, at, at + 1, at + 3)


@inner
def cross(rows, i, j, k):  # type: ignore[no-untyped-def]
    """Write the unit vector across rows i and j into row k; zero, and False returned, if they are parallel."""
    x = rows[i, 1] * rows[j, 2] - rows[i, 2] * rows[j, 1]
    y = rows[i, 2] * rows[j, 0] - rows[i, 0] * rows[j, 2]
    z = rows[i, 0] * rows[j, 1] - rows[i, 1] * rows[j, 0]
    size = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / size if size > 1e-9 else 0.0
    rows[k, 0], rows[k, 1], rows[k, 2] = x * scale, y * scale, z * scale
    return scale > 0.0


@inner
def gap_between(rows, axis, first, last, still, count):  # type: ignore[no-untyped-def]
    """Gap along direction ``axis`` (a row) between the points rows[first:last] and still[:count]; < 0: overlap."""
    x, y, z = rows[axis, 0], rows[axis, 1], rows[axis, 2]
    lo, hi, other_lo, other_hi = np.inf, -np.inf, np.inf, -np.inf
    for k in range(first, last):
        d = x * rows[k, 0] + y * rows[k, 1] + z * rows[k, 2]
        lo, hi = min(lo, d), max(hi, d)
    for k in range(count):
        d = x * still[k, 0] + y * still[k, 1] + z * still[k, 2]
        other_lo, other_hi = min(other_lo, d), max(other_hi, d)
    return max(other_lo - hi, lo - other_hi)


@inner
def swept_gap(moving, still, count, lo, hi, enough, space):  # type: ignore[no-untyped-def]
    """Gap that the best of 25 planes proves for every angle in [lo, hi], and the best gap at the middle.

    Args:
        moving: (count, 3) corners at angle 0 in a frame whose x axis is the axis of the turn.
        still: (count, 3) corners of the other solid.
        count: 6 for prisms, 3 for triangles.
        lo, hi: less than half a turn apart.
        enough: the search ends once a plane proves this gap.
        space: (33, 3) work space.
    """
    middle, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
    c0, s0, c1, s1 = math.cos(lo), math.sin(lo), math.cos(hi), math.sin(hi)
    cm, sm, out = math.cos(middle), math.sin(middle), 1.0 / math.cos(half)
    tx, ty, tz = 0.0, 0.0, 0.0
    for k in range(count):
        x, y, z = moving[k, 0], moving[k, 1], moving[k, 2]
        my, mz = y * cm - z * sm, y * sm + z * cm
        at = MID + k
        space[at, 0], space[at, 1], space[at, 2] = x, my, mz
        at = 3 * k
        space[at, 0], space[at, 1], space[at, 2] = x, y * c0 - z * s0, y * s0 + z * c0
        space[at + 1, 0], space[at + 1, 1], space[at + 1, 2] = x, y * c1 - z * s1, y * s1 + z * c1
        space[at + 2, 0], space[at + 2, 1], space[at + 2, 2] = x, my * out, mz * out
        tx, ty, tz = tx + x - still[k, 0], ty + my - still[k, 1], tz + mz - still[k, 2]
    size = math.sqrt(tx * tx + ty * ty + tz * tz)
    scale = 1.0 / size if size > 0.0 else 0.0
    space[AXIS, 0], space[AXIS, 1], space[AXIS, 2] = tx * scale, ty * scale, tz * scale
    best, at_middle = -np.inf, -np.inf
    for k in range(-1, len(AXES)):
        if k == 0:
            unit_directions(still, space, STILL)
            unit_directions(space[MID : MID + 3], space, MOVING)
        if k < 0:
            if scale == 0.0:
                continue
        elif not cross(space, AXES[k, 0], AXES[k, 1], AXIS):
            continue
        gap = gap_between(space, AXIS, MID, MID + count, still, count)
        at_middle = max(at_middle, gap)
        if gap > best:  # no gap of an interval is more than that at its middle
            best = max(best, gap_between(space, AXIS, 0, 3 * count, still, count))
            if best >= enough:
                break
    return best, at_middle


@inner
def pair_margin(moving, still, count, turn, slack, enough, space, stack, found):  # type: ignore[no-untyped-def]
    """Prove a pair free for all angles in [0, turn], as far as that goes.

    Args:
        moving, still, count, enough, space: as in ``swept_gap``.
        turn: > 0.
        slack: what a gap must exceed to count.
        stack: (80, 2) work space.
        found: (3,) receives the proven distance, and the first and the last angle that stay open.

    Returns:
        (FREE, OPEN, or CONTACT if the solids overlap at the first open angle; number of intervals looked at)
    """
    found[0], found[1], found[2] = enough, -1.0, -1.0
    pieces = max(1, math.ceil(turn / (0.5 * math.pi)))
    top = 0
    for k in range(pieces - 1, -1, -1):
        stack[top, 0], stack[top, 1] = turn * k / pieces, turn * (k + 1) / pieces
        top += 1
    # the end of the turn first, as an interval of no width: that is where solids come nearest
    stack[top, 0], stack[top, 1] = turn, turn
    top += 1
    state, used, least = FREE, 0, enough
    while top > 0:
        top -= 1
        lo, hi = stack[top, 0], stack[top, 1]
        used += 1
        gap, at_middle = swept_gap(moving, still, count, lo, hi, enough + slack, space)
        least = min(least, at_middle - slack)
        if gap > slack and (gap - slack >= TIGHT * least or used > MOST_FOR_TIGHT):
            found[0] = min(found[0], gap - slack)
            continue
        if lo == hi:
            continue  # the intervals that end here will tell
        if at_middle < -slack or used >= MOST_INTERVALS:
            if state == FREE:
                found[1] = lo
            found[2] = turn
            return (CONTACT if at_middle < -slack else OPEN), used
        if hi - lo < LEAST_INTERVAL_RAD:
            if gap > slack:
                found[0] = min(found[0], gap - slack)
                continue
            if state == FREE:
                found[1] = lo
            state, found[2] = OPEN, hi
            continue
        middle = 0.5 * (lo + hi)
        stack[top, 0], stack[top, 1] = middle, hi
        stack[top + 1, 0], stack[top + 1, 1] = lo, middle
        top += 2
    return state, used


@inner
def to_frame(points, frame, out):  # type: ignore[no-untyped-def]
    """Points (K, 3) into the frame (4, 3): origin, x, y and z direction; returns the largest distance."""
    largest = 0.0
    for k in range(len(points)):
        x, y, z = points[k, 0] - frame[0, 0], points[k, 1] - frame[0, 1], points[k, 2] - frame[0, 2]
        for d in range(3):
            out[k, d] = x * frame[d + 1, 0] + y * frame[d + 1, 1] + z * frame[d + 1, 2]
        largest = max(largest, math.sqrt(x * x + y * y + z * z))
    return largest


@inner
def turn_points(points, frame, c, s):  # type: ignore[no-untyped-def]
    """Turn points (K, 3) in place about the x direction of ``frame``; c, s: cosine and sine of the angle."""
    for k in range(len(points)):
        x, y, z = points[k, 0] - frame[0, 0], points[k, 1] - frame[0, 1], points[k, 2] - frame[0, 2]
        a = x * frame[1, 0] + y * frame[1, 1] + z * frame[1, 2]
        b = x * frame[2, 0] + y * frame[2, 1] + z * frame[2, 2]
        h = x * frame[3, 0] + y * frame[3, 1] + z * frame[3, 2]
        b, h = b * c - h * s, b * s + h * c
        for d in range(3):
            points[k, d] = frame[0, d] + a * frame[1, d] + b * frame[2, d] + h * frame[3, d]


@inner
def axis_frame(hinge, sign, frame):  # type: ignore[no-untyped-def]
    """Frame (4, 3) about a hinge (2, 3), x along it (against it for sign < 0); returns the hinge's length."""
    length = 0.0
    for d in range(3):
        frame[0, d] = hinge[0, d]
        frame[1, d] = sign * (hinge[1, d] - hinge[0, d])
        length += frame[1, d] * frame[1, d]
    length = math.sqrt(length)
    least = 0
    for d in range(3):
        frame[1, d] /= length
        if abs(frame[1, d]) <= abs(frame[1, least]):
            least = d
        frame[3, d] = 0.0
    frame[3, least] = 1.0
    cross(frame, 3, 1, 2)
    cross(frame, 1, 2, 3)
    return length


@inner
def bounds_about(points, out):  # type: ignore[no-untyped-def]
    """Bounds of a convex solid (K, 3) about the x axis into ``out``: x from, to, least and largest radius."""
    out[0], out[1], out[2], out[3] = np.inf, -np.inf, np.inf, 0.0
    y, z = 0.0, 0.0
    for k in range(len(points)):
        out[0], out[1] = min(out[0], points[k, 0]), max(out[1], points[k, 0])
        out[3] = max(out[3], math.sqrt(points[k, 1] * points[k, 1] + points[k, 2] * points[k, 2]))
        y += points[k, 1]
        z += points[k, 2]
    size = math.sqrt(y * y + z * z)
    if size == 0.0:
        out[2] = 0.0
        return
    y, z = y / size, z / size
    for k in range(len(points)):
        out[2] = min(out[2], y * points[k, 1] + z * points[k, 2])


@entry
def certify_folds(  # type: ignore[no-untyped-def]
    solids, sharp, until, hinges, parent, preorder, first, last, folds, enough, results, pairs,
):  # fmt: skip
    """Replay the folds of a plan and prove every pair of a moving and a still solid free.

    Args:
        solids: (N, 9, 3) corners in the flat sheet: 0-5 prism, 6-8 inset mid triangle; the faces of the net first.
            Changed in place to the end of the plan.
        sharp: (N,) the mid triangle sticks out of the prism and is proven as well.
        until: (N,) number of the fold from which on a solid is gone.
        hinges: (n, 2, 3) ends of the crease of every face in the flat sheet; changed in place.
        parent: (n,) parent face, -1 for the base.
        preorder, first, last: subtrees of the faces, see ``tree_kernels.subtree_ranges``.
        folds: (M, 2) face and turn in rad (signed) of every fold, in order.
        enough: distances are told up to this one, mm.
        results: (M, 4) receives per fold: proven distance of the pairs that are free, pairs, pairs that needed
            planes, intervals.
        pairs: (K, 6) receives the pairs that stay open: fold, moving and still solid, state, first and last
            open angle.

    Returns:
        (number of open pairs, which may exceed K; largest error bound of a coordinate, mm)
    """
    total, faces = len(solids), len(parent)
    error, hinge_error = np.zeros(total), np.zeros(faces)
    centres, radii = np.empty((total, 1, 3)), np.empty(total)
    for s in range(total):
        for d in range(3):
            centres[s, 0, d] = 0.0
            for k in range(9):
                centres[s, 0, d] += solids[s, k, d] / 9.0
        radii[s] = 0.0
        for k in range(9):
            far = 0.0
            for d in range(3):
                far += (solids[s, k, d] - centres[s, 0, d]) ** 2
            radii[s] = max(radii[s], math.sqrt(far))
        radii[s] += 1e-6
    mask = np.zeros(total, np.bool_)
    frame, space, stack, found = np.empty((4, 3)), np.empty((33, 3)), np.empty((80, 2)), np.empty(3)
    mov, mov_bounds = np.empty((faces, 9, 3)), np.empty((faces, 4))
    still, bounds, centre = np.empty((9, 3)), np.empty(4), np.empty((1, 3))
    open_pairs = 0
    for i in range(len(folds)):
        face, turn = int(folds[i, 0]), folds[i, 1]
        members = preorder[first[face] : last[face]]
        length = axis_frame(hinges[face], 1.0 if turn > 0.0 else -1.0, frame)
        x_lo, x_hi, r_lo, r_hi, reach = np.inf, -np.inf, np.inf, 0.0, 0.0
        member_error = 0.0
        for k in range(len(members)):
            m = members[k]
            mask[m] = True
            reach = max(reach, to_frame(solids[m], frame, mov[k]))
            bounds_about(mov[k], mov_bounds[k])
            x_lo, x_hi = min(x_lo, mov_bounds[k, 0]), max(x_hi, mov_bounds[k, 1])
            r_lo, r_hi = min(r_lo, mov_bounds[k, 2]), max(r_hi, mov_bounds[k, 3])
            member_error = max(member_error, error[m])
        # a line through two points that are off by e, at a distance of reach: off by 2 e (1 + 2 reach / length)
        off_axis = 2.0 * hinge_error[face] * (1.0 + 2.0 * (2.0 * reach + 1.0) / length)
        results[i, 0], results[i, 1], results[i, 2], results[i, 3] = enough, 0.0, 0.0, 0.0
        for s in range(total):
            if mask[s] or until[s] <= i:
                continue
            results[i, 1] += len(members) - (1 if s == parent[face] else 0)
            to_frame(centres[s], frame, centre)
            near = radii[s] + enough + 1e-6
            radius = math.sqrt(centre[0, 1] * centre[0, 1] + centre[0, 2] * centre[0, 2])
            if centre[0, 0] + near < x_lo or centre[0, 0] - near > x_hi:
                continue
            if radius - near > r_hi or radius + near < r_lo:
                continue
            size = max(reach, to_frame(solids[s], frame, still))
            bounds_about(still, bounds)
            for k in range(len(members)):
                m = members[k]
                if m == face and s == parent[face]:
                    continue
                slack = error[m] + error[s] + 2.0 * off_axis + ROUNDING * size
                gap = max(bounds[0] - mov_bounds[k, 1], mov_bounds[k, 0] - bounds[1])
                gap = max(gap, max(bounds[2] - mov_bounds[k, 3], mov_bounds[k, 2] - bounds[3]))
                if gap >= enough + slack:
                    continue
                results[i, 2] += 1.0
                state, proven = FREE, enough
                for body in range(2 if sharp[m] or sharp[s] else 1):  # the prisms, then the middle triangles
                    lo, hi = (0, 6) if body == 0 else (6, 9)
                    state, used = pair_margin(
                        mov[k, lo:hi], still[lo:hi], hi - lo, abs(turn), slack, enough, space, stack, found
                    )
                    results[i, 3] += used
                    proven = min(proven, found[0])
                    if state != FREE:
                        break
                if state == FREE:
                    results[i, 0] = min(results[i, 0], proven)
                else:
                    if open_pairs < len(pairs):
                        pairs[open_pairs, 0], pairs[open_pairs, 1], pairs[open_pairs, 2] = i, m, s
                        pairs[open_pairs, 3], pairs[open_pairs, 4], pairs[open_pairs, 5] = (
                            state,
                            found[1],
                            found[2],
                        )
                    open_pairs += 1
        c, s_ = math.cos(abs(turn)), math.sin(abs(turn))
        added = 2.0 * off_axis + ROUNDING * reach
        for m in members:
            mask[m] = False
            turn_points(solids[m], frame, c, s_)
            turn_points(centres[m], frame, c, s_)
            error[m] += added
            if m != face:
                turn_points(hinges[m], frame, c, s_)
                hinge_error[m] += added
    return open_pairs, error.max()
