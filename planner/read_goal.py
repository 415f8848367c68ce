"""A mesh file to a goal mesh: read, repair or refuse, coarsen, scale."""

from __future__ import annotations

import hashlib
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.fold_plan import MachineLimits
from planner.goal_mesh import GoalMesh
from planner.mesh_check import oriented_surface, require_foldable
from planner.mesh_coarsen import coarsen
from planner.mesh_polygons import triangulate
from planner.mesh_read import read_mesh
from planner.mesh_repair import repair
from planner.mesh_size import kerf_notices, require_fit, require_precision, scale_factor
from planner.raw_mesh import RawMesh, TriangleMesh, file_error

__all__ = ["MOST_FACES_UNASKED", "read_goal"]

MOST_FACES_UNASKED = 20_000
"""Finer meshes are refused unless a face budget is given: nobody folds them."""

_FAR_SIZES = 100.0
"""Meshes further from the origin than this many times their size are moved to it."""


def read_goal(
    path: str | os.PathLike[str],
    *,
    size_mm: float | None = None,
    scale: float | None = None,
    max_faces: int | None = None,
    limits: MachineLimits | None = None,
) -> GoalMesh:
    """Read the shape to be folded from a mesh file.

    A mesh with nothing wrong keeps its vertices, faces and their order. Whatever is repaired, coarsened or
    scaled is said in the ``notices`` of the result.

    Args:
        path: STL (text or binary), OBJ, PLY, OFF, glTF or GLB.
        size_mm: longest side of the part in mm; taken as meant.
        scale: factor from the file's numbers to mm, instead of ``size_mm``. Without either the numbers are
            mm (glTF: metres), and a size that suggests another unit is refused.
        max_faces: face budget; a finer mesh is coarsened to it. None: nothing is coarsened.
        limits: sheet and kerf that the size is checked against; None means the defaults.

    Raises:
        MeshError: the file cannot be read or the mesh not be folded from one sheet; the message names the
            file, the place and the cure.
    """
    limits = MachineLimits() if limits is None else limits
    raw, data = read_mesh(path)
    count = int(np.maximum(raw.sizes - 2, 0).sum())
    if max_faces is not None and max_faces < 1:
        raise file_error(
            raw.source, f"a budget of {max_faces} faces makes no sense", "give --faces 4 or more"
        )
    if max_faces is None and count > MOST_FACES_UNASKED:
        raise file_error(
            raw.source,
            f"{count} faces are far more than can be folded (more than {MOST_FACES_UNASKED} are not tried)",
            "coarsen it with --faces N, for example --faces 350",
        )
    used = raw.vertices[raw.corners]
    longest = float(np.ptp(used, axis=0).max()) if len(used) else 0.0
    factor, _ = scale_factor(raw, longest, size_mm, scale)
    require_precision(raw, factor, limits)
    raw, moved = _centred(raw)
    mesh = triangulate(raw)
    mesh = replace(mesh, notices=(*moved, *mesh.notices))
    tiny = 0.1 * limits.kerf / factor
    fine = max_faces is not None and len(mesh.faces) > max_faces
    surface = oriented_surface(repair(mesh, 1e-9 * longest if fine else tiny))
    longest = float(np.ptp(surface.vertices, axis=0).max())
    factor, _ = scale_factor(raw, longest, size_mm, scale)
    require_fit(raw.source, factor * longest, 0.0, limits)

    def foldable(candidate: TriangleMesh) -> TriangleMesh:
        clean = oriented_surface(repair(candidate, tiny)) if fine else candidate
        require_foldable(clean, limits.kerf / factor)
        return clean

    if max_faces is not None and len(surface.faces) > max_faces:
        surface = coarsen(surface, max_faces, foldable)
    else:
        surface = foldable(surface)
    return _sized(surface, path, data, size_mm, scale, limits)


def _centred(raw: RawMesh) -> tuple[RawMesh, tuple[str, ...]]:
    """Move a mesh that is very far from the origin to it; the shape stays, the numbers become exact."""
    used = raw.vertices[raw.corners]
    if not len(used):
        return raw, ()
    low, high = used.min(axis=0), used.max(axis=0)
    middle = (low + high) / 2.0
    if float(np.abs(middle).max()) <= _FAR_SIZES * float((high - low).max()):
        return raw, ()
    where = ", ".join(f"{c:.6g}" for c in middle)
    return replace(raw, vertices=raw.vertices - middle), (f"moved the mesh from ({where}) to the origin",)


def _sized(
    mesh: TriangleMesh,
    path: str | os.PathLike[str],
    data: bytes,
    size_mm: float | None,
    scale: float | None,
    limits: MachineLimits,
) -> GoalMesh:
    """The goal mesh in mm, after the checks that need its size."""
    longest = float(np.ptp(mesh.vertices, axis=0).max())
    factor, words = scale_factor(mesh.raw, longest, size_mm, scale)
    in_mm = mesh if factor == 1.0 else replace(mesh, vertices=mesh.vertices * factor)
    a, b, c = (in_mm.vertices[in_mm.faces[:, k]] for k in range(3))
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)
    require_fit(mesh.raw.source, factor * longest, area, limits)
    return GoalMesh(
        in_mm.vertices,
        in_mm.faces,
        name=Path(path).stem,
        notices=(*in_mm.notices, *words, *kerf_notices(in_mm, limits)),
        source_sha256=hashlib.sha256(data).hexdigest(),
    )
