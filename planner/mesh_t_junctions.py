"""T-junctions: an edge that meets a chain of shorter edges without being joined to them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.mesh_edges import edge_table
from planner.raw_mesh import TriangleMesh, counted

__all__ = ["split_t_junctions"]

_MOST_OPEN_EDGES = 20_000


def split_t_junctions(mesh: TriangleMesh, near: float) -> TriangleMesh:
    """Split triangles where an open edge runs along a whole chain of other open edges.

    The chain must start and end at the corners of the edge, so that nothing else than a T-junction fits.

    Args:
        mesh: triangles.
        near: largest distance of the chain from the edge.
    """
    split = 0
    for _ in range(20):
        table = edge_table(mesh.faces)
        open_edges = np.flatnonzero(table.count == 1)
        if not 3 <= len(open_edges) <= _MOST_OPEN_EDGES:
            break
        rounds = _split_once(mesh, table.of_face, table.edges[open_edges], open_edges, near)
        if rounds is None:
            break
        mesh, count = rounds
        split += count
    if split:
        return replace(mesh, notices=(*mesh.notices, f"joined {counted(split, 'T-junction')}"))
    return mesh


def _split_once(
    mesh: TriangleMesh,
    of_face: NDArray[np.int64],
    ends: NDArray[np.int64],
    open_edges: NDArray[np.int64],
    near: float,
) -> tuple[TriangleMesh, int] | None:
    """Split at most one edge of every triangle; None if there is nothing to split."""
    from scipy.spatial import cKDTree

    rim = np.unique(ends)
    tree = cKDTree(mesh.vertices[rim])
    is_open = {tuple(e) for e in ends.tolist()}
    open_set = np.zeros(int(of_face.max()) + 1, dtype=np.bool_)
    open_set[open_edges] = True
    parts: list[list[int]] = []
    origin: list[int] = []
    count = 0
    for face, corners in enumerate(mesh.faces.tolist()):
        chain: list[int] = []
        for k in range(3):
            if open_set[of_face[face, k]]:
                a, b, c = corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]
                chain = _chain_along(mesh.vertices, rim, tree, is_open, (a, b, c), near)
                if chain:
                    break
        if not chain:
            parts.append(corners)
            origin.append(int(mesh.origin[face]))
            continue
        count += len(chain)
        run = [a, *chain, b]
        parts.extend([p, q, c] for p, q in pairwise(run))
        origin.extend([int(mesh.origin[face])] * (len(run) - 1))
    if not count:
        return None
    faces, origins = np.array(parts, dtype=np.int64), np.array(origin, dtype=np.int64)
    return replace(mesh, faces=faces, origin=origins), count


def _chain_along(
    vertices: NDArray[np.float64],
    rim: NDArray[np.int64],
    tree: object,
    is_open: set[tuple[int, ...]],
    corners: tuple[int, int, int],
    near: float,
) -> list[int]:
    """Vertices of the open edges that run from a to b along the edge (a, b) of triangle (a, b, c)."""
    a, b, c = corners
    start, side = vertices[a], vertices[b] - vertices[a]
    length = float(np.linalg.norm(side))
    found = rim[tree.query_ball_point(start + side / 2.0, length / 2.0 + near)]  # type: ignore[attr-defined]  # scipy is imported where it is used
    inner = []
    for vertex in np.sort(found).tolist():
        if vertex in (a, b, c):
            continue
        away = vertices[vertex] - start
        along = float(away @ side) / length
        if near < along < length - near and float(np.linalg.norm(away - side * along / length)) <= near:
            inner.append((along, vertex))
    run = [a, *(v for _, v in sorted(inner)), b]
    links = [(min(p, q), max(p, q)) in is_open for p, q in pairwise(run)]
    return run[1:-1] if len(run) > 2 and all(links) else []
