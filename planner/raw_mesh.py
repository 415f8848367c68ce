"""What a mesh file says, before anything is checked or repaired."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.errors import MeshError

__all__ = ["MOST_FACES", "RawMesh", "TriangleMesh", "counted", "file_error"]

MOST_FACES = 3_000_000
"""Files with more faces are refused: reading them would need gigabytes of memory."""


def file_error(source: str, what: str, cure: str) -> MeshError:
    """The error for ``source``: ``what`` is wrong and where, and ``cure`` says what to do next."""
    return MeshError(f"{source}: {what}; {cure}")


def counted(count: int, one: str, many: str | None = None) -> str:
    """``count`` things in words: "1 edge", "3 edges"."""
    return f"{count} {one if count == 1 else many or one + 's'}"


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Vertices and polygons as the file has them.

    Attributes:
        source: the path as given, for messages.
        vertices: (V, 3) coordinates in the file's unit.
        corners: (N,) vertex indices of all polygons, one after another.
        sizes: (P,) number of corners of each polygon.
        lines: (P,) line of the file on which each polygon stands, or None for binary files.
        soup: the format repeats vertices (STL, glTF), so equal positions mean one vertex.
        single_precision: the coordinates were stored as 32-bit numbers.
        unit_mm: length in mm of the unit that the format prescribes; None if it prescribes none.
        notices: what the reader passed over, in words.
    """

    source: str
    vertices: NDArray[np.float64]
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    lines: NDArray[np.int64] | None = None
    soup: bool = False
    single_precision: bool = False
    unit_mm: float | None = None
    notices: tuple[str, ...] = ()

    def place(self, polygon: int) -> str:
        """Where polygon ``polygon`` (from 0) stands, in words that count from 1."""
        line = "" if self.lines is None else f" (line {self.lines[polygon]})"
        return f"face {polygon + 1}{line}"


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles on their way to a goal mesh.

    Attributes:
        vertices: (V, 3) positions.
        faces: (F, 3) vertex indices.
        origin: (F,) polygon of ``raw`` that each triangle came from, -1 where a coarsening made it.
        raw: the file's content, for messages.
        notices: what was changed so far, in words.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    origin: NDArray[np.int64]
    raw: RawMesh
    notices: tuple[str, ...] = field(default=())

    def places(self, faces: NDArray[np.int64] | list[int], most: int = 3) -> str:
        """Where ``faces`` stand in the file, at most ``most`` of them by name, in words."""
        polygons = list(dict.fromkeys(int(self.origin[f]) for f in faces))
        if any(p < 0 for p in polygons):
            return f"{len(faces)} faces of the coarsened mesh"
        named = ", ".join(self.raw.place(p) for p in polygons[:most])
        rest = len(polygons) - most
        return f"{named} and {rest} more" if rest > 0 else named

    def error(self, what: str, cure: str) -> MeshError:
        """The error that says ``what`` is wrong with this mesh and how to cure it."""
        return file_error(self.raw.source, what, cure)
