"""Whole plans over hand-made nets: every crease folded once, outermost first."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from planner.fabrication import fabrication_steps
from planner.fold_plan import Blocked, Fold, FoldPlan, MachineLimits, PlanMetrics, Rotate
from planner.holding import hold_base
from planner.net import Net
from planner.placement import place_net
from planner.substrate import make_sheet
from tests.planner import hand_nets

LIMITS = MachineLimits()


def some_nets() -> dict[str, Net]:
    """One net of each kind that cuts differ for: cross, strip, plate, narrow wedge, closed slit."""
    flat_fan = hand_nets.pyramid_goal(8, 20.0, 0.0)
    return {
        "cross": hand_nets.cross_net(),
        "strip": _bfs(hand_nets.strip_goal()),
        "plate": _bfs(hand_nets.plate_goal()),
        "wedge": hand_nets.net_from_parents(hand_nets.pyramid_goal(), [-1, 0, 1, 2, 3]),
        "narrow wedge": hand_nets.net_from_parents(hand_nets.pyramid_goal(9, 20.0, 1.0), [-1, *range(8)]),
        "closed slit": hand_nets.net_from_parents(flat_fan, [-1, *range(7)]),
        "sliver": hand_nets.net_from_parents(hand_nets.pyramid_goal(7, 20.0, 4.0), [1, 2, 3, -1, 3, 4, 5]),
    }


def _bfs(goal):
    return hand_nets.net_from_parents(goal, hand_nets.bfs_parents(goal))


def outside_in(net: Net) -> list[Fold | Rotate]:
    """Every crease to its goal, the faces farthest from the base first, from the side that it turns to."""
    steps: list[Fold | Rotate] = []
    side = 0.0
    for face in net.order[:0:-1].tolist():
        crease = int(net.crease_of[face])
        if net.assignment[crease] == "F":
            continue
        angle = float(net.fold_angle[crease])
        need = 0.0 if angle > 0.0 else float(np.pi)
        if need != side:
            steps.append(Rotate(need))
            side = need
        steps.append(Fold(crease, angle))
    return steps


def plan_for(net: Net, hits: Collection[int] = (), limits: MachineLimits = LIMITS) -> FoldPlan:
    """Place, make the sheet, hold, cut and fold."""
    placed = place_net(net, limits)
    sheet = make_sheet(placed, limits)
    hold = hold_base(placed, sheet, limits, hits)
    creases = sorted(placed.child_of)
    blocked = tuple(
        Blocked(c, 0.1, float(placed.fold_angle[c]), "collision", (0, 1), 0.12) for c in creases[:1]
    )
    return FoldPlan(
        net=placed,
        sheet=replace(sheet, tabs=hold.tabs),
        limits=limits,
        steps=fabrication_steps(placed, sheet, hold, outside_in(placed), hits),
        metrics=PlanMetrics(0.98765, 0.0123, 1e-4, 3, len(hold.clipped), 12.5, 1.0, 2.0),
        blocked=blocked,
        seed=7,
        without=("sight",),
        notices=("a notice",),
    )
