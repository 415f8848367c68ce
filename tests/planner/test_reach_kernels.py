"""Tilts along a face, and what no tilt shows, against the lean of the beam itself."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from planner._kernels.beam_kernels import BEAM_SIZE, OVERHANG_RAD, aim, lean, tilt_for_lean
from planner._kernels.reach_kernels import never_seen

MOST_TILT = math.radians(45.0)
PARALLEL = np.array([0.0, 0.0, 0.0, 0.0, 0.3, -0.2, 0.05, 0.01])
FROM_A_POINT = np.array([1.0, 4.0, -7.0, 220.0, 0.3, -0.2, 0.05, 0.01])


@njit  # kernels that only kernels call cannot be called from Python
def tilt_of(wanted, upright, ex, ey, head, mx, my, ux, uy, sign):
    return tilt_for_lean(wanted, upright, ex, ey, head, mx, my, ux, uy, sign, np.zeros(BEAM_SIZE))


@njit
def lean_at(angle, ex, ey, head, mx, my, ux, uy, sign):
    beam = np.zeros(BEAM_SIZE)
    aim(angle, ex, ey, head, beam)
    return lean(beam, mx, my, ux, uy, sign)


@njit
def missing(target, hinges, lengths, rotary, head):
    beams, out = np.zeros((len(rotary), BEAM_SIZE)), np.zeros(len(target))
    for r in range(len(rotary)):
        aim(rotary[r], 1.0, 0.0, head, beams[r])
    never_seen(target, hinges, lengths, beams, out)
    return out


@settings(deadline=None)
@given(
    tilt=st.floats(-MOST_TILT, MOST_TILT), heading=st.floats(0.0, 6.28), axis=st.floats(0.0, 3.14),
    sign=st.sampled_from([1.0, -1.0]), from_a_point=st.booleans(),
)  # fmt: skip
def test_the_tilt_that_gives_a_lean_is_found_from_it(tilt, heading, axis, sign, from_a_point):
    head = FROM_A_POINT if from_a_point else PARALLEL
    upright = 0.0 if sign > 0.0 else math.pi
    ex, ey, ux, uy = math.cos(axis), math.sin(axis), math.cos(heading), math.sin(heading)
    wanted = lean_at(upright + tilt, ex, ey, head, 5.0, -9.0, ux, uy, sign)
    found = tilt_of(wanted, upright, ex, ey, head, 5.0, -9.0, ux, uy, sign)
    if abs(ex * ux + ey * uy) < 0.05:  # along the crease a tilt leans over neither face
        return
    again = lean_at(upright + found, ex, ey, head, 5.0, -9.0, ux, uy, sign)
    assert again == pytest.approx(wanted, abs=2e-4 if from_a_point else 1e-9)


def test_a_crease_square_to_the_axis_has_no_such_tilt():
    assert math.isinf(tilt_of(1.0, 0.0, 1.0, 0.0, PARALLEL, 0.0, 0.0, 0.0, 1.0, 1.0))


def test_what_no_tilt_shows_is_the_angle_beyond_the_steepest_beam():
    rotary = np.array([0.0, MOST_TILT, -MOST_TILT, math.pi, math.pi + MOST_TILT, math.pi - MOST_TILT])
    hinges = np.array(
        [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.6, 0.8], [0.0, 0.0, 1.0, 0.0]]
    )
    target = np.radians([170.0, -100.0, 120.0, 0.0])
    found = missing(target, hinges, np.ones(4), rotary, PARALLEL)
    steepest = [math.pi / 2 + math.atan(math.tan(MOST_TILT) * abs(share)) for share in (1.0, 0.0, 0.6)]
    wanted = [max(0.0, abs(t) - s - OVERHANG_RAD) for t, s in zip(target[:3], steepest, strict=True)]
    assert found == pytest.approx([*wanted, 0.0], abs=1e-12)
    assert found[0] > 0.0
    assert found[1] > 0.0
