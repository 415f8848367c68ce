"""Self-intersection against exact rational arithmetic, and the cases that floats like to get wrong."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.mesh_intersect import intersecting_pairs
from planner.read_goal import read_goal

Vector = tuple[Fraction, Fraction, Fraction]


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def clipped(polygon: list[Vector], point: Vector, inward: Vector) -> list[Vector]:
    """Sutherland and Hodgman's clip of a polygon by a half-space, exact."""
    out = []
    for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        at_p, at_q = dot(minus(p, point), inward), dot(minus(q, point), inward)
        if at_p >= 0:
            out.append(p)
        if at_p * at_q < 0:
            share = at_p / (at_p - at_q)
            out.append(tuple(x + share * (y - x) for x, y in zip(p, q, strict=True)))
    return out


def exact_kind(one: list[Vector], two: list[Vector]) -> str:
    """ "apart", "touch", "area" (coplanar overlap) or "cross" (through one another along a stretch)."""
    normals = [cross(minus(t[1], t[0]), minus(t[2], t[0])) for t in (one, two)]
    heights = [
        [dot(minus(p, t[0]), n) for p in o] for o, t, n in ((one, two, normals[1]), (two, one, normals[0]))
    ]
    common = list(one)
    for inward in (normals[1], tuple(-x for x in normals[1])):
        common = clipped(common, two[0], inward)
    for a, b in zip(two, two[1:] + two[:1], strict=True):
        common = clipped(common, a, cross(normals[1], minus(b, a)))
    if not common:
        return "apart"
    if all(h == 0 for h in heights[0]):
        area = (
            cross(minus(common[1], common[0]), minus(common[2], common[0])) if len(common) > 2 else (0, 0, 0)
        )
        for k in range(3, len(common)):
            extra = cross(minus(common[k - 1], common[0]), minus(common[k], common[0]))
            area = tuple(x + y for x, y in zip(area, extra, strict=True))
        return "area" if any(area) else "touch"
    stretch = len(set(common)) > 1
    both = all(min(h) < 0 < max(h) for h in heights)
    return "cross" if stretch and both else "touch"


corner = st.tuples(*[st.integers(0, 6)] * 3)
triangle = st.tuples(corner, corner, corner).filter(
    lambda t: any(cross(minus(t[1], t[0]), minus(t[2], t[0])))
)


@given(triangle, triangle)
@settings(max_examples=250)
def test_two_separate_triangles_on_a_grid_match_exact_arithmetic(one, two):
    exact = exact_kind(*([tuple(map(Fraction, p)) for p in t] for t in (one, two)))
    found = intersecting_pairs(np.array([*one, *two], dtype=float), np.arange(6).reshape(2, 3))
    assert (len(found) == 1) == (exact in ("cross", "area")), exact


@given(triangle, triangle, st.integers(0, 2), st.integers(0, 2))
@settings(max_examples=200)
def test_two_triangles_with_a_common_corner_match_exact_arithmetic(one, two, i, j):
    moved = [tuple(np.array(p) - np.array(two[j]) + np.array(one[i])) for p in two]
    exact = exact_kind(*([tuple(Fraction(int(x)) for x in p) for p in t] for t in (one, moved)))
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    faces[1, j] = i
    found = intersecting_pairs(np.array([*one, *moved], dtype=float), faces)
    assert (len(found) == 1) == (exact in ("cross", "area")), exact


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=8)
def test_order_and_rigid_motion_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(0, 10, (60, 3))
    faces = np.arange(60).reshape(20, 3)
    pairs = {tuple(p) for p in intersecting_pairs(vertices, faces).tolist()}
    slow = {
        (i, j)
        for i, j in combinations(range(20), 2)
        if len(intersecting_pairs(vertices[faces[[i, j]]].reshape(-1, 3), np.arange(6).reshape(2, 3)))
    }
    assert pairs == slow
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    order = rng.permutation(20)
    again = intersecting_pairs(vertices @ turn.T + rng.uniform(-50, 50, 3), faces[order])
    assert {tuple(sorted((int(order[i]), int(order[j])))) for i, j in again} == pairs


FLOOR = [(-10, -10, 0), (10, -10, 0), (0, 15, 0)]
ALONE = [[0, 1, 2], [3, 4, 5]]
ROOF = [[0, 1, 2], [3, 4, 5], [4, 3, 6]]
ACROSS = [[0, 1, 2], [1, 0, 3]]
TOUCHING = {  # further points, faces, pairs that intersect
    "a corner stands on it": ([(0, 0, 0), (1, 0, 5), (0, 1, 5)], ALONE, 0),
    "an edge lies on it": ([(-2, 0, 0), (2, 0, 0), (0, 1, 5)], ALONE, 0),
    "the ridge of a roof touches it": ([(-2, 0, 0), (2, 0, 0), (0, 1, 5), (0, 1, 6)], ROOF, 0),
    "a wall goes through, with an edge in it": ([(-2, 0, 0), (2, 0, 0), (0, 1, 5), (0, 1, -5)], ROOF, 2),
    "a corner sticks through": ([(0, 0, -1), (1, 0, 5), (0, 1, 5)], ALONE, 1),
    "one lies flat inside it": ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], ALONE, 1),
    "flat neighbours across an edge": ([(0, -20, 0)], ACROSS, 0),
    "folded by 180 degrees": ([(0, 14, 0)], ACROSS, 1),
    "folded by 175 degrees": ([(0, 14, 1.2)], ACROSS, 0),
    "flat, touching in a vertex": ([(10, 30, 0), (-10, 30, 0)], [[0, 1, 2], [3, 4, 2]], 0),
}


@pytest.mark.parametrize(("points", "faces", "hits"), TOUCHING.values(), ids=TOUCHING.keys())
def test_touching_is_allowed_and_passing_through_is_not(points, faces, hits):
    found = intersecting_pairs(np.array([*FLOOR, *points], dtype=float), np.array(faces))
    assert len(found) == hits


def test_no_common_mesh_intersects_itself_after_any_turn(shared_meshes):
    rng = np.random.default_rng(5)
    for name in (
        "proc/openbox_free",
        "proc/snailtube5",
        "real/scorpion-348",
        "real/snail-286",
        "real/gear-508",
    ):
        goal = read_goal(shared_meshes / f"{name}.obj")
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        assert len(intersecting_pairs(goal.vertices @ turn.T, goal.faces)) == 0, name
