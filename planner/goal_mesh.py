"""The goal mesh: the shape to be folded, checked and scaled."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.values import content_sha256, frozen_array

__all__ = ["GoalMesh"]


@dataclass(frozen=True, eq=False)
class GoalMesh:
    """An orientable manifold triangle mesh of one piece, closed or open.

    Attributes:
        vertices: (V, 3) positions in mm, every vertex used by a face.
        faces: (F, 3) vertex indices, counter-clockwise seen from outside.
        name: short name for messages and reports, usually the stem of the file name.
        notices: what was repaired, coarsened or scaled on the way here, in words.
        source_sha256: sha256 of the input file's bytes, "" if there was none.
        whole: the mesh that this one is a part of, where faces were left out on request; else None.
        faces_of_whole: (F,) the face of ``whole`` that each face is, ascending; None if nothing is missing.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    name: str = "goal"
    notices: tuple[str, ...] = ()
    source_sha256: str = ""
    whole: GoalMesh | None = None
    faces_of_whole: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays and check their shapes."""
        object.__setattr__(self, "vertices", frozen_array(self.vertices, np.float64, (None, 3)))
        object.__setattr__(self, "faces", frozen_array(self.faces, np.int64, (None, 3)))
        if self.faces_of_whole is not None:
            kept = frozen_array(self.faces_of_whole, np.int64, (len(self.faces),))
            object.__setattr__(self, "faces_of_whole", kept)

    def without(self, left_out: Collection[int]) -> GoalMesh:
        """The mesh that is left when faces are left out; it remembers the whole.

        Faces and vertices keep their order; vertices that only missing faces use are gone.

        Args:
            left_out: faces of this mesh.

        Raises:
            ValueError: if a face does not exist, or none would be left.
        """
        missing = np.unique(np.array(sorted(left_out), dtype=np.int64))
        if len(missing) and not (missing[0] >= 0 and missing[-1] < len(self.faces)):
            raise ValueError(
                f"faces to leave out must lie in 0 to {len(self.faces) - 1}, got {missing.tolist()}"
            )
        if len(missing) >= len(self.faces):
            raise ValueError("at least one face has to stay")
        if not len(missing):
            return self
        kept = np.setdiff1d(np.arange(len(self.faces)), missing)
        used, corners = np.unique(self.faces[kept], return_inverse=True)
        return replace(
            self,
            vertices=self.vertices[used],
            faces=corners.reshape(-1, 3),
            whole=self.original,
            faces_of_whole=self.faces_goal[kept],
        )

    @property
    def original(self) -> GoalMesh:
        """The whole mesh: this one, unless faces were left out."""
        return self if self.whole is None else self.whole

    @property
    def faces_goal(self) -> NDArray[np.int64]:
        """(F,) the face of the whole mesh that each face is."""
        if self.faces_of_whole is None:
            return np.arange(len(self.faces))
        return self.faces_of_whole

    @cached_property
    def left_out(self) -> NDArray[np.int64]:
        """Faces of the whole mesh that are missing, ascending; empty unless the user asked for it."""
        missing = np.setdiff1d(np.arange(len(self.original.faces)), self.faces_goal)
        return frozen_array(missing, np.int64, (None,))

    @cached_property
    def sha256(self) -> str:
        """Content hash of the shape (name and notices do not count)."""
        return content_sha256("goal-mesh/1", self.vertices, self.faces)

    @cached_property
    def face_normals(self) -> NDArray[np.float64]:
        """(F, 3) outward unit normals."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        unit: NDArray[np.float64] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        return unit

    @cached_property
    def longest_side_mm(self) -> float:
        """Longest side of the axis-aligned bounding box."""
        return float(np.ptp(self.vertices, axis=0).max())
