"""From a goal mesh to an overlap-free net: the base face, the method, and what to say if there is none."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.base_choice import base_trials
from planner.base_faces import SAMPLE_ABOVE, rank_bases
from planner.blooming_trees import BLOOMING_TREES
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.nearly_blooming import DEFAULT_BUDGET_S, WORK_PER_SECOND, NetAttempt, nearly_blooming
from planner.net import Net
from planner.net_methods import attempt_order, net_method
from planner.no_net import check_only_pattern, no_net_error

__all__ = ["make_net", "starting_layouts"]

BASES_TRIED = 6
"""Bases, best first, for which nets are made before the best of them is chosen; fewer above 1000 faces."""

RANKING_SIZE = 300_000
"""Panels ranked as bases, times faces: 300 panels of a goal with 1000 faces."""


def make_net(
    goal: GoalMesh,
    *,
    method: str = "nb",
    base_face: int | None = None,
    seed: int = 0,
    budget_s: float | None = None,
) -> Net:
    """Lay ``goal`` flat without overlap, so that a tab can hold the base panel.

    Args:
        goal: a mesh of one piece.
        method: ``nb`` (nearly-blooming) or one of the baselines in ``NET_METHODS``.
        base_face: the stationary face; None: chosen among the best of ``rank_bases``.
        seed: of every random choice.
        budget_s: nominal seconds for the whole, counted as work so that the result does not depend on the
            machine.

    Raises:
        NetError: if there is no net, or none was found; its ``faces`` overlap in the best that was found.
    """
    make = net_method(method)
    graph = DualGraph(goal)
    count = len(goal.faces)
    if base_face is not None and not 0 <= base_face < count:
        raise NetError(f"base face {base_face} does not exist: {goal.name} has faces 0 to {count - 1}")
    if graph.pieces > 1:
        raise NetError(
            f"{goal.name} is not formable from one sheet: its faces are {graph.pieces} pieces that no edge "
            "joins; fold each piece by itself"
        )
    if graph.is_tree:
        check_only_pattern(graph)
    budget = DEFAULT_BUDGET_S if budget_s is None else budget_s
    best: NetAttempt | None = None
    attempts: list[NetAttempt] = []
    found = 0
    enough = max(1, min(BASES_TRIED, BASES_TRIED * 1000 // count))
    for base in _bases(graph, base_face, seed):
        attempt = make(graph, base, seed, budget)
        attempts.append(attempt)
        budget -= attempt.work / WORK_PER_SECOND
        if best is None or attempt_order(attempt) < attempt_order(best):
            best = attempt
        found += attempt.is_net
        if (best.is_net and best.roomy and found >= enough) or budget <= 0.0:
            break
    if method == "nb" and (best is None or not best.is_net) and budget > 0.0:
        for attempt in _with_cut_panels(graph, [attempt.layout.base for attempt in attempts], seed, budget):
            budget -= attempt.work / WORK_PER_SECOND
            attempts.append(attempt)
            if attempt.is_net or budget <= 0.0:
                best = min(attempts, key=attempt_order)
                break
    if best is None or not best.is_net:
        tried = len({attempt.layout.base for attempt in attempts})
        raise no_net_error(
            graph, best, method=method, tried=tried, base_face=base_face, seed=seed,
            budget_s=DEFAULT_BUDGET_S if budget_s is None else budget_s, left_s=budget,
        )  # fmt: skip
    net = best.to_net(method)
    attempts.sort(key=attempt_order)  # keeps the order of those that are equal
    bases = base_trials(graph, attempts) if len(attempts) > 1 else ()
    return replace(net, certificate=replace(net.certificate, bases=bases))


def starting_layouts(
    goal: GoalMesh | DualGraph, count: int, *, base_face: int | None = None, seed: int = 0
) -> list[FlatLayout]:
    """Up to ``count`` different overlap-free layouts to start a search from, in order of promise.

    Bases in the order of ``rank_bases``, each with its best blooming tree; then the other trees and other
    seeds. Layouts whose base panel has room for a tab come first.

    Args:
        goal: the goal, or its dual graph.
        count: how many.
        base_face: keep this base; None: any.
        seed: of every random choice.
    """
    graph = goal if isinstance(goal, DualGraph) else DualGraph(goal)
    if base_face is None:
        ranked = rank_bases(graph, count, seed=seed, sample=_sample(graph))
        bases, trees = [rank.face for rank in ranked], [BLOOMING_TREES.index(rank.tree) for rank in ranked]
    else:
        bases, trees = [base_face], [0]
    roomy: list[FlatLayout] = []
    narrow: list[FlatLayout] = []
    seen: set[bytes] = set()
    for turn in range(2 * len(BLOOMING_TREES) * (1 + count // (3 * len(bases)))):
        for base, first in zip(bases, trees, strict=True):
            if len(roomy) >= count:
                return roomy
            tree = BLOOMING_TREES[(first + turn) % len(BLOOMING_TREES)]
            attempt = nearly_blooming(graph, base, tree=tree, seed=seed + turn // len(BLOOMING_TREES))
            key = np.packbits(attempt.layout.tree).tobytes() + base.to_bytes(8, "little")
            if attempt.is_net and key not in seen:
                seen.add(key)
                (roomy if attempt.roomy else narrow).append(attempt.layout)
    return (roomy + narrow)[:count]


def _with_cut_panels(graph: DualGraph, bases: list[int], seed: int, budget_s: float) -> Iterator[NetAttempt]:
    """The search with flat panels cut as well, for goals that have no net with whole panels, as it seems.

    Goals whose panels have holes are left out: the method itself cuts those.
    """
    if not graph.has_rings and graph.flat_forest.any():
        for base in bases:
            for tree in BLOOMING_TREES:
                yield nearly_blooming(graph, base, tree=tree, seed=seed, budget_s=budget_s, cut_panels=True)


def _bases(graph: DualGraph, base_face: int | None, seed: int) -> Iterator[int]:
    """The bases to try, best first."""
    if base_face is not None:
        yield base_face
        return
    for rank in rank_bases(graph, seed=seed, sample=_sample(graph)):
        yield rank.face


def _sample(graph: DualGraph) -> int:
    """How many panels to rank as bases."""
    return min(SAMPLE_ABOVE, max(12, RANKING_SIZE // len(graph.goal.faces)))
