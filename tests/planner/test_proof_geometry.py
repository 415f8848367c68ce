"""Plain geometry of proofs against shapely, and against the layouts of the kernels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from planner.blooming_trees import blooming_tree
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.no_goods import PathFinder, hold_no_good, vertex_no_goods
from planner.overlap import overlapping_triangles
from planner.packed_bound import path_between
from planner.proof_geometry import PROVEN_DEPTH_MM, FaceShapes, Triangle, penetration, vertex_fan
from tests.planner.goal_shapes import even_ball, plate, rough_ball
from tests.planner.hand_nets import box_goal

numbers = st.floats(-10.0, 10.0, width=32)


def triangle(points: np.ndarray) -> Triangle:
    a, b, c = (complex(x, y) for x, y in points)
    return (a, b, c) if ((b - a).conjugate() * (c - a)).imag > 0 else (a, c, b)


@settings(max_examples=40)
@given(st.lists(numbers, min_size=12, max_size=12))
def test_penetration_is_how_far_one_must_move(values: list[float]) -> None:
    points = np.array(values).reshape(2, 3, 2)
    shapes = [Polygon(p) for p in points]
    if min(shape.area for shape in shapes) < 0.1:
        return
    one, other = triangle(points[0]), triangle(points[1])
    depth = penetration(one, other)
    assert depth == pytest.approx(penetration(other, one), abs=1e-9)
    common = shapes[0].intersection(shapes[1]).area
    if depth == 0.0:
        assert common < 1e-9
    elif depth > 1e-6:
        assert common > 0.0
        shifts = [
            Polygon(points[1] + 1.001 * depth * np.array([np.cos(a), np.sin(a)])).intersection(shapes[0]).area
            for a in np.linspace(0.0, 2.0 * np.pi, 721)
        ]
        assert min(shifts) < 1e-9
        less = [
            Polygon(points[1] + 0.9 * depth * np.array([np.cos(a), np.sin(a)])).intersection(shapes[0]).area
            for a in np.linspace(0.0, 2.0 * np.pi, 73)
        ]
        assert min(less) > 0.0


@settings(max_examples=15)
@given(st.integers(10, 60), st.integers(0, 10_000))
def test_paths_are_laid_out_as_the_kernels_do(count: int, seed: int) -> None:
    graph = DualGraph(rough_ball(count, seed, 0.6))
    layout = FlatLayout(graph, blooming_tree(graph, 0), 0)
    shapes = FaceShapes(graph.goal)
    corners = layout.corners[..., 0] + 1j * layout.corners[..., 1]
    for f, g in [(0, len(corners) - 1), (3, 7), *layout.overlapping_pairs()[:5].tolist()]:
        edges = path_between(layout, f, g)
        assert sorted(edges) == sorted(layout.path(f, g).tolist())
        laid = shapes.path(f, [tuple(graph.vertices[e].tolist()) for e in edges])
        assert laid[-1][0] == g
        own = np.array([triangle for _, triangle in laid])
        there = corners[[face for face, _ in laid]]
        turn = (own[0, 1] - own[0, 0]) / (there[0, 1] - there[0, 0])
        assert np.abs((there - there[0, 0]) * turn + own[0, 0] - own).max() < 1e-9


@settings(max_examples=10)
@given(st.integers(8, 40), st.integers(0, 10_000))
def test_violated_paths_of_a_tree_are_its_minimal_overlaps(count: int, seed: int) -> None:
    graph = DualGraph(rough_ball(count, seed, 0.7))
    tree = blooming_tree(graph, 0, "bfs")
    layout = FlatLayout(graph, tree, 0, hold_base=False)
    pairs = {tuple(pair) for pair in overlapping_triangles(layout.corners)}
    paths = {pair: set(layout.path(*pair).tolist()) for pair in pairs}
    minimal = {pair for pair in pairs if not any(paths[other] < paths[pair] for other in pairs)}
    found = PathFinder(graph).violated(tree.astype(np.float64), 10**7)
    assert {item.faces for item in found} == minimal
    for item in found:
        assert set(item.edges) == paths[item.faces]


@settings(max_examples=10)
@given(st.integers(8, 40), st.integers(0, 10_000))
def test_short_paths_overlap_and_are_minimal(count: int, seed: int) -> None:
    graph = DualGraph(rough_ball(count, seed, 0.7))
    shapes = FaceShapes(graph.goal)
    found = PathFinder(graph).short(7, 10**7)
    assert len({frozenset(item.edges) for item in found}) == len(found)
    for item in found[:50]:
        laid = shapes.path(item.faces[0], [tuple(graph.vertices[e].tolist()) for e in item.edges])
        over = [
            (i, j)
            for i in range(len(laid))
            for j in range(i + 2, len(laid))
            if penetration(laid[i][1], laid[j][1]) > PROVEN_DEPTH_MM
        ]
        assert over == [(0, len(laid) - 1)]


def test_vertices_with_too_much_angle() -> None:
    goal = rough_ball(40, 3, 0.7)
    graph = DualGraph(goal)
    corners = goal.vertices[goal.faces]
    angle = np.zeros(len(goal.vertices))
    for k in range(3):
        u, v = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        cosine = (u * v).sum(axis=1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)
        np.add.at(angle, goal.faces[:, k], np.arccos(cosine))
    found = {item.faces[0] for item in vertex_no_goods(graph)}
    assert found == set(np.flatnonzero(angle > 2.0 * np.pi + 1e-3).tolist())
    assert not vertex_no_goods(DualGraph(even_ball(40)))


def test_fans_go_around_inner_vertices_only() -> None:
    goal = plate(3, 3)
    fans = [vertex_fan(goal, vertex) for vertex in range(len(goal.vertices))]
    inner = [vertex for vertex, fan in enumerate(fans) if fan is not None]
    assert inner == [5, 6, 9, 10]
    for vertex in inner:
        fan = fans[vertex]
        assert fan is not None
        assert sorted(face for face, _ in fan) == np.flatnonzero((goal.faces == vertex).any(axis=1)).tolist()
        for (face, spoke), (before, _) in zip(fan, fan[-1:] + fan[:-1], strict=True):
            assert {vertex, spoke} <= set(goal.faces[face].tolist()) & set(goal.faces[before].tolist())


def test_the_hold_is_about_the_sides_of_the_base_panel() -> None:
    graph = DualGraph(box_goal())
    item = hold_no_good(graph, 0)
    assert item is not None
    own = graph.panel[graph.faces] == graph.panel[0]
    assert sorted(item.edges) == np.flatnonzero(own[:, 0] != own[:, 1]).tolist()
    assert hold_no_good(DualGraph(plate()), 0) is None
