"""The net of fewest edits from a blooming tree, with a proof that there is none with fewer.

Branch and bound over the edges of the dual graph. Bounds come from the linear programme of spanning trees
with the no-goods that its solutions break; each is turned into multipliers in whole numbers before it counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.blooming_trees import TreeGrower, TreeName
from planner.branching import BranchNode, Gains, assemble_proof, product
from planner.dual_graph import DualGraph
from planner.linear_program import OutOfTimeError
from planner.nearly_blooming import NetAttempt, nearly_blooming
from planner.net_proof import NetProof
from planner.no_goods import NoGood, PathFinder, hold_no_good, vertex_no_goods
from planner.repair_shares import net_from_shares, shared_tree
from planner.tree_bound import TreeBound
from planner.tree_program import TreeProgram, TreeShares
from planner.warm_up import compile_net_kernels

__all__ = ["ProvenNet", "prove_net"]

Progress = Callable[[int, int, float], None]

DENOMINATOR = 1_000_000
"""Of the multipliers."""

SHORT_PATH_WORK = 20_000
"""Faces placed to list the short overlapping paths that the programme starts with."""

SEARCH_WORK = 20_000_000
"""Faces placed at most to find paths that one solution breaks."""

STARTS = 4
"""Searches for a first net, each with a seed of its own."""

CANDIDATES = 8
"""Edges at most whose cases are solved before one is branched on."""

IDLE_CANDIDATES = 6
"""Edges in a row that promise less than the best before no more are looked at."""

NEVER = 1 << 40
"""Bound of a branch in which there is no spanning tree at all."""


@dataclass(frozen=True)
class ProvenNet:
    """The best net that was found, and what is proven about it.

    Attributes:
        attempt: the net, ``attempt.is_net`` False if none was found in the time.
        lower_bound: every net for this base and tree has at least so many edits.
        optimal: the net has no more than that.
        proof: of the bound.
        seconds: wall time taken.
    """

    attempt: NetAttempt
    lower_bound: int
    optimal: bool
    proof: NetProof
    seconds: float

    @property
    def impossible(self) -> bool:
        """True if it is proven that there is no net for this base: no tree has as many edits."""
        return self.lower_bound >= len(self.attempt.layout.parent)

    @property
    def impossible_for_any_base(self) -> bool:
        """The same for every base: nothing in the proof is about this one."""
        return (
            self.impossible
            and self.proof.whole_panels
            and not any(item.why == "hold" for item in self.proof.no_goods)
        )


def prove_net(
    graph: DualGraph,
    base: int,
    *,
    tree: TreeName = "steepest",
    seed: int = 0,
    seconds: float = 30.0,
    progress: Progress | None = None,
) -> ProvenNet:
    """Net of fewest edits from the blooming tree ``tree`` around ``base``, proven as far as the time allows.

    Flat panels stay whole and the base panel keeps a free side, as in ``nearly_blooming``. If only nets that
    cut flat panels are found, they are what the bound is for (``proof.whole_panels``).

    Args:
        graph: the dual graph of the goal.
        base: the base face.
        tree: the blooming tree from which edits are counted.
        seed: of every random choice.
        seconds: wall-clock limit. Where it ends the search, net and bound depend on the machine; else the
            same input gives the same result.
        progress: called with (edits, bound, seconds) when one of them has changed; -1 edits: no net yet.

    Raises:
        NetError: if ``base`` is not a face, or the goal is not one piece.
    """
    compile_net_kernels()  # before the clock starts: the first run of a version takes long
    search = _Search(graph, base, tree, seed, seconds, progress)
    search.run()
    proof = assemble_proof(
        search.root, graph, search.pool, DENOMINATOR, search.upper, whole_panels=not search.cut_panels
    )
    attempt = replace(search.best, proof=proof)
    optimal = attempt.is_net and attempt.edits == proof.bound
    return ProvenNet(attempt, proof.bound, optimal, proof, search.clock())


class _Search:
    """State of one branch and bound."""

    def __init__(
        self,
        graph: DualGraph,
        base: int,
        tree: TreeName,
        seed: int,
        seconds: float,
        progress: Progress | None,
    ) -> None:
        self.graph, self.base, self.tree, self.seed = graph, base, tree, seed
        self._started = time.perf_counter()
        self._seconds, self._progress = seconds, progress
        self._told = (-2, -1)
        self._tries = 0
        self.blooming = TreeGrower(graph).blooming(base, tree)
        self.cut_panels = False
        self.best = self._first_net()
        own = graph.panel[graph.faces[:, 0]] == graph.panel[base]
        self.frozen: NDArray[np.bool_] = graph.flat_forest & (own | (not self.cut_panels))
        self.finder = PathFinder(graph, cut_panels=self.cut_panels)
        self.program = TreeProgram(graph, self.blooming, self.frozen)
        self.bounds = TreeBound(
            len(graph.goal.faces),
            graph.faces.tolist(),
            self.blooming.tolist(),
            self.frozen.tolist(),
            DENOMINATOR,
        )
        self.pool: list[NoGood] = []
        self._known: set[tuple[int, ...]] = set()
        self.root = BranchNode({})
        self._gains = Gains(len(graph.faces))

    # -- small things ----------------------------------------------------------------------------------------

    def clock(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._started

    @property
    def left(self) -> float:
        """Seconds left."""
        return self._seconds - self.clock()

    @property
    def upper(self) -> int:
        """Edits of the best net; one more than any net has if there is none."""
        return self.best.edits if self.best.is_net else len(self.graph.goal.faces)

    def tell(self) -> None:
        """Report progress."""
        now = (self.best.edits if self.best.is_net else -1, min(self.root.lowest(), self.upper))
        if self._progress is not None and now != self._told:
            self._told = now
            self._progress(*now, self.clock())

    def _first_net(self) -> NetAttempt:
        """The best of a few searches."""
        tries = [
            nearly_blooming(self.graph, self.base, tree=self.tree, seed=self.seed + turn)
            for turn in range(STARTS if len(self.graph.goal.faces) <= 1000 else 1)
        ]
        if self.graph.has_rings and not any(found.is_net for found in tries):
            cut = nearly_blooming(self.graph, self.base, tree=self.tree, seed=self.seed, cut_panels=True)
            self.cut_panels = cut.is_net
            tries.append(cut)
        return min(tries, key=_quality)

    # -- the search ------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Search until the best net is proven or the time is up."""
        try:
            self._start()
            self.tell()
            node: BranchNode | None = self.root
            while node is not None and self.left > 0.0:
                child = self._process(node)
                self.tell()
                node = child if child is not None else self._most_promising()
        except OutOfTimeError:
            pass
        self.tell()

    def _start(self) -> None:
        """The first no-goods: hold, vertices, paths of the blooming tree, short paths."""
        hold = hold_no_good(self.graph, self.base)
        faces = len(self.graph.goal.faces)
        folds = max(3, int(np.log2(max(SHORT_PATH_WORK / (3.0 * faces), 4.0))) + 1)
        self._learn([] if hold is None else [hold])
        self._learn(vertex_no_goods(self.graph))
        self._learn(self.finder.violated(self.blooming.astype(np.float64), SEARCH_WORK))
        self._learn(self.finder.short(folds, SHORT_PATH_WORK))

    def _learn(self, no_goods: list[NoGood]) -> int:
        """Add those that are new; returns how many."""
        fresh = []
        for item in no_goods:
            key = tuple(sorted(item.edges))
            if key not in self._known:
                self._known.add(key)
                fresh.append(item)
        self.pool.extend(fresh)
        self.program.add(fresh)
        return len(fresh)

    def _solve(self, node: BranchNode) -> TreeShares | None:
        """Solve a node's programme and note its bound; None if the node is closed."""
        shares = self.program.solve(node.fixed, self.left)
        if shares is None:
            node.note((), NEVER if self.bounds.value([], node.fixed) is None else 0)
            node.value = float(NEVER)
            return None
        node.value = shares.value
        self._note_bound(node, shares)
        return None if node.bound >= self.upper else shares

    def _note_bound(self, node: BranchNode, shares: TreeShares) -> None:
        """Turn multipliers into whole numbers and count what they prove."""
        whole = np.rint(shares.multipliers * DENOMINATOR).astype(np.int64)
        used = np.flatnonzero(whole > 0)
        pairs = tuple(zip(used.tolist(), whole[used].tolist(), strict=True))
        terms = [(self.pool[i].edges, self.pool[i].cut_at_least, times) for i, times in pairs]
        bound = self.bounds.edits(terms, node.fixed)
        node.note(pairs, NEVER if bound is None else bound)

    def _process(self, node: BranchNode) -> BranchNode | None:
        """Bound a node, cut off what it breaks, branch; returns the child to go on with, None if closed."""
        node.is_open = False
        shares = self._solve(node)
        rounds = 0
        while shares is not None:
            fresh = self._learn(self.finder.violated(shares.kept, SEARCH_WORK))
            if fresh == 0 or (rounds >= 4 and node is not self.root and not _is_whole(shares.kept)):
                break
            if node is self.root:
                self._improve(shares)
            rounds += 1
            shares = self._solve(node)
        if shares is None:
            return None
        self._improve(shares)
        return None if node.bound >= self.upper else self._branch(node, shares)

    def _improve(self, shares: TreeShares) -> None:
        """Make a net from the shares; keep it if it is better."""
        self._tries += 1
        start = shared_tree(self.graph, self.blooming, self.frozen, shares.kept)
        found = net_from_shares(
            self.graph,
            self.base,
            self.blooming,
            start,
            self.best,
            self.seed + self._tries,
            cut_panels=self.cut_panels,
        )
        if found.is_net and (not self.best.is_net or _quality(found) < _quality(self.best)):
            self.best = found

    def _branch(self, node: BranchNode, shares: TreeShares) -> BranchNode | None:
        """Split a node at the edge whose two cases raise the bound most; returns the case to go on with."""
        edge = -1
        cases: tuple[BranchNode, BranchNode] | None = None
        best, tried, idle = -1.0, 0, 0
        for e in self._gains.ranked(shares.kept):
            if self._gains.is_known(e) or tried >= CANDIDATES:
                pair, score = None, self._gains.expected(e, float(shares.kept[e]))
            else:
                tried += 1
                pair = (self._case(node, e, True), self._case(node, e, False))
                rises = [min(case.value, self.upper) - node.value for case in pair]
                self._gains.learn(e, float(shares.kept[e]), rises[0], rises[1])
                score = product(rises[0], rises[1])
            idle += 1
            if score > best:
                edge, cases, best, idle = e, pair, score, 0
            if idle >= IDLE_CANDIDATES:
                break
        if edge < 0:
            return None
        if cases is None:
            cases = (self._case(node, edge, True), self._case(node, edge, False))
            rises = [min(case.value, self.upper) - node.value for case in cases]
            self._gains.learn(edge, float(shares.kept[edge]), rises[0], rises[1])
        node.edge, node.cases = edge, cases
        alive = []
        for case in cases:
            case.is_open = case.bound < self.upper
            if case.is_open:
                alive.append(case)
        return max(alive, key=lambda case: case.fixed[edge] == (shares.kept[edge] > 0.5), default=None)

    def _case(self, node: BranchNode, edge: int, keep: bool) -> BranchNode:
        """The node below ``node`` in which ``edge`` is in or out, solved once."""
        case = BranchNode({**node.fixed, edge: keep}, node.multipliers, node.bound, node.value)
        self._solve(case)
        return case

    def _most_promising(self) -> BranchNode | None:
        """The open node of lowest value."""
        open_nodes = [node for node in self.root.leaves() if node.is_open and node.bound < self.upper]
        return min(open_nodes, key=lambda node: node.value, default=None)


def _quality(attempt: NetAttempt) -> tuple[bool, int, int, bool, int]:
    """Key that puts better nets first: few edits, then room for a tab, then few folds in a row."""
    depth = int(attempt.layout.depth.max())
    return (not attempt.is_net, len(attempt.overlapping), attempt.edits, not attempt.roomy, depth)


def _is_whole(kept: NDArray[np.float64]) -> bool:
    """True if every edge is in or out."""
    return bool((np.minimum(kept, 1.0 - kept) < 1e-6).all())
