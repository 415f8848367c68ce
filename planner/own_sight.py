"""What every face hides of every crease that it hangs on: nets are bounded, and changed, by looking it up.

A turning part is what a beam is blocked by most. Outside-in folding turns a crease when all that hangs on it
stands as it will in the end, so what one face hides of one crease depends on these two and on the rotary
axis only: a table for each goal holds it for all nets. The bound takes microseconds, a whole plan takes
milliseconds, and most nets fail by it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.flat_layout import LEAST_TAB_EDGE_MM, FlatLayout
from planner.processors import processors, side_by_side

if TYPE_CHECKING:
    from planner.fold_problem import FoldProblem

__all__ = ["MOST_FACES", "OwnNet", "OwnSight"]

MOST_FACES = 500
"""Goals with more faces get no table: its time and size grow with the square of their number."""

FRACTIONS = (0.0, 0.08, 0.16, 0.25, 0.34, 0.43, 0.52, 0.6, 0.68, 0.76, 0.83, 0.89, 0.94, 0.97, 0.99, 1.0)
"""Shares of the goal angle at which is looked, denser to the end: a slit that closes is lost there."""

TILT_SHARES = (0.0, 0.18, -0.18, 0.38, -0.38, 0.6, -0.6, 0.8, -0.8, 0.9, 1.0, -1.0)
"""Tilts under which is looked, as shares of the limit."""

HEADINGS = 16
"""Directions of the rotary axis, over half a turn, for which the table holds."""

WARM, COLD = 0.02, 3e-4
"""Temperatures between which ``OwnSight.anneal`` cools down, in cost."""


_NO_STATE = np.ones(1, dtype=np.uint64)


@dataclass(frozen=True, eq=False)
class OwnNet:
    """A net from ``OwnSight.anneal``.

    Attributes:
        layout: overlap-free.
        axis_rad: direction of the rotary axis, from the base face's side from corner 0 to corner 1.
        cost: see ``OwnSight.cost``.
    """

    layout: FlatLayout
    axis_rad: float
    cost: float


class OwnSight:
    """The table of one goal under given limits.

    Light from one point is taken as parallel, a face at a time is looked at, and what hangs on a crease is
    taken to be folded wholly: the costs are estimates.

    Attributes:
        table: (D, F) row of the bits of each face (-1: it hides nothing) for each of the D = 2 M creases, an
            edge with either of its faces as the child; (HEADINGS, R + D, words) bits of these rows, set where
            the crease is hidden, see ``shadow_kernels``, and those of the leaning child behind; rows of the
            creases, rows of the faces, and figures, see ``own_sight_kernels``.
    """

    def __init__(
        self, problem: FoldProblem, hiding: tuple[NDArray[np.int32], NDArray[np.uint64]] | None = None
    ) -> None:
        """Work the table out: about a second of processor time at 128 faces, growing with their square.

        Args:
            problem: goal and limits.
            hiding: rows and bits of the table where they are known already.
        """
        from planner.fold_problem import SAFE_LOAD

        goal, limits = problem.goal, problem.limits
        graph = DualGraph(goal)
        creases, lengths, angles = lines = _creases(problem, graph)
        rows, bits = hiding or _hiding(problem, graph, *lines)
        corners = problem.corners_3d
        double = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        load = limits.weight_n_mm2 / limits.plastic_moment_n
        self.table = (
            rows,
            bits,
            np.column_stack([creases[:, :2].reshape(-1, 6), lengths, angles]),
            np.column_stack([problem.centroids_3d, 0.5 * np.linalg.norm(double, axis=1)]),
            np.array([goal.longest_side_mm, load, SAFE_LOAD, _steep(problem), *FRACTIONS]),
        )

    def cost(self, layout: FlatLayout, axis_rad: float) -> tuple[float, NDArray[np.float64]]:
        """What a net misses since the part that turns hides its own crease.

        Args:
            layout: the net.
            axis_rad: direction of the rotary axis, from the base face's side from corner 0 to corner 1.

        Returns:
            (cost, weighed as ``candidate.cost``; (F,) the angle missing at the crease of each face, rad)
        """
        from planner._kernels.own_sight_kernels import own_cost_within

        lost, void = np.zeros(len(layout.parent)), np.zeros(2, dtype=np.int64)
        cost = own_cost_within(
            layout.arrays, self.table, float(axis_rad), void, 0.0, 0, _NO_STATE, lost, void
        )
        return float(cost), lost

    def exchange(
        self,
        layout: FlatLayout,
        axis_rad: float,
        path: NDArray[np.int64],
        limit: float,
        tries: int,
        rng: np.random.Generator,
    ) -> float | None:
        """Cut a crease of ``path`` and join the net elsewhere, within a ``limit`` of ``cost``.

        Args:
            layout: changed in place; of no use any more if there is no result.
            axis_rad: direction of the rotary axis.
            path: creases to choose from; empty: none.
            limit: cost allowed.
            tries: exchanges tried.
            rng: of the choice.

        Returns:
            The cost, None if nothing was found.
        """
        from planner._kernels.own_sight_kernels import own_cost_within

        if len(path) == 0:
            return None
        out, lost = np.zeros(2, dtype=np.int64), np.zeros(len(layout.parent))
        cost = own_cost_within(
            layout.arrays, self.table, float(axis_rad), path, float(limit), tries, _state(rng), lost, out
        )
        return float(cost) if cost >= 0.0 and layout.exchanged_inside(int(out[1])) else None

    def anneal(
        self,
        layout: FlatLayout,
        axis_rad: float,
        moves: int,
        rng: np.random.Generator,
        *,
        fixed_base: bool = False,
        warm: float = WARM,
    ) -> OwnNet:
        """Change a net, without overlap, until it misses little that way.

        Args:
            layout: where to start; left as it is.
            axis_rad: direction of the rotary axis.
            moves: changes tried; it ends sooner once nothing is missing.
            rng: of the choices.
            fixed_base: keep the base face.
            warm: temperature at which it starts, in cost.
        """
        from planner._kernels.own_sight_kernels import anneal_own

        work = layout.copy()
        best, out = np.zeros(len(layout.graph.faces), dtype=np.bool_), np.zeros(3)
        anneal_own(
            work.arrays, self.table, np.array(_axis(layout, axis_rad)), _state(rng), moves,
            warm, min(warm, COLD), LEAST_TAB_EDGE_MM, not fixed_base, best, out,
        )  # fmt: skip
        return OwnNet(FlatLayout(layout.graph, best, int(out[1])), float(out[2]), float(out[0]))


def _axis(layout: FlatLayout, axis_rad: float) -> tuple[float, float]:
    """Direction of the rotary axis in the plane of the layout."""
    heading = layout.heading + axis_rad
    return math.cos(heading), math.sin(heading)


def _state(rng: np.random.Generator) -> NDArray[np.uint64]:
    """(1,) state for the random numbers of a kernel."""
    return rng.integers(1, 2**63, size=1, dtype=np.uint64)


def _creases(problem: FoldProblem, graph: DualGraph) -> tuple[NDArray[np.float64], ...]:
    """(D, 3, 3) start, direction and parent's normal of the creases, (D,) their lengths, (D,) goal angles."""
    child, slot, parent = graph.faces.ravel(), graph.slots.ravel(), graph.faces[:, ::-1].ravel()
    start = problem.corners_3d[child, slot]
    along = problem.corners_3d[child, (slot + 1) % 3] - start
    lengths = np.linalg.norm(along, axis=1)
    creases = np.stack([start, along / lengths[:, None], problem.goal.face_normals[parent]], axis=1)
    return creases, lengths, np.repeat(np.where(graph.flat, 0.0, graph.fold_angle), 2)


def _steep(problem: FoldProblem) -> float:
    """Slope of the most tilted beam."""
    return math.tan(problem.limits.max_tilt_rad)


def _hiding(
    problem: FoldProblem,
    graph: DualGraph,
    creases: NDArray[np.float64],
    lengths: NDArray[np.float64],
    angles: NDArray[np.float64],
) -> tuple[NDArray[np.int32], NDArray[np.uint64]]:
    """Rows and bits of the table, from what ``_creases`` gives."""
    from planner._kernels.shadow_kernels import WORDS, hidden_bits, hiding_pairs
    from planner.fold_problem import SIGHT_RESERVE

    limits = problem.limits
    corners = np.ascontiguousarray(problem.corners_3d)
    child, parent = graph.faces.ravel(), graph.faces[:, ::-1].ravel()
    panels = np.zeros((len(corners) + len(child), 2), dtype=np.int64)
    panels[: len(corners), 0] = graph.panel
    panels[len(corners) :] = np.stack([graph.panel[child], graph.panel[parent]], axis=1)
    radius, steep = max(limits.beam_radius, 0.5 * limits.thickness), _steep(problem)
    wide = radius + limits.beam_spread * 2.0 * problem.goal.longest_side_mm
    fractions = np.array(FRACTIONS)
    rows, used = hiding_pairs(corners, creases, lengths, angles, panels, fractions, steep, wide)
    bits = np.zeros((HEADINGS, int(used) + len(creases), WORDS), dtype=np.uint64)
    tilts = limits.max_tilt_rad * np.array(TILT_SHARES)
    headings = math.pi * (np.arange(HEADINGS) + 0.5) / HEADINGS
    head = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, radius, limits.beam_spread])
    parts = np.linspace(0, len(creases), processors() + 1).astype(np.int64)

    def fill(part: int) -> None:
        hidden_bits(
            corners, creases, lengths, angles, rows, fractions, tilts, headings, head,
            problem.hidden_max * SIGHT_RESERVE, steep, wide, parts[part], parts[part + 1], bits,
        )  # fmt: skip

    list(side_by_side(fill, range(len(parts) - 1)))
    return rows, bits
