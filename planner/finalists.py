"""Nets that fold well, with their sheets in place: how far each folds there, and annealing on from one."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from planner.angle_repair import repaired
from planner.candidate import Candidate, axis_angles, cost, judge
from planner.errors import PlanError
from planner.fold_plan import Sheet
from planner.fold_problem import FoldProblem, FoldResult
from planner.fold_search import SearchSettings
from planner.net import Net
from planner.placement import place_net
from planner.plan_on_sheet import SheetFold, fold_on_sheet
from planner.search_moves import random_trial
from planner.substrate import make_sheet

__all__ = ["Finalist", "NetOf", "improve_on_sheet", "on_its_sheet"]

WARM, COLD = 0.005, 2e-4
"""Temperatures between which the annealing on the sheet cools down."""

SPOILT = 0.002
"""A sheet that adds more than this cost to a net spoils it."""

NetOf = Callable[[Candidate], tuple[Net, float | None]]
"""The net of a candidate, and the direction of the rotary axis in it (None: any that fits)."""


@dataclass(frozen=True, eq=False)
class Finalist:
    """A net on its sheet, as far as it folds there.

    Attributes:
        candidate: the net as the search knows it, with the result and the cost that the search saw.
        cost: as ``candidate.cost``, with the sheet in place; 1 more if the base cannot be held.
        placed: the net under the machine.
        sheet: the sheet around it, without tabs.
        folded: how far it folds in that.
    """

    candidate: Candidate
    cost: float
    placed: Net
    sheet: Sheet
    folded: SheetFold


def on_its_sheet(
    candidate: Candidate, net_of: NetOf, problem: FoldProblem, without: Collection[str]
) -> Finalist:
    """Place the net of a candidate and fold it with the sheet in the way.

    Raises:
        PlanError: if it does not fit, or its base cannot be held.
    """
    net, axis_rad = net_of(candidate)
    placed = place_net(net, problem.limits, axis_rad)
    sheet = make_sheet(placed, problem.limits)
    folded = fold_on_sheet(placed, sheet, problem, without, after=candidate.after, back=candidate.held_back)
    weight = cost(folded.result, problem)
    if folded.hold.needed and "held" not in without:
        weight += 1.0  # ``plan_on_sheet`` refuses it: the last resort
    return Finalist(candidate, weight, placed, folded.sheet, folded)


def improve_on_sheet(
    start: Finalist,
    net_of: NetOf,
    problem: FoldProblem,
    settings: SearchSettings,
    most_sheets: int,
    without: Collection[str] = (),
) -> Finalist:
    """Anneal on from a finalist, with the sheet in the way.

    The same moves as in ``fold_search.improve``, driven by what stops the folds on the sheet. A sheet takes
    as long as many folds, and only takes away. While it costs the net nothing, the annealing goes on without
    it, and only a net that would be the best is folded on its sheet; if that spoils it, the annealing goes
    back to the best one. While it does cost something, every net gets its sheet that would be taken up. At
    the end the angles of the best one are repaired, see ``angle_repair``.

    Args:
        start: where to start.
        net_of: the net of a candidate.
        problem: goal, limits and rules.
        settings: ``evaluations`` bounds the nets tried; with a deadline it cools down until then.
        most_sheets: bounds the sheets made.
        without: rules that are switched off.

    Returns:
        The best finalist met; ``start`` if nothing was better.
    """
    rng = np.random.default_rng(settings.seed)
    axes = axis_angles(problem)
    now = best = _State.of(start)
    sheets, began, moved = 0, time.monotonic(), False
    for step in range(settings.evaluations):
        if sheets >= most_sheets or settings.late or (best.result.cause == 0).all():
            break
        moved = True
        work = max(sheets / max(1, most_sheets - 1), step / max(1, settings.evaluations - 1))
        temperature = WARM * (COLD / WARM) ** settings.share(work, began)
        bar = now.cost - temperature * math.log(1.0 - rng.random())
        net = now.candidate
        limit = net.own_limit(problem, net.cost + bar - now.cost, fixed_net=settings.fixed_net)
        move = random_trial(
            net.trial, net.tree, now.result, rng, axes, fixed_base=settings.fixed_base,
            fixed_net=settings.fixed_net, own=limit,
        )  # fmt: skip
        if move is None:
            continue
        trial = judge(move.layout, problem, move.axis_rad, bar, move.after, move.own, move.back)
        if trial.cost > bar or not math.isfinite(trial.cost):
            continue
        if trial.cost >= best.cost and not now.spoilt:
            now = _State(trial, trial.cost, trial.result)
            continue
        sheets += 1
        try:
            found = _State.of(on_its_sheet(trial, net_of, problem, without))
        except PlanError:
            found = None  # it does not fit, or nothing can hold its base
        if found is not None and found.cost < best.cost:
            best = now = found
        elif found is not None and found.cost <= bar:
            now = found
        elif not now.spoilt:
            now = best
    assert best.finalist is not None  # noqa: S101 - only nets on their sheets become the best
    mended = repaired(best.candidate, problem, settings.repair_until) if moved else best.candidate
    if mended is not best.candidate:
        with suppress(PlanError):
            return min(best.finalist, on_its_sheet(mended, net_of, problem, without), key=lambda f: f.cost)
    return best.finalist


@dataclass(frozen=True, eq=False)
class _State:
    """A net in the annealing: with the result and cost on its sheet, or, if that was not made, without."""

    candidate: Candidate
    cost: float
    result: FoldResult
    finalist: Finalist | None = None

    @staticmethod
    def of(finalist: Finalist) -> _State:
        return _State(finalist.candidate, finalist.cost, finalist.folded.result, finalist)

    @property
    def spoilt(self) -> bool:
        """True if the sheet costs it something."""
        return self.cost > self.candidate.cost + SPOILT
