"""The methods that make a net of a goal for one base face, behind one interface with one result."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

from planner.blooming_trees import BLOOMING_TREES, TreeName, blooming_tree
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.nearly_blooming import (
    DEFAULT_BUDGET_S,
    WORK_PER_SECOND,
    NetAttempt,
    nearly_blooming,
    repair_tree,
)

__all__ = ["NET_METHODS", "NetMethod", "net_method"]

NetMethod = Callable[[DualGraph, int, int, float | None], NetAttempt]
"""A method takes the dual graph, the base face, a seed and a nominal budget in seconds (None: its own)."""


def fewest_edits(graph: DualGraph, base: int, seed: int, budget_s: float | None) -> NetAttempt:
    """Nearly-blooming: the search from each blooming tree; room for a tab first, then fewest edits.

    Only if no tree leads to a net and some flat panel is a ring are flat panels cut as well.
    """
    attempts: list[NetAttempt] = []
    trials = [(tree, False) for tree in BLOOMING_TREES]
    if graph.has_rings:
        trials += [(tree, True) for tree in BLOOMING_TREES]
    for tree, cut_panels in trials:
        if cut_panels and any(attempt.is_net for attempt in attempts):
            break
        attempts.append(
            nearly_blooming(graph, base, tree=tree, seed=seed, budget_s=budget_s, cut_panels=cut_panels)
        )
    return replace(min(attempts, key=attempt_order), work=sum(attempt.work for attempt in attempts))


EXACT_SHARE = 0.5
"""Share of the budget that is left which the exact method spends on one base face."""


def exact(graph: DualGraph, base: int, seed: int, budget_s: float | None) -> NetAttempt:
    """Fewest edits, proven for this base face and the tree that is chosen, as far as the time allows.

    Each blooming tree is searched for a third of its share of the budget, in seconds of the clock; the net
    with room for a tab and the fewest edits wins. Nothing is claimed about other base faces and trees.
    """
    from planner.fewest_edits import prove_net

    share = EXACT_SHARE * (DEFAULT_BUDGET_S if budget_s is None else budget_s)
    seconds = share / len(BLOOMING_TREES)
    attempts = [
        prove_net(graph, base, tree=tree, seed=seed, seconds=seconds).attempt for tree in BLOOMING_TREES
    ]
    return replace(min(attempts, key=attempt_order), work=int(share * WORK_PER_SECOND))


def attempt_order(attempt: NetAttempt) -> tuple[bool, int, bool, int, int]:
    """Key that puts better attempts first: a net at all, few overlaps, room for a tab, few edits, shallow."""
    depth = int(attempt.layout.depth.max())
    return (not attempt.is_net, len(attempt.overlapping), not attempt.roomy, attempt.edits, depth)


def plain_tree(name: TreeName) -> NetMethod:
    """The blooming tree ``name`` as it is; only the hold of the base is seen to. May overlap."""

    def method(graph: DualGraph, base: int, seed: int, budget_s: float | None) -> NetAttempt:
        tree = blooming_tree(graph, base, name)
        return repair_tree(graph, tree, base, name=name, seed=seed, budget_s=budget_s, remove_overlaps=False)

    return method


def best_tree(name: str) -> NetMethod:
    """The best of many trees of one kind; only the hold of the base is seen to. May overlap."""

    def method(graph: DualGraph, base: int, seed: int, budget_s: float | None) -> NetAttempt:
        from planner.net_heuristics import WEIGHTS, best_of_many  # kernels of their own

        return best_of_many(graph, base, WEIGHTS[name], seed=seed, budget_s=budget_s)

    return method


def genetic(graph: DualGraph, base: int, seed: int, budget_s: float | None) -> NetAttempt:
    """The genetic algorithm of the paper's comparison; see ``planner.net_genetic``. May overlap."""
    from planner.net_genetic import genetic_net  # kernels of its own

    return genetic_net(graph, base, seed, budget_s)


NET_METHODS: Mapping[str, NetMethod] = MappingProxyType(
    {
        "nb": fewest_edits,
        "exact": exact,
        "steepest": plain_tree("steepest"),
        "dijkstra": plain_tree("dijkstra"),
        "bfs": plain_tree("bfs"),
        "steepest-random": best_tree("steepest-random"),
        "flat-tree": best_tree("flat-tree"),
        "unflat-tree": best_tree("unflat-tree"),
        "random": best_tree("random"),
        "ga": genetic,
    }
)
"""Name of every method and the method."""


def net_method(name: str) -> NetMethod:
    """The method called ``name``.

    Raises:
        NetError: if there is none; the message lists them, the nearest name first.
    """
    if name in NET_METHODS:
        return NET_METHODS[name]
    near = difflib.get_close_matches(name, NET_METHODS, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise NetError(f"unknown net method {name!r}; {hint}choose one of {', '.join(NET_METHODS)}")
