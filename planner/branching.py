"""The case distinctions of a search for the fewest edits, and the proof that they make."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.net_proof import NetProof, ProofBranch, ProofNoGood
from planner.no_goods import NoGood

__all__ = ["BranchNode", "Gains", "assemble_proof", "product"]

KNOWN_AFTER = 2
"""Trials after which the gains of an edge are trusted."""


@dataclass(eq=False)
class BranchNode:
    """Nets that keep or cut the edges in ``fixed``.

    Attributes:
        fixed: edge to True (a crease) or False (cut).
        multipliers: the no-goods and multipliers of the best bound.
        bound: edits that any such net needs, as far as those prove.
        value: the programme's value.
        edge: the edge that was branched on, -1: none.
        cases: the two nodes in which it is a crease, and cut.
        is_open: whether it waits to be looked at.
    """

    fixed: dict[int, bool]
    multipliers: tuple[tuple[int, int], ...] = ()
    bound: int = 0
    value: float = 0.0
    edge: int = -1
    cases: tuple[BranchNode, BranchNode] | None = None
    is_open: bool = field(default=True)

    def note(self, multipliers: tuple[tuple[int, int], ...], bound: int) -> None:
        """Keep these multipliers if they prove more than those before, or as much."""
        if bound >= self.bound:
            self.multipliers, self.bound = multipliers, bound

    def leaves(self) -> Iterator[BranchNode]:
        """The nodes below that are not branched on."""
        todo = [self]
        while todo:
            node = todo.pop()
            if node.cases is None:
                yield node
            else:
                todo.extend(reversed(node.cases))

    def lowest(self) -> int:
        """What is proven for all nodes below."""
        return min(node.bound for node in self.leaves())


def product(one: float, other: float) -> float:
    """Score of a pair of gains: large only if both are."""
    return max(one, 1e-4) * max(other, 1e-4)


class Gains:
    """What branching on each edge has gained so far, per unit by which its share was changed.

    Reliability branching: Achterberg, Koch and Martin, Branching rules revisited (2005).
    """

    def __init__(self, edges: int) -> None:
        """Nothing is known yet."""
        self._sums = np.zeros((edges, 2))
        self._trials = np.zeros(edges, dtype=np.int64)

    def learn(self, edge: int, kept: float, in_gain: float, out_gain: float) -> None:
        """Note the gains of an edge of share ``kept`` put in, and put out."""
        self._sums[edge] += min(in_gain, 10.0) / (1.0 - kept), min(out_gain, 10.0) / kept
        self._trials[edge] += 1

    def is_known(self, edge: int) -> bool:
        """True if the edge was tried often enough."""
        return bool(self._trials[edge] >= KNOWN_AFTER)

    def expected(self, edge: int, kept: float) -> float:
        """Score that is to be expected; edges not tried yet count as the mean of all that were."""
        if self._trials[edge]:
            mean = self._sums[edge] / self._trials[edge]
        else:
            mean = self._sums.sum(axis=0) / max(int(self._trials.sum()), 1) + 1e-3
        return product(float(mean[0]) * (1.0 - kept), float(mean[1]) * kept)

    def ranked(self, kept: NDArray[np.float64]) -> list[int]:
        """Edges that are neither in nor out, the most promising first."""
        open_edges = np.flatnonzero(np.minimum(kept, 1.0 - kept) > 1e-6).tolist()
        return sorted(open_edges, key=lambda e: (-self.expected(e, float(kept[e])), e))


def assemble_proof(
    root: BranchNode,
    graph: DualGraph,
    pool: list[NoGood],
    denominator: int,
    upper: int,
    *,
    whole_panels: bool,
) -> NetProof:
    """The proof of the bound that the nodes below ``root`` show, without what it does not need.

    Args:
        root: the first node.
        graph: the dual graph of the goal.
        pool: the no-goods to which the multipliers of the nodes belong.
        denominator: of the multipliers.
        upper: edits of the best net: more need not be shown.
        whole_panels: whether flat panels stay whole.
    """
    bound = min(root.lowest(), upper)
    rows: dict[tuple[tuple[int, int], ...], int] = {}
    used: dict[int, int] = {}
    ends: list[list[int]] = graph.vertices.tolist()
    branches: list[ProofBranch] = [ProofBranch()]
    todo = [(root, 0)]
    while todo:
        node, at = todo.pop()
        if node.bound >= bound or node.cases is None:
            row = tuple((used.setdefault(item, len(used)), times) for item, times in node.multipliers)
            branches[at] = ProofBranch(multipliers=rows.setdefault(row, len(rows)))
            continue
        first = len(branches)
        branches += [ProofBranch(), ProofBranch()]
        edge = (ends[node.edge][0], ends[node.edge][1])
        branches[at] = ProofBranch(edge, (first, first + 1))
        todo += [(node.cases[1], first + 1), (node.cases[0], first)]
    no_goods = tuple(
        ProofNoGood(
            tuple((ends[e][0], ends[e][1]) for e in pool[item].edges), pool[item].cut_at_least,
            pool[item].why, pool[item].faces,
        )
        for item in used
    )  # fmt: skip
    return NetProof(no_goods, denominator, tuple(rows), tuple(branches), bound, whole_panels)
