"""First contact of prisms under rotation, against dense sampling with python-fcl."""

import math

import numpy as np
import pytest
from numba import njit

from planner._kernels.contact_kernels import prisms_meet, triangles_meet
from tests.planner.contact_reference import PRISM_FACES, body, first_sampled_contact, touch, turned_about_x

LIMIT = 3.0
STEP = 0.01


def random_triangle(rng, spread):
    return rng.normal(size=(3, 3)) + rng.normal(size=3) * spread


def prism_of(triangle, thickness=0.1):
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    normal *= 0.5 * thickness / np.linalg.norm(normal)
    return np.concatenate([triangle + normal, triangle - normal])


@njit  # kernels that only kernels call cannot be called from Python
def meet_prisms(moving, still, limit=LIMIT):
    return prisms_meet(moving, still, limit, np.empty((5, 4)), np.empty((5, 4)), np.empty(2))


@njit
def meet_triangles(moving, still, limit=LIMIT):
    return triangles_meet(moving, still, limit, np.empty(2))


def agrees_with_samples(moving, still, faces, found):
    """The exact angle lies in the interval before the first sampled hit; None where they start in contact."""
    if touch(body(moving, faces), body(still, faces)):
        return None
    sampled = first_sampled_contact(moving, still, faces, LIMIT, STEP)
    if sampled is None:
        if found >= LIMIT:
            return True
        # a brief contact between two samples: it must be real just after the exact angle
        return any(
            touch(body(turned_about_x(moving, found + after), faces), body(still, faces))
            for after in (1e-6, 1e-5, 1e-4, 1e-3, 4e-3)
        )
    return sampled - STEP - 1e-6 <= found <= sampled + 1e-6


@pytest.mark.parametrize("seed", range(6))
def test_prisms_meet_when_dense_sampling_says_so(seed):
    rng = np.random.default_rng(seed)
    outcomes = []
    for _ in range(50):
        moving, still = prism_of(random_triangle(rng, 1.5)), prism_of(random_triangle(rng, 1.5))
        outcomes.append(agrees_with_samples(moving, still, PRISM_FACES, meet_prisms(moving, still)))
    assert all(outcome is not False for outcome in outcomes)
    assert sum(outcome is True for outcome in outcomes) > 25


@pytest.mark.parametrize("seed", range(4))
def test_triangles_meet_when_dense_sampling_says_so(seed):
    rng = np.random.default_rng(100 + seed)
    faces = np.array([[0, 1, 2]])
    outcomes = []
    for _ in range(50):
        moving, still = random_triangle(rng, 1.5), random_triangle(rng, 1.5)
        outcomes.append(agrees_with_samples(moving, still, faces, meet_triangles(moving, still)))
    assert all(outcome is not False for outcome in outcomes)


def test_contact_angle_does_not_depend_on_who_moves():
    rng = np.random.default_rng(7)
    mirror = np.array([1.0, 1.0, -1.0])
    met = 0
    for _ in range(200):
        a, b = prism_of(random_triangle(rng, 1.5)), prism_of(random_triangle(rng, 1.5))
        if touch(body(a, PRISM_FACES), body(b, PRISM_FACES)):
            continue
        # turning a by t against b is turning b by -t against a; the mirror in z = 0 makes that +t again
        first, second = meet_prisms(a, b), meet_prisms(b * mirror, a * mirror)
        assert first == pytest.approx(second, abs=1e-9)
        met += first < LIMIT
    assert met > 10


def test_plate_swung_onto_a_parallel_plate_stops_at_the_analytic_angle():
    # a unit plate from radius 1 to 2 in the plane z = 0 and the same plate turned to 90 degrees: the lower
    # face of one meets the upper face of the other when the angle between the middles is 2 asin(h / r)
    half = 0.05
    triangle = np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.5, 2.0, 0.0]])
    still = turned_about_x(prism_of(triangle, 2 * half), math.pi / 2)
    expected = math.pi / 2 - 2 * math.atan2(half, 1.0)
    assert meet_prisms(prism_of(triangle, 2 * half), still) == pytest.approx(expected, abs=1e-9)
