"""Whether the base of a net can be held without its sheet: how much that the folds sweep is in the way."""

from __future__ import annotations

from planner.flat_layout import LEAST_TAB_EDGE_MM
from planner.fold_problem import FlatTree, FoldProblem, FoldResult, panel_numbers
from planner.placement import frame_gap

__all__ = ["CELL_MM", "hold_gap"]

CELL_MM = 2.0
"""Side of the cells into which the sheet is divided: about the width of a tab and what leads to it."""


def hold_gap(tree: FlatTree, result: FoldResult, problem: FoldProblem) -> int:
    """Cells swept by the folds that lie on the way from the base panel to the frame, on the best way.

    0 means that a strip of sheet may stay. It is an estimate, in a fraction of the time that a sheet takes:
    the sheet has triangles instead of cells, and strength counts.

    Args:
        tree: the flat net.
        result: how it was folded.
        problem: goal and limits.

    Returns:
        The number of cells; -1 if the base panel has no free side, or the net encloses it.
    """
    from planner._kernels.hold_kernels import hold_gap as count

    preorder, first, last = tree.subtrees
    hinges, _ = tree.hinge_lines
    faces = len(tree.parent)
    cells = count(
        tree.corners, preorder, first, last, hinges, panel_numbers(tree, faces), result.steps, tree.base,
        frame_gap(problem.limits), CELL_MM, LEAST_TAB_EDGE_MM,
    )  # fmt: skip
    return int(cells)
