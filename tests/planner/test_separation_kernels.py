"""A plane that keeps two solids apart for a whole turn: never where the exact contact finds one."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from planner._kernels.contact_kernels import prisms_meet, triangles_meet
from planner._kernels.separation_kernels import plane_between


@njit  # kernels that only kernels call cannot be called from Python
def ruled_out(moving, still, count, limit):
    return plane_between(moving, still, count, limit, np.empty((27, 3)))


@njit
def first_contact(moving, still, limit):
    t = prisms_meet(moving[:6], still[:6], limit, np.empty((5, 4)), np.empty((5, 4)), np.empty(2))
    return triangles_meet(moving[6:], still[6:], t, np.empty(2))


def solid(rng, spread=1.2, thickness=0.1):
    """(9, 3) a prism, and a triangle that sticks out of it."""
    triangle = rng.normal(size=(3, 3)) + rng.normal(size=3) * spread
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    normal *= 0.5 * thickness / np.linalg.norm(normal)
    middle = triangle.mean(axis=0)
    return np.concatenate([triangle + normal, triangle - normal, middle + 1.2 * (triangle - middle)])


@given(st.integers(0, 2**32), st.floats(0.01, 2.5))
def test_what_a_plane_rules_out_never_touches(seed, limit):
    rng = np.random.default_rng(seed)
    for _ in range(20):
        moving, still = solid(rng), solid(rng)
        if ruled_out(moving, still, 9, limit):
            assert first_contact(moving, still, limit) == limit
            assert ruled_out(moving, still, 6, limit)


def test_most_pairs_that_do_not_touch_are_ruled_out():
    rng = np.random.default_rng(1)
    free = out = 0
    for _ in range(300):
        moving, still = solid(rng), solid(rng)
        free += first_contact(moving, still, 0.3) == 0.3
        out += ruled_out(moving, still, 9, 0.3)
    assert out > 0.8 * free > 50
