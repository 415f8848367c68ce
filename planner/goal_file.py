"""The goal mesh on disk: ``goal.ply``, binary, double precision, faces and vertices in their order."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numpy as np

from planner.atomic_file import write_atomic
from planner.errors import FormatError, MeshError
from planner.goal_mesh import GoalMesh
from planner.mesh_ply import read_ply

__all__ = ["read_goal_ply", "write_goal_ply"]

_HEADER = """ply
format binary_little_endian 1.0
comment metal-blossom goal mesh, mm
element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
end_header
"""


def write_goal_ply(goal: GoalMesh, path: str | os.PathLike[str]) -> None:
    """Write ``goal`` as a PLY file; equal meshes give equal bytes.

    Raises:
        OSError: the file cannot be written.
    """
    rows = np.zeros(len(goal.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"] = 3
    rows["corners"] = goal.faces
    header = _HEADER.format(vertices=len(goal.vertices), faces=len(goal.faces))
    write_atomic(path, header.encode("ascii") + goal.vertices.astype("<f8").tobytes() + rows.tobytes())


def read_goal_ply(path: str | os.PathLike[str]) -> GoalMesh:
    """Read a goal mesh that ``write_goal_ply`` wrote; vertices and faces are bit for bit the same.

    Notices are not part of the file.

    Raises:
        FormatError: the file is missing, damaged or no triangle mesh.
    """
    file = Path(path)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise FormatError(
            f"{path}: cannot be read ({error.strerror}); name the goal.ply of a bundle"
        ) from error
    try:
        raw = read_ply(data, os.fspath(path))
    except MeshError as error:
        raise FormatError(str(error)) from error
    if (raw.sizes != 3).any() or not np.isfinite(raw.vertices).all():
        raise FormatError(
            f"{path}: expected triangles with finite corners; make the bundle again or restore the file"
        )
    return GoalMesh(
        raw.vertices,
        raw.corners.reshape(-1, 3),
        name=file.stem,
        source_sha256=hashlib.sha256(data).hexdigest(),
    )
