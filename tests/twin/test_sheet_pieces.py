"""Merged substrate: the same area, convex, never across what one step clips."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from planner.fold_plan import Bend, Clip, FoldPlan, Sheet
from tests.twin.hand_plans import box, breadth_first_net, plan_of
from twin.sheet_pieces import KEPT, MOST_SIDES, sheet_pieces


def plan_with_substrate(points: np.ndarray, triangles: np.ndarray, steps=()) -> FoldPlan:
    net = breadth_first_net(box())
    sheet = Sheet(
        outline=np.array([[0, 0], [1, 0], [1, 1.0]]), vertices=points, faces=triangles,
        frame_faces=np.zeros(len(triangles), bool), tabs=(), rotary_axis=np.array([[0.0, 0], [1, 0]]),
    )  # fmt: skip
    return plan_of(net, steps, sheet)


def counter_clockwise(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    keep = np.abs(area) > 0.05
    out = triangles.copy()
    out[area < 0] = out[area < 0][:, ::-1]
    return out[keep]


@given(st.integers(0, 10**6))
@settings(max_examples=40)
def test_merged_pieces_are_the_triangles_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(7), np.arange(6)), axis=-1).reshape(-1, 2) * 3.0
    points = grid + rng.choice([0.0, 1.0]) * rng.uniform(-0.9, 0.9, grid.shape)
    triangles = counter_clockwise(points, Delaunay(points).simplices.astype(np.int64))
    triangles = triangles[rng.random(len(triangles)) < 0.8]  # holes
    groups = rng.integers(0, 3, len(triangles))
    first, second = (tuple(np.flatnonzero(groups == k).tolist()) for k in (1, 2))
    steps = [Clip(first), Bend(second, ((0.0, 0.0), (1.0, 0.0)), 0.5)]
    pieces = sheet_pieces(plan_with_substrate(points, triangles, steps))
    assert sorted(t for p in pieces for t in p.triangles) == list(range(len(triangles)))
    for piece in pieces:
        whole = shapely.union_all([shapely.Polygon(points[triangles[t]]) for t in piece.triangles])
        polygon = shapely.Polygon(piece.outline)
        assert polygon.symmetric_difference(whole).area < 1e-9
        assert polygon.convex_hull.area - polygon.area < 1e-9
        assert shapely.Polygon(piece.outline).exterior.is_ccw
        assert len(piece.outline) <= MOST_SIDES
        kinds = {int(groups[t]) for t in piece.triangles}
        assert len(kinds) == 1
        assert (piece.gone_at, piece.bent_at) == {0: (KEPT, KEPT), 1: (0, KEPT), 2: (KEPT, 1)}[kinds.pop()]


def test_a_grid_of_squares_becomes_one_piece() -> None:
    points = np.stack(np.meshgrid(np.arange(9), np.arange(5)), axis=-1).reshape(-1, 2).astype(float)
    triangles = counter_clockwise(points, Delaunay(points).simplices.astype(np.int64))
    (piece,) = sheet_pieces(plan_with_substrate(points, triangles))
    assert len(piece.outline) == 4
    assert len(piece.triangles) == len(triangles)


@pytest.mark.parametrize("width", [1e-5, 1e-9])
def test_slivers_of_rounding_are_dropped(width: float) -> None:
    points = np.array([[0, 0], [30, 0], [15, width]])
    assert sheet_pieces(plan_with_substrate(points, np.array([[0, 1, 2]]))) == ()
