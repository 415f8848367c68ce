"""Bend deduction: its limits, and the law that a pattern bent to arcs gives the shape of the plan."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.bend_allowance import bend_deduction, bend_radius, bent_triangles, face_shifts, outward
from planner.kinematics import folded_triangles
from tests.planner import hand_nets
from tests.planner.goal_shapes import random_hull, rough_ball

angles = st.floats(0.01, 2.8)
widths = st.floats(0.01, 2.0)
shares = st.floats(0.0, 0.9)


def random_parents(goal, seed):
    """A deep random tree: depth first, neighbours in random order."""
    rng = np.random.default_rng(seed)
    side = hand_nets.neighbours(goal)
    faces = goal.faces.tolist()
    parent = {0: -1}
    stack = [0]
    while stack:
        f = stack[-1]
        free = [side[faces[f][(k + 1) % 3], faces[f][k]][0] for k in range(3)]
        free = [g for g in free if g not in parent]
        if free:
            g = free[rng.integers(len(free))]
            parent[g] = f
            stack.append(g)
        else:
            stack.pop()
    return [parent[f] for f in range(len(faces))]


def bent_strip(angle, width, shift, pieces=4000):
    """End of a strip bent to an arc, marched along its chords: (along, up) and its direction there."""
    length = width - shift * angle  # of the middle surface: it loses what lies beyond the neutral fibre
    step = angle / pieces
    chord = 2.0 * (length / angle) * math.sin(0.5 * step)
    heading = (np.arange(pieces) + 0.5) * step
    return chord * math.fsum(np.cos(heading)), chord * math.fsum(np.sin(heading))


def marched(net, fold, width, shift, shifts):
    """Corners of all faces when a net cut with ``shifts`` is bent: charts of the faces, strip after strip."""
    flat = np.zeros((len(net.faces), 3, 3))
    chart = {net.base_face: (np.zeros(3), np.eye(3))}  # pattern point p -> o + basis @ p
    for face in net.order[1:].tolist():
        o, basis = chart[int(net.parent[face])]
        start, end = (np.append(p, 0.0) for p in net.hinge(face))
        middle = 0.5 * (shifts[face] + shifts[net.parent[face]])
        start, end = start + np.append(middle, 0.0), end + np.append(middle, 0.0)
        line = (end - start) / np.linalg.norm(end - start)
        across = np.cross([0.0, 0.0, 1.0], line)
        angle = float(fold[net.crease_of[face]])
        if angle == 0.0:
            chart[face] = chart[int(net.parent[face])]
            continue
        along, up = bent_strip(abs(angle), width, shift)
        c, s = math.cos(angle), math.sin(angle)
        turn = np.column_stack([line, c * across + [0, 0, s], -s * across + [0, 0, c]])
        turn = turn @ np.column_stack([line, across, [0.0, 0.0, 1.0]]).T
        first, last = start - 0.5 * width * across, start + 0.5 * width * across
        arrived = first + along * across + [0.0, 0.0, math.copysign(up, angle)]
        chart[face] = (o + basis @ (arrived - turn @ last), basis @ turn)
    for face, (o, basis) in chart.items():
        for k, vertex in enumerate(net.faces[face].tolist()):
            flat[face, k] = o + basis @ np.append(net.vertices[vertex] + shifts[face], 0.0)
    return flat


@given(widths, shares)
def test_small_angles(width, share):
    shift = share * width
    tiny = 1e-5
    assert bend_deduction(tiny, width, 0.0) == pytest.approx(width * tiny**2 / 12.0, rel=1e-6)
    assert bend_deduction(tiny, width, shift) == pytest.approx(
        width * tiny**2 / 12.0 - shift * tiny, rel=1e-6
    )
    assert bend_deduction(0.0, width, shift) == 0.0


@given(angles, widths, shares)
def test_it_is_the_bend_deduction_of_sheet_metal_on_the_middle_surface(angle, width, share):
    """With inner radius R, thickness T and K-factor: setbacks of the middle less the allowance."""
    shift = share * width / angle
    thickness = 1.3 * shift + 0.01
    radius = width / angle - shift - 0.5 * thickness  # R; below 0 for narrow strips, the algebra is the same
    k = 0.5 + shift / thickness
    allowance = angle * (radius + k * thickness)
    assert allowance == pytest.approx(width, rel=1e-9)
    expected = 2.0 * (radius + 0.5 * thickness) * math.tan(0.5 * angle) - allowance
    assert bend_deduction(angle, width, shift) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert bend_deduction(-angle, width, shift) == bend_deduction(angle, width, shift)
    assert bend_radius(angle, width, shift) == pytest.approx(radius + 0.5 * thickness, rel=1e-9, abs=1e-12)


@given(angles, widths)
def test_where_the_metal_is_used_up_the_strip_is_gone(angle, width):
    assert bend_deduction(angle, width, 1.01 * width / angle) == -width
    assert bend_radius(angle, width, 1.01 * width / angle) == 0.0
    assert bend_deduction(angle, width, 0.9999999 * width / angle) == pytest.approx(-width, rel=1e-5)


def test_the_series_meets_the_formula():
    near = np.array([0.04 - 1e-9, 0.04 + 1e-9])
    low, high = bend_deduction(near, 1.0, 0.0) / near**2
    assert low == pytest.approx(high, rel=1e-10)


@settings(max_examples=25)
@given(st.integers(8, 40), st.integers(0, 10**6), widths, shares, st.booleans())
def test_the_pattern_bent_to_arcs_is_the_folded_net(count, seed, width, share, convex):
    goal = random_hull(count, seed) if convex else rough_ball(count, seed)
    net = hand_nets.net_from_parents(goal, random_parents(goal, seed))
    fold = np.array(net.fold_angle)
    shift = share * width / max(float(np.abs(fold).max()), 1e-9)
    shifts = face_shifts(net, fold, width, shift)
    wanted = folded_triangles(net, fold)
    size = float(np.ptp(wanted, axis=(0, 1)).max()) + float(np.abs(shifts).max())
    assert np.abs(marched(net, fold, width, shift, shifts) - wanted).max() < 1e-9 * max(size, 1.0)
    assert np.abs(bent_triangles(net, fold, width, shift, shifts) - wanted).max() < 1e-9 * max(size, 1.0)


@settings(max_examples=15)
@given(st.integers(8, 30), st.integers(0, 10**6), widths, shares)
def test_bent_triangles_march_along_the_strips(count, seed, width, share):
    """Any shifts across the creases: the closed form agrees with the strips marched one by one."""
    goal = rough_ball(count, seed)
    net = hand_nets.net_from_parents(goal, random_parents(goal, seed))
    fold = np.array(net.fold_angle)
    shift = share * width / max(float(np.abs(fold).max()), 1e-9)
    shifts = np.zeros((len(net.faces), 2))
    made = np.random.default_rng(seed).normal(size=len(net.faces))
    for face in net.order[1:].tolist():
        if fold[net.crease_of[face]] != 0.0:
            shifts[face] = shifts[net.parent[face]] + made[face] * outward(net, face)
        else:
            shifts[face] = shifts[net.parent[face]]
    got = bent_triangles(net, fold, width, shift, shifts)
    assert np.abs(marched(net, fold, width, shift, shifts) - got).max() < 1e-7


@given(st.floats(-2.8, 2.8).filter(lambda a: abs(a) > 0.01), widths, shares)
def test_without_the_pattern_one_crease_is_off_by_what_the_formula_says(angle, width, share):
    goal = hand_nets.strip_goal(2)
    net = hand_nets.net_from_parents(goal, hand_nets.bfs_parents(goal))
    crease = next(e for e, letter in enumerate(net.assignment.tolist()) if letter in "VM")
    fold = np.zeros(len(net.edges))
    fold[crease] = angle
    shift = share * width / abs(angle)
    off = bent_triangles(net, fold, width, shift, np.zeros((4, 2))) - folded_triangles(net, fold)
    face = net.child_of[crease]
    expected = abs(float(bend_deduction(angle, width, shift))) * math.cos(0.5 * angle)
    moved = net.subtree[face]
    assert np.linalg.norm(off[moved], axis=2) == pytest.approx(expected, rel=1e-6, abs=1e-9)
    still = np.setdiff1d(np.arange(4), moved)
    assert np.abs(off[still]).max() == 0.0


def test_flat_joints_and_zero_lengths_move_nothing():
    net = hand_nets.cross_net()
    assert np.all(face_shifts(net, net.fold_angle, 0.0, 0.0) == 0.0)
    shifts = face_shifts(net, net.fold_angle, 0.1, 0.03)
    assert np.all(shifts[net.base_panel] == 0.0)
    for face, edge in enumerate(net.crease_of.tolist()):
        if edge >= 0 and net.assignment[edge] == "F":
            assert np.all(shifts[face] == shifts[net.parent[face]])


@pytest.mark.parametrize(("width", "shift"), [(-1.0, 0.0), (0.1, -0.1), (math.nan, 0.0), (0.1, math.inf)])
def test_lengths_that_cannot_be(width, shift):
    with pytest.raises(ValueError, match="bend width"):
        bend_deduction(1.0, width, shift)


@pytest.mark.parametrize("angle", [math.pi, -4.0, math.nan])
def test_angles_that_cannot_be(angle):
    with pytest.raises(ValueError, match="180 degrees"):
        bend_deduction(angle, 0.1, 0.0)
