"""From a goal mesh to an overlap-free net: the base face, the method, and what to say if there is none."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from planner.base_faces import SAMPLE_ABOVE, rank_bases
from planner.blooming_trees import BLOOMING_TREES
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.nearly_blooming import DEFAULT_BUDGET_S, WORK_PER_SECOND, NetAttempt, nearly_blooming
from planner.net import Net
from planner.net_methods import attempt_order, net_method

__all__ = ["make_net", "starting_layouts"]

BASES_TRIED = 6
"""Bases, best first, for which nets are made before the best of them is chosen; fewer above 1000 faces."""

RANKING_SIZE = 300_000
"""Panels ranked as bases, times faces: 300 panels of a goal with 1000 faces."""

PAIRS_NAMED = 6
"""Overlapping pairs that a message names."""


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
        _check_only_pattern(graph)
    budget = DEFAULT_BUDGET_S if budget_s is None else budget_s
    best: NetAttempt | None = None
    found, tried = 0, 0
    enough = max(1, min(BASES_TRIED, BASES_TRIED * 1000 // count))
    for base in _bases(graph, base_face, seed):
        attempt = make(graph, base, seed, budget)
        tried += 1
        budget -= attempt.work / WORK_PER_SECOND
        if best is None or attempt_order(attempt) < attempt_order(best):
            best = attempt
        found += attempt.is_net
        if (best.is_net and best.roomy and found >= enough) or budget <= 0.0:
            break
    if best is None or not best.is_net:
        raise _no_net(graph, best, method, tried, base_face, seed)
    return best.to_net(method)


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


def _check_only_pattern(graph: DualGraph) -> None:
    """Refuse a goal whose only flat pattern overlaps.

    Raises:
        NetError: with the overlapping faces.
    """
    only = FlatLayout(graph, np.ones(len(graph.faces), dtype=np.bool_), 0, hold_base=False)
    if only.overlaps:
        pairs = only.overlapping_pairs()
        raise NetError(
            f"{graph.goal.name} is not formable from one sheet: each of its {len(graph.faces)} inner edges "
            f"has to be a crease, so it has one flat pattern only. There {_name_pairs(pairs)}. Change the "
            "shape, or cut the mesh into parts that are folded separately",
            _faces_of(pairs),
        )


def _no_net(
    graph: DualGraph, best: NetAttempt | None, method: str, tried: int, base_face: int | None, seed: int
) -> NetError:
    """The error to raise when the method found no net."""
    name = graph.goal.name
    if best is None or not len(best.overlapping):
        where = f"base face {base_face}" if base_face is not None else f"any of {tried} base faces"
        return NetError(
            f"{name}: with {where} every long enough side of the base is a crease, so no tab can hold it; "
            "choose another base face (--base)"
        )
    bases = f"base face {base_face}" if base_face is not None else f"{tried} base faces"
    cure = (
        "Try --method nb, which removes overlaps"
        if method != "nb"
        else "Try another --base, another --seed or a larger --budget, or coarsen the mesh with --faces"
    )
    return NetError(
        f"{name} is not formable from one sheet, as far as was tried: method {method!r} with {bases}, "
        f"seed {seed}. In the best net {_name_pairs(best.overlapping)}. {cure}",
        _faces_of(best.overlapping),
    )


def _faces_of(pairs: NDArray[np.int64]) -> tuple[int, ...]:
    """The faces that occur in pairs, ascending."""
    return tuple(np.unique(pairs).tolist())


def _name_pairs(pairs: NDArray[np.int64]) -> str:
    """Words that name the first pairs of overlapping faces."""
    shown = ", ".join(f"{a} on {b}" for a, b in pairs[:PAIRS_NAMED].tolist())
    more = f" and {len(pairs) - PAIRS_NAMED} more pairs" if len(pairs) > PAIRS_NAMED else ""
    return f"faces overlap ({shown}{more})"
