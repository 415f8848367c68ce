"""Hidden share of a crease, against polygons, and its laws."""

import math

import numpy as np
import pytest
from numba import njit

from planner._kernels.sight_kernels import END_SHARE, covered_interval, union_share
from tests.planner.contact_reference import hidden_share_reference


@njit  # kernels that only kernels call cannot be called from Python
def share_of(intervals, count):
    return union_share(intervals, count)


@njit
def covered(tri, ax, ay, bx, by, kx, ky, up, radius, out):
    return covered_interval(tri, ax, ay, bx, by, kx, ky, up, radius, out)


def cover(triangle, start, end, rotary, radius=0.0, axis=(1.0, 0.0)):
    out = np.empty(2)
    kx, ky = math.tan(rotary) * axis[1], -math.tan(rotary) * axis[0]
    hit = covered(triangle, *start, *end, kx, ky, 1 / math.cos(rotary), radius, out)
    return (float(out[0]), float(out[1])) if hit else None


@pytest.mark.parametrize("rotary", [0.0, 0.4, -0.6, math.pi, math.pi + 0.5])
def test_covered_length_equals_the_polygon_intersection(rotary):
    rng = np.random.default_rng(int(1000 * rotary) % 97)
    beam = np.array([0.0, math.sin(rotary), math.cos(rotary)])
    seen = 0
    for _ in range(300):
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangle = rng.uniform(-2, 2, (3, 3))
        triangle[:, 2] = np.sign(math.cos(rotary)) * rng.uniform(0.1, 2, 3)
        found = cover(triangle, start, end, rotary)
        expected = hidden_share_reference(np.append(start, 0.0), np.append(end, 0.0), [triangle], beam)
        assert (found[1] - found[0] if found else 0.0) == pytest.approx(expected, abs=1e-6)
        seen += expected > 0
    assert seen > 20


def test_what_lies_under_the_crease_hides_nothing():
    triangle = np.array([[-1.0, -1.0, -0.5], [1.0, -1.0, -0.5], [0.0, 2.0, -0.5]])
    assert cover(triangle, (-1.0, 0.0), (1.0, 0.0), 0.0) is None
    assert cover(triangle, (-1.0, 0.0), (1.0, 0.0), math.pi) is not None


def test_slanted_triangle_hides_only_where_it_is_above():
    # the plane z = s along the segment: only the half with s > 0 (plus the least height) hides
    triangle = np.array([[-2.0, -3.0, -2.0], [2.0, -3.0, 2.0], [0.0, 3.0, 0.0]])
    lo, hi = cover(triangle, (-1.0, 0.0), (1.0, 0.0), 0.0)
    assert lo == pytest.approx(0.5 + 0.01 / 2.0, abs=1e-9)
    assert hi == pytest.approx(1.0, abs=1e-9)


def test_wider_beam_never_sees_more():
    rng = np.random.default_rng(3)
    for _ in range(300):
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangle = rng.uniform(-2, 2, (3, 3))
        triangle[:, 2] = rng.uniform(0.1, 2, 3)
        thin, wide = (cover(triangle, start, end, 0.3, radius) for radius in (0.0, 0.1))
        if thin is not None:
            assert wide is not None
            assert wide[0] <= thin[0] + 1e-9
            assert wide[1] >= thin[1] - 1e-9


def test_rotating_everything_about_z_changes_nothing():
    rng = np.random.default_rng(5)
    for _ in range(200):
        turn = rng.uniform(0, 2 * math.pi)
        R = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangle = rng.uniform(-2, 2, (3, 3))
        turned = triangle.copy()
        turned[:, :2] = triangle[:, :2] @ R.T
        one = cover(triangle, start, end, 0.5)
        other = cover(turned, R @ start, R @ end, 0.5, axis=R @ [1.0, 0.0])
        assert (one is None) == (other is None)
        if one:
            assert one == pytest.approx(other, abs=1e-7)


def test_union_counts_overlapping_intervals_once_and_leaves_out_the_ends():
    intervals = np.array([[0.0, 0.01], [0.3, 0.5], [0.4, 0.6], [0.45, 0.47]])
    assert share_of(intervals, 4) == pytest.approx(0.3 / (1 - 2 * END_SHARE))
