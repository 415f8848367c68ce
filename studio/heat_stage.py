"""The part of planning that heat decides: laser settings, waits, and folds that take turns."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from studio.errors import UsageError
from studio.options import PlanOptions

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan
    from rigs.process import Process
    from studio.workspace import Workspace

__all__ = ["choose_heat", "heat_values", "made_process", "taking_turns"]


def choose_heat(ws: Workspace, options: PlanOptions) -> None:
    """Note in the manifest how the process is made, so that every later stage makes the same.

    Raises:
        UsageError: if creases may not be warmer than the room.
    """
    from twin.plan_process import ALLOWED_START_C, COLD_C

    start_c = ALLOWED_START_C if options.start_c is None else options.start_c
    if start_c < COLD_C:
        raise UsageError(
            f"--start-temperature {start_c:g}: creases cool to the room's temperature only in the end; give "
            f"{COLD_C:g} °C or more"
        )
    ws.manifest.process = {"prefer": options.prefer, "start_c": start_c, "heating": options.heating}


def made_process(ws: Workspace, plan: FoldPlan) -> Process:
    """Passes, power, speed and waits of ``plan``, as the manifest says that they are made."""
    from twin.plan_process import plan_process

    return plan_process(plan, ws.rig, ws.material, **_choice(ws))


def taking_turns(ws: Workspace, plan: FoldPlan, options: PlanOptions) -> FoldPlan:
    """``plan`` with folds in stages that take turns, if that was asked for and saves time."""
    if not options.take_turns:
        return plan
    from twin.interleave import interleave

    ws.progress.update(0.99, "letting folds take turns")
    made = interleave(plan, ws.rig, ws.material, **_choice(ws))
    if made.staged == 0:
        notice = "no fold takes turns with others: nothing is saved by it"
    else:
        notice = (
            f"{made.staged} folds take turns while creases cool: {made.seconds:.0f} s of machine time in "
            f"place of {made.seconds_in_order:.0f} s one by one"
        )
    return replace(made.plan, notices=(*plan.notices, notice))


def heat_values(process: Process) -> dict[str, float]:
    """Figures of heat for the summary."""
    return {
        "peak_start_c": process.peak_start_c,
        "allowed_start_c": process.allowed_start_c,
        "wait_s": round(process.wait_s, 3),
        "naive_wait_s": round(process.naive_wait_s, 3),
    }


def _choice(ws: Workspace) -> dict[str, Any]:
    from twin.plan_process import ALLOWED_START_C

    chosen = ws.manifest.process
    return {
        "objective": chosen.get("prefer", "joules"),
        "allowed_start_c": float(chosen.get("start_c", ALLOWED_START_C)),
        "heating": chosen.get("heating", "fast"),
    }
