"""The arrays of the kernels, filled for a dual graph or for loose triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner._kernels import net_arrays as k
from planner._kernels.net_arrays import NetArrays
from planner.dual_graph import DualGraph

__all__ = ["graph_arrays", "triangle_arrays"]


def graph_arrays(graph: DualGraph, tree: NDArray[np.bool_] | None = None) -> NetArrays:
    """Arrays for a dual graph and a tree (M,), nothing laid out yet."""
    local = graph.flat_corners
    edge = np.zeros((len(graph.faces), k.EDGES), dtype=np.int64)
    edge[:, k.FACES : k.FACES + 2] = graph.faces
    edge[:, k.SLOTS : k.SLOTS + 2] = graph.slots
    edge[:, k.FLAT] = graph.flat
    edge[:, k.FROZEN] = graph.flat
    if tree is not None:
        edge[:, k.TREE] = tree
    arrays = _arrays(local, graph.side_length, edge, graph.turn)
    arrays.real[:-1, k.LOCAL : k.LOCAL + 6] = local.reshape(-1, 6)
    arrays.node[k.SIDES : k.SIDES + 3] = graph.face_edges.T
    return arrays


def triangle_arrays(corners: NDArray[np.float64]) -> NetArrays:
    """Arrays for counter-clockwise triangles (F, 3, 2) where they are, F > 0; no edges, an empty grid."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    arrays = _arrays(corners, sides, np.zeros((0, k.EDGES), dtype=np.int64), np.zeros((0, 2)))
    arrays.real[:-1, k.CORNER : k.CORNER + 6] = corners.reshape(-1, 6)
    arrays.real[:-1, k.CENTRE : k.CENTRE + 2] = corners.mean(axis=1)
    return arrays


def _arrays(
    corners: NDArray[np.float64],
    sides: NDArray[np.float64],
    edge: NDArray[np.int64],
    turn: NDArray[np.float64],
) -> NetArrays:
    """What both need: sizes of the faces, and a grid with room for each of them in any pose."""
    faces = len(corners)
    longest = sides.max(axis=1)
    cell = max(float(longest.mean()), float(longest.max()) / 16.0)
    per_face = (np.floor(longest / cell).astype(np.int64) + 2) ** 2
    real = np.zeros((faces + 1, k.REALS))
    real[:-1, k.SIDE : k.SIDE + 3] = sides
    real[:-1, k.RADIUS] = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    real[:, k.CELL] = cell
    node = np.zeros((k.NODES, faces), dtype=np.int64)
    node[k.FIRST, 1:] = np.cumsum(per_face)[:-1]
    return NetArrays(
        real=real,
        node=node,
        edge=edge,
        turn=np.array(turn),
        head=np.full(1 << max(4, int(np.ceil(np.log2(4 * faces)))), -1, dtype=np.int64),
        entry=np.zeros((int(per_face.sum()), 4), dtype=np.int64),
        number=np.zeros(k.NUMBERS, dtype=np.int64),
    )
