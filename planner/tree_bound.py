"""Fewest edits of any net, from below: a minimum spanning tree with multipliers, in whole numbers.

Of the edges P of a no-good every net T cuts at least k, so ``k - |P| + |P & T| <= 0``. Adding these terms,
each times a number m_P >= 0, to the edits never raises what a net costs. So no net has fewer edits than

    sum over P of m_P (k_P - |P|)  +  weight of a minimum spanning tree,
    where edge e weighs [e is not in the blooming tree] + sum of m_P over the no-goods that hold e.

All is scaled by one denominator, so nothing is rounded. With edges forced in or out it bounds the nets of
a branch.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

__all__ = ["TreeBound"]


class TreeBound:
    """Bounds for one blooming tree."""

    def __init__(
        self, count: int, ends: list[list[int]], blooming: list[bool], frozen: list[bool], denominator: int
    ) -> None:
        """Keep the problem.

        Args:
            count: faces.
            ends: the two faces of every interior edge.
            blooming: whether the edge is in the blooming tree.
            frozen: whether every net that counts keeps it.
            denominator: of all multipliers.
        """
        self._count = count
        self._ends = ends
        self._cost = [0 if mine else denominator for mine in blooming]
        self._frozen = [e for e, kept in enumerate(frozen) if kept]
        self.denominator = denominator

    def value(
        self, terms: Iterable[tuple[tuple[int, ...], int, int]], fixed: Mapping[int, bool]
    ) -> int | None:
        """The bound times the denominator; None if no spanning tree is left.

        Args:
            terms: edges, least cuts and multiplier (>= 0) of the no-goods that are used.
            fixed: edges that are in (True) or out (False) in this branch.
        """
        weight = self._cost.copy()
        total = 0
        for edges, cuts, multiplier in terms:
            total += multiplier * (cuts - len(edges))
            for e in edges:
                weight[e] += multiplier
        parent = list(range(self._count))

        def join(e: int) -> bool:
            a, b = self._ends[e]
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            parent[a] = b
            return a != b

        left = self._count - 1
        forced = dict.fromkeys([*self._frozen, *(e for e, kept in fixed.items() if kept)])
        for e in forced:
            if fixed.get(e, True) is False or not join(e):
                return None
            total += weight[e]
            left -= 1
        for e in sorted(range(len(weight)), key=weight.__getitem__):
            if left == 0:
                break
            if e not in forced and fixed.get(e, True) and join(e):
                total += weight[e]
                left -= 1
        return total if left == 0 else None

    def edits(
        self, terms: Iterable[tuple[tuple[int, ...], int, int]], fixed: Mapping[int, bool]
    ) -> int | None:
        """The bound in whole edits, rounded up; None if the branch is empty."""
        value = self.value(terms, fixed)
        return None if value is None else max(0, -(-value // self.denominator))
