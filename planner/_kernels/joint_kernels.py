"""Contact while many creases turn at once: conservative advancement with separating axes as distance bounds.

There is no closed form for such a motion. Each pair of bodies is followed by itself: as long as they are a
distance apart that their relative motion cannot cover, they do not meet (Mirtich 1996, "Impulse-based
dynamic simulation of rigid body systems", conservative advancement). The distance is bounded from below
by the widest gap along the axes of the separating axis test (Gottschalk, Lin and Manocha 1996, "OBBTree").
"""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import entry, inner

TOUCH_MM = 1e-3
"""Bodies nearer than this count as touching."""
FAR_MM = 1.0
"""Gap between bounding spheres from which on the bodies themselves are not looked at."""
MOST_ADVANCES = 200_000
"""Steps after which a pair that creeps along is taken to touch."""


@inner
def _gap_along(x, y, z, p, q, best):  # type: ignore[no-untyped-def]
    """The larger of ``best`` and the gap between two point sets along the axis (x, y, z)."""
    size = math.sqrt(x * x + y * y + z * z)
    if size < 1e-9:
        return best
    p_lo, p_hi, q_lo, q_hi = np.inf, -np.inf, np.inf, -np.inf
    for k in range(len(p)):
        s = p[k, 0] * x + p[k, 1] * y + p[k, 2] * z
        p_lo, p_hi = min(p_lo, s), max(p_hi, s)
    for k in range(len(q)):
        s = q[k, 0] * x + q[k, 1] * y + q[k, 2] * z
        q_lo, q_hi = min(q_lo, s), max(q_hi, s)
    return max(best, max(q_lo - p_hi, p_lo - q_hi) / size)


@inner
def _directions(points, has_height, edges, normals):  # type: ignore[no-untyped-def]
    """Edge directions (4, 3) and side normals (4, 3) of a prism (6, 3), or of a triangle (3, 3)."""
    for k in range(3):
        for d in range(3):
            edges[k, d] = points[(k + 1) % 3, d] - points[k, d]
    _cross(edges[0], edges[1], normals[3])
    for d in range(3):
        edges[3, d] = points[3, d] - points[0, d] if has_height else normals[3, d]
    for k in range(3):
        _cross(edges[k], edges[3], normals[k])


@inner
def _cross(a, b, out):  # type: ignore[no-untyped-def]
    """Cross product into ``out``, scaled so that long and short edges compare."""
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    size = math.sqrt((a[0] ** 2 + a[1] ** 2 + a[2] ** 2) * (b[0] ** 2 + b[1] ** 2 + b[2] ** 2))
    scale = 1.0 / size if size > 1e-30 else 0.0
    out[0], out[1], out[2] = x * scale, y * scale, z * scale


@inner
def convex_gap(p, q, has_height, work):  # type: ignore[no-untyped-def]
    """Lower bound of the distance of two prisms (6, 3), or triangles (3, 3); not above 0 if they intersect.

    ``work`` is (17, 3) work space.
    """
    edges_p, normals_p, edges_q, normals_q, axis = work[:4], work[4:8], work[8:12], work[12:16], work[16]
    _directions(p, has_height, edges_p, normals_p)
    _directions(q, has_height, edges_q, normals_q)
    best = -np.inf
    for k in range(4):
        best = _gap_along(normals_p[k, 0], normals_p[k, 1], normals_p[k, 2], p, q, best)
        best = _gap_along(normals_q[k, 0], normals_q[k, 1], normals_q[k, 2], p, q, best)
    real = 4 if has_height else 3
    for i in range(real):
        for j in range(real):
            _cross(edges_p[i], edges_q[j], axis)
            if axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2 > 1e-16:
                best = _gap_along(axis[0], axis[1], axis[2], p, q, best)
    return best


@inner
def _place(points, face, top, share, parent, start, delta, rate, hinges, reach, links, slack):  # type: ignore[no-untyped-def]
    """Move ``points`` (K, 3) of ``face`` into the frame of its ancestor ``top``, ``share`` of the way.

    Args:
        slack: added to every distance from a crease: the radius if ``points`` is a centre only.

    Returns:
        (speed now, half of how fast it can grow): of any point, in mm per unit of the way
    """
    speed, growth, below, chain = 0.0, 0.0, 0.0, reach[face]
    f = face
    while f != top:
        ox, oy, ux, uy = hinges[f, 0], hinges[f, 1], hinges[f, 2], hinges[f, 3]
        turn = min(abs(delta[f]), rate[f] * share)
        angle = start[f] + (turn if delta[f] > 0.0 else -turn)
        c, s = math.cos(angle), math.sin(angle)
        farthest = 0.0
        for k in range(len(points)):
            dx, dy, dz = points[k, 0] - ox, points[k, 1] - oy, points[k, 2]
            along, across = dx * ux + dy * uy, dy * ux - dx * uy
            farthest = max(farthest, across * across + dz * dz)
            turned = across * c - dz * s
            points[k, 0], points[k, 1] = ox + along * ux - turned * uy, oy + along * uy + turned * ux
            points[k, 2] = across * s + dz * c
        if delta[f] != 0.0:
            speed += rate[f] * (math.sqrt(farthest) + slack)
            growth += 0.5 * rate[f] * below
            below += rate[f] * chain
        chain += links[f]
        f = parent[f]
    return speed, growth


@entry
def joint_motion(  # type: ignore[no-untyped-def]
    parent, depth, start, delta, rate, hinges, reach, links, solids, centres, radii, sharp,
):  # fmt: skip
    """How far a motion of all creases at once goes before two faces touch.

    The crease of face f stands at start[f] + sign(delta[f]) * min(|delta[f]|, rate[f] * p) after the share p
    of the way. Two faces that share a crease are never tested against each other.

    Args:
        parent: (n,) parent face, -1 for the base.
        depth: (n,) creases between a face and the base.
        start, delta, rate: (n,) rad; 0 for the base.
        hinges: (n, 4) start x, start y and unit direction of the crease in the flat net.
        reach: (n,) largest distance of a face's corners from the middle of its crease.
        links: (n,) distance from there to the middle of the parent's crease, 0 below the base.
        solids, centres, radii, sharp: as in ``turn_contact``, of the flat net.

    Returns:
        (share, face, other face, advances): share 1 and -1, -1 if nothing is touched; share 0 also if faces
        touch at the start. The advances of all pairs are the work that it took.
    """
    n = len(parent)
    best, hit_a, hit_b, advances = 1.0, -1, -1, 0
    a_points, b_points, work = np.empty((9, 3)), np.empty((9, 3)), np.empty((17, 3))
    a_centre, b_centre = np.empty((1, 3)), np.empty((1, 3))
    for a in range(n):
        for b in range(a):
            if parent[a] == b or parent[b] == a:
                continue
            up_a, up_b = a, b
            while up_a != up_b:
                if depth[up_a] >= depth[up_b]:
                    up_a = parent[up_a]
                else:
                    up_b = parent[up_b]
            top, share = up_a, 0.0
            for advance in range(MOST_ADVANCES):
                advances += 1
                for d in range(3):
                    a_centre[0, d], b_centre[0, d] = centres[a, d], centres[b, d]
                va, ga = _place(
                    a_centre, a, top, share, parent, start, delta, rate, hinges, reach, links, radii[a]
                )
                vb, gb = _place(
                    b_centre, b, top, share, parent, start, delta, rate, hinges, reach, links, radii[b]
                )
                square = 0.0
                for d in range(3):
                    square += (a_centre[0, d] - b_centre[0, d]) ** 2
                gap = math.sqrt(square) - radii[a] - radii[b]
                if gap < FAR_MM:
                    for k in range(9):
                        for d in range(3):
                            a_points[k, d], b_points[k, d] = solids[a, k, d], solids[b, k, d]
                    va, ga = _place(
                        a_points, a, top, share, parent, start, delta, rate, hinges, reach, links, 0.0
                    )
                    vb, gb = _place(
                        b_points, b, top, share, parent, start, delta, rate, hinges, reach, links, 0.0
                    )
                    close = convex_gap(a_points[:6], b_points[:6], True, work)
                    if sharp[a] or sharp[b]:
                        close = min(close, convex_gap(a_points[6:], b_points[6:], False, work))
                    gap = max(gap, close)
                if gap <= TOUCH_MM or advance == MOST_ADVANCES - 1:
                    best, hit_a, hit_b = share, a, b
                    break
                speed, growth = va + vb, ga + gb
                if speed <= 1e-12 and growth <= 1e-12:
                    break
                # gap = speed * step + growth * step ** 2 has one root above 0
                share += 2.0 * gap / (speed + math.sqrt(speed * speed + 4.0 * growth * gap))
                if share >= best:
                    break
            if best == 0.0:
                return best, hit_a, hit_b, advances
    return best, hit_a, hit_b, advances
