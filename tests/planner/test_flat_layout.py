"""Flat layouts: positions, exchanges, undo, hold of the base, and the net that comes out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blooming_trees import blooming_tree, weighted_tree
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.kinematics import folded_triangles, rigid_fit
from planner.net import Net
from planner.overlap import overlapping_faces, overlapping_triangles
from tests.planner.goal_shapes import bodies, even_ball, plate, random_hull, rough_ball, torus
from tests.planner.hand_nets import box_goal, net_from_parents


def sides(corners: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def aligned(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Points (N, 2) moved rigidly, without a mirror, onto the target."""
    p, t = points @ [1, 1j], target @ [1, 1j]
    p, t = p - p.mean(), t - t.mean()
    turn = np.vdot(p, t)
    return np.abs(p * turn / abs(turn) - t)


def check_net(net: Net) -> None:
    """Isometry, a tree, creases of the right kind, and the goal comes back when all creases are folded."""
    goal = net.goal
    flat = net.vertices[net.faces]
    assert np.abs(sides(flat) - sides(goal.vertices[goal.faces])).max() < 1e-9
    first, second = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    assert (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] > 0.0).all()
    assert len(net.order) == len(net.faces)
    creases = net.assignment != "B"
    assert creases.sum() == len(net.faces) - 1
    assert set(net.crease_of[net.crease_of >= 0].tolist()) == set(np.flatnonzero(creases).tolist())
    assert np.array_equal(net.assignment == "V", net.fold_angle > 0.0)
    assert np.array_equal(net.assignment == "M", net.fold_angle < 0.0)
    pairs = np.sort(net.edges, axis=1)
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    every = np.sort(np.stack([net.faces, np.roll(net.faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    found, count = np.unique(every, axis=0, return_counts=True)
    kinds = {tuple(pair): letter for pair, letter in zip(pairs.tolist(), net.assignment, strict=True)}
    assert {tuple(pair) for pair in found.tolist()} == set(kinds)
    assert all((kinds[tuple(p)] == "B") == (c == 1) for p, c in zip(found.tolist(), count, strict=True))
    folded = folded_triangles(net, net.fold_angle).reshape(-1, 3)
    target = goal.vertices[goal.faces].reshape(-1, 3)
    turn, shift = rigid_fit(folded, target)
    flat_play = np.abs(DualGraph(goal).fold_angle[DualGraph(goal).flat]).sum()  # flat joints are not folded
    assert np.abs(folded @ turn.T + shift - target).max() < (1e-11 + 2.0 * flat_play) * goal.longest_side_mm
    assert np.linalg.det(turn) > 0.0


@settings(max_examples=25)
@given(bodies, st.integers(0, 10_000))
def test_layout_is_an_isometry_and_folds_back(goal: GoalMesh, seed: int) -> None:
    graph = DualGraph(goal)
    rng = np.random.default_rng(seed)
    base = int(rng.integers(len(goal.faces)))
    layout = FlatLayout(graph, weighted_tree(graph, rng.random(len(graph.faces))), base)
    assert np.abs(sides(layout.corners) - graph.side_length).max() < 1e-10
    net = layout.to_net()
    check_net(net)
    assert aligned(layout.corners.reshape(-1, 2), net.vertices[net.faces].reshape(-1, 2)).max() < 1e-9
    slow = net_from_parents(goal, layout.parent.tolist())
    assert (
        aligned(slow.vertices[slow.faces].reshape(-1, 2), net.vertices[net.faces].reshape(-1, 2)).max() < 1e-9
    )
    assert np.array_equal(slow.parent, net.parent)
    assert sorted(zip(slow.assignment, slow.fold_angle.round(9), strict=True)) == sorted(
        zip(net.assignment, net.fold_angle.round(9), strict=True)
    )
    assert layout.overlaps == len(overlapping_faces(net)) == len(layout.overlapping_pairs())


@pytest.mark.parametrize("goal", [box_goal(), plate(), torus(), even_ball(30)], ids=lambda g: g.name)
def test_nets_of_bodies_with_panels_holes_and_boundaries(goal: GoalMesh) -> None:
    graph = DualGraph(goal)
    for base in (0, len(goal.faces) // 2):
        layout = FlatLayout(graph, blooming_tree(graph, base, "bfs"), base)
        net = layout.to_net()
        check_net(net)
        assert (net.assignment == "F").sum() == graph.flat_forest.sum()
        assert (layout.depth[net.base_panel] == 0).all()


def test_relative_depth_and_target() -> None:
    graph = DualGraph(box_goal())
    layout = FlatLayout(graph, blooming_tree(graph, 2, "bfs"), 2)
    assert sorted(layout.depth.tolist()) == [0, 0] + [1] * 8 + [2] * 2
    net = layout.to_net()
    wanted = np.where(net.crease_of >= 0, net.fold_angle[net.crease_of], 0.0)
    assert np.array_equal(layout.target, wanted)
    slot = layout.slot
    for face in layout.order[1:].tolist():
        start, end = net.hinge(face)
        corners = net.vertices[net.faces[face]]
        assert np.array_equal(corners[slot[face]], start)
        assert np.array_equal(corners[(slot[face] + 1) % 3], end)


def exchanges(layout: FlatLayout, rng: np.random.Generator, count: int) -> list[tuple[int, int, bool]]:
    """Random exchanges, with what came of them."""
    out: list[tuple[int, int, bool]] = []
    for _ in range(count):
        cut = int(rng.choice(np.flatnonzero(layout.tree)))
        join = int(rng.choice([*layout.joinable(cut).tolist(), -1]))
        out += [(cut, join, layout.exchange(cut, join))] if join >= 0 else []
    return out


@settings(max_examples=25)
@given(st.integers(20, 60), st.integers(0, 10_000))
def test_exchanges_agree_with_laying_out_afresh(count: int, seed: int) -> None:
    graph = DualGraph(rough_ball(count, seed, depth=0.3))
    rng = np.random.default_rng(seed)
    layout = FlatLayout(graph, blooming_tree(graph, 0, "steepest"), 0, hold_base=False)
    for _ in range(30):
        before = layout.tree
        clean = not len(layout.overlapping_pairs())
        for cut, join, done in exchanges(layout, rng, 1):
            wanted = before.copy()
            wanted[[cut, join]] = False, True
            afresh = FlatLayout(graph, wanted, 0, hold_base=False)
            part = set(np.flatnonzero(crossing(graph, before, cut)).tolist())
            hits = [
                pair for pair in afresh.overlapping_pairs().tolist() if (pair[0] in part) != (pair[1] in part)
            ]
            assert done == (not hits and not graph.flat[cut])
            if done:
                assert np.array_equal(layout.tree, wanted)
                assert np.array_equal(layout.parent, afresh.parent)
                assert np.array_equal(layout.order, afresh.order)
                assert aligned(layout.corners.reshape(-1, 2), afresh.corners.reshape(-1, 2)).max() < 1e-9
                assert not clean or not len(layout.overlapping_pairs())
            else:
                assert np.array_equal(layout.tree, before)


def crossing(graph: DualGraph, tree: np.ndarray, cut: int) -> np.ndarray:
    """(F,) True on one side of the tree without ``cut``."""
    inside = np.zeros(len(graph.goal.faces), dtype=bool)
    stack = [int(graph.faces[cut, 0])]
    while stack:
        face = stack.pop()
        inside[face] = True
        for edge in graph.face_edges[face].tolist():
            if edge >= 0 and edge != cut and tree[edge]:
                other = int(graph.faces[edge].sum()) - face
                if not inside[other]:
                    stack.append(other)
    return inside


@settings(max_examples=20)
@given(st.integers(15, 60), st.integers(0, 10_000))
def test_undo_is_exact(count: int, seed: int) -> None:
    graph = DualGraph(random_hull(count, seed))
    rng = np.random.default_rng(seed)
    layout = FlatLayout(graph, blooming_tree(graph, 1, "dijkstra"), 1, hold_base=False)

    def state() -> tuple[np.ndarray, ...]:
        return layout.tree, layout.corners, layout.parent.copy(), layout.order.copy()

    states = [state()]
    for _ in range(40):
        states += [state() for _, _, done in exchanges(layout, rng, 1) if done]
    for earlier in states[-2::-1]:
        layout.undo()
        for now, before in zip(state(), earlier, strict=True):
            assert np.array_equal(now, before)
    with pytest.raises(NetError, match="nothing to take back"):
        layout.undo()
    assert len(overlapping_triangles(layout.corners)) == layout.overlaps


def test_copies_are_independent() -> None:
    graph = DualGraph(even_ball(40))
    layout = FlatLayout(graph, blooming_tree(graph, 0, "bfs"), 0, hold_base=False)
    corners, tree = layout.corners, layout.tree
    twin = layout.copy()
    assert any(done for _, _, done in exchanges(twin, np.random.default_rng(0), 20))
    assert np.array_equal(layout.corners, corners)
    assert np.array_equal(layout.tree, tree)
    assert not np.array_equal(twin.tree, tree)
    assert np.array_equal(twin.copy().corners, twin.corners)


def test_path_and_joinable() -> None:
    graph = DualGraph(rough_ball(50, 4))
    layout = FlatLayout(graph, blooming_tree(graph, 0, "bfs"), 0)
    faces = len(graph.goal.faces)
    for a, b in ((0, faces - 1), (5, 9), (3, 3)):
        path = layout.path(a, b)
        expected = {e for e in np.flatnonzero(layout.tree).tolist()
                    if crossing(graph, layout.tree, e)[a] != crossing(graph, layout.tree, e)[b]}  # fmt: skip
        assert set(path.tolist()) == expected
    for cut in np.flatnonzero(layout.tree).tolist()[::7]:
        inside = crossing(graph, layout.tree, cut)
        bridges = np.flatnonzero(inside[graph.faces[:, 0]] != inside[graph.faces[:, 1]])
        assert layout.joinable(cut).tolist() == bridges[bridges != cut].tolist()


def test_set_base_keeps_the_net() -> None:
    graph = DualGraph(even_ball(30))
    layout = FlatLayout(graph, blooming_tree(graph, 0, "steepest"), 0)
    corners, tree = layout.corners, layout.tree
    layout.set_base(11)
    assert layout.base == 11
    assert layout.parent[11] == -1
    assert np.array_equal(layout.corners, corners)
    assert np.array_equal(layout.tree, tree)
    check_net(layout.to_net())


def test_the_base_keeps_a_free_edge_and_room() -> None:
    graph = DualGraph(even_ball(60))
    tree = blooming_tree(graph, 0, "bfs")
    full = FlatLayout(graph, tree, 0)
    assert full.free_edges() == 0  # three petals around a triangle
    rng = np.random.default_rng(3)
    sides_of_base = graph.face_edges[0].tolist()
    cut = sides_of_base[0]
    freed = next(join for join in full.joinable(cut).tolist() if full.exchange(cut, join))
    assert freed not in sides_of_base
    layout = FlatLayout(graph, full.tree, 0)
    assert layout.free_edges() == 1
    room = layout.tab_has_room()
    for _ in range(300):
        exchanges(layout, rng, 1)
        assert layout.free_edges() >= 1
        assert layout.tab_has_room() or not room


def test_room_is_what_the_rectangle_says() -> None:
    from shapely.geometry import Polygon

    for seed in range(12):
        graph = DualGraph(rough_ball(40, seed, depth=0.4))
        base = seed % len(graph.goal.faces)
        layout = FlatLayout(
            graph, weighted_tree(graph, np.random.default_rng(seed).random(len(graph.faces))), base
        )
        polygons = [Polygon(c) for c in layout.corners]
        room = False
        for face, slot, edge in layout.outline.tolist():
            if edge >= 0 and layout.tree[edge]:
                continue
            a, b = layout.corners[face, slot], layout.corners[face, (slot + 1) % 3]
            length = float(np.linalg.norm(b - a))
            along = (b - a) / length
            out = np.array([along[1], -along[0]])
            width = min(2.0, length)
            steps = max(1, int(np.ceil(length / width - 1e-9)))
            starts = np.linspace(0.0, length - width, steps) if steps > 1 else [0.5 * (length - width)]
            for start in starts:
                low, high = a + start * along, a + (start + width) * along
                box = Polygon([low, low + out, high + out, high])
                room |= all(box.intersection(p).area < 1e-3 for p in polygons)
        assert layout.tab_has_room() == room


def test_flat_joints_are_never_cut() -> None:
    graph = DualGraph(box_goal())
    layout = FlatLayout(graph, blooming_tree(graph, 0, "bfs"), 0)
    for edge in np.flatnonzero(graph.flat).tolist():
        assert not any(layout.exchange(edge, join) for join in layout.joinable(edge).tolist())


def test_wrong_trees_bases_and_edges_are_refused() -> None:
    graph = DualGraph(box_goal())
    tree = blooming_tree(graph, 0, "bfs")
    with pytest.raises(NetError, match="not a spanning tree"):
        FlatLayout(graph, np.zeros(len(tree), dtype=bool), 0)
    with pytest.raises(NetError, match="not a spanning tree"):
        FlatLayout(graph, np.ones(len(tree), dtype=bool), 0)
    with pytest.raises(NetError, match="one entry per interior edge"):
        FlatLayout(graph, tree[:-1], 0)
    with pytest.raises(NetError, match="faces 0 to 11"):
        FlatLayout(graph, tree, 12)
    layout = FlatLayout(graph, tree, 0)
    inside, outside = int(np.flatnonzero(tree)[0]), int(np.flatnonzero(~tree)[0])
    with pytest.raises(NetError, match="not in the tree"):
        layout.exchange(outside, outside)
    with pytest.raises(NetError, match="choose one of joinable"):
        layout.exchange(inside, inside)
    with pytest.raises(NetError, match="not in the tree"):
        layout.joinable(outside)


def test_single_triangle() -> None:
    goal = GoalMesh(np.array([[0, 0, 0], [30, 0, 0], [0, 20, 0]], float), np.array([[0, 1, 2]]))
    graph = DualGraph(goal)
    layout = FlatLayout(graph, np.zeros(0, dtype=bool), 0)
    assert layout.overlaps == 0
    assert layout.free_edges() == 3
    assert layout.tab_has_room()
    net = layout.to_net()
    assert net.assignment.tolist() == ["B"] * 3
