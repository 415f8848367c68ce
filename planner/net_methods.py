"""The methods that make a net of a goal for one base face, behind one interface with one result."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from planner.blooming_trees import BLOOMING_TREES, TreeName, blooming_tree, weighted_tree
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.nearly_blooming import NetAttempt, nearly_blooming, repair_tree

__all__ = ["NET_METHODS", "NetMethod", "net_method"]

NetMethod = Callable[[DualGraph, int, int, float | None], NetAttempt]
"""A method takes the dual graph, the base face, a seed and a nominal budget in seconds (None: its own)."""


def fewest_edits(graph: DualGraph, base: int, seed: int, budget_s: float | None) -> NetAttempt:
    """Nearly-blooming: the search from each blooming tree; room for a tab first, then fewest edits."""
    share = None if budget_s is None else budget_s / len(BLOOMING_TREES)
    attempts = [nearly_blooming(graph, base, tree=tree, seed=seed, budget_s=share) for tree in BLOOMING_TREES]
    return replace(min(attempts, key=attempt_order), work=sum(attempt.work for attempt in attempts))


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


def random_tree(graph: DualGraph, base: int, seed: int, budget_s: float | None) -> NetAttempt:
    """Random spanning trees (random edge weights) until one does not overlap, at most 100; the best of them."""
    rng = np.random.default_rng([seed, base])
    best: NetAttempt | None = None
    for _ in range(100):
        tree = weighted_tree(graph, rng.random(len(graph.faces)), base)
        attempt = repair_tree(
            graph, tree, base, name="random", seed=seed, budget_s=budget_s, remove_overlaps=False
        )
        if best is None or attempt_order(attempt) < attempt_order(best):
            best = attempt
        if best.is_net:
            break
    assert best is not None  # noqa: S101 - the loop ran
    return best


NET_METHODS: Mapping[str, NetMethod] = MappingProxyType(
    {
        "nb": fewest_edits,
        "steepest": plain_tree("steepest"),
        "dijkstra": plain_tree("dijkstra"),
        "bfs": plain_tree("bfs"),
        "random": random_tree,
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
