"""Convex bodies: where the blooming trees never overlap, where they do, and that the motion is free."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base_faces import blooming_figures
from planner.blooming_trees import BLOOMING_TREES, TreeGrower, TreeName, blooming_tree
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.kinematics import folded_triangles
from planner.nearly_blooming import nearly_blooming
from tests.planner.goal_shapes import even_ball, hull_goal, random_hull

GOLDEN = (1.0 + 5.0**0.5) / 2.0


def platonic_solids() -> list[GoalMesh]:
    cube = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    rectangles = [p for a in (-1, 1) for b in (-GOLDEN, GOLDEN) for p in ((0, a, b), (a, b, 0), (b, 0, a))]
    small = [
        p for a in (-1, 1) for b in (-1, 1)
        for p in ((0, a / GOLDEN, b * GOLDEN), (a / GOLDEN, b * GOLDEN, 0), (b * GOLDEN, 0, a / GOLDEN))
    ]  # fmt: skip
    points = {
        "tetrahedron": [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)],
        "cube": cube,
        "octahedron": [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)],
        "icosahedron": rectangles,
        "dodecahedron": cube + small,
    }
    return [hull_goal(20.0 * np.array(corners, dtype=float), name) for name, corners in points.items()]


def prism(sides: int, height: float, turn: float) -> GoalMesh:
    """A prism, or with ``turn`` half a side an antiprism."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rings = [
        np.stack([20.0 * np.cos(angle + shift), 20.0 * np.sin(angle + shift), np.full(sides, z)], axis=1)
        for shift, z in ((0.0, 0.0), (turn * 2.0 * np.pi / sides, height))
    ]
    return hull_goal(np.concatenate(rings), f"prism{sides}-{height:g}-{turn:g}")


def squeezed(goal: GoalMesh, *factors: float) -> GoalMesh:
    return hull_goal(goal.vertices * np.array(factors))


def nets_that_overlap(goal: GoalMesh, name: TreeName) -> int:
    grower = TreeGrower(DualGraph(goal))
    return sum(blooming_figures(grower, base, name).overlaps > 0 for base in range(len(goal.faces)))


REGULAR = [
    *platonic_solids(),
    *(prism(n, h, t) for n in (3, 4, 5, 8, 12) for h in (10.0, 40.0, 120.0) for t in (0.0, 0.5)),
    even_ball(20), even_ball(80), even_ball(160),
]  # fmt: skip


@pytest.mark.parametrize("name", BLOOMING_TREES)
def test_regular_bodies_bloom_without_overlap_from_every_base(name: TreeName) -> None:
    for goal in REGULAR:
        assert nets_that_overlap(goal, name) == 0, goal.name


def test_steepest_overlaps_least_on_random_hulls_but_no_tree_never_does() -> None:
    """No rule that chooses edges is known to be free of overlap on all convex bodies; these are not."""
    round_ones = [random_hull(count, seed) for count in (15, 30, 60) for seed in range(4)]
    slim_ones = [squeezed(goal, 0.2, 0.2, 1.0) for goal in round_ones]
    share: dict[TreeName, list[float]] = {}
    for bodies in (round_ones, slim_ones):
        faces = sum(len(goal.faces) for goal in bodies)
        for name in BLOOMING_TREES:
            hits = sum(nets_that_overlap(goal, name) for goal in bodies)
            share.setdefault(name, []).append(hits / faces)
    assert share["steepest"][0] == min(shares[0] for shares in share.values())
    assert share["steepest"][0] < 0.02
    assert all(shares[1] > 0.1 for shares in share.values())


def test_what_overlaps_on_convex_bodies_is_repaired() -> None:
    for seed in range(4):
        goal = squeezed(random_hull(30, seed), 0.2, 0.2, 1.0)
        graph = DualGraph(goal)
        for base in range(0, len(goal.faces), 7):
            for name in BLOOMING_TREES:
                attempt = nearly_blooming(graph, base, tree=name)
                assert attempt.is_net


def crossings(triangles: np.ndarray, apart: np.ndarray) -> int:
    """Pairs of triangles (F, 3, 3) among ``apart`` (P, 2) where a side of one passes through the other.

    Touching does not count: the hit must lie inside both by a thousandth.
    """
    count = 0
    for first, second in ((0, 1), (1, 0)):
        one, other = triangles[apart[:, first]], triangles[apart[:, second]]
        origin = other[:, 0]
        u, v = other[:, 1] - origin, other[:, 2] - origin
        normal = np.cross(u, v)
        gram = np.einsum("ij,ij->i", normal, normal)
        for k in range(3):
            start, end = one[:, k], one[:, (k + 1) % 3]
            a = np.einsum("ij,ij->i", start - origin, normal)
            b = np.einsum("ij,ij->i", end - origin, normal)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = a / (a - b)
                hit = start + t[:, None] * (end - start) - origin
                s = np.einsum("ij,ij->i", np.cross(hit, v), normal) / gram
                r = np.einsum("ij,ij->i", np.cross(u, hit), normal) / gram
            inside = np.minimum.reduce([t, 1 - t, s, r, 1 - s - r]) > 1e-3
            count += int(np.count_nonzero(inside & (a * b < 0.0)))
    return count


def test_the_oracle_sees_crossings() -> None:
    flat = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], dtype=float)
    upright = np.array([[1, 1, -1], [1, 1, 1], [3, 3, 1]], dtype=float)
    pair = np.array([[0, 1]])
    assert crossings(np.stack([flat, upright]), pair) > 0
    assert crossings(np.stack([flat, upright + np.array([0.0, 0.0, 1.1])]), pair) == 0


@pytest.mark.parametrize("name", BLOOMING_TREES)
def test_regular_bodies_open_without_crossing(name: TreeName) -> None:
    """All creases open at the same pace; sampled at 40 stages, with an oracle of its own."""
    for goal in (*platonic_solids(), prism(6, 40.0, 0.0), prism(5, 40.0, 0.5), even_ball(20)):
        graph = DualGraph(goal)
        for base in range(0, len(goal.faces), max(1, len(goal.faces) // 4)):
            net = FlatLayout(graph, blooming_tree(graph, base, name), base, hold_base=False).to_net()
            faces = np.arange(len(goal.faces))
            pairs = np.stack(np.meshgrid(faces, faces), axis=-1).reshape(-1, 2)
            joined = (net.parent[pairs[:, 0]] == pairs[:, 1]) | (net.parent[pairs[:, 1]] == pairs[:, 0])
            apart = pairs[(pairs[:, 0] < pairs[:, 1]) & ~joined]
            for stage in np.linspace(0.0, 0.999, 40):
                assert crossings(folded_triangles(net, stage * net.fold_angle), apart) == 0, goal.name
