"""Nets from edge weights of one kind, the best of many: random directions, random weights.

Steepest-edge and flat-tree unfolding: Schlickenrieder, Nets of Polyhedra (1997). Here, as in the paper's
comparison, with many directions, uniform on the sphere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.nearly_blooming import WORK_PER_SECOND, NetAttempt, certify, repair_tree
from planner.tree_judge import TreeJudge

__all__ = [
    "TRIES",
    "WEIGHTS",
    "best_of_many",
    "flat_tree_weights",
    "random_directions",
    "random_edge_weights",
    "random_weights",
    "seen_to_hold",
    "steepest_weights",
    "unflat_tree_weights",
]

TRIES = 100
"""Directions or trees that are tried; the best of them counts."""

BATCH = 20
"""Trees judged between two looks at the budget."""

WeightMaker = Callable[[TreeJudge, int, np.random.Generator], NDArray[np.float64]]
"""Makes the weights (K, M) of K trees: 0 is kept as a crease first, 1 is cut first."""


def random_directions(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(count, 3) unit vectors, uniform on the sphere."""
    points = rng.standard_normal((count, 3))
    unit: NDArray[np.float64] = points / np.linalg.norm(points, axis=1, keepdims=True)
    return unit


def steepest_weights(judge: TreeJudge, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(K, M) 1 for the edges that the steepest-edge rule cuts for a random direction, 0 for the others."""
    cuts = [judge.grower.steepest_cuts_along(direction) for direction in random_directions(count, rng)]
    return np.array(cuts, dtype=np.float64).reshape(count, len(judge.graph.faces))


def flat_tree_weights(judge: TreeJudge, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(K, M) how nearly each edge points along a random direction c: ``|c . e| / |e|``."""
    graph = judge.graph
    points = graph.goal.vertices
    unit = (points[graph.vertices[:, 1]] - points[graph.vertices[:, 0]]) / graph.length[:, None]
    along: NDArray[np.float64] = np.abs(random_directions(count, rng) @ unit.T)
    return along


def unflat_tree_weights(judge: TreeJudge, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(K, M) one minus the weights of ``flat_tree_weights``."""
    return 1.0 - flat_tree_weights(judge, count, rng)


def random_weights(judge: TreeJudge, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(K, M) uniform in [0, 1)."""
    return rng.random((count, len(judge.graph.faces)))


def random_edge_weights(judge: TreeJudge, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(K, M) 1 for edges to cut: a random one at every inner vertex, two where it has over a full turn."""
    graph = judge.graph
    edges = len(graph.faces)
    ends = graph.vertices.T.ravel()
    open_ends = np.zeros(len(graph.goal.vertices), dtype=np.bool_)
    for step in range(2):
        open_ends[graph.goal.faces[graph.boundary[:, 0], (graph.boundary[:, 1] + step) % 3]] = True
    wanted = np.where(open_ends, 0, 1)
    wanted[judge.hyperbolic] += 1
    weights = np.zeros((count, edges))
    for row in weights:
        order = np.lexsort((rng.random(2 * edges), ends))
        owner = ends[order]
        place = np.arange(2 * edges) - np.searchsorted(owner, owner)  # among the edges of its vertex
        row[order[place < wanted[owner]] % edges] = 1.0
    return weights


WEIGHTS: Mapping[str, WeightMaker] = MappingProxyType(
    {
        "steepest-random": steepest_weights,
        "flat-tree": flat_tree_weights,
        "unflat-tree": unflat_tree_weights,
        "random": random_weights,
    }
)
"""The kinds of weights that are net methods, by the name of the method."""


def best_of_many(
    graph: DualGraph,
    base: int,
    make_weights: WeightMaker,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    tries: int = TRIES,
) -> NetAttempt:
    """The best of ``tries`` trees: fewest overlaps, then the shortest cuts; the hold of the base is seen to.

    Args:
        graph: the dual graph of the goal.
        base: the base face.
        make_weights: makes the weights that the trees are grown for.
        seed: of the random choices.
        budget_s: nominal seconds, counted as work; the first ``BATCH`` trees are judged in any case.
        tries: how many trees.

    Raises:
        NetError: if the goal is not one piece, or ``base`` is not a face.
    """
    judge = TreeJudge(graph)
    rng = np.random.default_rng([seed, base])
    best: tuple[int, float] | None = None
    chosen = np.zeros(len(graph.faces))
    while judge.judged < tries:
        weights = make_weights(judge, min(BATCH, tries - judge.judged), rng)
        overlaps = judge.judge(weights)[:, 0]
        for row in np.flatnonzero(overlaps == overlaps.min()).tolist():
            key = (int(overlaps[row]), judge.cut_length(weights[row]))
            if best is None or key < best:
                best, chosen = key, weights[row]
        if budget_s is not None and judge.work > budget_s * WORK_PER_SECOND:
            break
    return seen_to_hold(judge, judge.tree(chosen), base, seed=seed, budget_s=budget_s)


def seen_to_hold(
    judge: TreeJudge, tree: NDArray[np.bool_], base: int, *, seed: int, budget_s: float | None
) -> NetAttempt:
    """The attempt that ``tree`` makes; if nothing overlaps, the base is given a free side for a tab.

    Such trees start from no blooming tree, so edits are counted from the nearest one of the base.
    """
    graph = judge.graph
    attempt = repair_tree(
        graph, tree, base, name="steepest", seed=seed, budget_s=budget_s, remove_overlaps=False
    )
    nearest = certify(attempt.layout, "")
    return replace(
        attempt,
        tree=nearest.tree,
        blooming_overlaps=nearest.blooming_overlaps,
        edits=nearest.edits,
        work=attempt.work + judge.work,
        proof=None,
    )
