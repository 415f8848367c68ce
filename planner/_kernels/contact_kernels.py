"""First contact of convex prisms under a rotation about a fixed line, in closed form.

With the axis through the origin along x, a point (x, y, z) of the moving part turns to
(x, y cos t - z sin t, y sin t + z cos t). "Vertex meets plane" and "edge meets edge" (the side product of
two Pluecker lines) are linear in cos t and sin t, so every event is a root of A cos t + B sin t + C = 0.
The first contact of two disjoint convex bodies is always such an event.
"""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import entry, inner
from planner._kernels.sector_kernels import is_far, sector, sectors_apart, to_axis_frame
from planner._kernels.separation_kernels import LARGEST_TURN_RAD, plane_between

INSIDE_MM = 1e-7
"""A point counts as inside a face, and a crossing as on a segment, within this distance."""

BLOCK, SUPER_BLOCK = 8, 64
"""Moving solids are looked at in blocks of so many, neighbours in the tree, if a block is near enough at all."""

ROUNDING = 1e-12
"""What the comparison of two cosines is widened by."""

PRISM_EDGES = np.array([0, 1, 1, 2, 2, 0, 3, 4, 4, 5, 5, 3, 0, 3, 1, 4, 2, 5], dtype=np.int64)
TRIANGLE_EDGES = np.array([0, 1, 1, 2, 2, 0], dtype=np.int64)


@inner
def roots(a, b, c, limit, cos_limit, sin_limit, out):  # type: ignore[no-untyped-def]
    """Roots in (0, limit) of a cos t + b sin t + c, ascending, into ``out`` (2,); returns how many.

    ``limit`` is at most pi, and ``cos_limit``, ``sin_limit`` are its cosine and sine: most functions are
    ruled out by their signs at both ends, without trigonometry.
    """
    at_start, at_end = a + c, a * cos_limit + b * sin_limit + c
    if at_start * at_end > 0.0:
        # same sign at both ends: two roots need an extremum of the other sign between them
        slope_end = b * cos_limit - a * sin_limit
        if at_start > 0.0:
            if b >= 0.0 or slope_end <= 0.0:
                return 0
        elif b <= 0.0 or slope_end >= 0.0:
            return 0
    size = math.sqrt(a * a + b * b)
    if size < 1e-14 or abs(c) > size:
        return 0
    middle = math.atan2(b, a)
    half = math.acos(-c / size)
    count = 0
    for k in range(2):
        t = middle - half if k == 0 else middle + half
        if t < 0.0:
            t += 2.0 * math.pi
        if t >= 2.0 * math.pi:
            t -= 2.0 * math.pi
        if 1e-12 < t < limit:
            out[count] = t
            count += 1
    if count == 2 and out[0] > out[1]:
        out[0], out[1] = out[1], out[0]
    return count


@inner
def prism_planes(points, planes):  # type: ignore[no-untyped-def]
    """Outward planes (5, 4) n.x <= d of a triangular prism (6, 3): bottom 0 1 2, top 3 4 5."""
    for k in range(5):
        if k == 0:
            i, j, m, other = 0, 1, 2, 3
        elif k == 1:
            i, j, m, other = 3, 4, 5, 0
        else:
            i = k - 2
            j = (i + 1) % 3
            m = i + 3
            other = (i + 2) % 3
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[m, 0] - points[i, 0], points[m, 1] - points[i, 1], points[m, 2] - points[i, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        size = math.sqrt(nx * nx + ny * ny + nz * nz)
        if size < 1e-15:
            size = 1e-15
        nx, ny, nz = nx / size, ny / size, nz / size
        d = nx * points[i, 0] + ny * points[i, 1] + nz * points[i, 2]
        if nx * points[other, 0] + ny * points[other, 1] + nz * points[other, 2] > d:
            nx, ny, nz, d = -nx, -ny, -nz, -d
        planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3] = nx, ny, nz, d


@inner
def _vertices_meet_prism(points, planes, sign, limit, scratch):  # type: ignore[no-untyped-def]
    """First t in (0, limit] at which a turning vertex (sign = direction of the turn) enters the prism."""
    best = limit
    cb, sb = math.cos(best), math.sin(best)
    for v in range(6):
        x, y, z = points[v, 0], points[v, 1], sign * points[v, 2]
        for k in range(5):
            nx, ny, nz, d = planes[k, 0], planes[k, 1], sign * planes[k, 2], planes[k, 3]
            count = roots(ny * y + nz * z, nz * y - ny * z, nx * x - d, best, cb, sb, scratch)
            for r in range(count):
                t = scratch[r]
                if t >= best:
                    break
                c, s = math.cos(t), math.sin(t)
                py, pz = y * c - z * s, sign * (y * s + z * c)
                inside = True
                for o in range(5):
                    if (
                        o != k
                        and planes[o, 0] * x + planes[o, 1] * py + planes[o, 2] * pz > planes[o, 3] + 1e-7
                    ):
                        inside = False
                        break
                if inside:
                    best, cb, sb = t, math.cos(t), math.sin(t)
    return best


@inner
def _edges_meet(moving, moving_edges, still, still_edges, limit, scratch):  # type: ignore[no-untyped-def]
    """First t in (0, limit] at which an edge of the moving body crosses an edge of the still one."""
    best = limit
    cb, sb = math.cos(best), math.sin(best)
    for e in range(0, len(moving_edges), 2):
        i, j = moving_edges[e], moving_edges[e + 1]
        px, py, pz = moving[i, 0], moving[i, 1], moving[i, 2]
        dx, dy, dz = moving[j, 0] - px, moving[j, 1] - py, moving[j, 2] - pz
        mx, my, mz = py * dz - pz * dy, pz * dx - px * dz, px * dy - py * dx
        for g in range(0, len(still_edges), 2):
            k, m = still_edges[g], still_edges[g + 1]
            qx, qy, qz = still[k, 0], still[k, 1], still[k, 2]
            ex, ey, ez = still[m, 0] - qx, still[m, 1] - qy, still[m, 2] - qz
            nx, ny, nz = qy * ez - qz * ey, qz * ex - qx * ez, qx * ey - qy * ex
            a = dy * ny + dz * nz + my * ey + mz * ez
            b = dy * nz - dz * ny + my * ez - mz * ey
            count = roots(a, b, dx * nx + mx * ex, best, cb, sb, scratch)
            for r in range(count):
                t = scratch[r]
                if t >= best:
                    break
                c, s = math.cos(t), math.sin(t)
                ux, uy, uz = dx, dy * c - dz * s, dy * s + dz * c
                wx, wy, wz = qx - px, qy - (py * c - pz * s), qz - (py * s + pz * c)
                uu, ee, ue = (
                    ux * ux + uy * uy + uz * uz,
                    ex * ex + ey * ey + ez * ez,
                    ux * ex + uy * ey + uz * ez,
                )
                det = uu * ee - ue * ue
                if det < 1e-12 * uu * ee:
                    continue  # parallel edges: a vertex event finds this contact
                wu, we = wx * ux + wy * uy + wz * uz, wx * ex + wy * ey + wz * ez
                f = (wu * ee - we * ue) / det
                h = (wu * ue - we * uu) / det
                tol_f, tol_h = 1e-7 / math.sqrt(uu), 1e-7 / math.sqrt(ee)
                if -tol_f <= f <= 1.0 + tol_f and -tol_h <= h <= 1.0 + tol_h:
                    best, cb, sb = t, math.cos(t), math.sin(t)
    return best


@inner
def prisms_meet(moving, still, limit, planes_m, planes_s, scratch):  # type: ignore[no-untyped-def]
    """First t in (0, limit) at which the prism ``moving`` (6, 3), turning about x, meets ``still``; else limit.

    The prisms must be disjoint at t = 0. ``planes_m``, ``planes_s`` (5, 4) and ``scratch`` (2,) are work space.
    """
    prism_planes(still, planes_s)
    prism_planes(moving, planes_m)
    best = _vertices_meet_prism(moving, planes_s, 1.0, limit, scratch)
    best = _vertices_meet_prism(still, planes_m, -1.0, best, scratch)
    return _edges_meet(moving, PRISM_EDGES, still, PRISM_EDGES, best, scratch)


@inner
def _vertices_meet_triangle(points, tri, sign, limit, scratch):  # type: ignore[no-untyped-def]
    """First t in (0, limit] at which a turning vertex of a triangle passes through the triangle ``tri``."""
    best = limit
    cb, sb = math.cos(best), math.sin(best)
    ax, ay, az = tri[1, 0] - tri[0, 0], tri[1, 1] - tri[0, 1], tri[1, 2] - tri[0, 2]
    bx, by, bz = tri[2, 0] - tri[0, 0], tri[2, 1] - tri[0, 1], tri[2, 2] - tri[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if size < 1e-15:
        return best
    nx, ny, nz = nx / size, ny / size, nz / size
    d = nx * tri[0, 0] + ny * tri[0, 1] + nz * tri[0, 2]
    for v in range(3):
        x, y, z = points[v, 0], points[v, 1], sign * points[v, 2]
        mz = sign * nz
        count = roots(ny * y + mz * z, mz * y - ny * z, nx * x - d, best, cb, sb, scratch)
        for r in range(count):
            t = scratch[r]
            if t >= best:
                break
            c, s = math.cos(t), math.sin(t)
            py, pz = y * c - z * s, sign * (y * s + z * c)
            inside = True
            for k in range(3):
                q, w = tri[k], tri[(k + 1) % 3]
                gx, gy, gz = w[0] - q[0], w[1] - q[1], w[2] - q[2]
                rx, ry, rz = x - q[0], py - q[1], pz - q[2]
                side = nx * (gy * rz - gz * ry) + ny * (gz * rx - gx * rz) + nz * (gx * ry - gy * rx)
                if side < -1e-7 * math.sqrt(gx * gx + gy * gy + gz * gz):
                    inside = False
                    break
            if inside:
                best, cb, sb = t, math.cos(t), math.sin(t)
    return best


@inner
def triangles_meet(moving, still, limit, scratch):  # type: ignore[no-untyped-def]
    """First t in (0, limit) at which the triangle ``moving`` (3, 3), turning about x, meets ``still``; else limit."""
    best = _vertices_meet_triangle(moving, still, 1.0, limit, scratch)
    best = _vertices_meet_triangle(still, moving, -1.0, best, scratch)
    return _edges_meet(moving, TRIANGLE_EDGES, still, TRIANGLE_EDGES, best, scratch)


@entry
def turn_contact(  # type: ignore[no-untyped-def]
    face, parent, members, moving_mask, solids, centres, radii, sharp, present,
    ox, oy, ux, uy, limit, work,
):  # fmt: skip
    """Largest free angle of a turn about the line through (ox, oy, 0) along (ux, uy, 0), right-handed.

    Args:
        face: the face at the hinge; with ``parent`` the one pair that is never tested.
        parent: its parent.
        members: faces that move.
        moving_mask: (N,) work space; False for all afterwards.
        solids: (N, 12, 3) corners now: 0-5 prism, 6-8 inset mid triangle, 9-11 full mid triangle.
        centres: (N, 3) and
        radii: (N,) bounding spheres.
        sharp: (N,) the mid triangle sticks out of the prism and is tested as well.
        present: (N,) solids that exist.
        ox, oy, ux, uy: the axis.
        limit: angle wanted, > 0 and at most pi.
        work: (18, 3) or larger work space.

    Returns:
        (angle, moving face, still solid); the angle equals ``limit`` and the faces are -1 if nothing is met.
    """
    count, still_ones = 0, np.empty(len(solids), np.int64)
    for m in members:
        moving_mask[m] = True
    for s in range(len(solids)):
        if present[s] and not moving_mask[s]:
            still_ones[count] = s
            count += 1
    for m in members:
        moving_mask[m] = False
    return listed_contact(
        face, parent, members, still_ones[:count], solids, centres, radii, sharp, ox, oy, ux, uy, limit, work
    )


@inner
def listed_contact(  # type: ignore[no-untyped-def]
    face, parent, members, still_ones, solids, centres, radii, sharp, ox, oy, ux, uy, limit, work
):
    """``turn_contact`` with the solids ``still_ones`` (K,) alone."""
    best = limit
    hit_m, hit_s = -1, -1
    x_lo, x_hi, r_hi, r_lo = np.inf, -np.inf, 0.0, np.inf
    count = len(members)
    ch, sh = math.cos(0.5 * best), math.sin(0.5 * best)
    blocks, supers = (count + BLOCK - 1) // BLOCK, (count + SUPER_BLOCK - 1) // SUPER_BLOCK
    places = np.empty((count, 5))  # along the axis, across, up, off it, radius
    near = np.empty(
        (blocks + supers, 4)
    )  # x from, to, radius from, to of the blocks, then of the super-blocks
    for b in range(blocks + supers):
        near[b, 0], near[b, 1], near[b, 2], near[b, 3] = np.inf, -np.inf, np.inf, 0.0
    for k in range(count):
        m = members[k]
        x = (centres[m, 0] - ox) * ux + (centres[m, 1] - oy) * uy
        y = (centres[m, 1] - oy) * ux - (centres[m, 0] - ox) * uy
        r = math.sqrt(y * y + centres[m, 2] * centres[m, 2])
        places[k, 0], places[k, 1], places[k, 2] = x, y, centres[m, 2]
        places[k, 3], places[k, 4] = r, radii[m]
        b = k // BLOCK
        near[b, 0], near[b, 1] = min(near[b, 0], x - radii[m]), max(near[b, 1], x + radii[m])
        near[b, 2], near[b, 3] = min(near[b, 2], r - radii[m]), max(near[b, 3], r + radii[m])
    for b in range(blocks):
        c = blocks + b * BLOCK // SUPER_BLOCK
        near[c, 0], near[c, 1] = min(near[c, 0], near[b, 0]), max(near[c, 1], near[b, 1])
        near[c, 2], near[c, 3] = min(near[c, 2], near[b, 2]), max(near[c, 3], near[b, 3])
    for c in range(blocks, blocks + supers):
        x_lo, x_hi = min(x_lo, near[c, 0]), max(x_hi, near[c, 1])
        r_lo, r_hi = min(r_lo, near[c, 2]), max(r_hi, near[c, 3])
    mov, still = work[0:9], work[9:18]
    sectors = np.empty((count, 6))
    known = np.zeros(count, np.bool_)
    planes_m, planes_s, bounds_s = np.empty((5, 4)), np.empty((5, 4)), np.empty((1, 6))
    scratch, hull = np.empty(2), np.empty((27, 3))
    for s in still_ones:
        rs = radii[s]
        sx = (centres[s, 0] - ox) * ux + (centres[s, 1] - oy) * uy
        if sx + rs < x_lo or sx - rs > x_hi:
            continue
        sy = (centres[s, 1] - oy) * ux - (centres[s, 0] - ox) * uy
        sz = centres[s, 2]
        sr = math.sqrt(sy * sy + sz * sz)
        if sr - rs > r_hi or sr + rs < r_lo:
            continue
        loaded = False
        k = 0
        while k < count:
            if k % SUPER_BLOCK == 0:
                c = blocks + k // SUPER_BLOCK
                if is_far(near, c, sx, sr, rs):
                    k += SUPER_BLOCK
                    continue
            if k % BLOCK == 0:
                c = k // BLOCK
                if is_far(near, c, sx, sr, rs):
                    k += BLOCK
                    continue
            j = k
            k += 1
            # spheres: the angles at which the centres come within reach of each other, if they do at all
            reach = places[j, 4] + rs
            dx, dr = places[j, 0] - sx, places[j, 3] - sr
            apart = reach * reach - dx * dx - dr * dr
            if apart <= 0.0:
                continue
            m = members[j]
            if m == face and s == parent:
                continue
            product = places[j, 3] * sr
            if apart < 4.0 * product:
                # they lie within ``half`` of the angle from one centre to the other; all are beyond the turn if
                # cos(angle - best / 2) <= cos(half + best / 2) with half + best / 2 <= pi
                c_half = 1.0 - 0.5 * apart / product
                if c_half >= -ch:
                    s_half = math.sqrt(max(0.0, 1.0 - c_half * c_half))
                    dot = places[j, 1] * sy + places[j, 2] * sz
                    cross = places[j, 1] * sz - places[j, 2] * sy
                    if dot * ch + cross * sh <= product * (c_half * ch - s_half * sh - ROUNDING):
                        continue
            if not loaded:
                to_axis_frame(solids, s, ox, oy, ux, uy, still)
                sector(still, bounds_s, 0)
                loaded = True
            to_axis_frame(solids, m, ox, oy, ux, uy, mov)
            if not known[j]:
                sector(mov, sectors, j)
                known[j] = True
            if sectors_apart(sectors, j, bounds_s, best):
                continue
            corners = 9 if sharp[m] or sharp[s] else 6
            if best <= LARGEST_TURN_RAD and plane_between(mov, still, corners, best, hull):
                continue
            t = prisms_meet(mov[:6], still[:6], best, planes_m, planes_s, scratch)
            if corners == 9:
                t = triangles_meet(mov[6:9], still[6:9], t, scratch)
            if t < best:
                best, hit_m, hit_s = t, m, s
                ch, sh = math.cos(0.5 * best), math.sin(0.5 * best)
    return best, hit_m, hit_s
