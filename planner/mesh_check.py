"""What a mesh must be to be folded from one sheet, and what is wrong with one that is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.mesh_edges import EdgeTable, components, edge_table, face_heights, fold_angles
from planner.mesh_intersect import intersecting_pairs
from planner.raw_mesh import TriangleMesh, counted

__all__ = ["STEEPEST_FOLD_RAD", "oriented_surface", "require_foldable"]

STEEPEST_FOLD_RAD = float(np.radians(179.0))
"""Folds beyond this angle are hems: both sheets lie on one another."""


def oriented_surface(mesh: TriangleMesh) -> TriangleMesh:
    """``mesh`` with one winding, outward if it is closed, after all checks of how it hangs together.

    Raises:
        MeshError: several pieces, an edge with more than two faces, faces that only touch in a vertex, or
            a one-sided surface.
    """
    table = edge_table(mesh.faces)
    _require_one_piece(mesh, table)
    crowded = np.flatnonzero(table.count > 2)
    if len(crowded):
        faces = np.flatnonzero((table.of_face == crowded[0]).any(axis=1))
        raise mesh.error(
            f"{counted(len(crowded), 'edge')} with more than two faces, the first at {mesh.places(faces, 4)}",
            "take out inner walls and branches: a sheet has one face on either side of an edge",
        )
    _require_discs(mesh, table)
    return _oriented(mesh, table)


def require_foldable(mesh: TriangleMesh, kerf: float) -> None:
    """Check the shape of an oriented surface.

    Args:
        mesh: the surface.
        kerf: width of a cut in the unit of the vertices.

    Raises:
        MeshError: faces too thin to be cut, folds of 180 degrees, or faces that pass through others.
    """
    heights = face_heights(mesh.vertices, mesh.faces)
    thin = np.flatnonzero(heights < 0.1 * kerf)
    if len(thin):
        raise mesh.error(
            f"{counted(len(thin), 'face')} less than a tenth of the kerf high "
            f"(smallest {heights[thin].min():.2g}), the first is {mesh.places(thin[:1])}",
            "make the part larger (--size), or remesh it in a modelling program",
        )
    table = edge_table(mesh.faces)
    folds = np.abs(fold_angles(mesh.vertices, mesh.faces, table))
    flat = np.flatnonzero(folds > STEEPEST_FOLD_RAD)
    if len(flat):
        raise mesh.error(
            f"{counted(len(flat), 'edge')} folded by more than {np.degrees(STEEPEST_FOLD_RAD):.0f} degrees, "
            f"the first between {_both(mesh, table.pairs[flat[0]])}",
            "a laser cannot form a hem: open the fold or take one of the layers out",
        )
    pairs = intersecting_pairs(mesh.vertices, mesh.faces)
    if len(pairs):
        raise mesh.error(
            f"the surface passes through or lies on itself at {counted(len(pairs), 'pair')} of faces, "
            f"the first {_both(mesh, pairs[0])}",
            "a sheet cannot do that: separate the parts in a modelling program",
        )


def _both(mesh: TriangleMesh, pair: NDArray[np.int64]) -> str:
    """Both faces of a pair, in words."""
    if (mesh.origin[pair] < 0).any():
        return "two faces of the coarsened mesh"
    names = (mesh.raw.place(int(mesh.origin[pair[0]])), mesh.raw.place(int(mesh.origin[pair[1]])))
    return f"{names[0]} and {names[1]}"


def _require_one_piece(mesh: TriangleMesh, table: EdgeTable) -> None:
    """Refuse a mesh of several pieces."""
    links = np.concatenate([mesh.faces[:, :2], mesh.faces[:, 1:]])
    label = components(len(mesh.vertices), links)[mesh.faces[:, 0]]
    names, first, sizes = np.unique(label, return_index=True, return_counts=True)
    if len(names) > 1:
        closed = not (table.count == 1).any()
        order = np.argsort(first)
        listed = ", ".join(f"{sizes[k]} faces from {mesh.places([int(first[k])])}" for k in order[:4])
        raise mesh.error(
            f"the mesh has {len(names)} separate pieces ({listed}{', ...' if len(names) > 4 else ''})",
            "one sheet folds one piece: export each as a file of its own"
            + (", take inner shells out" if closed else ""),
        )


def _require_discs(mesh: TriangleMesh, table: EdgeTable) -> None:
    """Refuse a mesh in which faces meet in a vertex without sharing an edge there."""
    # corners of one vertex hang together where their faces share an edge
    corner_of = 3 * np.arange(len(mesh.faces))[:, None] + np.arange(3)
    one, two = table.pairs[:, 0], table.pairs[:, 1]
    links = []
    for end in table.edges[table.pair_edge].T:
        at_one = corner_of[one][mesh.faces[one] == end[:, None]]
        at_two = corner_of[two][mesh.faces[two] == end[:, None]]
        links.append(np.column_stack([at_one, at_two]))
    label = components(3 * len(mesh.faces), np.concatenate(links))
    fans = np.unique(label, return_index=True)[1]  # one corner of every fan of faces around a vertex
    split = np.flatnonzero(np.bincount(mesh.faces.ravel()[fans]) > 1)
    if len(split):
        where = ", ".join(f"{c:g}" for c in mesh.vertices[split[0]])
        faces = np.flatnonzero((mesh.faces == split[0]).any(axis=1))
        raise mesh.error(
            f"faces touch in {counted(len(split), 'vertex', 'vertices')} without a common edge, "
            f"the first at ({where}) between {mesh.places(faces)}",
            "join the parts along an edge or separate them",
        )


def _oriented(mesh: TriangleMesh, table: EdgeTable) -> TriangleMesh:
    """Turn faces until all windings agree; a closed surface then faces outward."""
    count = len(mesh.faces)
    # two copies of every face, as it is and turned; neighbours that agree link equal copies
    one, two = table.pairs[:, 0], table.pairs[:, 1]
    cross = np.where(table.same_way, count, 0)
    links = np.concatenate(
        [np.column_stack([one, two + cross]), np.column_stack([one + count, two + count - cross])]
    )
    label = components(2 * count, links)
    if label[0] == label[count]:
        raise mesh.error(
            "the surface is one-sided, like a Moebius strip or a Klein bottle",
            "cut it open: inside and outside must differ",
        )
    turned = label[:count] != label[0]
    if 2 * int(turned.sum()) > count:
        turned = ~turned
    notices = []
    if turned.any():
        notices.append(f"turned {int(turned.sum())} of {count} faces so that all windings agree")
    faces = np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)
    if not (table.count == 1).any() and _volume(mesh.vertices, faces) < 0.0:
        notices.append("turned the mesh inside out: its faces pointed inward")
        faces = faces[:, ::-1]
    if not notices:
        return mesh
    return replace(mesh, faces=np.ascontiguousarray(faces), notices=(*mesh.notices, *notices))


def _volume(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Signed volume by the divergence theorem."""
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
