"""The dual graph of a goal mesh: its faces, joined across the edges that two of them share."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.errors import NetError
from planner.goal_mesh import GoalMesh
from planner.net import FLAT_FOLD_RAD
from planner.values import frozen_array

__all__ = ["DualGraph"]


@dataclass(frozen=True, eq=False)
class DualGraph:
    """Faces of ``goal`` as nodes, its interior edges as the edges between them.

    The M interior edges are numbered by their goal vertices (lower first). Slot k of a face is its side from
    corner k to corner k + 1. Column 0 of ``faces`` is the face whose boundary runs along
    ``vertices[:, 0] -> vertices[:, 1]``, column 1 the one that runs against it.

    Attributes:
        goal: the mesh.
        faces: (M, 2) the two faces of every interior edge.
        slots: (M, 2) the side of each of these faces that lies on the edge.
        vertices: (M, 2) goal vertices of the edge, the lower number first.
        fold_angle: (M,) signed fold angle in rad; 0 flat, positive = valley seen from the outer side, so the
            edges of a convex body are negative.
        length: (M,) mm.
        flat: (M,) True where ``|fold_angle| < FLAT_FOLD_RAD``.
        boundary: (B, 2) rows (face, slot) of the edges that only one face has.
        face_edges: (F, 3) interior edge on every side of every face, -1 on the boundary.
    """

    goal: GoalMesh
    faces: NDArray[np.int64] = field(init=False)
    slots: NDArray[np.int64] = field(init=False)
    vertices: NDArray[np.int64] = field(init=False)
    fold_angle: NDArray[np.float64] = field(init=False)
    length: NDArray[np.float64] = field(init=False)
    flat: NDArray[np.bool_] = field(init=False)
    boundary: NDArray[np.int64] = field(init=False)
    face_edges: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        """Find the edges.

        Raises:
            NetError: if the mesh is empty, or an edge has more than two faces or two that run the same way.
        """
        goal = self.goal
        count = len(goal.faces)
        if count == 0:
            raise NetError(f"{goal.name}: the goal mesh has no faces; expected at least one triangle")
        start = goal.faces.ravel()
        end = np.roll(goal.faces, -1, axis=1).ravel()
        low, high = np.minimum(start, end), np.maximum(start, end)
        key = low * np.int64(len(goal.vertices)) + high
        # faces that run from the lower to the higher vertex come first within an edge
        order = np.lexsort((start > end, key))
        sorted_key = key[order]
        same = np.flatnonzero(sorted_key[1:] == sorted_key[:-1])
        first, second = order[same], order[same + 1]
        wrong = (start[first] > end[first]) | (start[second] < end[second])
        if np.any(np.diff(same) == 1) or wrong.any():
            bad = same[1:][np.diff(same) == 1] if np.any(np.diff(same) == 1) else same[wrong]
            edge = order[bad[0]]
            raise NetError(
                f"{goal.name}: the edge between vertices {low[edge]} and {high[edge]} (face {edge // 3}) has "
                "more than two faces, or two wound against each other; read the mesh with read_goal"
            )
        faces = np.stack([first // 3, second // 3], axis=1)
        slots = np.stack([first % 3, second % 3], axis=1)
        vertices = np.stack([low[first], high[first]], axis=1)
        alone = np.ones(key.size, dtype=np.bool_)
        alone[first] = False
        alone[second] = False
        face_edges = np.full(key.size, -1, dtype=np.int64)
        face_edges[first] = np.arange(len(first))
        face_edges[second] = np.arange(len(first))
        along = goal.vertices[vertices[:, 1]] - goal.vertices[vertices[:, 0]]
        length = np.linalg.norm(along, axis=1)
        a, b = goal.face_normals[faces[:, 0]], goal.face_normals[faces[:, 1]]
        sine = np.einsum("ij,ij->i", np.cross(a, b), along / length[:, None])
        angle = -np.arctan2(sine, np.einsum("ij,ij->i", a, b))
        lone = np.flatnonzero(alone)
        for name, values, dtype, shape in (
            ("faces", faces, np.int64, (None, 2)),
            ("slots", slots, np.int64, (None, 2)),
            ("vertices", vertices, np.int64, (None, 2)),
            ("fold_angle", angle, np.float64, (None,)),
            ("length", length, np.float64, (None,)),
            ("flat", np.abs(angle) < FLAT_FOLD_RAD, np.bool_, (None,)),
            ("boundary", np.stack([lone // 3, lone % 3], axis=1), np.int64, (None, 2)),
            ("face_edges", face_edges.reshape(-1, 3), np.int64, (count, 3)),
        ):
            object.__setattr__(self, name, frozen_array(values, dtype, shape))

    @cached_property
    def side_length(self) -> NDArray[np.float64]:
        """(F, 3) length of every side of every face, mm."""
        corners = self.goal.vertices[self.goal.faces]
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        return frozen_array(lengths, np.float64, (None, 3))

    @cached_property
    def flat_corners(self) -> NDArray[np.float64]:
        """(F, 3, 2) corners of every face laid flat alone: corner 0 at the origin, corner 1 on +x, mm."""
        a, b, c = (self.goal.vertices[self.goal.faces[:, k]] for k in range(3))
        along, other = b - a, c - a
        length = np.linalg.norm(along, axis=1)
        corners = np.zeros((len(a), 3, 2))
        corners[:, 1, 0] = length
        corners[:, 2, 0] = np.einsum("ij,ij->i", along, other) / length
        corners[:, 2, 1] = np.linalg.norm(np.cross(along, other), axis=1) / length
        return frozen_array(corners, np.float64, (None, 3, 2))

    @cached_property
    def turn(self) -> NDArray[np.float64]:
        """(M, 2) cosine and sine of the turn from the frame of face 0 to that of face 1 when joined flat."""
        along = np.roll(self.flat_corners, -1, axis=1) - self.flat_corners
        unit = (along[..., 0] + 1j * along[..., 1]) / self.side_length
        one = unit[self.faces[:, 0], self.slots[:, 0]]
        other = unit[self.faces[:, 1], self.slots[:, 1]]
        turn = -one * other.conj()
        turn /= np.abs(turn)
        return frozen_array(np.stack([turn.real, turn.imag], axis=1), np.float64, (None, 2))

    @cached_property
    def panel(self) -> NDArray[np.int64]:
        """(F,) number of the flat panel of each face: faces reached over flat edges share one."""
        parent = list(range(len(self.goal.faces)))

        def root(face: int) -> int:
            while parent[face] != face:
                parent[face] = parent[parent[face]]
                face = parent[face]
            return face

        for one, other in self.faces[self.flat].tolist():
            low, high = sorted((root(one), root(other)))
            parent[high] = low
        roots = np.array([root(face) for face in range(len(parent))])
        return frozen_array(np.unique(roots, return_inverse=True)[1], np.int64, (len(parent),))

    @cached_property
    def flat_forest(self) -> NDArray[np.bool_]:
        """(M,) flat edges that every net keeps: a spanning forest of the panels, longest edges first."""
        flat = np.flatnonzero(self.flat)
        chosen = np.zeros(len(self.faces), dtype=np.bool_)
        chosen[self.forest(flat[np.lexsort((flat, -self.length[flat].round(9)))])] = True
        return frozen_array(chosen, np.bool_, (None,))

    def forest(self, edges: NDArray[np.int64]) -> NDArray[np.int64]:
        """(K,) those of ``edges`` whose faces the edges before do not join yet: a spanning forest.

        Source: Kruskal, On the shortest spanning subtree of a graph (1956): the forest weighs least if the
        edges come in the order of their weights.
        """
        parent = list(range(len(self.goal.faces)))

        def root(face: int) -> int:
            while parent[face] != face:
                parent[face] = parent[parent[face]]
                face = parent[face]
            return face

        taken = []
        for edge in edges.tolist():
            one, other = (root(face) for face in self.faces[edge].tolist())
            if one != other:
                parent[one] = other
                taken.append(edge)
        return np.array(taken, dtype=np.int64)

    @cached_property
    def has_rings(self) -> bool:
        """True if some flat panel has a hole: its Euler characteristic is less than 1."""
        for panel in np.flatnonzero(np.bincount(self.panel) > 2).tolist():
            members = np.flatnonzero(self.panel == panel)
            corners = self.goal.faces[members]
            inner = np.count_nonzero(self.flat & (self.panel[self.faces[:, 0]] == panel))
            if len(np.unique(corners)) - (3 * len(members) - inner) + len(members) < 1:
                return True
        return False

    @cached_property
    def pieces(self) -> int:
        """Number of connected components of the dual graph."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        count = len(self.goal.faces)
        links = coo_matrix((np.ones(len(self.faces)), (self.faces[:, 0], self.faces[:, 1])), (count, count))
        return int(connected_components(links, directed=False)[0])

    @cached_property
    def is_tree(self) -> bool:
        """True if the dual graph is itself a tree: then there is one flat pattern only."""
        return self.pieces == 1 and len(self.faces) == len(self.goal.faces) - 1
