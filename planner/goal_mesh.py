"""The goal mesh: the shape to be folded, checked and scaled."""

from __future__ import annotations

from dataclasses import dataclass
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
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    name: str = "goal"
    notices: tuple[str, ...] = ()
    source_sha256: str = ""

    def __post_init__(self) -> None:
        """Freeze the arrays and check their shapes."""
        object.__setattr__(self, "vertices", frozen_array(self.vertices, np.float64, (None, 3)))
        object.__setattr__(self, "faces", frozen_array(self.faces, np.int64, (None, 3)))

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
