"""Coarsening to a face budget by quadric edge collapse (the only module that loads pymeshlab, GPL-3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import MeshError
from planner.mesh_edges import boundary_loops, edge_table
from planner.raw_mesh import TriangleMesh

__all__ = ["coarsen"]

_STOPOVER = 16
"""Much finer meshes are first reduced to this many times the budget, so that the tries are quick."""


def coarsen(
    mesh: TriangleMesh, max_faces: int, accept: Callable[[TriangleMesh], TriangleMesh]
) -> TriangleMesh:
    """Reduce ``mesh`` to at most ``max_faces`` faces and keep planar regions, borders and topology.

    Source: Garland and Heckbert 1997, as in MeshLab's "quadric edge collapse decimation". A collapse does
    not see distant parts of the surface, so several settings are tried; of those that
    ``accept`` has no objection to, the one nearest to the original is taken.

    Args:
        mesh: an oriented manifold.
        max_faces: largest number of faces of the result.
        accept: checks (and may repair) a candidate; raises MeshError to refuse it.

    Raises:
        MeshError: the budget is below 4 or cannot be reached, or every candidate was refused.
    """
    if max_faces < 4:
        raise mesh.error(f"a budget of {max_faces} faces is too small", "give at least 4 (--faces)")
    count = len(mesh.faces)
    centre = mesh.vertices.mean(axis=0)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    points, faces = (mesh.vertices - centre) / size, mesh.faces
    if count > 2 * _STOPOVER * max_faces:
        points, faces = _collapse(
            points, faces, _STOPOVER * max_faces, 0.3, optimal=True, planar=1e-5, rim=True
        )
    shape = _topology(mesh)
    refusal: MeshError | None = None
    fewest = count
    for fewer, rim in product((1.0, 0.97, 0.9, 0.8), (True, False)):
        best: tuple[float, TriangleMesh] | None = None
        for planar, quality, optimal in product((1e-5, 1e-3), (0.3, 0.8), (True, False)):
            target = max(4, int(fewer * max_faces))
            some, triangles = _collapse(
                points, faces, target, quality, optimal=optimal, planar=planar, rim=rim
            )
            fewest = min(fewest, len(triangles))
            if not 0 < len(triangles) <= max_faces:
                continue
            none = np.full(len(triangles), -1, dtype=np.int64)
            candidate = replace(mesh, vertices=some * size + centre, faces=triangles, origin=none)
            try:
                good = accept(candidate)
                if _topology(good) != shape:
                    raise mesh.error("holes or handles got lost", "allow more faces (--faces)")
            except MeshError as error:
                refusal = error
                continue
            moved = _distance(points, faces, (good.vertices - centre) / size, good.faces)
            if best is None or moved < best[0]:
                best = moved, good
        if best is not None:
            notice = (
                f"coarsened from {count} to {len(best[1].faces)} faces; the surface moved by up to "
                f"{100.0 * best[0]:.2g} % of the longest side"
            )
            return replace(best[1], notices=(*best[1].notices, notice))
    if refusal is None:
        raise mesh.error(
            f"{count} faces cannot be reduced to {max_faces} without changing the topology "
            f"(fewest: {fewest})",
            f"allow more faces (--faces {max(fewest, 2 * max_faces)}) or simplify the mesh first",
        )
    reason = str(refusal).removeprefix(f"{mesh.raw.source}: ")
    raise mesh.error(
        f"no way to coarsen {count} to {max_faces} faces gave a mesh that can be folded (last: {reason})",
        f"try another budget, such as --faces {2 * max_faces}",
    )


def _topology(mesh: TriangleMesh) -> tuple[int, int]:
    """Euler characteristic and number of boundary curves."""
    table = edge_table(mesh.faces)
    return len(np.unique(mesh.faces)) - len(table.edges) + len(mesh.faces), boundary_loops(table)


def _mesh_set(*meshes: tuple[NDArray[np.float64], NDArray[np.int64]]) -> Any:  # noqa: ANN401 -- a foreign type
    """A MeshLab document with these meshes."""
    import pymeshlab

    document = pymeshlab.MeshSet(verbose=False)
    for points, faces in meshes:
        document.add_mesh(pymeshlab.Mesh(vertex_matrix=points, face_matrix=faces.astype(np.int32)))
    return document


def _collapse(
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    target: int,
    quality: float,
    *,
    optimal: bool,
    planar: float,
    rim: bool,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and faces after the collapse of edges down to ``target`` faces; ``rim`` keeps open edges."""
    document = _mesh_set((points, faces))
    document.meshing_decimation_quadric_edge_collapse(
        targetfacenum=target,
        qualitythr=quality,
        preserveboundary=rim,
        boundaryweight=10.0,
        preservenormal=True,
        preservetopology=True,
        optimalplacement=optimal,
        planarquadric=True,
        planarweight=planar,
        autoclean=True,
    )
    document.meshing_remove_unreferenced_vertices()
    current = document.current_mesh()
    return (
        np.array(current.vertex_matrix(), dtype=np.float64),
        np.array(current.face_matrix(), dtype=np.int64).reshape(-1, 3),
    )


def _distance(
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    coarse_points: NDArray[np.float64],
    coarse_faces: NDArray[np.int64],
) -> float:
    """Largest distance of the vertices of a mesh from a coarser one."""
    import pymeshlab

    document = _mesh_set((points, faces), (coarse_points, coarse_faces))
    result = document.get_hausdorff_distance(
        sampledmesh=0,
        targetmesh=1,
        samplevert=True,
        samplenum=len(points),  # every vertex
        maxdist=pymeshlab.PercentageValue(100.0),
    )
    return float(result["max"])
