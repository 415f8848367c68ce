"""The programme of spanning trees: warm and cold solvers agree, and bounds are those of all trees."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import linear_program
from planner.blooming_trees import blooming_tree, weighted_tree
from planner.dual_graph import DualGraph
from planner.goal_mesh import GoalMesh
from planner.linear_program import LinearProgram, OutOfTimeError
from planner.no_goods import NoGood, PathFinder
from planner.repair_shares import shared_tree
from planner.tree_bound import TreeBound
from planner.tree_program import TreeProgram
from tests.planner.all_spanning_trees import spanning_trees
from tests.planner.goal_shapes import plate, random_hull, rough_ball, torus


def random_no_goods(graph: DualGraph, rng: np.random.Generator, count: int) -> list[NoGood]:
    """Sets of edges, of which some are to be cut; no geometry in them."""
    made = []
    for _ in range(count):
        edges = rng.choice(len(graph.faces), size=int(rng.integers(2, 6)), replace=False)
        made.append(NoGood(tuple(edges.tolist()), int(rng.integers(1, 3)), "overlap", (0, 1)))
    return made


def fewest(graph: DualGraph, tree: np.ndarray, no_goods: list[NoGood], fixed: dict[int, bool]) -> int | None:
    """Fewest edits by looking at all trees."""
    best = None
    for other in spanning_trees(graph):
        if any(other[e] != keep for e, keep in fixed.items()):
            continue
        if all(sum(not other[e] for e in item.edges) >= item.cut_at_least for item in no_goods):
            edits = int(np.count_nonzero(other & ~tree))
            best = edits if best is None else min(best, edits)
    return best


@settings(max_examples=25)
@given(st.integers(5, 6), st.integers(0, 10_000))
def test_bounds_are_below_all_trees_and_agree(count: int, seed: int) -> None:
    graph = DualGraph(random_hull(count, seed))
    rng = np.random.default_rng(seed)
    tree = blooming_tree(graph, 0)
    no_goods = random_no_goods(graph, rng, 5)
    fixed = {int(e): bool(rng.integers(2)) for e in rng.choice(len(tree), size=2, replace=False)}
    program = TreeProgram(graph, tree, graph.flat_forest)
    assert program.is_exact
    program.add(no_goods)
    shares = program.solve(fixed, 60.0)
    bound = TreeBound(len(graph.goal.faces), graph.faces.tolist(), tree.tolist(), [False] * len(tree), 1000)
    exact = fewest(graph, tree, no_goods, fixed)
    if shares is None:
        assert fewest(graph, tree, [], fixed) is None
        assert bound.edits([], fixed) is None
        return
    whole = np.rint(shares.multipliers * 1000).astype(int).tolist()
    terms = [(item.edges, item.cut_at_least, times) for item, times in zip(no_goods, whole, strict=True)]
    proven = bound.edits(terms, fixed)
    assert proven is not None
    if exact is None:  # no tree obeys them: the price of breaking them shows
        return
    assert proven <= exact
    assert shares.value <= exact + 1e-6
    assert proven >= np.ceil(shares.value - 0.05)
    assert shares.kept.sum() == pytest.approx(len(graph.goal.faces) - 1)


@settings(max_examples=20)
@given(st.integers(5, 6), st.integers(0, 10_000), st.integers(1, 5))
def test_any_multipliers_bound_from_below(count: int, seed: int, denominator: int) -> None:
    graph = DualGraph(random_hull(count, seed))
    rng = np.random.default_rng(seed)
    tree = blooming_tree(graph, 0)
    no_goods = random_no_goods(graph, rng, 4)
    bound = TreeBound(
        len(graph.goal.faces), graph.faces.tolist(), tree.tolist(), [False] * len(tree), denominator
    )
    terms = [(item.edges, item.cut_at_least, int(rng.integers(0, 4 * denominator))) for item in no_goods]
    exact = fewest(graph, tree, no_goods, {})
    proven = bound.edits(terms, {})
    assert proven is not None
    assert exact is None or proven <= exact


@pytest.mark.parametrize(
    ("goal", "exact"),
    [
        (random_hull(20, 1), True),
        (plate(), True),
        (torus(8, 4), False),
        (GoalMesh(torus(8, 4).vertices, torus(8, 4).faces[3:]), False),
        (GoalMesh(rough_ball(30, 2).vertices, rough_ball(30, 2).faces[2:]), True),
    ],
    ids=["closed", "plate", "torus", "open torus", "open"],
)
def test_without_no_goods_the_blooming_tree_is_the_answer(goal: GoalMesh, exact: bool) -> None:
    graph = DualGraph(goal)
    tree = weighted_tree(graph, np.random.default_rng(4).random(len(graph.faces)))
    program = TreeProgram(graph, tree, graph.flat_forest)
    assert program.is_exact == exact
    shares = program.solve({}, 60.0)
    assert shares is not None
    assert shares.value == pytest.approx(0.0, abs=1e-6)
    assert np.array_equal(shares.kept.round(6) == 1.0, tree)
    assert np.array_equal(shared_tree(graph, tree, graph.flat_forest, shares.kept), tree)


def test_on_a_torus_cycles_are_cut_off() -> None:
    graph = DualGraph(torus(8, 4))
    tree = blooming_tree(graph, 0, "bfs")
    program = TreeProgram(graph, tree, graph.flat_forest)
    rng = np.random.default_rng(3)
    for _ in range(6):
        program.add(random_no_goods(graph, rng, 8))
        shares = program.solve({}, 60.0)
        assert shares is not None
        if (np.minimum(shares.kept, 1.0 - shares.kept) < 1e-6).all():
            start = shared_tree(graph, tree, graph.flat_forest, shares.kept)
            assert np.array_equal(start, shares.kept > 0.5)


def test_the_cold_solver_gives_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = DualGraph(rough_ball(40, 5, 0.7))
    tree = blooming_tree(graph, 2, "bfs")
    values = []
    for cold in (False, True):
        if cold:
            monkeypatch.setattr(linear_program, "_highs_core", lambda: None)
        finder = PathFinder(graph)
        program = TreeProgram(graph, tree, graph.flat_forest)
        assert (program._program._solver is None) == cold
        program.add(finder.short(8, 10**7))
        program.add(finder.violated(tree.astype(float), 10**7))
        for fixed in ({}, {3: True, 9: False}, {0: False, 1: False, 2: True}):
            shares = program.solve(fixed, 60.0)
            values.append(np.inf if shares is None else shares.value)
    assert values[:3] == pytest.approx(values[3:], abs=1e-6)
    assert values[0] > 0.5


def test_no_time_left_is_said() -> None:
    program = LinearProgram(
        np.ones(2), np.ones(2), np.zeros(2, dtype=np.int64), np.arange(2, dtype=np.int64), np.ones(1)
    )
    with pytest.raises(OutOfTimeError):
        program.solve(np.ones(2), 0.0)
    solution = program.solve(np.ones(2), 10.0)
    assert solution is not None
    assert solution[0] == pytest.approx(1.0)
    assert program.solve(np.zeros(2), 10.0) is None
