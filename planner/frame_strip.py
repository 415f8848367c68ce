"""The clamped frame as solids, before there is a sheet: what no fold may touch, whatever is cut."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import MachineLimits
from planner.fold_problem import FlatTree
from planner.placement import frame_gap

__all__ = ["LONGEST_MM", "frame_strip"]

LONGEST_MM = 40.0
"""The strips are divided into pieces no longer than this, which a fold is kept from touching one by one."""

_HALVES = np.array([[[0, 1], [2, 1], [2, 3]], [[0, 1], [2, 3], [0, 3]]])
"""Columns of a rectangle (from x, from y, to x, to y) that are the corners of its two triangles."""


def frame_strip(tree: FlatTree, limits: MachineLimits) -> NDArray[np.float64]:
    """(M, 12, 3) the clamped frame around a flat net with its bars, as ``FoldProblem.fold`` wants obstacles.

    It covers what ``make_sheet`` makes the frame of the sheet around the same net.

    Args:
        tree: the net and the direction of its rotary axis, which the sheet lies along.
        limits: what the machine allows; ``frame_margin``, ``clamp_height`` and ``thickness`` count.
    """
    axes = np.array([tree.axis, [-tree.axis[1], tree.axis[0]]])
    points = tree.corners.reshape(-1, 2) @ axes.T
    gap = frame_gap(limits)
    inner = np.array([points.min(axis=0) - gap, points.max(axis=0) + gap])
    outer = inner + limits.frame_margin * np.array([[-1.0], [1.0]])
    (x0, y0), (x1, y1) = outer.tolist()
    (left, low), (right, high) = inner.tolist()
    sides = ((x0, y0, x1, low), (x0, high, x1, y1), (x0, low, left, high), (right, low, x1, high))
    rectangles = np.concatenate([_pieces(*side) for side in sides])
    triangles = np.zeros((2 * len(rectangles), 3, 3))
    triangles[:, :, :2] = rectangles[:, _HALVES].reshape(-1, 3, 2) @ axes
    up = np.array([0.0, 0.0, max(0.5 * limits.thickness, limits.clamp_height)])
    return np.concatenate([triangles + up, triangles - up, triangles, triangles], axis=1)


def _pieces(x0: float, y0: float, x1: float, y1: float) -> NDArray[np.float64]:
    """(K, 4) rectangles, from and to, into which a rectangle is divided along its longer side."""
    count = max(1, math.ceil(max(x1 - x0, y1 - y0) / LONGEST_MM))
    cuts = np.linspace(0.0, 1.0, count + 1)
    out = np.empty((count, 4))
    out[:] = x0, y0, x1, y1
    k, (start, end) = (0, (x0, x1)) if x1 - x0 > y1 - y0 else (1, (y0, y1))
    out[:, k], out[:, k + 2] = start + cuts[:-1] * (end - start), start + cuts[1:] * (end - start)
    return out
