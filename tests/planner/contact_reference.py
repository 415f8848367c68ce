"""Slow, obvious versions of contact and sight: pose, sample and ask python-fcl or shapely."""

from __future__ import annotations

import math

import fcl
import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.ops import unary_union

PRISM_FACES = np.array(
    [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]]
)


def turned_about_x(points, angle):
    """Points (K, 3) turned about the x axis, right-handed."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def body(points, faces):
    """A collision mesh of python-fcl."""
    model = fcl.BVHModel()
    model.beginModel(len(points), len(faces))
    model.addSubModel(np.ascontiguousarray(points), np.asarray(faces))
    model.endModel()
    return fcl.CollisionObject(model)


def touch(a, b):
    """True if two collision objects intersect."""
    return fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()) > 0


def first_sampled_contact(moving, still, faces, limit, step):
    """First sampled angle in (0, limit] at which ``moving``, turned about x, meets ``still``, or None."""
    a, b = body(moving, faces), body(still, faces)
    for k in range(1, math.ceil(limit / step) + 1):
        angle = min(limit, k * step)
        c, s = math.cos(angle), math.sin(angle)
        a.setTransform(fcl.Transform(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.zeros(3)))
        if touch(a, b):
            return angle
    return None


def hidden_share_reference(start, end, triangles, beam):
    """Share of the segment start-end (3,) that lies under ``triangles`` (K, 3, 3) seen against ``beam``.

    Projects everything along the beam (a unit vector that points to the laser) and uses polygons. The crease
    lies in a plane of constant z; the triangles must lie wholly above that plane or wholly under it.
    """
    helper = np.array([1.0, 0.0, 0.0]) if abs(beam[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    e1 = np.cross(beam, helper)
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(beam, e1)
    flat = np.array([e1, e2])
    line = LineString([(flat @ start).tolist(), (flat @ end).tolist()])
    above = [t for t in triangles if ((t[:, 2] - start[2]) / beam[2]).min() > 0.01]
    covers = [Polygon((t @ flat.T).tolist()) for t in above]
    if not covers:
        return 0.0
    return line.intersection(unary_union(covers)).length / line.length
