"""Overlap of triangles in the plane against polygons and all pairs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from planner._kernels.overlap_kernels import OVERLAP_TOLERANCE_MM
from planner.overlap import overlapping_faces, overlapping_triangles
from tests.planner.hand_nets import bfs_parents, box_goal, net_from_parents


def random_triangles(count: int, seed: int, spread: float) -> np.ndarray:
    """Counter-clockwise triangles of very different sizes."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 3, 2)) * rng.lognormal(0.0, 1.0, size=(count, 1, 1))
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0.0
    corners[clockwise] = corners[clockwise][:, ::-1]
    return corners + spread * rng.normal(size=(count, 1, 2))


def slow_pairs(triangles: np.ndarray) -> tuple[set[tuple[int, int]], set[tuple[int, int]]]:
    """All pairs whose polygons share area: surely deeper than the tolerance, and any area at all."""
    polygons = [Polygon(corners) for corners in triangles]
    sure, any_area = set(), set()
    for i in range(len(polygons)):
        for j in range(i + 1, len(polygons)):
            shared = polygons[i].intersection(polygons[j])
            if shared.area > 0.0:
                any_area.add((i, j))
            if not shared.buffer(-2.0 * OVERLAP_TOLERANCE_MM).is_empty:
                sure.add((i, j))
    return sure, any_area


@settings(max_examples=40)
@given(st.integers(2, 40), st.integers(0, 10_000), st.sampled_from([0.5, 3.0, 20.0, 1000.0]))
def test_agrees_with_polygons(count: int, seed: int, spread: float) -> None:
    triangles = random_triangles(count, seed, spread)
    found = set(overlapping_triangles(triangles))
    sure, any_area = slow_pairs(triangles)
    assert sure <= found <= any_area


RIGHT = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])


@pytest.mark.parametrize(
    ("other", "overlaps"),
    [
        ([[10, 0], [10, 10], [0, 10]], False),
        ([[0, 0], [0, -10], [10, 0]], False),
        ([[10, 0], [20, 0], [20, 10]], False),
        ([[5, 0], [4, -5], [6, -5]], False),
        ([[5, 0.001], [4, -5], [6, -5]], True),
        ([[5, 0.00005], [4, -5], [6, -5]], False),
        ([[1, 1], [3, 1], [1, 3]], True),
        ([[-5, -5], [40, -5], [-5, 40]], True),
        ([[0, 0], [10, 0], [0, 10]], True),
        ([[-1, 4], [20, 4], [20, 4.01]], True),
    ],
    ids=["edge", "edge below", "corner", "corner on edge", "1 um deep", "within the tolerance", "inside",
         "around", "same", "needle through"],
)  # fmt: skip
def test_touching_is_no_overlap(other: list[list[float]], overlaps: bool) -> None:
    pairs = overlapping_triangles(np.array([RIGHT, other]))
    assert pairs == ([(0, 1)] if overlaps else [])
    turned = np.array([RIGHT, other]) @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + [1e3, -2e3]
    assert overlapping_triangles(turned) == pairs


def test_no_triangles() -> None:
    assert overlapping_triangles(np.zeros((0, 3, 2))) == []


def test_many_on_one_spot() -> None:
    count = 60
    assert len(overlapping_triangles(np.tile(RIGHT, (count, 1, 1)))) == count * (count - 1) // 2


def test_net_of_a_box() -> None:
    goal = box_goal()
    assert overlapping_faces(net_from_parents(goal, bfs_parents(goal))) == []
