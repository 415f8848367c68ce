"""An animal-like free-form body: blocks put together on a grid, their surface smoothed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from models.goals.folded_panels import Mesh

__all__ = ["creature_coarse", "creature_fine"]

Block = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]
"""First and one-past-last cell along x (tail to head), y (right to left) and z (up)."""


def _surface(blocks: Sequence[Block]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Grid points (V, 3) and quads (Q, 4) on the surface of a union of blocks, seen from outside."""
    cells = {
        (x, y, z)
        for (x0, x1), (y0, y1), (z0, z1) in blocks
        for x in range(x0, x1)
        for y in range(y0, y1)
        for z in range(z0, z1)
    }
    numbers: dict[tuple[int, ...], int] = {}
    quads = []
    for cell in sorted(cells):
        for axis in range(3):
            for side in (0, 1):
                neighbour = list(cell)
                neighbour[axis] += 2 * side - 1
                if tuple(neighbour) in cells:
                    continue
                square = []
                for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    point = list(cell)
                    point[axis] += side
                    point[(axis + 1) % 3] += u
                    point[(axis + 2) % 3] += v
                    square.append(numbers.setdefault(tuple(point), len(numbers)))
                quads.append(square if side else square[::-1])
    return np.array(list(numbers), dtype=np.int64), np.array(quads, dtype=np.int64)


def _smoothed(points: NDArray[np.float64], quads: NDArray[np.int64], rounds: int) -> NDArray[np.float64]:
    """Points (V, 3) after ``rounds`` of smoothing that does not shrink.

    Source: Taubin, A signal processing approach to fair surface design, SIGGRAPH 1995; steps 0.5 and -0.4.
    """
    count = len(points)
    joined = np.zeros((count, count))
    for k in range(4):
        joined[quads[:, k], quads[:, (k + 1) % 4]] = 1.0
    joined = np.maximum(joined, joined.T)
    mean = joined / joined.sum(axis=1, keepdims=True)
    for _ in range(rounds):
        for step in (0.5, -0.4):
            points = points + step * (mean @ points - points)
    return points


def _split(points: NDArray[np.float64], quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Two triangles (2Q, 3) for each quad, along the diagonal that is shorter (with a tie: the first)."""
    faces = []
    for a, b, c, d in quads.tolist():
        if np.sum((points[a] - points[c]) ** 2) <= np.sum((points[b] - points[d]) ** 2) * (1.0 + 1e-9):
            faces += [(a, b, c), (a, c, d)]
        else:
            faces += [(b, c, d), (b, d, a)]
    return np.array(faces, dtype=np.int64)


def _body(blocks: Sequence[Block], lines: Sequence[Sequence[float]], rounds: int) -> Mesh:
    """Surface of blocks whose grid lines stand at the given places (mm) along each axis, smoothed."""
    grid, quads = _surface(blocks)
    points = np.column_stack([np.asarray(lines[axis], dtype=np.float64)[grid[:, axis]] for axis in range(3)])
    points = _smoothed(points, quads, rounds)
    return points, _split(points, quads)


def creature_coarse() -> Mesh:
    """About 140 faces: four legs, head with snout and two ears, tail."""
    legs: list[Block] = [((x, x + 1), (y, y + 1), (0, 1)) for x in (1, 3) for y in (0, 2)]
    ears: list[Block] = [((3, 4), (y, y + 1), (3, 4)) for y in (0, 2)]
    blocks = [*legs, ((1, 4), (0, 3), (1, 2)), ((3, 4), (0, 3), (2, 3)), *ears]
    blocks += [((4, 5), (1, 2), (2, 3)), ((0, 1), (1, 2), (1, 2))]
    return _body(blocks, ([0, 12, 22, 36, 50, 64], [0, 9, 17, 26], [0, 16, 32, 46, 60]), rounds=9)


def creature_fine() -> Mesh:
    """About 300 faces: the same animal with longer legs, a deeper body and a longer tail."""
    legs: list[Block] = [((x, x + 1), (y, y + 1), (0, 2)) for x in (2, 5) for y in (0, 2)]
    ears: list[Block] = [((6, 7), (y, y + 1), (6, 7)) for y in (0, 2)]
    blocks = [*legs, ((2, 6), (0, 3), (2, 4)), ((5, 7), (0, 3), (4, 6)), *ears]
    blocks += [((7, 9), (1, 2), (4, 5)), ((0, 2), (1, 2), (3, 4))]
    return _body(
        blocks,
        (
            [0, 8, 16, 25, 34, 43, 53, 62, 69, 76],
            [0, 9, 17, 26],
            [0, 10, 20, 29, 38, 47, 56, 68],
        ),
        rounds=3,
    )
