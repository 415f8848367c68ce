"""One finished plan, changed in one respect and folded again: what comes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.candidate import fits, flat_tree, held_back
from planner.dual_graph import DualGraph
from planner.errors import PlanError
from planner.flat_layout import FlatLayout
from planner.fold_plan import FoldPlan
from planner.fold_problem import FoldProblem, FoldResult
from planner.insets import edge_insets
from planner.lost_folds import foldable_share
from planner.placement import place_net
from planner.plan_on_sheet import fold_on_sheet, same_places, tree_of_net
from planner.sheet_hits import sheet_solids
from planner.substrate import make_sheet

__all__ = ["Change", "Trial", "Workbench"]


@dataclass(frozen=True)
class Change:
    """What is changed of a plan whose net stays; what is None stays as it is.

    Attributes:
        tilt_rad: the tilt limit.
        clearance: of the faces, mm.
        hidden_max: largest hidden share.
        unfold: a face and by how much its crease is folded less, rad.
        restore: a face whose crease is no longer held back.
    """

    tilt_rad: float | None = None
    clearance: float | None = None
    hidden_max: float | None = None
    unfold: tuple[int, float] | None = None
    restore: int | None = None


@dataclass(frozen=True, eq=False)
class Trial:
    """How a changed plan folds.

    Attributes:
        crease: (F,) interior edge of the dual graph at the crease of each face, -1 for the base.
        target: (F,) the goal's angle at the crease of each face.
        reached: (F,) angle reached.
        completion: fold completion of the whole.
        shape_rms: mm.
    """

    crease: NDArray[np.int64]
    target: NDArray[np.float64]
    reached: NDArray[np.float64]
    completion: float
    shape_rms: float

    @property
    def short(self) -> NDArray[np.bool_]:
        """(F,) True where a crease stays short of the goal."""
        stays: NDArray[np.bool_] = np.abs(self.reached) < np.abs(self.target) - 1e-9
        return stays

    def angle_at(self, edge: int) -> tuple[float, bool]:
        """Angle reached at an interior edge of the goal, and whether it is the goal's; (0, False) if cut."""
        at = np.flatnonzero(self.crease == edge)
        if len(at) == 0:
            return 0.0, False
        face = int(at[0])
        return float(self.reached[face]), not bool(self.short[face])


class Workbench:
    """A finished plan, ready to be changed and folded again.

    Args:
        plan: the plan.

    Attributes:
        plan: the plan.
        problem: its goal, limits and rules.
        tree: its net as arrays.
        kept: substrate triangles that stay and stand in the way of folds.
        bodies: these as solids.
        layout: the net as a layout that can be changed; copies of it are.
        back: (M,) angle, rad, by which the plan holds back the crease at each interior edge of the goal.
        folds: how many times a net has been folded so far.
    """

    def __init__(self, plan: FoldPlan) -> None:
        net, limits = plan.net, plan.limits
        self.plan = plan
        self.problem = FoldProblem(
            net.goal, edge_insets(net, limits.thickness, limits.clearance), limits,
            hidden_max=plan.hidden_max, without=plan.without,
        )  # fmt: skip
        self.tree = tree_of_net(net)
        graph = DualGraph(net.goal)
        joined = np.flatnonzero(self.tree.parent >= 0)
        mask = np.zeros(len(graph.faces), dtype=np.bool_)
        mask[graph.face_edges[joined, self.tree.slot[joined]]] = True
        self.layout = FlatLayout(graph, mask, net.base_face)
        self.back = np.zeros(len(graph.faces))
        for blocked in plan.blocked:
            if blocked.by == "room":
                short = abs(blocked.wanted_rad) - abs(blocked.reached_rad)
                self.back[self.layout.crease[net.child_of[blocked.crease]]] = max(0.0, short)
        self.folds = 1
        back = held_back(self.layout, self.back)
        made = fold_on_sheet(net, plan.sheet, self.problem, plan.without, back=back)
        stays = same_places(made.sheet, made.kept, plan.sheet)
        named = [b.blockers[0] for b in plan.blocked if b.by == "substrate" and b.blockers]
        self.kept = np.union1d(stays, np.array(named, dtype=np.int64))
        self.bodies = sheet_solids(plan.sheet, limits.thickness)[self.kept]
        if "substrate" in plan.without:
            self.bodies = self.bodies[:0]
        self.share = foldable_share(net)
        self._known: dict[Change, Trial] = {}
        self._sure: dict[Change, Trial | None] = {}
        self._nets: dict[tuple[int, bytes, float], Trial | None] = {}

    # -- the same net ----------------------------------------------------------------------------------------

    def fold(self, change: Change) -> Trial:
        """Fold the net again among what stays of its sheet; asked twice, answered from memory."""
        if change not in self._known:
            problem, back = self._changed(change)
            self.folds += 1
            self._known[change] = self._trial(
                problem.fold(self.tree, obstacles=self.bodies, back=back, fine_sight=True),
                self.layout.crease,
                self.tree.target,
            )
        return self._known[change]

    def fold_on_sheet(self, change: Change) -> Trial | None:
        """The same, with tabs and clips chosen anew; None if the base cannot be held then."""
        if change not in self._sure:
            problem, back = self._changed(change)
            plan = self.plan
            self.folds += 1
            try:
                made = fold_on_sheet(plan.net, plan.sheet, problem, plan.without, back=back)
            except PlanError:
                self._sure[change] = None
                return None
            held = not made.hold.needed or "held" in plan.without
            trial = self._trial(made.result, self.layout.crease, self.tree.target)
            self._sure[change] = trial if held else None
        return self._sure[change]

    # -- another net -----------------------------------------------------------------------------------------

    def axis_of(self, layout: FlatLayout, turn_rad: float = 0.0) -> float:
        """Direction of the rotary axis, as ``flat_tree`` takes it, so that it lies as in the plan.

        Args:
            layout: a copy of ``self.layout``, perhaps with another base, not exchanged.
            turn_rad: turn the axis by so much.
        """
        start, end = self.tree.corners[layout.base, :2]
        return turn_rad - math.atan2(end[1] - start[1], end[0] - start[0])

    def fold_net(self, layout: FlatLayout, axis_rad: float) -> Trial | None:
        """Fold another net of the goal without its sheet; None if that would not fit the machine."""
        tree = flat_tree(layout, axis_rad)
        if not fits(tree, self.problem):
            return None
        self.folds += 1
        result = self.problem.fold(tree, back=held_back(layout, self.back))
        return self._trial(result, layout.crease, tree.target)

    def fold_net_on_sheet(self, layout: FlatLayout, axis_rad: float) -> Trial | None:
        """Place another net in a sheet of its own and fold it there; None if that is impossible."""
        key = (layout.base, layout.tree.tobytes(), round(axis_rad, 9))
        if key not in self._nets:
            self._nets[key] = self._placed(layout, axis_rad)
        return self._nets[key]

    # -- inside ----------------------------------------------------------------------------------------------

    def _placed(self, layout: FlatLayout, axis_rad: float) -> Trial | None:
        plan, limits = self.plan, self.plan.limits
        net = layout.to_net()
        start, end = net.vertices[net.faces[net.base_face, :2]]
        self.folds += 1
        try:
            placed = place_net(net, limits, math.atan2(end[1] - start[1], end[0] - start[0]) + axis_rad)
            back = held_back(layout, self.back)
            made = fold_on_sheet(placed, make_sheet(placed, limits), self.problem, plan.without, back=back)
        except PlanError:
            return None
        if made.hold.needed and "held" not in plan.without:
            return None
        tree = tree_of_net(placed)
        return self._trial(made.result, layout.crease, tree.target)

    def _changed(self, change: Change) -> tuple[FoldProblem, NDArray[np.float64]]:
        """The problem and what is held back, (F,), after the change."""
        problem, plan = self.problem, self.plan
        back = held_back(self.layout, self.back)
        if change != Change(unfold=change.unfold, restore=change.restore):
            limits, insets, hidden = plan.limits, problem.insets, problem.hidden_max
            if change.tilt_rad is not None:
                limits = replace(limits, max_tilt_rad=change.tilt_rad)
            if change.clearance is not None:
                limits = replace(limits, clearance=change.clearance)
                insets = edge_insets(plan.net, limits.thickness, change.clearance)
            if change.hidden_max is not None:
                hidden = change.hidden_max
            problem = FoldProblem(plan.net.goal, insets, limits, hidden_max=hidden, without=plan.without)
        if change.unfold is not None:
            face, less = change.unfold
            back[face] += less
        if change.restore is not None:
            back[change.restore] = 0.0
        return problem, back

    def _trial(
        self,
        result: FoldResult,
        crease: NDArray[np.int64],
        target: NDArray[np.float64],
    ) -> Trial:
        wanted = float(np.abs(target).sum())
        folded = float(np.minimum(np.abs(result.reached), np.abs(target)).sum())
        return Trial(
            crease=np.array(crease),
            target=target,
            reached=result.reached,
            completion=self.share * (folded / wanted if wanted else 1.0),
            shape_rms=result.shape_rms,
        )
