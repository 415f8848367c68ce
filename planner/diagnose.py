"""Diagnosis of a finished plan: why each crease that stays short does, and what would free it."""

from __future__ import annotations

from dataclasses import replace

from planner.cures import CureFinder, Effort
from planner.diagnosis import Proof
from planner.fold_causes import find_causes
from planner.fold_orders import angle_proof, try_all_orders
from planner.fold_plan import FoldPlan
from planner.fold_trials import Workbench

__all__ = ["diagnose"]


def diagnose(plan: FoldPlan, effort: Effort | None = None, *, only: int | None = None) -> FoldPlan:
    """``plan`` with a ``Diagnosis`` at each of its blocked creases.

    Causes are measured on the plan. Cures are changes with which the net was folded again, on its sheet and
    with the rules that were on; see ``planner.cures``. The same plan and effort give the same diagnosis.

    Args:
        plan: a finished plan.
        effort: how much is tried; None: ``Effort.small()``, about three seconds on 128 faces.
        only: look for cures of this crease only; the others get their causes.
    """
    if not plan.blocked:
        return plan
    effort = Effort.small() if effort is None else effort
    bench = Workbench(plan)
    found = find_causes(plan, bench.problem, bench.tree, bench.bodies, bench.kept)
    finder = CureFinder(bench, effort)
    faces = {crease: plan.net.child_of[crease] for crease in found}
    orders = try_all_orders(bench.problem, bench.tree, bench.bodies, faces.values(), effort.states)
    worst = sorted(found, key=lambda crease: (-round(found[crease].loss_mm, 9), crease))
    for rank, crease in enumerate(worst):
        proof = angle_proof(bench.problem, bench.tree, faces[crease])
        if proof is None and orders.exhausted and faces[crease] not in orders.freed:
            proof = Proof("orders", states=orders.states, beams=orders.beams)
        if rank >= effort.creases if only is None else crease != only:
            found[crease] = replace(found[crease], proof=proof, capped=True)
            continue
        cures, capped = finder.find(crease, found[crease])
        found[crease] = replace(
            found[crease], proof=proof, cures=cures, capped=capped, tries=sum(c.tries for c in cures)
        )
    return replace(plan, blocked=tuple(replace(b, diagnosis=found[b.crease]) for b in plan.blocked))
