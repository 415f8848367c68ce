"""Whether the base of a net can be held without its sheet: how much that the folds sweep is in the way."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.corner_tabs import CORNER_WIDTHS_MM, LONGEST_MM, corner_tabs
from planner.flat_layout import LEAST_TAB_EDGE_MM, FlatLayout
from planner.fold_plan import MachineLimits
from planner.fold_problem import FlatTree, FoldProblem, FoldResult, panel_numbers
from planner.placement import frame_gap

__all__ = ["CELL_MM", "hold_gap"]

CELL_MM = 2.0
"""Side of the cells into which the sheet is divided: about the width of a tab and what leads to it."""

AROUND_MM = 3.0
"""What lies farther from the base panel than the longest neck and this has no part in its necks."""

MOST_KEPT = 4096
"""Bases whose necks are kept."""

_NO_MOUTHS = np.zeros((0, 4))


def hold_gap(
    tree: FlatTree, result: FoldResult, problem: FoldProblem, layout: FlatLayout | None = None
) -> int:
    """Cells swept by the folds that lie on the way from the base panel to the frame, on the best way.

    0 means that a strip of sheet may stay. It is an estimate, in a fraction of the time that a sheet takes:
    the sheet has triangles instead of cells, and strength counts.

    Args:
        tree: the flat net.
        result: how it was folded.
        problem: goal and limits.
        layout: the same net: then ways through necks at corners of the base panel count too.

    Returns:
        The number of cells; -1 if the base panel has no free side and no neck, or the net encloses it.
    """
    cells = _cells(tree, result, problem, _NO_MOUTHS)
    if cells == 0 or layout is None:
        return cells
    mouths = _neck_mouths(layout, problem)
    return _cells(tree, result, problem, mouths) if len(mouths) else cells


def _cells(tree: FlatTree, result: FoldResult, problem: FoldProblem, mouths: NDArray[np.float64]) -> int:
    from planner._kernels.hold_kernels import hold_gap as count

    preorder, first, last = tree.subtrees
    hinges, _ = tree.hinge_lines
    faces = len(tree.parent)
    return int(count(
        tree.corners, tree.parent, tree.slot, preorder, first, last, hinges, panel_numbers(tree, faces),
        result.steps, tree.base, frame_gap(problem.limits), CELL_MM, LEAST_TAB_EDGE_MM, mouths,
    ))  # fmt: skip


def _neck_mouths(layout: FlatLayout, problem: FoldProblem) -> NDArray[np.float64]:
    """(K, 4) ends and directions, in the frame of ``layout``, of the necks that its base panel may have.

    They depend on the faces around the base panel alone, which most changes of a net leave as they are: what
    was found for them is kept in ``problem.mouths``.
    """
    here = layout.corners[layout.base]
    side = (here[1] - here[0]) / math.dist(here[0], here[1])
    turned = np.array([side, [-side[1], side[0]]])
    placed = (layout.corners - here[0]) @ turned.T
    panel = placed[layout.depth == 0].reshape(-1, 2)
    low, high = panel.min(axis=0) - LONGEST_MM - AROUND_MM, panel.max(axis=0) + LONGEST_MM + AROUND_MM
    near = np.flatnonzero(((placed.max(axis=1) >= low) & (placed.min(axis=1) <= high)).all(axis=1))
    key = b"".join(
        part.tobytes()
        for part in (near, layout.parent[near], layout.crease[near], np.round(placed[near], 6) + 0.0)
    )
    mouths = problem.mouths.get(key)
    if mouths is None:
        mouths = _mouths_of_base(layout, problem.limits)
        if len(problem.mouths) >= MOST_KEPT:
            problem.mouths.clear()
        problem.mouths[key] = mouths
    return np.hstack([here[0] + mouths[:, :2] @ turned, mouths[:, 2:] @ turned])


def _mouths_of_base(layout: FlatLayout, limits: MachineLimits) -> NDArray[np.float64]:
    """(K, 4) as ``_neck_mouths``, from corner 0 of the base face with its side 0 along x."""
    net = layout.to_net()
    necks = corner_tabs(net, limits, CORNER_WIDTHS_MM[0])
    if not necks:
        return _NO_MOUTHS
    outward = np.array([neck.outward for neck in necks])
    reach = np.array([[neck.reach_mm + 2.0 * neck.kerf_mm] for neck in necks])
    return np.hstack([np.array([neck.corner for neck in necks]) + reach * outward, outward])
