"""Pairs proven free, against sampling with python-fcl, which knows nothing of planes and intervals."""

import math

import fcl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from planner._kernels.certificate_kernels import (
    AXIS,
    CONTACT,
    FREE,
    MID,
    OPEN,
    STILL,
    cross,
    pair_margin,
    swept_gap,
)
from tests.planner.contact_reference import PRISM_FACES, body, first_sampled_contact, turned_about_x

TURN = 2.8
STEP = 0.01
ENOUGH = 0.5
SLACK = 1e-9


@njit  # kernels that only kernels call cannot be called from Python
def prove(moving, still, turn=TURN, slack=SLACK):
    found = np.empty(3)
    state, used = pair_margin(
        moving, still, len(moving), turn, slack, ENOUGH, np.empty((33, 3)), np.empty((80, 2)), found
    )
    return state, found, used


@njit
def gap_in(moving, still, lo, hi):
    return swept_gap(moving, still, len(moving), lo, hi, np.inf, np.empty((33, 3)))


@njit
def across(rows, i, j, k):
    return cross(rows, i, j, k)


def prism(rng, spread=1.2, thickness=0.1):
    triangle = rng.normal(size=(3, 3)) + rng.normal(size=3) * spread
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    normal *= 0.5 * thickness / np.linalg.norm(normal)
    return np.concatenate([triangle + normal, triangle - normal])


def least_distance(moving, still, faces, turn):
    """Least distance at samples of a turn."""
    a, b = body(moving, faces), body(still, faces)
    least = math.inf
    for angle in np.linspace(0.0, turn, math.ceil(turn / STEP) + 1):
        c, s = math.cos(angle), math.sin(angle)
        a.setTransform(fcl.Transform(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.zeros(3)))
        least = min(least, fcl.distance(a, b, fcl.DistanceRequest(), fcl.DistanceResult()))
    return least


@pytest.mark.parametrize("seed", range(3))
def test_what_is_proven_free_is_free_and_what_touches_is_not(seed):
    rng = np.random.default_rng(seed)
    states = []
    for _ in range(40):
        moving, still = prism(rng), prism(rng)
        state, found, _ = prove(moving, still)
        sampled = first_sampled_contact(moving, still, PRISM_FACES, TURN, STEP)
        states.append(state)
        if state == FREE:
            assert sampled is None
            distance = least_distance(moving, still, PRISM_FACES, TURN)
            assert found[0] <= min(distance, ENOUGH) + 1e-9
            # no plane of the set need lie square between two nearest corners, and intervals cost a fifth
            assert found[0] >= 0.2 * min(distance, ENOUGH) - STEP
        else:
            assert state == CONTACT  # random solids do not just touch
            assert sampled is None or found[1] <= sampled + 1e-9
    assert states.count(FREE) > 3
    assert states.count(CONTACT) > 3


@given(st.integers(0, 2**32), st.floats(0.0, 2.0), st.floats(0.01, 1.5))
def test_the_gap_of_an_interval_holds_at_every_angle_in_it(seed, lo, width):
    rng = np.random.default_rng(seed)
    moving, still = prism(rng), prism(rng)
    gap, at_middle = gap_in(moving, still, lo, lo + width)
    assert gap <= at_middle + 1e-12
    if gap > 0.0:
        a, b = body(moving, PRISM_FACES), body(still, PRISM_FACES)
        for angle in np.linspace(lo, lo + width, 7):
            a = body(turned_about_x(moving, angle), PRISM_FACES)
            assert fcl.distance(a, b, fcl.DistanceRequest(), fcl.DistanceResult()) >= gap - 1e-9


def test_two_plates_that_meet_at_the_end_of_the_turn_stay_open_there_only():
    # the plate that ends exactly on the other one: see test_contact_kernels for the angle
    half, triangle = 0.05, np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.5, 2.0, 0.0]])
    up = np.array([0.0, 0.0, half])
    plate = np.concatenate([triangle + up, triangle - up])
    still = turned_about_x(plate, math.pi / 2)
    touch = math.pi / 2 - 2.0 * math.atan2(half, 1.0)
    state, found, _ = prove(plate, still, touch)
    assert state == OPEN
    assert touch - 1e-4 < found[1] <= found[2] == touch
    state, found, _ = prove(plate, still, touch - 1e-3)
    assert state == FREE
    assert 0.5e-3 <= found[0] <= 1.01e-3
    state, found, _ = prove(plate, still, touch + 0.1)
    assert state == CONTACT
    assert found[1] <= touch


def test_doubt_about_the_coordinates_counts_against_the_proof():
    rng = np.random.default_rng(3)
    for _ in range(30):
        moving, still = prism(rng), prism(rng)
        state, found, _ = prove(moving, still, TURN, 0.0)
        if state == FREE and found[0] < ENOUGH:
            assert prove(moving, still, TURN, 2.0 * ENOUGH)[0] != FREE


def test_unit_vector_across_two_rows():
    rows = np.zeros((33, 3))
    rows[STILL], rows[MID] = (2.0, 0.0, 0.0), (1.0, 3.0, 0.0)
    assert across(rows, STILL, MID, AXIS)
    assert rows[AXIS].tolist() == [0.0, 0.0, 1.0]
    rows[MID] = (-4.0, 0.0, 0.0)
    assert not across(rows, STILL, MID, AXIS)
    assert not rows[AXIS].any()
