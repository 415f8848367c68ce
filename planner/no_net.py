"""What to say where no net was found: what was tried, how near it came, and what may help."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.base_faces import rank_bases
from planner.blooming_trees import BLOOMING_TREES
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.nearly_blooming import WORK_PER_SECOND, NetAttempt
from planner.net_methods import net_method

__all__ = ["check_only_pattern", "faces_of", "no_net_error"]

PAIRS_NAMED = 6
"""Overlapping pairs that a message names."""

OTHER_BASES = 6
"""Further bases that are tried where the base was given and leads to no net."""

OTHER_BASES_S = 2.0
"""Nominal seconds that looking for another base may take."""

CHANGES = "let the mesh be changed a little (--mesh-edit MM), or let faces be left out (--leave-out)"


def no_net_error(
    graph: DualGraph,
    best: NetAttempt | None,
    *,
    method: str,
    tried: int,
    base_face: int | None,
    seed: int,
    budget_s: float,
    left_s: float,
) -> NetError:
    """The error to raise when a method found no net.

    Args:
        graph: the dual graph of the goal.
        best: the best that was found.
        method: the method that was used.
        tried: number of bases that it was used with.
        base_face: the base that was asked for; None: any.
        seed: of the search.
        budget_s: nominal seconds that there were.
        left_s: nominal seconds that are left; 0 or less: the budget ended the search.
    """
    name = graph.goal.name
    where = f"base face {base_face}" if base_face is not None else f"{tried} base faces"
    other = _other_base(graph, method, base_face, seed)
    if best is None or not len(best.overlapping):
        whose = where if base_face is not None else f"any of {where}"
        return NetError(
            f"{name}: with {whose} every long enough side of the base is a crease, so no tab can hold it; "
            f"choose another base face ({_base_words(other)})"
        )
    trees = f" from the trees {', '.join(BLOOMING_TREES)}" if method == "nb" else ""
    tests = int((budget_s - left_s) * WORK_PER_SECOND)
    end = "the budget is used up" if left_s <= 0.0 else "the search came to its end"
    search = f", {_count(tests, 'face')} tested for overlap; {end}" if tests else ""
    cures = [] if method == "nb" else ["use --method nb, which removes overlaps"]
    if base_face is not None:
        cures.append(f"choose another base ({_base_words(other)})")
    if tests:
        cures.append(f"give it more time (--budget {2 * budget_s:g}) or another --seed")
    cures.append(CHANGES)
    return NetError(
        f"{name} is not formable from one sheet, as far as was tried: method {method!r}{trees} with {where}, "
        f"seed {seed}{search}. In the best net "
        f"{_name_pairs(best.overlapping)}{_bound_words(best, method)}. What may help, in this order: "
        + "; ".join(cures),
        faces_of(best.overlapping),
    )


def check_only_pattern(graph: DualGraph) -> None:
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
            f"shape, cut the mesh into parts that are folded separately, {CHANGES}",
            faces_of(pairs),
        )


def faces_of(pairs: NDArray[np.int64]) -> tuple[int, ...]:
    """The faces that occur in pairs, ascending."""
    return tuple(np.unique(pairs).tolist())


def _other_base(graph: DualGraph, method: str, base_face: int | None, seed: int) -> int | None:
    """Another base with which the method finds a net, if one of the most promising is such."""
    if base_face is None or graph.is_tree:
        return None
    make, left = net_method(method), OTHER_BASES_S
    for rank in rank_bases(graph, OTHER_BASES, seed=seed, sample=40):
        if rank.face != base_face and left > 0.0:
            attempt = make(graph, rank.face, seed, left)
            left -= attempt.work / WORK_PER_SECOND
            if attempt.is_net:
                return rank.face
    return None


def _base_words(other: int | None) -> str:
    return "--base" if other is None else f"with --base {other} there is a net"


def _bound_words(best: NetAttempt, method: str) -> str:
    """How many edits every net from that tree needs at least, as far as is known."""
    bound = best.certificate(method).lower_bound
    return f"; a net needs {bound} or more edits from the tree {best.tree}" if bound else ""


def _count(number: int, thing: str) -> str:
    if number >= 1_000_000:
        return f"{number / 1e6:.1f} million {thing}s"
    return f"{number} {thing}" + ("" if number == 1 else "s")


def _name_pairs(pairs: NDArray[np.int64]) -> str:
    """Words that name the first pairs of overlapping faces."""
    shown = ", ".join(f"{a} on {b}" for a, b in pairs[:PAIRS_NAMED].tolist())
    more = f" and {len(pairs) - PAIRS_NAMED} more pairs" if len(pairs) > PAIRS_NAMED else ""
    return f"faces overlap ({shown}{more})"
