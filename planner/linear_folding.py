"""All creases at once: linear folding, where all arrive together, and uniform folding, at one angular speed.

Neither is a plan for a laser, which folds one crease at a time. Order, side, sight and substrate have no
meaning here; contact between faces is the only rule, and the motion stops at the first one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_problem import FlatTree, FoldProblem, bounding_spheres

__all__ = ["JointMotion", "Touch", "linear_rates", "uniform_rates"]


@dataclass(frozen=True)
class Touch:
    """How far a motion goes: the ``share`` of it that is free, and the faces that touch there (-1: none)."""

    share: float
    face: int
    other: int


class JointMotion:
    """Motions of a flat net in which all creases may turn at the same time.

    Contact counts thickness and insets as the fold planner does: the same solids, followed by conservative
    advancement, so that a motion that is called free is free at every moment, not at samples.

    Attributes:
        tree: the net.
        work: advances of pairs of faces so far.
    """

    def __init__(self, problem: FoldProblem, tree: FlatTree) -> None:
        self.tree = tree
        self.work = 0
        count = len(tree.parent)
        self._solids = problem.solids(tree)
        self._centres, self._radii = bounding_spheres(self._solids)
        self._sharp = problem.sharp
        self._hinges, lengths = tree.hinge_lines
        middle = self._hinges[:, :2] + 0.5 * lengths[:, None] * self._hinges[:, 2:]
        self._reach = np.linalg.norm(
            self._solids - np.append(middle, np.zeros((count, 1)), axis=1)[:, None], axis=2
        ).max(axis=1)
        up = np.maximum(tree.parent, 0)
        inner = (tree.parent >= 0) & (tree.parent[up] >= 0)
        self._links = np.where(inner, np.linalg.norm(middle - middle[up], axis=1), 0.0)
        self._depth = np.zeros(count, dtype=np.int64)
        for face in tree.order[1:].tolist():
            self._depth[face] = self._depth[tree.parent[face]] + 1

    def free(
        self,
        start: NDArray[np.float64],
        end: NDArray[np.float64],
        rates: NDArray[np.float64] | None = None,
    ) -> Touch:
        """How far the net gets from angles ``start`` to ``end``, both (F,) rad.

        Args:
            start: angles now.
            end: angles wanted.
            rates: (F,) rad per whole motion; None: all creases arrive together, in a straight line.
        """
        from planner._kernels.joint_kernels import joint_motion

        delta = np.asarray(end, dtype=np.float64) - start
        share, face, other, advances = joint_motion(
            self.tree.parent, self._depth, np.asarray(start, dtype=np.float64), delta,
            np.abs(delta) if rates is None else np.asarray(rates, dtype=np.float64),
            self._hinges, self._reach, self._links, self._solids, self._centres, self._radii, self._sharp,
        )  # fmt: skip
        self.work += int(advances)
        return Touch(float(share), int(face), int(other))


def linear_rates(target: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F,) rates of linear folding: each crease takes the whole motion."""
    return np.abs(target)


def uniform_rates(target: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F,) rates of uniform folding: all turn equally fast, and each waits at its goal for the largest."""
    largest = float(np.abs(target).max(initial=0.0))
    return np.where(target != 0.0, largest, 0.0)
