"""Nearly-blooming nets: few exchanges from a blooming tree, no overlap, a base that a tab can hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner._kernels import nb_kernels, restore_kernels, search_kernels
from planner._kernels.net_arrays import BLOCKED, BLOOMING, FROZEN, TESTED
from planner.blooming_trees import BLOOMING_TREES, TreeGrower, TreeName, blooming_tree
from planner.corner_tabs import CORNER_WIDTHS_MM, corner_tabs
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.fold_plan import MachineLimits
from planner.net import Net, NetCertificate
from planner.net_proof import NetProof
from planner.no_goods import never_free
from planner.packed_bound import packed_proof

__all__ = ["WORK_PER_SECOND", "NetAttempt", "certify", "nearly_blooming", "repair_tree"]

WORK_PER_SECOND = 1_500_000
"""Faces tested for overlap that stand for one second of a budget: budgets count work, so that results do not
depend on the machine or its load."""

DEFAULT_BUDGET_S = 20.0
"""Nominal budget of one search where none is given."""

ROUNDS, ROUNDS_FACES = 40, 12_000
"""How often creases are brought back by force; at most the second figure over the number of faces."""

ROOM_TRIES = 300
"""Exchanges tried to give a tab room before another base is preferred."""


@dataclass(frozen=True, eq=False)
class NetAttempt:
    """What one method made of one base face.

    Attributes:
        layout: the net as laid out, at its best.
        tree: the tree that it started from.
        blooming_overlaps: overlapping face pairs in that tree.
        edits: creases of the net that the tree does not have.
        overlapping: (P, 2) face pairs that still overlap.
        held: the base panel has a free side for a tab, or ``held_at_corner``.
        roomy: some free side of the base panel has room for a tab, or ``held_at_corner``.
        work: faces that were tested for overlap on the way.
        proof: of the fewest edits that any net needs, if there is one.
    """

    layout: FlatLayout
    tree: str
    blooming_overlaps: int
    edits: int
    overlapping: NDArray[np.int64]
    held: bool
    roomy: bool
    work: int
    proof: NetProof | None = None

    @property
    def is_net(self) -> bool:
        """True if nothing overlaps and the base can be held."""
        return len(self.overlapping) == 0 and self.held

    def certificate(self, method: str) -> NetCertificate:
        """How near to blooming the net is; without a proof of its own the bound is that of ``packed_proof``.

        Nets from other than blooming trees have no bound.
        """
        if self.tree not in BLOOMING_TREES:
            return NetCertificate(self.blooming_overlaps, self.edits, method=method, tree=self.tree)
        proof = self.proof or packed_proof(self.layout, self.tree)
        return NetCertificate(
            self.blooming_overlaps, self.edits, proof.bound, self.edits == proof.bound, method=method,
            tree=self.tree, proof=proof,
        )  # fmt: skip

    def to_net(self, method: str) -> Net:
        """The net with its certificate."""
        return self.layout.to_net(self.certificate(method))


def repair_tree(
    graph: DualGraph,
    tree: NDArray[np.bool_],
    base: int,
    *,
    name: str,
    seed: int = 0,
    budget_s: float | None = None,
    remove_overlaps: bool = True,
    cut_panels: bool = False,
    rounds: int | None = None,
) -> NetAttempt:
    """Exchange creases of ``tree`` until no faces overlap and the base panel can be held, then restore.

    A tabu search picks an overlapping pair, cuts a crease on the tree path between its faces and joins the
    parts at the edge that leaves the fewest overlaps. Afterwards creases of ``tree`` are brought back, each
    in exchange for a foreign one, as long as nothing overlaps, and by force in ``rounds`` of trial. Flat
    joints are never cut.

    Args:
        graph: the dual graph of the goal.
        tree: (M,) the tree to start from.
        base: the base face.
        name: what the tree is called in the certificate.
        seed: of the random choices.
        budget_s: nominal seconds, counted as work (``WORK_PER_SECOND``).
        remove_overlaps: False: only see to the hold of the base, and only if nothing overlaps.
        cut_panels: flat joints may be cut, but for those of the base panel. Some goals need it: the walls of
            a hole may hang on nothing but the flat ring around it, and not fit inside.
        rounds: how often creases are brought back by force; None: ``ROUNDS``, fewer for many faces.
    """
    layout = FlatLayout(graph, tree, base)
    found, edits, work = layout.overlaps, 0, 0
    overlapping = layout.overlapping_pairs() if found else np.empty((0, 2), dtype=np.int64)
    rng = np.array([_scramble(seed, base)], dtype=np.uint64)
    loose = not found and not layout.free_edges() and not never_free(graph, base)
    if (found and remove_overlaps) or loose:
        arrays = layout.arrays
        arrays.edge[:, BLOOMING] = tree
        if cut_panels:
            own = graph.panel[graph.faces[:, 0]] == graph.panel[base]
            arrays.edge[:, FROZEN] = graph.flat & own
        pairs = np.zeros((2 * found + 4 * len(graph.goal.faces), 2), dtype=np.int64)
        pairs[:found] = overlapping
        limit = int((DEFAULT_BUDGET_S if budget_s is None else budget_s) * WORK_PER_SECOND)
        stall = 500 + 2 * len(graph.goal.faces)
        left = search_kernels.search(arrays, tab_sides(layout), pairs, found, rng, stall, limit)
        if left == 0:
            roomy = make_room(layout, seed)
            edits = restore(layout, tree, roomy, rounds=rounds_for(graph, rounds), seed=seed)
        else:
            edits = int(np.count_nonzero(layout.tree & ~tree))
        work = int(arrays.number[TESTED])
        layout = FlatLayout(graph, layout.tree, base)
        overlapping = layout.overlapping_pairs() if layout.overlaps else overlapping[:0]
    elif not found and layout.free_edges() and not layout.tab_has_room():
        make_room(layout, seed)
        edits = int(np.count_nonzero(layout.tree & ~tree))
        layout = FlatLayout(graph, layout.tree, base)
    cornered = len(overlapping) == 0 and held_at_corner(layout)
    return NetAttempt(
        layout=layout,
        tree=name,
        blooming_overlaps=found,
        edits=edits,
        overlapping=overlapping,
        held=layout.free_edges() > 0 or cornered,
        roomy=layout.tab_has_room() or cornered,
        work=work,
    )


def restore(
    layout: FlatLayout, tree: NDArray[np.bool_], roomy: bool, *, rounds: int = 0, seed: int = 0
) -> int:
    """Bring creases of ``tree`` back, each in exchange for a foreign one, while nothing overlaps.

    In each round after that some creases are brought back by force, the overlaps are removed elsewhere, and
    what has more edits than before is taken back. The base panel keeps a free side, and with ``roomy`` the
    room for a tab. Returns the edits that are left.

    Args:
        layout: an overlap-free layout; it is changed.
        tree: (M,) the blooming tree.
        roomy: a tab at the base panel has room, and keeps it.
        rounds: how often to try by force.
        seed: of the random choices.
    """
    arrays, faces, edges = layout.arrays, len(layout.graph.goal.faces), len(layout.graph.faces)
    arrays.edge[:, BLOOMING] = tree
    return int(
        restore_kernels.polish(
            arrays,
            tab_sides(layout),
            np.zeros((6 * faces, 2), dtype=np.int64),
            np.zeros((restore_kernels.ROWS, faces + 1), dtype=np.int64),
            np.full((edges, 2), -1, dtype=np.int64),
            np.array([_scramble(seed, layout.base)], dtype=np.uint64),
            int(roomy),
            rounds,
        )
    )


def make_room(layout: FlatLayout, seed: int) -> bool:
    """Look for one exchange of an overlap-free layout that gives a tab room; True if there is room then."""
    if layout.tab_has_room():
        return True
    rng = np.random.default_rng([seed, layout.base])
    blocking = np.zeros((64, 2), dtype=np.int64)
    nb_kernels.clear_tabs(layout.arrays, layout.outline, 1, blocking, len(blocking))
    blockers = np.unique(blocking[: layout.arrays.number[BLOCKED], 1])
    tries = 0
    for face in rng.permutation(blockers).tolist():
        for cut in rng.permutation(layout.path(layout.base, face)).tolist():
            if layout.graph.flat[cut]:
                continue
            for join in rng.permutation(layout.joinable(cut))[:4].tolist():
                tries += 1
                if tries > ROOM_TRIES:
                    return False
                if layout.exchange(cut, join):
                    if layout.tab_has_room():
                        return True
                    layout.undo()
    return False


def held_at_corner(layout: FlatLayout) -> bool:
    """True if no net has a free side at this base, and at some corner of it the narrowest neck has room."""
    return never_free(layout.graph, layout.base) and bool(
        corner_tabs(layout.to_net(), MachineLimits(), CORNER_WIDTHS_MM[0])
    )


def tab_sides(layout: FlatLayout) -> NDArray[np.int64]:
    """``layout.outline`` for the kernels; where no net has a free side, a row of none stands for one."""
    if not never_free(layout.graph, layout.base):
        return layout.outline
    none = layout.outline[:1].copy()
    none[:, 2] = -1
    return np.ascontiguousarray(np.concatenate([layout.outline, none]))


def nearly_blooming(
    graph: DualGraph,
    base: int,
    *,
    tree: TreeName = "steepest",
    seed: int = 0,
    budget_s: float | None = None,
    cut_panels: bool = False,
    rounds: int | None = None,
) -> NetAttempt:
    """A net of few edits from the blooming tree ``tree`` around ``base``; see ``repair_tree``."""
    start = blooming_tree(graph, base, tree)
    return repair_tree(
        graph, start, base, name=tree, seed=seed, budget_s=budget_s, cut_panels=cut_panels, rounds=rounds
    )


def rounds_for(graph: DualGraph, rounds: int | None) -> int:
    """How often creases are brought back by force where ``rounds`` does not say."""
    return min(ROUNDS, ROUNDS_FACES // len(graph.goal.faces)) if rounds is None else rounds


def certify(layout: FlatLayout, method: str) -> NetCertificate:
    """Certificate of an overlap-free layout: edits from the nearest blooming tree, bound by packed paths."""
    grower = TreeGrower(layout.graph)
    trees = {name: grower.blooming(layout.base, name) for name in BLOOMING_TREES}
    edits = {name: int(np.count_nonzero(layout.tree & ~tree)) for name, tree in trees.items()}
    name = min(BLOOMING_TREES, key=lambda tree: edits[tree])
    overlaps = FlatLayout(layout.graph, trees[name], layout.base, hold_base=False).overlaps
    proof = packed_proof(layout, name)
    return NetCertificate(
        overlaps, edits[name], proof.bound, edits[name] == proof.bound, method=method, tree=name, proof=proof
    )


def _scramble(seed: int, base: int) -> int:
    """A 64-bit state that is never 0, from seed and base face (splitmix64, Steele et al. 2014)."""
    state = (seed * 0x9E3779B97F4A7C15 + base * 0xD1342543DE82EF95 + 0x632BE59BD9B4E019) % 2**64
    state = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) % 2**64
    state = ((state ^ (state >> 27)) * 0x94D049BB133111EB) % 2**64
    return (state ^ (state >> 31)) or 1
