"""The sheet as few convex pieces: what is clipped by one step, bent by one step or kept is merged apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Bend, Clip, FoldPlan
from planner.values import frozen_array

__all__ = ["KEPT", "MOST_SIDES", "SheetPiece", "sheet_pieces"]

KEPT = -1
"""``gone_at`` or ``bent_at`` of a piece that no step clips or bends."""

MOST_SIDES = 16
"""Most sides of a merged piece: enough to merge well, few enough for quick contact tests."""

_LEAST_WIDTH_MM = 1e-3
_STRAIGHT = 1e-12


@dataclass(frozen=True, eq=False)
class SheetPiece:
    """A convex piece of substrate.

    Attributes:
        triangles: the substrate triangles that it is made of, sorted.
        outline: (K, 2) corners in mm, counter-clockwise, without straight ones.
        gone_at: step that clips it, or ``KEPT``.
        bent_at: step that bends it about a hinge, or ``KEPT``.
    """

    triangles: tuple[int, ...]
    outline: NDArray[np.float64]
    gone_at: int = KEPT
    bent_at: int = KEPT

    def __post_init__(self) -> None:
        """Freeze the outline."""
        object.__setattr__(self, "outline", frozen_array(self.outline, np.float64, (None, 2)))


def sheet_pieces(plan: FoldPlan) -> tuple[SheetPiece, ...]:
    """Merge the substrate triangles of ``plan`` to convex pieces, in a deterministic order.

    Triangles are merged only with triangles that the same step clips or bends, so that a clip is a matter of
    switching whole pieces off, and those under the bars of the frame only with one another.
    Source: Hertel and Mehlhorn 1983 (drop diagonals while corners stay convex).
    """
    count = len(plan.sheet.faces)
    gone, bent = np.full(count, KEPT), np.full(count, KEPT)
    for number, step in enumerate(plan.steps):
        if isinstance(step, Clip):
            gone[list(step.faces)] = number
        elif isinstance(step, Bend):
            bent[list(step.faces)] = number
    groups: dict[tuple[int, int, bool], list[int]] = {}
    frame = plan.sheet.frame_faces if plan.sheet.clamp_height > 0.0 else np.zeros(count, dtype=np.bool_)
    for triangle in range(count):
        groups.setdefault((int(gone[triangle]), int(bent[triangle]), bool(frame[triangle])), []).append(
            triangle
        )
    pieces: list[SheetPiece] = []
    for (gone_at, bent_at, _), members in sorted(groups.items()):
        for triangles, loop in _merge(plan.sheet.vertices, plan.sheet.faces, members):
            outline = _without_straight_corners(plan.sheet.vertices[loop])
            if len(outline) >= 3 and _width(outline) > _LEAST_WIDTH_MM:  # no slivers of rounding
                pieces.append(SheetPiece(tuple(sorted(triangles)), outline, gone_at, bent_at))
    return tuple(pieces)


def _merge(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], members: list[int]
) -> list[tuple[list[int], list[int]]]:
    """Convex unions of the triangles ``members``: (triangles, vertex loop) each."""
    xy = vertices.tolist()
    loops: dict[int, list[int]] = {t: faces[t].tolist() for t in members}
    owner: dict[int, int] = {t: t for t in members}
    content: dict[int, list[int]] = {t: [t] for t in members}
    side_of: dict[tuple[int, int], int] = {}
    for t in members:
        a, b, c = loops[t]
        side_of[a, b], side_of[b, c], side_of[c, a] = t, t, t
    shared = [
        ((xy[a][0] - xy[b][0]) ** 2 + (xy[a][1] - xy[b][1]) ** 2, a, b)
        for a, b in side_of
        if a < b and (b, a) in side_of
    ]
    shared.sort(key=lambda item: (-item[0], item[1], item[2]))

    def root(t: int) -> int:
        while owner[t] != t:
            owner[t] = owner[owner[t]]
            t = owner[t]
        return t

    while shared:  # a merge that is not convex now may be once its neighbours have grown
        waiting = []
        for item in shared:
            left, right = root(side_of[item[1:]]), root(side_of[item[:0:-1]])
            if left == right:
                continue
            loop = _joined(loops[left], loops[right], *item[1:])
            if loop is None or not _convex(xy, loop):
                waiting.append(item)
                continue
            loops[left] = loop
            owner[right] = left
            content[left] += content.pop(right)
            del loops[right]
        if len(waiting) == len(shared):
            break
        shared = waiting
    return [(content[t], loops[t]) for t in sorted(loops)]


def _joined(left: list[int], right: list[int], a: int, b: int) -> list[int] | None:
    """The loop around both: side a to b of ``left`` is side b to a of ``right``; None if more is shared."""
    i, j = left.index(b), right.index(a)
    first = left[i:] + left[:i]  # b ... a
    second = right[j:] + right[:j]  # a ... b
    while len(first) > 1 and len(second) > 1 and first[-2] == second[1]:  # a chain of sides is shared
        first.pop()
        second.pop(0)
    while len(first) > 1 and len(second) > 1 and first[1] == second[-2]:
        first.pop(0)
        second.pop()
    loop = first + second[1:-1]
    return loop if len(loop) >= 3 and len(set(loop)) == len(loop) else None


def _convex(xy: list[list[float]], loop: list[int]) -> bool:
    """No corner turns right and at most ``MOST_SIDES`` corners turn left."""
    corners = 0
    x0, y0 = xy[loop[-2]]
    x1, y1 = xy[loop[-1]]
    for index in loop:
        x2, y2 = xy[index]
        turn = (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1)
        scale = (abs(x1 - x0) + abs(y1 - y0)) * (abs(x2 - x1) + abs(y2 - y1))
        if turn < -_STRAIGHT * scale:
            return False
        corners += turn > _STRAIGHT * scale
        x0, y0, x1, y1 = x1, y1, x2, y2
    return corners <= MOST_SIDES


def _without_straight_corners(outline: NDArray[np.float64]) -> NDArray[np.float64]:
    before = outline - np.roll(outline, 1, axis=0)
    after = np.roll(outline, -1, axis=0) - outline
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    scale = np.abs(before).sum(axis=1) * np.abs(after).sum(axis=1)
    kept: NDArray[np.float64] = outline[turn > _STRAIGHT * scale]
    return kept


def _width(outline: NDArray[np.float64]) -> float:
    """Twice the area over half the circumference: about the width of a narrow polygon, in mm."""
    x, y = outline[:, 0], outline[:, 1]
    doubled_area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return 2.0 * doubled_area / float(np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1).sum())
