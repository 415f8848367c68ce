"""Shapes folded from flat panels: each panel hangs on an edge of another and is turned about it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["Mesh", "PanelModel"]

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices (V, 3) in mm and triangles (F, 3), counter-clockwise seen from outside."""


def _corner_quality(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    """Signed area over squared longest side of a triangle in the plane: at most 0 if it is not an ear."""
    (ux, uy), (vx, vy) = b - a, c - a
    sides = (np.sum((b - a) ** 2), np.sum((c - b) ** 2), np.sum((a - c) ** 2))
    return float((ux * vy - uy * vx) / max(sides))


def _ear_clip(outline: NDArray[np.float64]) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon (K, 2), counter-clockwise; the best shaped ear goes first."""
    ring = list(range(len(outline)))
    triangles = []
    while len(ring) > 3:
        best, best_quality = -1, 1e-9
        for k in range(len(ring)):
            i, j, m = ring[k - 1], ring[k], ring[(k + 1) % len(ring)]
            quality = _corner_quality(outline[i], outline[j], outline[m])
            if quality <= best_quality:
                continue
            others = (n for n in ring if n not in (i, j, m))
            inside = any(
                min(
                    _corner_quality(outline[i], outline[j], outline[n]),
                    _corner_quality(outline[j], outline[m], outline[n]),
                    _corner_quality(outline[m], outline[i], outline[n]),
                )
                >= -1e-9
                for n in others
            )
            if not inside:
                best, best_quality = k, quality
        if best < 0:
            raise ValueError("the outline of a panel crosses itself")
        triangles.append((ring[best - 1], ring[best], ring[(best + 1) % len(ring)]))
        del ring[best]
    triangles.append((ring[0], ring[1], ring[2]))
    return triangles


class PanelModel:
    """Flat panels joined by hinges, already folded; the outer side of the first panel is +z."""

    def __init__(self, outline: Sequence[tuple[float, float]]) -> None:
        """Start from the first panel: its outline in the plane z = 0, mm, counter-clockwise."""
        flat = np.array(outline, dtype=np.float64)
        corners = np.column_stack([flat, np.zeros(len(flat))])
        self._corners: list[NDArray[np.float64]] = [corners]
        self._normals: list[NDArray[np.float64]] = [np.array([0.0, 0.0, 1.0])]
        self._triangles: list[list[tuple[int, int, int]]] = [_ear_clip(flat)]

    def attach(self, panel: int, edge: int, outline: Sequence[tuple[float, float]], angle_deg: float) -> int:
        """Hang a new panel on an edge of a panel and fold it.

        Args:
            panel: number of the panel that carries the new one.
            edge: which of its edges; edge k runs from corner k to the next one. Edge 0 of a new panel is
                its hinge, edge 1 starts where the hinge of the carrier starts.
            outline: corners of the new panel beyond the hinge as (along, out), mm: ``along`` from the start
                of the edge, ``out`` away from the carrier; in order from the start of the edge to its end.
            angle_deg: positive folds the panel towards the carrier's outer side (valley).

        Returns:
            The number of the new panel.
        """
        ring = self._corners[panel]
        start, end = ring[edge], ring[(edge + 1) % len(ring)]
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        out_flat = np.cross(along, self._normals[panel])
        angle = np.radians(angle_deg)
        out = np.cos(angle) * out_flat + np.sin(angle) * self._normals[panel]
        normal = np.cos(angle) * self._normals[panel] - np.sin(angle) * out_flat
        beyond = [start + u * along + v * out for u, v in outline]
        self._corners.append(np.array([end, start, *beyond]))
        self._normals.append(normal)
        flat = np.array([(length, 0.0), (0.0, 0.0), *outline]) * [1.0, -1.0]
        self._triangles.append(_ear_clip(flat))
        return len(self._corners) - 1

    def edge_length_mm(self, panel: int, edge: int) -> float:
        """Length of an edge of a panel."""
        ring = self._corners[panel]
        return float(np.linalg.norm(ring[(edge + 1) % len(ring)] - ring[edge]))

    def mesh(self, *, turned_deg: float = 0.0) -> Mesh:
        """All panels as one triangle mesh; corners at the same place (1e-6 mm) become one vertex.

        Args:
            turned_deg: turn of the whole shape about the x axis, so that it stands as one expects.
        """
        cos, sin = np.cos(np.radians(turned_deg)), np.sin(np.radians(turned_deg))
        turn = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]])
        numbers: dict[tuple[float, ...], int] = {}
        vertices: list[NDArray[np.float64]] = []
        faces = []
        for corners, triangles in zip(self._corners, self._triangles, strict=True):
            index = []
            for corner in corners:
                key = tuple(np.round(corner, 6) + 0.0)
                if key not in numbers:
                    numbers[key] = len(vertices)
                    vertices.append(corner)
                index.append(numbers[key])
            faces += [tuple(index[k] for k in triangle) for triangle in triangles]
        return np.array(vertices) @ turn.T, np.array(faces, dtype=np.int64)
