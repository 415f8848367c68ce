"""The clamped frame as solids, before there is a sheet: what no fold may touch, whatever is cut."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import MachineLimits
from planner.fold_problem import FlatTree
from planner.placement import GAP_MM

__all__ = ["LONGEST_MM", "frame_strip"]

LONGEST_MM = 40.0
"""The strips are divided into pieces no longer than this, which a fold is kept from touching one by one."""


def frame_strip(tree: FlatTree, limits: MachineLimits) -> NDArray[np.float64]:
    """(M, 12, 3) the clamped frame around a flat net, as ``FoldProblem.fold`` wants obstacles.

    It covers what ``make_sheet`` makes the frame of the sheet around the same net.

    Args:
        tree: the net and the direction of its rotary axis, which the sheet lies along.
        limits: what the machine allows; ``frame_margin`` and ``thickness`` are used.
    """
    axes = np.array([tree.axis, [-tree.axis[1], tree.axis[0]]])
    points = tree.corners.reshape(-1, 2) @ axes.T
    inner = np.array([points.min(axis=0) - GAP_MM, points.max(axis=0) + GAP_MM])
    outer = inner + limits.frame_margin * np.array([[-1.0], [1.0]])
    (x0, y0), (x1, y1) = outer.tolist()
    (left, low), (right, high) = inner.tolist()
    flat = []
    for ax, ay, bx, by in (
        (x0, y0, x1, low),
        (x0, high, x1, y1),
        (x0, low, left, high),
        (right, low, x1, high),
    ):
        parts = max(1, math.ceil(max(bx - ax, by - ay) / LONGEST_MM))
        along_x = bx - ax > by - ay
        for k in range(parts):
            start, end = k / parts, (k + 1) / parts
            px, qx = (ax + start * (bx - ax), ax + end * (bx - ax)) if along_x else (ax, bx)
            py, qy = (ay, by) if along_x else (ay + start * (by - ay), ay + end * (by - ay))
            flat += [[[px, py], [qx, py], [qx, qy]], [[px, py], [qx, qy], [px, qy]]]
    triangles = np.zeros((len(flat), 3, 3))
    triangles[:, :, :2] = np.array(flat) @ axes
    up = np.array([0.0, 0.0, 0.5 * limits.thickness])
    return np.concatenate([triangles + up, triangles - up, triangles, triangles], axis=1)
