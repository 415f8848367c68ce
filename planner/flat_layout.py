"""A flat net that can be changed: exchange one crease for another, ask what overlaps, take it back."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from planner._kernels import nb_kernels, net_kernels
from planner._kernels import net_arrays as columns
from planner._kernels.net_arrays import NetArrays
from planner._kernels.overlap_kernels import all_overlaps
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.layout_arrays import graph_arrays
from planner.net import Net, NetCertificate
from planner.net_from_tree import net_from_tree
from planner.overlap import overlapping_pairs

__all__ = ["LEAST_TAB_EDGE_MM", "FlatLayout"]

LEAST_TAB_EDGE_MM = 2.0
"""The base panel keeps a free side at least this long (or its longest side), so that a tab can hold it."""

UNDO_DEPTH = 64
"""How many exchanges can be taken back."""


class FlatLayout:
    """A spanning tree of a dual graph, rooted at a base face and laid flat.

    ``exchange`` replaces one crease by another by moving the smaller part rigidly, and does so only if
    nothing overlaps afterwards and the base panel still has a free edge for a tab (with room beside it, if
    there was room before). Flat joints are never cut. The pose of the whole net in the plane is arbitrary
    and changes with exchanges; ``to_net`` lays it out afresh from the base.
    """

    def __init__(
        self, graph: DualGraph, tree: NDArray[np.bool_], base: int, *, hold_base: bool = True
    ) -> None:
        """Lay out ``tree``.

        Args:
            graph: the dual graph of the goal.
            tree: (M,) True for the creases and flat joints; they must span the faces without a cycle.
            base: the stationary face.
            hold_base: whether exchanges must leave a free edge for a tab at the base panel.

        Raises:
            NetError: if ``tree`` is not a spanning tree, or ``base`` is not a face.
        """
        self.graph = graph
        self._hold_base = hold_base
        self._history: deque[tuple[int, int, NDArray[np.int64], NDArray[np.float64]]] = deque(
            maxlen=UNDO_DEPTH
        )
        if np.shape(tree) != (len(graph.faces),):
            raise NetError(
                f"a tree mask has one entry per interior edge, ({len(graph.faces)},), got {np.shape(tree)}"
            )
        self.arrays: NetArrays = graph_arrays(graph, np.asarray(tree, dtype=np.bool_))
        self._set_base(base)
        self._lay()

    # -- what it is ------------------------------------------------------------------------------------------

    @property
    def base(self) -> int:
        """The stationary face."""
        return int(self.arrays.number[columns.BASE])

    @property
    def tree(self) -> NDArray[np.bool_]:
        """(M,) True for the edges of the tree, a copy."""
        mask: NDArray[np.bool_] = self.arrays.edge[:, columns.TREE] != 0
        return mask

    @property
    def parent(self) -> NDArray[np.int64]:
        """(F,) parent face, -1 for the base; a view that exchanges change."""
        return self._row(columns.PARENT)

    @property
    def slot(self) -> NDArray[np.int64]:
        """(F,) side of the face (corner k to k + 1) that lies on its crease, -1 for the base; a view."""
        return self._row(columns.SLOT)

    @property
    def crease(self) -> NDArray[np.int64]:
        """(F,) interior edge of the dual graph that joins a face to its parent, -1 for the base; a view."""
        return self._row(columns.CREASE)

    @property
    def depth(self) -> NDArray[np.int64]:
        """(F,) folds between a face and the base (flat joints do not count); a view."""
        return self._row(columns.DEPTH)

    @property
    def order(self) -> NDArray[np.int64]:
        """(F,) faces, every parent before its children; a view."""
        return self._row(columns.ORDER)

    @property
    def corners(self) -> NDArray[np.float64]:
        """(F, 3, 2) flat positions in mm, corner by corner as in the goal; a copy."""
        first = columns.CORNER
        return self.arrays.real[:-1, first : first + 6].reshape(-1, 3, 2).copy()

    @property
    def heading(self) -> float:
        """Direction in the plane of the base face's side from corner 0 to corner 1, rad."""
        x0, y0, x1, y1 = self.arrays.real[self.base, columns.CORNER : columns.CORNER + 4].tolist()
        return math.atan2(y1 - y0, x1 - x0)

    @property
    def target(self) -> NDArray[np.float64]:
        """(F,) goal fold angle in rad at the crease of each face, 0 for flat joints and the base."""
        crease = self.crease
        angle: NDArray[np.float64] = np.where(self.graph.flat, 0.0, self.graph.fold_angle)[crease]
        angle[crease < 0] = 0.0
        return angle

    @property
    def overlaps(self) -> int:
        """Number of overlapping face pairs when the layout was made (exchanges never add one)."""
        return self._overlaps

    @property
    def outline(self) -> NDArray[np.int64]:
        """(K, 3) sides of the base panel long enough for a tab: face, slot, interior edge or -1."""
        return self._outline

    def path(self, face_a: int, face_b: int) -> NDArray[np.int64]:
        """Interior edges on the tree path from one face to another (unordered)."""
        out = np.empty(len(self.graph.goal.faces), dtype=np.int64)
        return out[: nb_kernels.tree_path(self.arrays, int(face_a), int(face_b), out)]

    def joinable(self, cut_edge: int) -> NDArray[np.int64]:
        """Interior edges that would join the two components again if ``cut_edge`` were cut, ascending.

        Raises:
            NetError: if ``cut_edge`` is not in the tree.
        """
        self._check_cut(cut_edge)
        out = np.empty(len(self.graph.faces), dtype=np.int64)
        net_kernels.component(self.arrays, int(cut_edge))
        found = out[: nb_kernels.joining_edges(self.arrays, out)]
        net_kernels.unmark(self.arrays)
        return np.sort(found)

    def overlapping_pairs(self) -> NDArray[np.int64]:
        """(P, 2) overlapping face pairs, lower face first, in ascending order."""
        return overlapping_pairs(self.corners)

    def free_edges(self) -> int:
        """How many sides of the base panel that are long enough for a tab are not creases."""
        return int(nb_kernels.free_edges(self.arrays, self._outline))

    def tab_has_room(self) -> bool:
        """True if some free side of the base panel has no other face within 1 mm along 2 mm of its length."""
        return bool(nb_kernels.clear_tabs(self.arrays, self._outline, 1, self.arrays.entry, 0))

    def keeps_hold(self, cut_edge: int, join_edge: int) -> bool:
        """False if replacing ``cut_edge`` by ``join_edge`` would take the base panel's last free side."""
        edge = self.arrays.edge
        return (
            not edge[join_edge, columns.OUTLINE]
            or bool(edge[cut_edge, columns.OUTLINE])
            or self.free_edges() > 1
        )

    # -- changing it -----------------------------------------------------------------------------------------

    def exchange(self, cut_edge: int, join_edge: int) -> bool:
        """Replace crease ``cut_edge`` by ``join_edge`` if the result is overlap-free and can be held.

        Returns False, and changes nothing, if the moved part would overlap the rest, ``join_edge`` does not
        join the two parts, ``cut_edge`` is a flat joint, or the base panel would lose its free edge or the
        room for a tab that it has.

        Raises:
            NetError: if ``cut_edge`` is not in the tree or ``join_edge`` is.
        """
        self._check_cut(cut_edge)
        cut, join = int(cut_edge), int(join_edge)
        arrays = self.arrays
        if not 0 <= join < len(self.graph.faces) or arrays.edge[join, columns.TREE]:
            raise NetError(f"edge {join} is not an interior edge that is cut; choose one of joinable({cut})")
        if arrays.edge[cut, columns.FROZEN]:
            return False
        if self._held and not self.keeps_hold(cut, join):
            return False
        if net_kernels.swap_is_free(arrays, cut, join) != 1:
            return False
        before = arrays.real[:-1, columns.POSE : columns.POSE + 4].copy()
        net_kernels.swap(arrays, cut, join)
        members = np.flatnonzero((arrays.real[:-1, columns.POSE : columns.POSE + 4] != before).any(axis=1))
        self._history.append((cut, join, members, before[members]))
        if self.graph.flat[join]:
            self._find_outline()
        if self._roomy and not self.tab_has_room():
            self.undo()
            return False
        return True

    def exchanged_inside(self, join_edge: int) -> bool:
        """Take note that a kernel has joined ``join_edge`` in ``arrays``; it cannot be taken back.

        Returns False if the base panel has lost its free side, or the room for a tab that it had.
        """
        self._history.clear()
        if self.graph.flat[join_edge]:
            self._find_outline()
        return (not self._held or self.free_edges() > 0) and (not self._roomy or self.tab_has_room())

    def undo(self) -> None:
        """Take the last exchange back, exactly (up to 64 of them).

        Raises:
            NetError: if there is nothing to take back.
        """
        if not self._history:
            raise NetError(
                f"nothing to take back: the last {UNDO_DEPTH} exchanges are kept, and set_base forgets them"
            )
        cut, join, members, poses = self._history.pop()
        self.arrays.edge[cut, columns.TREE], self.arrays.edge[join, columns.TREE] = 1, 0
        net_kernels.place_back(self.arrays, members, poses)
        if self.graph.flat[join]:
            self._find_outline()

    def set_base(self, face: int) -> None:
        """Make another face the stationary one. Exchanges made before cannot be taken back any more.

        Raises:
            NetError: if ``face`` is not a face.
        """
        self._set_base(face)
        self._look_at_base()

    def copy(self) -> FlatLayout:
        """An independent layout in the same state (without the exchanges to take back)."""
        twin = object.__new__(FlatLayout)
        twin.__dict__.update(self.__dict__)
        twin.arrays = NetArrays(**{name: array.copy() for name, array in self.arrays._asdict().items()})
        twin._history = deque(maxlen=UNDO_DEPTH)
        return twin

    def to_net(self, certificate: NetCertificate | None = None) -> Net:
        """The net, laid out afresh in double precision from the base face (its corner 0 at the origin)."""
        return net_from_tree(self.graph, self.parent, self.crease, self.order, self.base, certificate)

    # -- inside ----------------------------------------------------------------------------------------------

    def _row(self, number: int) -> NDArray[np.int64]:
        row: NDArray[np.int64] = self.arrays.node[number]
        return row

    def _check_cut(self, edge: int) -> None:
        if not (0 <= edge < len(self.graph.faces) and self.arrays.edge[edge, columns.TREE]):
            raise NetError(f"edge {edge} is not in the tree; choose one of its {len(self.parent) - 1} edges")

    def _set_base(self, face: int) -> None:
        count = len(self.graph.goal.faces)
        if not 0 <= face < count:
            raise NetError(f"base face {face} does not exist: the goal has faces 0 to {count - 1}")
        if net_kernels.root_tree(self.arrays, int(face)) != count:
            raise NetError("the edges given are not a spanning tree: they form a cycle, or leave faces out")
        self._history.clear()
        self._find_outline()

    def _find_outline(self) -> None:
        """Sides of the base panel: the base and what flat joints of the tree join to it (no fold away)."""
        self._outline = base_outline(self.graph, self.depth == 0)
        sides = self._outline[:, 2]
        self.arrays.edge[:, columns.OUTLINE] = 0
        self.arrays.edge[sides[sides >= 0], columns.OUTLINE] = 1

    def _lay(self) -> None:
        net_kernels.lay_flat(self.arrays)
        self._overlaps = int(all_overlaps(self.arrays, self.arrays.entry, 0))
        self._look_at_base()

    def _look_at_base(self) -> None:
        self._held = self._hold_base and self.free_edges() > 0
        self._roomy = self._hold_base and self.tab_has_room()


def base_outline(graph: DualGraph, members: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(K, 3) sides of a base panel that are long enough for a tab: face, slot, interior edge or -1.

    Long enough is LEAST_TAB_EDGE_MM, or the longest side where all are shorter. Edges between two faces of
    the panel do not count.

    Args:
        graph: the dual graph.
        members: (F,) True for the faces of the panel.
    """
    panel = np.flatnonzero(members)
    edges = graph.face_edges[panel]
    if len(graph.faces):
        other = graph.faces[edges].sum(axis=2) - panel[:, None]
        outer = (edges < 0) | ~members[np.where(edges < 0, panel[:, None], other)]
    else:
        outer = np.ones(edges.shape, dtype=np.bool_)
    length = np.where(outer, graph.side_length[panel], -1.0)
    enough = min(LEAST_TAB_EDGE_MM, float(length.max()) * (1.0 - 1e-9))
    row, slot = np.nonzero(length >= enough)
    return np.ascontiguousarray(np.stack([panel[row], slot, edges[row, slot]], axis=1))
