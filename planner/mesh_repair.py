"""Repairs that do not change the shape: joining, removing what has no area, T-junctions, debris.

Every repair leaves a notice. What cannot be repaired without a choice is left for ``mesh_check`` to refuse.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.mesh_edges import components, edge_table, face_heights
from planner.mesh_t_junctions import split_t_junctions
from planner.raw_mesh import TriangleMesh, counted

__all__ = ["JOIN_FRACTION", "repair"]

JOIN_FRACTION = 2e-5
"""Vertices on open edges that are nearer than this fraction of the longest side are one vertex."""


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
    mesh = _drop_duplicates(_drop_repeated_corners(mesh))
    if mesh.raw.soup or int(_pieces(mesh).max()) > 0:
        # A mesh of one piece in a format with shared vertices is left alone: edges that coincide in it
        # without being joined are open slits, and its index lists say so.
        mesh = _drop_duplicates(_drop_repeated_corners(_join_equal(mesh)))
        mesh = _drop_duplicates(_drop_repeated_corners(_join_near(mesh, near)))
    else:
        mesh = _tell_slits(mesh)
    mesh = _drop_slivers(mesh, tiny)
    mesh = split_t_junctions(mesh, max(near, 2.0 * tiny))
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


def _tell_slits(mesh: TriangleMesh) -> TriangleMesh:
    """Say how many vertices coincide without being joined."""
    distinct = len(np.unique(mesh.vertices + 0.0, axis=0))
    extra = len(mesh.vertices) - distinct
    if not extra:
        return mesh
    notice = (
        f"kept open slits: {counted(extra, 'vertex', 'vertices')} at the place of another "
        "(to close them, merge vertices by distance in a modelling program)"
    )
    return replace(mesh, notices=(*mesh.notices, notice))


def _join_equal(mesh: TriangleMesh) -> TriangleMesh:
    """Let vertices at equal positions be one vertex."""
    points = mesh.vertices + 0.0  # no negative zero
    order = np.lexsort(points.T)
    fresh = np.ones(len(points), dtype=np.bool_)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    labels = np.empty(len(points), dtype=np.int64)
    labels[order] = np.cumsum(fresh)
    return _merged(mesh, labels, "" if mesh.raw.soup else "listed more than once")


def _join_near(mesh: TriangleMesh, near: float) -> TriangleMesh:
    """Let vertices on open edges that are within ``near`` of each other be one vertex."""
    close = _near_open_vertices(mesh.vertices, mesh.faces, near)
    labels = components(len(mesh.vertices), close)
    return _merged(mesh, labels, f"within {near:.2g} of others on open edges")


def _merged(mesh: TriangleMesh, labels: NDArray[np.int64], which: str) -> TriangleMesh:
    """Join vertices of equal label; ``which`` says in words which these are, "" says nothing."""
    keep = _relabelled(labels)
    gone = int((keep != np.arange(len(keep))).sum())
    if not gone:
        return mesh
    notices = (f"joined {counted(gone, 'vertex', 'vertices')} {which}",) if which else ()
    return _drop_unused(_with(mesh, keep[mesh.faces], mesh.origin, *notices), silent=True)


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
    slim = split_t_junctions(_with(mesh, faces[~low], mesh.origin[~low], notice), 2.0 * tiny)
    if _open_length(slim.vertices, slim.faces) > 1.001 * before + 20.0 * tiny:
        raise mesh.error(
            f"{counted(int(low.sum()), 'needle face')} (less than {tiny:.2g} high) cannot be cut, and taking "
            f"them out would leave gaps ({places})",
            "remesh or merge vertices by distance in a modelling program",
        )
    return slim


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
