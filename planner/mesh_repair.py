"""Repairs that do not change the shape: joining, removing what has no area, T-junctions, debris.

Every repair leaves a notice. What cannot be repaired without a choice is left for ``mesh_check`` to refuse.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.mesh_edges import components, edge_table, face_heights
from planner.raw_mesh import TriangleMesh, counted

__all__ = ["JOIN_FRACTION", "repair"]

JOIN_FRACTION = 2e-5
"""Vertices on open edges that are nearer than this fraction of the longest side are one vertex."""

_MOST_OPEN_EDGES = 20_000


def repair(mesh: TriangleMesh, tiny: float) -> TriangleMesh:
    """Repair what can be repaired without changing the shape by more than ``tiny``.

    Args:
        mesh: triangles as read.
        tiny: triangles that are less high than this, and edges shorter than this, are taken out
            (in the unit of the vertices).

    Raises:
        MeshError: no face is left, or needle triangles leave a gap when they are taken out.
    """
    mesh = _drop_unused(mesh, silent=mesh.raw.soup)
    near = JOIN_FRACTION * float(np.ptp(mesh.vertices, axis=0).max(initial=0.0))
    mesh = _join_vertices(mesh, near)
    mesh = _drop_repeated_corners(mesh)
    mesh = _drop_duplicates(mesh)
    mesh = _drop_slivers(mesh, tiny)
    mesh = _split_t_junctions(mesh, max(near, 2.0 * tiny))
    mesh = _drop_debris(mesh)
    return _drop_unused(mesh, silent=True)


def _with(
    mesh: TriangleMesh,
    faces: NDArray[np.int64],
    origin: NDArray[np.int64],
    *notices: str,
) -> TriangleMesh:
    """``mesh`` with other faces and more notices."""
    if not len(faces):
        raise mesh.error("no face with an area is left", "check the mesh in a modelling program")
    return replace(mesh, faces=faces, origin=origin, notices=(*mesh.notices, *notices))


def _drop_unused(mesh: TriangleMesh, *, silent: bool) -> TriangleMesh:
    """Leave out vertices that no face uses, in order."""
    used = np.zeros(len(mesh.vertices), dtype=np.bool_)
    used[mesh.faces] = True
    gone = int((~used).sum())
    if not gone:
        return mesh
    number = np.cumsum(used) - 1
    notices = () if silent else (f"removed {counted(gone, 'vertex', 'vertices')} that no face uses",)
    return replace(
        mesh,
        vertices=mesh.vertices[used],
        faces=number[mesh.faces].astype(np.int64),
        notices=(*mesh.notices, *notices),
    )


def _relabelled(labels: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each node, the first node that has the same label."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    out: NDArray[np.int64] = first[inverse].astype(np.int64)
    return out


def _join_vertices(mesh: TriangleMesh, near: float) -> TriangleMesh:
    """Join equal vertices, where the format repeats them or the mesh falls apart without it.

    A mesh of one piece in a format with shared vertices is left alone: edges that coincide in it without
    being joined are open slits, and the index lists say so.
    """
    soup = mesh.raw.soup
    if not soup and int(_pieces(mesh).max()) == 0:
        return mesh
    points = mesh.vertices + 0.0  # no negative zero
    order = np.lexsort(points.T)
    fresh = np.ones(len(points), dtype=np.bool_)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    labels = np.empty(len(points), dtype=np.int64)
    labels[order] = np.cumsum(fresh)
    keep = _relabelled(labels)
    joined = int((keep != np.arange(len(keep))).sum())
    faces = keep[mesh.faces]
    notices = (
        []
        if soup or not joined
        else [f"joined {counted(joined, 'vertex', 'vertices')} listed more than once"]
    )
    close = _near_open_vertices(points, faces, near)
    if len(close):
        merged = _relabelled(components(len(points), close))
        faces = merged[faces]
        moved = int((merged != np.arange(len(merged))).sum())
        notices.append(
            f"joined {counted(moved, 'vertex', 'vertices')} within {near:.2g} of others on open edges"
        )
    if not joined and not len(close):
        return mesh
    return _drop_unused(_with(mesh, faces, mesh.origin, *notices), silent=True)


def _near_open_vertices(
    points: NDArray[np.float64], faces: NDArray[np.int64], near: float
) -> NDArray[np.int64]:
    """(L, 2) pairs of vertices on open edges that are within ``near`` of each other."""
    from scipy.spatial import cKDTree

    proper = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if not len(proper):
        return np.zeros((0, 2), dtype=np.int64)
    table = edge_table(proper)
    rim = np.unique(table.edges[table.count == 1])
    if not len(rim):
        return np.zeros((0, 2), dtype=np.int64)
    pairs: NDArray[np.int64] = cKDTree(points[rim]).query_pairs(near, output_type="ndarray").astype(np.int64)
    return rim[pairs]


def _drop_repeated_corners(mesh: TriangleMesh) -> TriangleMesh:
    """Leave out triangles that name a vertex twice."""
    wrong = (mesh.faces == np.roll(mesh.faces, 1, axis=1)).any(axis=1)
    if not wrong.any():
        return mesh
    notice = (
        f"removed {counted(int(wrong.sum()), 'face')} without area ({mesh.places(np.flatnonzero(wrong))})"
    )
    return _with(mesh, mesh.faces[~wrong], mesh.origin[~wrong], notice)


def _drop_duplicates(mesh: TriangleMesh) -> TriangleMesh:
    """Leave out triangles that are listed before.

    A twin of opposite winding goes only if all its edges have other faces too; else it is one side of a
    flat double layer, and stays to be refused.
    """
    ordered = np.sort(mesh.faces, axis=1)
    order = np.lexsort(ordered.T)
    repeats = np.zeros(len(order), dtype=np.bool_)
    repeats[1:] = (ordered[order[1:]] == ordered[order[:-1]]).all(axis=1)
    if not repeats.any():
        return mesh
    group = np.empty(len(order), dtype=np.int64)
    group[order] = np.cumsum(~repeats)
    first = _relabelled(group)
    rolled = mesh.faces[
        np.arange(len(first))[:, None], (mesh.faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    ]
    turns = rolled[:, 1] < rolled[:, 2]
    table = edge_table(mesh.faces)
    layer = np.bincount(group)[group]
    shared = (table.count[table.of_face] > layer[:, None]).all(axis=1)
    wrong = (first != np.arange(len(first))) & ((turns == turns[first]) | shared)
    if not wrong.any():
        return mesh
    notice = (
        f"removed {counted(int(wrong.sum()), 'face')} listed before ({mesh.places(np.flatnonzero(wrong))})"
    )
    return _with(mesh, mesh.faces[~wrong], mesh.origin[~wrong], notice)


def _open_length(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Total length of the edges that have one face."""
    table = edge_table(faces)
    ends = vertices[table.edges[table.count == 1]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


def _drop_slivers(mesh: TriangleMesh, tiny: float) -> TriangleMesh:
    """Take out triangles less high than ``tiny``: their short edges shrink to a point, flat ones go."""
    if not (face_heights(mesh.vertices, mesh.faces) < tiny).any():
        return mesh
    before = _open_length(mesh.vertices, mesh.faces)
    table = edge_table(mesh.faces)
    ends = mesh.vertices[table.edges]
    short = table.edges[np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) < tiny]
    faces = _relabelled(components(len(mesh.vertices), short))[mesh.faces]
    low = face_heights(mesh.vertices, faces) < tiny
    places = mesh.places(np.flatnonzero(low))
    notice = f"removed {counted(int(low.sum()), 'needle face')} too thin to be cut ({places})"
    slim = _split_t_junctions(_with(mesh, faces[~low], mesh.origin[~low], notice), 2.0 * tiny)
    if _open_length(slim.vertices, slim.faces) > 1.001 * before + 20.0 * tiny:
        raise mesh.error(
            f"{counted(int(low.sum()), 'needle face')} (less than {tiny:.2g} high) cannot be cut, and taking "
            f"them out would leave gaps ({places})",
            "remesh or merge vertices by distance in a modelling program",
        )
    return slim


def _split_t_junctions(mesh: TriangleMesh, near: float) -> TriangleMesh:
    """Split triangles where an open edge runs along a whole chain of other open edges.

    The chain must start and end at the corners of the edge, so that nothing else than a T-junction fits.
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
    return _with(mesh, np.array(parts, dtype=np.int64), np.array(origin, dtype=np.int64)), count


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


def _pieces(mesh: TriangleMesh) -> NDArray[np.int64]:
    """(F,) number of the piece of each face; faces that share a vertex are of one piece."""
    links = np.concatenate([mesh.faces[:, :2], mesh.faces[:, 1:]])
    of_vertex = components(len(mesh.vertices), links)[mesh.faces[:, 0]]
    pieces: NDArray[np.int64] = np.unique(of_vertex, return_inverse=True)[1].astype(np.int64)
    return pieces


def _drop_debris(mesh: TriangleMesh) -> TriangleMesh:
    """Leave out open pieces of a few faces beside a main piece that has nearly all faces."""
    pieces = _pieces(mesh)
    sizes = np.bincount(pieces)
    if len(sizes) == 1:
        return mesh
    table = edge_table(mesh.faces)
    is_open = np.zeros(len(sizes), dtype=np.bool_)
    is_open[pieces[(table.count[table.of_face] == 1).any(axis=1)]] = True
    small = is_open & (sizes <= max(2.0, 0.02 * len(pieces)))
    if not small.any() or sizes[small].sum() > 0.05 * len(pieces):
        return mesh
    gone = small[pieces]
    notice = f"removed {counted(int(small.sum()), 'stray piece')} ({mesh.places(np.flatnonzero(gone))})"
    return _with(mesh, mesh.faces[~gone], mesh.origin[~gone], notice)
