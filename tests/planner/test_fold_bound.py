"""The bound on what any net can fold: against all trees of small goals, laws, and plans."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from planner.dual_graph import DualGraph
from planner.fold_bound import bound_notice, most_completion
from planner.fold_orders import steepest_fold
from planner.fold_plan import MachineLimits
from planner.goal_mesh import GoalMesh
from planner.make_net import make_net
from planner.plan_folds import plan_folds

FLIPS = MachineLimits(max_tilt_rad=0.0)
OCTAHEDRON = (
    np.array([[20, 0, 0], [0, 20, 0], [-20, 0, 0], [0, -20, 0], [0, 0, 20], [0, 0, -20]], dtype=float),
    np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]]),
)
TETRAHEDRON = (
    np.array([[0, 0, 0], [20, 0, 0], [0, 20, 0], [0, 0, 20]], dtype=float),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)


def of_all_trees(goal, limits):
    """The bound by trying every spanning tree."""
    graph = DualGraph(goal)
    wanted = np.where(graph.flat, 0.0, np.abs(graph.fold_angle))
    seen = np.minimum(wanted, steepest_fold(limits))
    best = 0.0
    for edges in itertools.combinations(range(len(wanted)), len(goal.faces) - 1):
        part = list(range(len(goal.faces)))
        for edge in edges:
            a, b = (part[face] for face in graph.faces[edge])
            part = [b if p == a else p for p in part]
        if len(set(part)) == 1:
            best = max(best, seen[list(edges)].sum() / wanted[list(edges)].sum())
    return best


@pytest.mark.parametrize("solid", [TETRAHEDRON, OCTAHEDRON], ids=["tetrahedron", "octahedron"])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("tilt_deg", [0.0, 15.0, 45.0])
def test_bound_is_that_of_the_best_of_all_trees(solid, seed, tilt_deg):
    rng = np.random.default_rng(seed)
    stretch = rng.uniform(0.1, 1.5, 3)
    goal = GoalMesh(solid[0] * stretch, solid[1], "stretched")
    limits = replace(FLIPS, max_tilt_rad=math.radians(tilt_deg))
    assert most_completion(goal, limits) == pytest.approx(of_all_trees(goal, limits), abs=1e-9)


def test_bound_does_not_depend_on_place_size_or_order_of_faces():
    points, faces = OCTAHEDRON
    points = points * [1.0, 0.4, 0.2]
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    before = most_completion(GoalMesh(points, faces, "flat octahedron"), FLIPS)
    after = most_completion(GoalMesh(3.0 * points @ turn.T + 7.0, faces[::-1], "the same"), FLIPS)
    assert before < 0.95
    assert after == pytest.approx(before, abs=1e-9)


def test_more_tilt_never_lowers_the_bound_and_any_tilt_folds_a_box():
    thin = GoalMesh(OCTAHEDRON[0] * [1.0, 1.0, 0.1], OCTAHEDRON[1], "thin")
    bounds = [
        most_completion(thin, replace(FLIPS, max_tilt_rad=math.radians(tilt))) for tilt in range(0, 90, 5)
    ]
    assert bounds == sorted(bounds)
    assert bounds[0] < 0.9
    assert bounds[-1] == 1.0
    box = trimesh.creation.box((30.0, 20.0, 10.0))
    assert most_completion(GoalMesh(box.vertices, box.faces, "box"), FLIPS) == 1.0


def test_no_plan_folds_further_than_the_bound_and_the_plan_tells_it():
    goal = GoalMesh(
        np.array([[10, 10, 10], [10, -10, -10], [-10, 10, -10], [-10, -10, 10]], dtype=float),
        np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]),
        "regular tetrahedron",
    )
    net = make_net(goal)
    most = most_completion(goal, FLIPS)
    plan = plan_folds(net, FLIPS)
    assert plan.metrics.fold_completion <= most + 1e-9
    assert most == pytest.approx(steepest_fold(FLIPS) / math.acos(-1.0 / 3.0))
    assert set(bound_notice(goal, FLIPS)) <= set(plan.notices)
    assert bound_notice(goal, FLIPS)
    assert bound_notice(goal, replace(FLIPS, max_tilt_rad=math.radians(45.0))) == ()
