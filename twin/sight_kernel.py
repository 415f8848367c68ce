"""Kernel of the beam's view: which rays from a crease go through the middle surface of which body.

One file on purpose: numba notices a change of the file in which a compiled function stands, and of no other.
"""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import entry, inner

__all__ = ["pierced"]


@inner
def _cross(ax, ay, az, bx, by, bz):  # type: ignore[no-untyped-def]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inner
def _bounds(points, lights):  # type: ignore[no-untyped-def]
    """(4, 4) unit normals and offsets of what bounds the rays, 0 where the light comes along the crease.

    The plane that all rays lie in; behind the crease; beside the first ray; beside the last one.
    """
    out = np.zeros((4, 4))
    last = len(points) - 1
    x, y, z = points[last, 0] - points[0, 0], points[last, 1] - points[0, 1], points[last, 2] - points[0, 2]
    span = math.sqrt(x * x + y * y + z * z)
    a, b, c = _cross(x, y, z, lights[0, 0], lights[0, 1], lights[0, 2])
    length = math.sqrt(a * a + b * b + c * c)
    if length <= 1e-9 * span:
        return out
    a, b, c = a / length, b / length, c / length
    out[0, 0], out[0, 1], out[0, 2] = a, b, c
    out[1, 0], out[1, 1], out[1, 2] = _cross(a, b, c, x / span, y / span, z / span)
    out[2, 0], out[2, 1], out[2, 2] = _cross(lights[0, 0], lights[0, 1], lights[0, 2], a, b, c)
    out[3, 0], out[3, 1], out[3, 2] = _cross(a, b, c, lights[last, 0], lights[last, 1], lights[last, 2])
    for n in range(4):
        at = last if n == 3 else 0
        out[n, 3] = out[n, 0] * points[at, 0] + out[n, 1] * points[at, 1] + out[n, 2] * points[at, 2]
    return out


@inner
def _beside(bounds, x, y, z, reach):  # type: ignore[no-untyped-def]
    """Does a ball lie where no ray comes?"""
    for n in range(4):
        height = bounds[n, 0] * x + bounds[n, 1] * y + bounds[n, 2] * z - bounds[n, 3]
        if height < -reach or (n == 0 and height > reach):
            return True
    return False


@inner
def _through(ray, light, lift, outline, sides):  # type: ignore[no-untyped-def]
    """Does a ray go through a convex outline (K, 3), counter-clockwise, in front of its start?"""
    x0, y0, z0 = outline[0, 0], outline[0, 1], outline[0, 2]
    end = sides - 1
    nx, ny, nz = _cross(
        outline[1, 0] - x0, outline[1, 1] - y0, outline[1, 2] - z0,
        outline[end, 0] - x0, outline[end, 1] - y0, outline[end, 2] - z0,
    )  # fmt: skip
    towards = nx * light[0] + ny * light[1] + nz * light[2]
    if abs(towards) < 1e-12 * math.sqrt(nx * nx + ny * ny + nz * nz):
        return False
    x, y, z = ray[0] + lift * light[0], ray[1] + lift * light[1], ray[2] + lift * light[2]
    along = (nx * (x0 - x) + ny * (y0 - y) + nz * (z0 - z)) / towards
    if along < -lift:
        return False
    x, y, z = x + along * light[0], y + along * light[1], z + along * light[2]
    for k in range(sides):
        after = k + 1 if k < end else 0
        px, py, pz = outline[k, 0], outline[k, 1], outline[k, 2]
        a, b, c = _cross(
            outline[after, 0] - px, outline[after, 1] - py, outline[after, 2] - pz, x - px, y - py, z - pz
        )
        if a * nx + b * ny + c * nz < 0.0:
            return False
    return True


@entry
def pierced(  # type: ignore[no-untyped-def]
    points, lights, lift, geoms, reach, centre, body_of, turned, moved, middles, corners
):  # fmt: skip
    """(N, 2) point and geom of all rays that go through a body's middle surface in front of their start.

    All rays lie in one plane, so most bodies are passed over: those whose ball lies on one side of it, behind
    the crease, or beside the first or the last ray.

    Args:
        points: (P, 3) where the rays start on the crease.
        lights: (P, 3) unit vectors towards the light.
        lift: rays count from this far off the crease on; a surface up to as far behind that counts too.
        geoms: (G,) what may be in the way.
        reach: (G,) radius of a ball about the centre of each that holds it.
        centre: (ngeom, 3) centres of all geoms.
        body_of: (ngeom,) body of every geom.
        turned: (nbody, 9) rotation of every body.
        moved: (nbody, 3) origin of every body.
        middles: (ngeom, K, 3) corners of the middle surface of every geom, in the frame of its body.
        corners: (ngeom,) how many there are.
    """
    bounds = _bounds(points, lights)
    near, met = np.empty(len(geoms), dtype=np.int64), 0
    for n in range(len(geoms)):
        geom = geoms[n]
        if not _beside(bounds, centre[geom, 0], centre[geom, 1], centre[geom, 2], reach[n]):
            near[met] = geom
            met += 1
    out, found = np.empty((met * len(points), 2), dtype=np.int64), 0
    outline = np.empty((middles.shape[1], 3))
    for geom in near[:met]:
        body, sides = body_of[geom], corners[geom]
        for k in range(sides):
            for i in range(3):
                outline[k, i] = moved[body, i]
                for j in range(3):
                    outline[k, i] += turned[body, 3 * i + j] * middles[geom, k, j]
        for p in range(len(points)):
            if _through(points[p], lights[p], lift, outline, sides):
                out[found, 0], out[found, 1] = p, geom
                found += 1
    return out[:found].copy()
