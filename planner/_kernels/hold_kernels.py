"""How the base of a folded net could be held: cells of the sheet that no fold sweeps, from the base to the frame."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import entry, inner
from planner._kernels.plan_kernels import STEP_FOLD

FREE, SWEPT, NET, OUTSIDE = 0, 1, 2, 3
"""What a cell is."""

SAMPLE_CELLS = 0.75
"""Distance between the points of a face that are followed, in cells."""

BESIDE_CELLS = 0.5
"""A point sweeps the cells so far beside it, along both axes."""

NEAR_CELLS = 0.6
"""A cell belongs to the net if its middle is at most so far from a face."""

OUT_CELLS = 1.2
"""A way starts so far outside of a free side, in cells."""

BESIDE_MM = 0.3
"""A side with the net so far beside it is not free."""

SAME_MM = 1e-4
"""Points nearer to each other are the same."""

LEVEL_MM = 1e-6
"""A point at most so high lies in the sheet."""

SLIM_MM = 0.2
"""A way that begins at a neck stays so far from the net, while the cells about it belong to the net."""


@inner
def _sides(tri, out):  # type: ignore[no-untyped-def]
    """The three sides of a flat face as (3, 3): how far (x, y) lies inside of one is x a + y b + c."""
    for k in range(3):
        n = 0 if k == 2 else k + 1
        ex, ey = tri[n, 0] - tri[k, 0], tri[n, 1] - tri[k, 1]
        size = math.sqrt(ex * ex + ey * ey)
        out[k, 0], out[k, 1] = -ey / size, ex / size
        out[k, 2] = -out[k, 0] * tri[k, 0] - out[k, 1] * tri[k, 1]


@inner
def _within(sides, x, y, near):  # type: ignore[no-untyped-def]
    """True if a point is in a face or at most ``near`` beside it."""
    return (
        x * sides[0, 0] + y * sides[0, 1] + sides[0, 2] >= -near
        and x * sides[1, 0] + y * sides[1, 1] + sides[1, 2] >= -near
        and x * sides[2, 0] + y * sides[2, 1] + sides[2, 2] >= -near
    )


@inner
def _way_out(cells, corners, x0, y0, cell, mouth):  # type: ignore[no-untyped-def]
    """The first cell straight on from a neck that is not of the net; (-1, -1) if a face is in the way."""
    x, y = mouth[0], mouth[1]
    sides = np.empty((3, 3))
    while True:
        i, j = int((x - x0) / cell), int((y - y0) / cell)
        if not (0 <= i < cells.shape[0] and 0 <= j < cells.shape[1]):
            return -1, -1
        if cells[i, j] != NET:
            return i, j
        for f in range(len(corners)):
            _sides(corners[f], sides)
            if _within(sides, x, y, SLIM_MM):
                return -1, -1
        x, y = x + 0.5 * cell * mouth[2], y + 0.5 * cell * mouth[3]


@inner
def _mark_net(cells, corners, x0, y0, cell):  # type: ignore[no-untyped-def]
    """Mark the cells of the flat net."""
    near = NEAR_CELLS * cell
    sides = np.empty((3, 3))
    for f in range(len(corners)):
        _sides(corners[f], sides)
        lo_x, hi_x, lo_y, hi_y = np.inf, -np.inf, np.inf, -np.inf
        for k in range(3):
            lo_x, hi_x = min(lo_x, corners[f, k, 0]), max(hi_x, corners[f, k, 0])
            lo_y, hi_y = min(lo_y, corners[f, k, 1]), max(hi_y, corners[f, k, 1])
        for i in range(int((lo_x - near - x0) / cell), int((hi_x + near - x0) / cell) + 1):
            for j in range(int((lo_y - near - y0) / cell), int((hi_y + near - y0) / cell) + 1):
                if _within(sides, x0 + (i + 0.5) * cell, y0 + (j + 0.5) * cell, near):
                    cells[i, j] = NET


@inner
def _sweep(cells, tri, x0, y0, cell, hinge, turn):  # type: ignore[no-untyped-def]
    """Mark the free cells through which points of a face pass while it turns about a crease by ``turn``."""
    ox, oy, ux, uy = hinge[0], hinge[1], hinge[2], hinge[3]
    longest = 0.0
    for k in range(3):
        n = 0 if k == 2 else k + 1
        d = tri[n] - tri[k]
        longest = max(longest, math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]))
    count = max(1, math.ceil(longest / (SAMPLE_CELLS * cell)))
    for a in range(count + 1):
        for b in range(count + 1 - a):
            p = tri[0] + (tri[1] - tri[0]) * (a / count) + (tri[2] - tri[0]) * (b / count)
            along = (p[0] - ox) * ux + (p[1] - oy) * uy
            across = (p[1] - oy) * ux - (p[0] - ox) * uy
            if abs(p[2]) < LEVEL_MM:
                continue  # it lies in the sheet and leaves it
            reach = math.sqrt(across * across + p[2] * p[2])
            angle = math.atan2(p[2], across)
            for side in range(2):
                # the angle at which it lies in the sheet: on the side across, or on the other
                way = (-angle if side == 0 else math.pi - angle) * (1.0 if turn > 0.0 else -1.0)
                while way < 0.0:
                    way += 2.0 * math.pi
                if way >= abs(turn):
                    continue
                y = reach if side == 0 else -reach
                at_x, at_y = (ox + along * ux - y * uy - x0) / cell, (oy + along * uy + y * ux - y0) / cell
                for corner in range(4):
                    i = int(at_x + (BESIDE_CELLS if corner % 2 == 0 else -BESIDE_CELLS))
                    j = int(at_y + (BESIDE_CELLS if corner < 2 else -BESIDE_CELLS))
                    if 0 <= i < cells.shape[0] and 0 <= j < cells.shape[1] and cells[i, j] == FREE:
                        cells[i, j] = SWEPT


@inner
def _fewest_swept(cells, starts, count):  # type: ignore[no-untyped-def]
    """Fewest swept cells on a way from the starts to the outside; -1 if the net is in every way."""
    rows, columns = cells.shape
    far = rows * columns + 1
    cost = np.full((rows, columns), far, np.int64)
    now, later = np.empty((8 * far, 2), np.int64), np.empty((8 * far, 2), np.int64)
    used = 0
    for s in range(count):
        i, j = starts[s, 0], starts[s, 1]
        if cells[i, j] != NET:
            cost[i, j] = 1 if cells[i, j] == SWEPT else 0
            now[used, 0], now[used, 1] = i, j
            used += 1
    level = 0
    best = far
    while used > 0 and level < best:
        waiting = 0
        while used > 0:
            used -= 1
            i, j = now[used, 0], now[used, 1]
            if cost[i, j] > level:
                if waiting < len(later):
                    later[waiting, 0], later[waiting, 1] = i, j
                    waiting += 1
                continue
            if cells[i, j] == OUTSIDE:
                best = min(best, cost[i, j])
                continue
            for k in range(4):
                p = i + (1 if k == 0 else -1 if k == 1 else 0)
                q = j + (1 if k == 2 else -1 if k == 3 else 0)
                if not (0 <= p < rows and 0 <= q < columns) or cells[p, q] == NET:
                    continue
                new = cost[i, j] + (1 if cells[p, q] == SWEPT else 0)
                if new < cost[p, q]:
                    cost[p, q] = new
                    if new == level and used < len(now):
                        now[used, 0], now[used, 1] = p, q
                        used += 1
                    elif waiting < len(later):
                        later[waiting, 0], later[waiting, 1] = p, q
                        waiting += 1
        now, later, used = later, now, waiting
        level += 1
    return best if best < far else -1


@inner
def _is_joined(corners, parent, slot, face, side):  # type: ignore[no-untyped-def]
    """True if the tree joins another face to this side."""
    if parent[face] >= 0 and slot[face] == side:
        return True
    n = 0 if side == 2 else side + 1
    for c in range(len(parent)):
        if parent[c] != face:
            continue
        a, b = slot[c], 0 if slot[c] == 2 else slot[c] + 1
        apart = 0.0
        for d in range(2):
            apart += abs(corners[c, a, d] - corners[face, n, d]) + abs(
                corners[c, b, d] - corners[face, side, d]
            )
        if apart < SAME_MM:
            return True
    return False


@inner
def _is_covered(corners, x, y):  # type: ignore[no-untyped-def]
    """True if a face of the flat net lies there."""
    sides = np.empty((3, 3))
    for f in range(len(corners)):
        _sides(corners[f], sides)
        if _within(sides, x, y, 0.0):
            return True
    return False


@entry
def hold_gap(  # type: ignore[no-untyped-def]
    corners, parent, slot, preorder, first, last, hinges, panel, steps, base, room, cell, least, mouths,
):  # fmt: skip
    """Cells swept by the folds that lie between the base panel and the frame, at least, on any way around the net.

    Args:
        corners: (F, 3, 2) the flat net, mm.
        parent, slot: (F,) parent of each face, -1 for the base, and its side towards that.
        preorder, first, last, hinges: as in ``fold_greedily``.
        panel: (F,) flat panel of each face.
        steps: (S, 3) as from there.
        base: the stationary face.
        room: gap between the net and the frame, mm.
        cell: side of a cell, mm.
        least: sides of the base panel from this length on can hold a tab, mm.
        mouths: (K, 4) ends of necks from which a way may lead, mm, and the directions of these.

    Returns:
        number of cells; -1 if the net leaves no way, or there is nothing to start from
    """
    n = len(corners)
    solids = np.zeros((n, 3, 3))
    x0, y0, x1, y1 = np.inf, np.inf, -np.inf, -np.inf
    for f in range(n):
        for k in range(3):
            x, y = corners[f, k, 0], corners[f, k, 1]
            solids[f, k, 0], solids[f, k, 1] = x, y
            x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
    x0, y0 = x0 - room - 2.0 * cell, y0 - room - 2.0 * cell
    rows, columns = int((x1 + room - x0) / cell) + 3, int((y1 + room - y0) / cell) + 3
    cells = np.zeros((rows, columns), np.int8)
    for i in range(rows):
        for j in range(columns):
            if min(i, j, rows - 1 - i, columns - 1 - j) < 2:
                cells[i, j] = OUTSIDE
    _mark_net(cells, corners, x0, y0, cell)
    starts, count = np.empty((rows * columns, 2), np.int64), 0
    for f in range(n):
        if panel[f] != panel[base]:
            continue
        for k in range(3):
            e = 0 if k == 2 else k + 1
            dx, dy = corners[f, e, 0] - corners[f, k, 0], corners[f, e, 1] - corners[f, k, 1]
            length = math.sqrt(dx * dx + dy * dy)
            if length < least or _is_joined(corners, parent, slot, f, k):
                continue
            points = max(1, int(length / cell))
            for p in range(points):
                share = (p + 0.5) / points
                x, y = corners[f, k, 0] + share * dx, corners[f, k, 1] + share * dy
                out_x, out_y = dy / length, -dx / length
                if _is_covered(corners, x + BESIDE_MM * out_x, y + BESIDE_MM * out_y):
                    continue
                i, j = (
                    int((x + OUT_CELLS * cell * out_x - x0) / cell),
                    int((y + OUT_CELLS * cell * out_y - y0) / cell),
                )
                if cells[i, j] != NET and count < len(starts):
                    starts[count, 0], starts[count, 1] = i, j
                    count += 1
    if count == 0 and len(mouths) == 0:
        return -1
    angle, turned = np.zeros(n), np.empty((3, 3))
    for step in range(len(steps)):
        if steps[step, 0] != STEP_FOLD:
            continue
        f = int(steps[step, 1])
        turn = steps[step, 2] - angle[f]
        angle[f] = steps[step, 2]
        c, s = math.cos(turn), math.sin(turn)
        ox, oy, ux, uy = hinges[f, 0], hinges[f, 1], hinges[f, 2], hinges[f, 3]
        for m in preorder[first[f] : last[f]]:
            lowest, highest = np.inf, -np.inf
            for k in range(3):
                dx, dy, z = solids[m, k, 0] - ox, solids[m, k, 1] - oy, solids[m, k, 2]
                along, across = dx * ux + dy * uy, dy * ux - dx * uy
                lowest, highest = min(lowest, z), max(highest, z)
                across, z = across * c - z * s, across * s + z * c
                lowest, highest = min(lowest, z), max(highest, z)
                turned[k, 0], turned[k, 1] = ox + along * ux - across * uy, oy + along * uy + across * ux
                turned[k, 2] = z
            # by less than half a turn nothing goes through the sheet that is on one side before and after
            if lowest < -LEVEL_MM and highest > LEVEL_MM:
                _sweep(cells, solids[m], x0, y0, cell, hinges[f], turn)
            for k in range(3):
                for d in range(3):
                    solids[m, k, d] = turned[k, d]
    for m in range(len(mouths)):
        i, j = _way_out(cells, corners, x0, y0, cell, mouths[m])
        if i >= 0 and count < len(starts):
            starts[count, 0], starts[count, 1] = i, j
            count += 1
    return _fewest_swept(cells, starts, count)
