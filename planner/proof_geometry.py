"""Flat layouts and overlap in plain Python, for checking proofs: shares no code with the search kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from planner.goal_mesh import GoalMesh

__all__ = ["PROVEN_DEPTH_MM", "FaceShapes", "penetration", "vertex_fan"]

PROVEN_DEPTH_MM = 1e-4 * (1.0 - 1e-6)
"""Faces that penetrate each other deeper than this overlap: the tolerance of the nets, less some rounding."""

Triangle = tuple[complex, complex, complex]


class FaceShapes:
    """Side lengths of the faces of a goal, and layouts of a few of them side by side."""

    def __init__(self, goal: GoalMesh) -> None:
        """Measure the sides."""
        corners = goal.vertices[goal.faces]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        self.goal = goal
        self._faces: list[list[int]] = goal.faces.tolist()
        self._sides: list[list[float]] = sides.tolist()

    def alone(self, face: int) -> Triangle:
        """The face laid flat by itself."""
        a, b, c = self._sides[face]
        x = (a * a + c * c - b * b) / (2.0 * a)
        return 0j, complex(a), complex(x, math.sqrt(max(c * c - x * x, 0.0)))

    def beside(self, laid: Triangle, face: int, next_face: int, shared: tuple[int, int]) -> Triangle:
        """``next_face`` laid flat against ``face``, which lies at ``laid``, along their shared edge.

        Raises:
            ValueError: if the goal vertices ``shared`` are not an edge of both, run in opposite ways.
        """
        here, there = _slot(self._faces[face], shared), _slot(self._faces[next_face], shared)
        start, end = laid[(here + 1) % 3], laid[here]
        if self._faces[face][here] == self._faces[next_face][there]:
            raise ValueError(f"faces {face} and {next_face} run the same way along {shared}")
        sides = self._sides[next_face]
        a, b, c = sides[there], sides[(there + 1) % 3], sides[(there + 2) % 3]
        x = (a * a + c * c - b * b) / (2.0 * a)
        apex = start + (end - start) / abs(end - start) * complex(x, math.sqrt(max(c * c - x * x, 0.0)))
        placed = [0j, 0j, 0j]
        placed[there], placed[(there + 1) % 3], placed[(there + 2) % 3] = start, end, apex
        return placed[0], placed[1], placed[2]

    def path(self, first: int, edges: Sequence[tuple[int, int]]) -> list[tuple[int, Triangle]]:
        """The faces from ``first`` on, each laid against the one before across the next edge.

        Raises:
            ValueError: if an edge does not lead on to another face.
        """
        laid = [(first, self.alone(first))]
        for shared in edges:
            face, triangle = laid[-1]
            across = [f for f in self._owners(shared) if f != face]
            if len(across) != 1 or not set(shared) <= set(self._faces[face]):
                raise ValueError(f"edge {shared} does not lead on from face {face}")
            laid.append((across[0], self.beside(triangle, face, across[0], shared)))
        return laid

    def every_cut_overlaps(self, vertex: int, fan: Sequence[tuple[int, int]]) -> bool:
        """True if the faces around ``vertex`` overlap whichever single edge of the fan is cut.

        Args:
            vertex: an inner goal vertex.
            fan: faces around it as ``vertex_fan`` gives them.
        """
        count = len(fan)
        for cut in range(count):
            ring = [fan[(cut + i) % count] for i in range(count)]
            laid = self.path(ring[0][0], [(vertex, spoke) for _, spoke in ring[1:]])
            triangles = [triangle for _, triangle in laid]
            if penetration(triangles[0], triangles[-1]) <= PROVEN_DEPTH_MM and not any(
                penetration(triangles[i], triangles[j]) > PROVEN_DEPTH_MM
                for i in range(count)
                for j in range(i + 2, count)
            ):
                return False
        return True

    def _owners(self, shared: tuple[int, int]) -> list[int]:
        return self._by_edge.get((min(shared), max(shared)), [])

    @cached_property
    def _by_edge(self) -> dict[tuple[int, int], list[int]]:
        owners: dict[tuple[int, int], list[int]] = {}
        for face, corners in enumerate(self._faces):
            for k in range(3):
                a, b = corners[k], corners[(k + 1) % 3]
                owners.setdefault((min(a, b), max(a, b)), []).append(face)
        return owners


def vertex_fan(goal: GoalMesh, vertex: int) -> list[tuple[int, int]] | None:
    """The faces around an inner vertex in their order, each with the neighbour vertex on its first side.

    Row i is (face, w): the face whose boundary leaves ``vertex`` along the edge to w; the face before it in
    the order lies on the other side of that edge. None if the vertex is not inside a disc of faces.
    """
    leaving: dict[int, tuple[int, int]] = {}
    faces = np.flatnonzero((goal.faces == vertex).any(axis=1)).tolist()
    for face in faces:
        corners = goal.faces[face].tolist()
        k = corners.index(vertex)
        leaving[corners[(k + 1) % 3]] = (face, corners[(k + 2) % 3])
    if len(leaving) != len(faces):
        return None
    fan = []
    spoke = min(leaving)
    for _ in faces:
        if spoke not in leaving:
            return None
        face, after = leaving.pop(spoke)
        fan.append((face, spoke))
        spoke = after
    return fan if spoke == fan[0][1] else None


def penetration(one: Triangle, other: Triangle) -> float:
    """How deep two counter-clockwise triangles penetrate each other: the least way to part them; 0 if apart.

    The least translation that parts two convex polygons is along a normal of one of their sides.
    """
    least = math.inf
    for a, b in ((one, other), (other, one)):
        for k in range(3):
            side = a[(k + 1) % 3] - a[k]
            inwards = 1j * side / abs(side)
            depth = max(((p - a[k]) * inwards.conjugate()).real for p in b)
            if depth <= 0.0:
                return 0.0
            least = min(least, depth)
    return least


def _slot(corners: Sequence[int], shared: tuple[int, int]) -> int:
    """The side of a face that lies on an edge."""
    for k in range(3):
        if {corners[k], corners[(k + 1) % 3]} == set(shared):
            return k
    raise ValueError(f"edge {shared} is not a side of the face {tuple(corners)}")
