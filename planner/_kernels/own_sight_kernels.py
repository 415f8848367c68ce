"""A quick bound on what a net cannot fold, and changes of nets by it: sight past what hangs on each crease."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.beam_kernels import OVERHANG_RAD
from planner._kernels.compiled import entry, inner
from planner._kernels.nb_kernels import draw, joining_edges, tree_path
from planner._kernels.net_arrays import (
    BASE,
    CENTRE,
    CORNER,
    CREASE,
    DEPTH,
    FACES,
    FROZEN,
    HOPS,
    ORDER,
    PARENT,
    SIDE,
    SIDES,
    SLOT,
    TREE,
)
from planner._kernels.net_kernels import component, move_part, moved_overlaps, root_tree, swap, unmark
from planner._kernels.plan_kernels import ANGLE_WEIGHT, MOST_OVERLOAD, OVERLOAD_WEIGHT, SHAPE_WEIGHT
from planner._kernels.shadow_kernels import WORDS, samples_seen
from planner._kernels.tree_kernels import subtree_ranges

MOMENTS = 13
"""Sums over what hangs on a crease: faces, centroids, their products (xx xy xz yy yz zz), area, area by place."""

SIZE_MM, WEIGHT, SAFE, STEEP, FRACTION = 0, 1, 2, 3, 4
"""Places in the figures of a table: longest side of the goal, weight over plastic moment of the sheet, load without
remark, slope of the most tilted beam, and from the last on the shares of an angle at which is looked."""

START, ALONG, LENGTH, ANGLE = 0, 3, 6, 7
"""Places in the row of a crease: start and direction on the goal, length, signed goal angle."""

LEAST_LOST_RAD = 0.02
"""Weight with which a crease is chosen that misses next to nothing."""

AXIS_PERCENT, BASE_PERCENT, ANYWHERE_PERCENT, AXIS_STEP_RAD = 8, 8, 15, 0.4
"""Changes of the axis, of the base, and of a crease anywhere, in a hundred; largest small turn of the axis."""

SOLVED = 1e-6
"""A net that costs no more has nothing left to mend."""


@inner
def _side_of(s, child):  # type: ignore[no-untyped-def]
    """Number of the crease of face ``child``: twice its edge, and 1 more if the child is the second face there."""
    e = s.node[CREASE, child]
    return 2 * e if s.edge[e, FACES] == child else 2 * e + 1


@inner
def _crease_line(s, f):  # type: ignore[no-untyped-def]
    """Start and vector of the crease of face ``f`` in the plane."""
    k = s.node[SLOT, f]
    n = 0 if k == 2 else k + 1
    x, y = s.real[f, CORNER + 2 * k], s.real[f, CORNER + 2 * k + 1]
    return x, y, s.real[f, CORNER + 2 * n] - x, s.real[f, CORNER + 2 * n + 1] - y


@inner
def _base_heading(s):  # type: ignore[no-untyped-def]
    """Direction of the base's side 0 in the plane, rad."""
    f = s.number[BASE]
    return math.atan2(
        s.real[f, CORNER + 3] - s.real[f, CORNER + 1], s.real[f, CORNER + 2] - s.real[f, CORNER]
    )


@inner
def _heading(dx, dy, ax, ay, count):  # type: ignore[no-untyped-def]
    """Which of ``count`` directions over half a turn the axis (ax, ay) has, seen from a crease along (dx, dy)."""
    angle = math.atan2(dx * ay - dy * ax, dx * ax + dy * ay)
    if angle < 0.0:
        angle += math.pi
    return min(count - 1, int(angle * count / math.pi))


@inner
def own_cost(s, table, ax, ay, masks, sums, lost):  # type: ignore[no-untyped-def]
    """Cost of what a rooted net misses since the turning part hides its own crease, as ``candidate.cost``.

    Args:
        s: the net, rooted and laid out.
        table: see ``planner.own_sight``.
        ax, ay: unit direction of the rotary axis in the plane of the layout.
        masks, sums: (F, WORDS) and (F, MOMENTS) work space.
        lost: (F,) angle missing at the crease of each face, rad; the result.
    """
    rows, bits, sides_of, faces, figures = table
    leaning = bits.shape[1] - len(sides_of)
    node, real = s.node, s.real
    n = node.shape[1]
    sides, headings = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        f = node[ORDER, i]
        lost[f] = 0.0
        x, y, z, a = faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3]
        sums[f, 0], sums[f, 1], sums[f, 2], sums[f, 3] = 1.0, x, y, z
        sums[f, 4], sums[f, 5], sums[f, 6] = x * x, x * y, x * z
        sums[f, 7], sums[f, 8], sums[f, 9] = y * y, y * z, z * z
        sums[f, 10], sums[f, 11], sums[f, 12] = a, a * real[f, CENTRE], a * real[f, CENTRE + 1]
        if i == 0:
            continue
        d = _side_of(s, f)
        sides[f], headings[f] = d, -1
        if sides_of[d, ANGLE] != 0.0:
            _, _, dx, dy = _crease_line(s, f)
            b = _heading(dx, dy, ax, ay, len(bits))
            headings[f] = b
            for w in range(WORDS):
                masks[f, w] = bits[b, leaning + d, w]
    preorder, first, last = subtree_ranges(node[PARENT], node[ORDER])
    for i in range(1, n):
        f = node[ORDER, i]
        b = headings[f]
        if b >= 0:  # all that hangs on one crease at once: its rows lie side by side
            d = sides[f]
            for p in range(first[f] + 1, last[f]):
                row = rows[d, preorder[p]]
                if row >= 0:
                    for w in range(WORDS):
                        masks[f, w] |= bits[b, row, w]
    wanted, missing, shape, overload = 0.0, 0.0, 0.0, 0.0
    for i in range(n - 1, 0, -1):
        f = node[ORDER, i]
        if headings[f] >= 0:
            d = sides[f]
            goal, length = abs(sides_of[d, ANGLE]), sides_of[d, LENGTH]
            wanted += goal
            x0, y0, dx, dy = _crease_line(s, f)
            less = goal * (1.0 - figures[FRACTION + samples_seen(masks[f])])
            # the face itself leans over its crease by no more than the most tilted beam allows
            steep = figures[STEEP] * abs(dx * ax + dy * ay) / length
            less = max(less, goal - 0.5 * math.pi - math.atan(steep) - OVERHANG_RAD)
            if less > 0.0:
                lost[f] = less
                missing += less
                shape += 0.25 * less * less * _lever_squared(sums[f], sides_of[d]) / n
            arm = abs(dx * (sums[f, 12] - sums[f, 10] * y0) - dy * (sums[f, 11] - sums[f, 10] * x0))
            overload += max(0.0, figures[WEIGHT] * arm / (length * length) - figures[SAFE])
        p = node[PARENT, f]
        for m in range(MOMENTS):
            sums[p, m] += sums[f, m]
    return (
        SHAPE_WEIGHT * math.sqrt(shape) / figures[SIZE_MM]
        + ANGLE_WEIGHT * missing / max(1e-9, wanted)
        + OVERLOAD_WEIGHT * min(overload, MOST_OVERLOAD)
    )


@inner
def _lever_squared(sums, crease):  # type: ignore[no-untyped-def]
    """Sum of the squared distances of what hangs on a crease from its line, mm²."""
    ox, oy, oz = crease[START], crease[START + 1], crease[START + 2]
    ux, uy, uz = crease[ALONG], crease[ALONG + 1], crease[ALONG + 2]
    count, at = sums[0], ox * ux + oy * uy + oz * uz
    away = sums[4] + sums[7] + sums[9] - 2.0 * (ox * sums[1] + oy * sums[2] + oz * sums[3])
    along = ux * ux * sums[4] + uy * uy * sums[7] + uz * uz * sums[9]
    along += 2.0 * (ux * uy * sums[5] + ux * uz * sums[6] + uy * uz * sums[8])
    along -= 2.0 * at * (ux * sums[1] + uy * sums[2] + uz * sums[3])
    return max(0.0, away + count * (ox * ox + oy * oy + oz * oz) - along - count * at * at)


@inner
def _some_hider(s, table, ax, ay, f, rng):  # type: ignore[no-untyped-def]
    """A random face of those that hang on ``f`` and hide something of its crease; -1 if none does."""
    rows, bits = table[0], table[1]
    node = s.node
    d = _side_of(s, f)
    _, _, dx, dy = _crease_line(s, f)
    b = _heading(dx, dy, ax, ay, len(bits))
    found, count = np.int64(-1), 0
    for i in range(node.shape[1]):
        x = node[ORDER, i]
        hides, row = False, rows[d, x]
        for w in range(WORDS if row >= 0 else 0):
            hides = hides or bits[b, row, w] != 0
        if not hides:
            continue
        g = x
        while node[HOPS, g] > node[HOPS, f]:
            g = node[PARENT, g]
        if g == f and x != f:
            count += 1
            if draw(rng, count) == 0:
                found = x
    return found


@inner
def _has_free_side(s, least):  # type: ignore[no-untyped-def]
    """True if a side of the base panel that is at least so long is no crease."""
    node = s.node
    for i in range(node.shape[1]):
        f = node[ORDER, i]
        if node[DEPTH, f] != 0:
            continue
        for k in range(3):
            e = node[SIDES + k, f]
            if s.real[f, SIDE + k] < least:
                continue
            if e < 0:
                return True
            g = s.edge[e, FACES + 1] if s.edge[e, FACES] == f else s.edge[e, FACES]
            if s.edge[e, TREE] == 0 and node[DEPTH, g] != 0:
                return True
    return False


@inner
def _replace_free(s, cut, joins, rng, tries):  # type: ignore[no-untyped-def]
    """Replace crease ``cut`` by a random edge so that nothing overlaps; the edge, or -1 if nothing was changed."""
    if s.edge[cut, FROZEN] != 0:
        return np.int64(-1)
    component(s, cut)
    few = joining_edges(s, joins)
    for _ in range(tries if few > 0 else 0):
        e = joins[draw(rng, few)]
        if moved_overlaps(s, e, np.int64(0), s.entry, np.int64(0), np.int64(0)) == 0:
            move_part(s, e)
            unmark(s)
            s.edge[cut, TREE], s.edge[e, TREE] = 0, 1
            root_tree(s, s.number[BASE])
            return e
    unmark(s)
    return np.int64(-1)


@entry
def own_cost_within(s, table, axis, path, limit, tries, rng, lost, out):  # type: ignore[no-untyped-def]
    """``own_cost`` of a net, after a crease of ``path`` was replaced, without overlap, if there are ``tries``.

    Args:
        s: the net, rooted and laid out; changed in place where it works out.
        table, lost: as in ``own_cost``.
        axis: direction of the rotary axis from the base's side 0, rad.
        path: (K,) creases to choose from, K > 0 if there are tries.
        limit: cost allowed of a changed net.
        tries: creases cut at random; 0: the net stays as it is.
        rng: (1,) state of the random numbers.
        out: (2,) the crease that was cut and the edge joined.

    Returns:
        the cost; -1 if no change was found
    """
    n = s.node.shape[1]
    masks, sums = np.zeros((n, WORDS), np.uint64), np.zeros((n, MOMENTS))
    joins = np.empty(len(s.edge) + 1, np.int64)
    for _ in range(max(1, tries)):
        if tries > 0:
            out[0] = path[draw(rng, len(path))]
            out[1] = _replace_free(s, out[0], joins, rng, 1)
            if out[1] < 0:
                continue
        heading = _base_heading(s) + axis  # the base may have moved
        cost = own_cost(s, table, math.cos(heading), math.sin(heading), masks, sums, lost)
        if tries == 0 or cost <= limit:
            return cost
        swap(s, out[1], out[0])
    return -1.0


@entry
def anneal_own(s, table, axis, rng, moves, warm, cold, least, move_base, best_tree, out):  # type: ignore[no-untyped-def]
    """Anneal an overlap-free net by ``own_cost``: net, base and rotary axis.

    Args:
        s: the net, rooted and laid out; changed in place.
        table: as in ``own_cost``.
        axis: (2,) unit direction of the rotary axis in the plane of the layout; changed in place.
        rng: (1,) state of the random numbers.
        moves: changes tried.
        warm, cold: temperatures between which it cools down, in cost.
        least: the base panel keeps a free side at least so long, mm.
        move_base: whether the base may change.
        best_tree: (M,) the best tree found.
        out: (3,) its cost, its base, and the direction of the axis from the base's side 0.
    """
    n = s.node.shape[1]
    masks, sums = np.zeros((n, WORDS), np.uint64), np.zeros((n, MOMENTS))
    lost, trial_lost = np.zeros(n), np.zeros(n)
    path, joins = np.empty(len(s.edge) + 1, np.int64), np.empty(len(s.edge) + 1, np.int64)
    cost, best, bar = np.inf, np.inf, np.inf
    for move in range(moves + 1):
        kind = -1 if move == 0 else draw(rng, 100)  # at first the net as it is
        if move > 0:
            temperature = warm * (cold / warm) ** (move / moves)
            bar = cost - temperature * math.log((draw(rng, 1 << 30) + 1.0) / (1 << 30))
        ax, ay, old, cut, join = axis[0], axis[1], s.number[BASE], np.int64(-1), np.int64(-1)
        if 0 <= kind < AXIS_PERCENT:
            angle = math.pi * draw(rng, 1000) / 1000.0
            if 2 * kind < AXIS_PERCENT:
                angle = math.atan2(ay, ax) + AXIS_STEP_RAD * (draw(rng, 2001) / 1000.0 - 1.0)
            axis[0], axis[1] = math.cos(angle), math.sin(angle)
        elif AXIS_PERCENT <= kind < AXIS_PERCENT + BASE_PERCENT:
            new = draw(rng, n)
            if kind < AXIS_PERCENT + BASE_PERCENT // 2:
                e = s.node[SIDES + draw(rng, 3), old]
                if e >= 0:
                    new = s.edge[e, FACES + 1] if s.edge[e, FACES] == old else s.edge[e, FACES]
            if not move_base or new == old:
                continue
            root_tree(s, new)
        elif kind >= 0:
            count = 0
            if kind < 100 - ANYWHERE_PERCENT:
                f = _lossy_face(lost, rng)
                if f >= 0:
                    path[0] = s.node[CREASE, f]
                    x = _some_hider(s, table, ax, ay, f, rng)
                    count = 1 if x < 0 else 1 + tree_path(s, f, x, path[1:])
            if count == 0:
                path[0] = s.node[CREASE, s.node[ORDER, 1 + draw(rng, n - 1)]]
                count = 1
            cut = path[draw(rng, count)]
            join = _replace_free(s, cut, joins, rng, 4)
            if join < 0:
                continue
        if (cut < 0 and s.number[BASE] == old) or _has_free_side(s, least):
            now = own_cost(s, table, axis[0], axis[1], masks, sums, trial_lost)
            if now <= bar:
                cost = now
                lost, trial_lost = trial_lost, lost
                if cost < best:
                    best = cost
                    for e in range(len(best_tree)):
                        best_tree[e] = s.edge[e, TREE] != 0
                    out[0], out[1] = best, s.number[BASE]
                    out[2] = math.atan2(axis[1], axis[0]) - _base_heading(s)
                if best <= SOLVED:
                    break
                continue
        axis[0], axis[1] = ax, ay
        if join >= 0:
            swap(s, join, cut)
        elif s.number[BASE] != old:
            root_tree(s, old)


@inner
def _lossy_face(lost, rng):  # type: ignore[no-untyped-def]
    """A random face, by what its crease misses; -1 if none misses anything."""
    total = 0.0
    for f in range(len(lost)):
        if lost[f] > 0.0:
            total += lost[f] + LEAST_LOST_RAD
    pick = total * draw(rng, 1 << 30) / (1 << 30)
    for f in range(len(lost)):
        if lost[f] > 0.0:
            pick -= lost[f] + LEAST_LOST_RAD
            if pick < 0.0:
                return np.int64(f)
    return np.int64(-1)
