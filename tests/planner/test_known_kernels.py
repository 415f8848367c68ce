"""What is left out of a question, and what is looked up, changes no answer."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from planner._kernels.contact_kernels import listed_contact, turn_contact
from planner._kernels.crowd_kernels import CROWD_BLOCK, bound_blocks, crowd_order, near_sight, near_turn
from planner._kernels.known_kernels import mixed, mixed_real
from planner._kernels.sight_kernels import SIGHT_SUBSTEPS, sight_limit
from planner.blooming_trees import blooming_tree
from planner.candidate import flat_tree
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.fold_problem import FoldProblem, bounding_spheres
from planner.frame_strip import frame_strip
from planner.insets import edge_insets
from tests.planner.test_contact_kernels import prism_of
from tests.planner.test_fold_problem import problem_of
from tests.planner.test_sight_kernels import beam_at, scene


@njit  # kernels that only kernels call cannot be called from Python
def crowd(preorder, centres, radii, flat, present):
    order = crowd_order(preorder, len(centres))
    blocks = np.empty(((len(centres) + CROWD_BLOCK - 1) // CROWD_BLOCK, 5))
    bound_blocks(order, 0, len(centres), centres, radii, flat, present, blocks)
    return order, blocks


@njit
def sight_of_the_near(
    order, blocks, first, last, panel, flat, solids, centres, radii, present, crease, sign, limit, beam,
    most_tilt,
):  # fmt: skip
    near = np.empty(len(solids), np.int64)
    turning, count = near_sight(
        order, blocks, first, last, 0, 1, panel, flat, centres, radii, present,
        crease[:4], crease[4], sign, limit, beam, most_tilt, near,
    )  # fmt: skip
    return near[:turning], near[turning:count]


@njit
def sight_of(panel, moving, flat, solids, centres, radii, suspects, crease, sign, limit, beam):
    intervals, turned = np.empty((len(solids), 2)), np.empty((3, 3))
    return sight_limit(
        0, 1, panel, moving, flat, solids, centres, radii, suspects,
        crease[0], crease[1], crease[2], crease[3], crease[4], sign, limit, beam, 0.05,
        intervals, turned, SIGHT_SUBSTEPS, True,
    )  # fmt: skip


@njit
def contact_of_the_near(
    order, blocks, first, last, solids, centres, radii, sharp, present, ox, oy, ux, uy, limit
):
    near = np.empty(len(solids), np.int64)
    count = near_turn(order, blocks, first, last, centres, radii, present, ox, oy, ux, uy, near)
    found = listed_contact(
        -1, -1, order[first:last], near[:count], solids, centres, radii, sharp, ox, oy, ux, uy, limit,
        np.zeros((30, 3)),
    )  # fmt: skip
    return found, count


@njit
def marks_of(numbers):
    return [mixed_real(mixed(np.uint64(1), np.uint64(2)), x) for x in numbers]


def crowded(rng, far):
    """A scene in which what turns stands together in the order, and some solids are gone."""
    panel, moving, flat, solids, centres, radii, crease = scene(rng, far)
    count, turning = len(solids), int(rng.integers(1, 20))
    preorder = rng.permutation(count - 8)
    first = int(rng.integers(0, len(preorder) - turning))
    last = first + turning
    moving[:] = False
    moving[preorder[first:last]] = True
    present = rng.random(count) < 0.9
    present[moving] = True
    order, blocks = crowd(preorder, centres, radii, flat, present)
    assert sorted(order) == list(range(count))
    return panel, moving, flat, solids, centres, radii, crease, present, order, blocks, first, last


def prisms_about(crease, moving, rng):
    """Solids about an axis, those that turn on one side and all others on the other."""
    ox, oy, ux, uy, _ = crease
    solids = np.zeros((len(moving), 12, 3))
    for s, turns in enumerate(moving):
        around = rng.uniform(-0.5, 0.0) if turns else rng.uniform(0.3, 2.6)
        around += rng.uniform(0.0, 0.4, 3) - (0.4 if turns else 0.0)
        along, off = rng.uniform(-20, 20) + rng.uniform(-3, 3, 3), rng.uniform(1, 20) + rng.uniform(0, 5, 3)
        across = off * np.cos(around)
        triangle = np.stack(
            [ox + along * ux - across * uy, oy + along * uy + across * ux, off * np.sin(around)], axis=1
        )
        solids[s, :6], solids[s, 6:9], solids[s, 9:] = prism_of(triangle), triangle, triangle
    centres, radii = bounding_spheres(solids)
    return solids, centres, radii


@pytest.mark.parametrize(
    "source", [None, (1.0, -2.0, 160.0), (3.0, 2.0, 14.0)], ids=["parallel", "from far", "from near"]
)
def test_what_is_not_near_a_crease_hides_nothing_of_it(source):
    rng = np.random.default_rng(11)
    left_out, hidden = 0, 0
    for trial in range(500):
        axis = rng.uniform(0, math.pi)
        upright = 0.0 if trial % 2 else math.pi
        tilt, most = rng.uniform(-0.7, 0.7), float(rng.choice([0.0, 0.7]))
        spread, radius = float(rng.choice([0.0, 0.02])), float(rng.choice([0.0, 0.05, 0.5]))
        panel, moving, flat, solids, centres, radii, crease, present, order, blocks, first, last = crowded(
            rng, float(rng.choice([2.0, 8.0, 30.0]))
        )
        sign, limit = (1.0 if trial % 2 else -1.0), float(rng.uniform(0.01, 3.1))
        beam = beam_at(upright + tilt, radius, (math.cos(axis), math.sin(axis)), spread, source)
        turning, still = sight_of_the_near(
            order, blocks, first, last, panel, flat, solids, centres, radii, present, crease, sign, limit,
            beam, most,
        )  # fmt: skip
        assert moving[turning].all()
        assert not moving[still].any()
        near = np.concatenate([turning, still])
        everything = np.flatnonzero(present)
        tilts = [tilt] if most == 0.0 else [tilt, -0.7, 0.7, 0.0, float(rng.uniform(-0.7, 0.7))]
        for other in tilts:
            beam = beam_at(upright + other, radius, (math.cos(axis), math.sin(axis)), spread, source)
            scene_now = panel, moving, flat, solids, centres, radii
            among_all = sight_of(*scene_now, everything, crease, sign, limit, beam)
            assert sight_of(*scene_now, near, crease, sign, limit, beam)[0] == among_all[0]
            hidden += among_all[1] >= 0
        left_out += len(everything) - len(near)
    assert hidden > 200
    assert left_out > 1000


def test_what_is_not_near_a_turn_is_not_touched():
    rng = np.random.default_rng(5)
    left_out, touched = 0, 0
    for _ in range(500):
        _, moving, flat, _, _, _, crease, present, order, _, first, last = crowded(rng, 8.0)
        solids, centres, radii = prisms_about(crease, moving, rng)
        blocks = crowd(order[:-8], centres, radii, flat, present)[1]
        sharp, mask = np.ones(len(solids), np.bool_), np.zeros(len(solids), np.bool_)
        limit = float(rng.uniform(0.01, 3.1))
        found, count = contact_of_the_near(
            order, blocks, first, last, solids, centres, radii, sharp, present, *crease[:4], limit
        )
        among_all = turn_contact(
            -1, -1, order[first:last], mask, solids, centres, radii, sharp, present, *crease[:4], limit,
            np.zeros((30, 3)),
        )  # fmt: skip
        assert found[0] == among_all[0]
        left_out += present.sum() - (last - first) - count
        touched += among_all[1] >= 0
    assert touched > 100
    assert left_out > 1000


def results_of(problem, trees):
    return [
        (r.steps, r.reached, r.cause, r.blocker, r.toucher, r.stopped_at, r.shape_rms)
        for tree, back, give_up in trees
        for r in [problem.fold(tree, obstacles=frame_strip(tree, problem.limits), back=back, give_up=give_up)]
    ]


@pytest.mark.parametrize("source", [None, (20.0, -30.0, 160.0)], ids=["parallel", "from a point"])
def test_plans_are_the_same_with_and_without_memory(source):
    """A chain of nets, each an exchange away from another, with other bases, axes and creases held back."""
    problem, _ = problem_of("ball")
    limits = replace(problem.limits, beam_source=source)
    graph = DualGraph(problem.goal)
    insets = edge_insets(
        FlatLayout(graph, blooming_tree(graph, 0), 0).to_net(), limits.thickness, limits.clearance
    )
    rng = np.random.default_rng(3)
    layout, axis, trees = FlatLayout(graph, blooming_tree(graph, 0), 0), 0.3, []
    for turn in range(60):
        if turn % 10 == 9:
            layout = layout.copy()
            layout.set_base(int(rng.integers(len(graph.goal.faces))))
        if turn % 15 == 14:
            axis = float(rng.uniform(0, math.pi))
        cut = int(rng.choice(np.flatnonzero(layout.tree)))
        layout = layout.copy()
        for join in layout.joinable(cut).tolist():
            if join != cut and layout.exchange(cut, join):
                break
        back = rng.uniform(0, 0.2, len(graph.goal.faces)) if turn % 4 == 3 else None
        trees.append((flat_tree(layout, axis), back, 0.05 if turn % 5 == 4 else np.inf))
    remembering = FoldProblem(problem.goal, insets, limits)
    first, again = results_of(remembering, trees), results_of(remembering, trees)
    assert np.count_nonzero(remembering._known()[0]) > 100
    remembering.forget()
    assert not remembering._known()[0].any()
    forgetful = FoldProblem(problem.goal, insets, limits)
    forgetful.known_turns = 0
    plain = results_of(forgetful, trees)
    assert len(forgetful._known()[0]) == 0
    assert {int(cause) for result in plain for cause in result[2]} >= {0, 1, 2}
    for results in (first, again):
        for one, other in zip(results, plain, strict=True):
            assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_marks_of_different_numbers_differ():
    numbers = np.concatenate([np.linspace(-1.0, 1.0, 20_001), [np.nextafter(1.0, 2.0), 1e-300, np.inf]])
    assert len(set(marks_of(numbers))) == len(numbers)
    bits = np.array([int(mark) for mark in marks_of(np.linspace(0.0, 1.0, 4096))], dtype=np.uint64)
    set_bits = ((bits[:, None] >> np.arange(64, dtype=np.uint64)) & np.uint64(1)).mean(axis=0)
    assert abs(set_bits - 0.5).max() < 0.05  # five standard deviations
