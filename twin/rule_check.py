"""Rules of a plan that are no contact and no shadow: order, side, tilt, what holds the part, clearance.

The planner keeps them by construction; here a plan is read step by step and whatever breaks one is named for
what it is. Rules that a plan was made without (``--without``) are not asked.
"""

from __future__ import annotations

import math
import re

import numpy as np

from planner.clearance import check_rotation_clearance
from planner.fold_plan import Fold, FoldPlan, Rotate
from planner.held_check import check_held
from twin.events import Event

__all__ = ["RULES", "rule_events"]

RULES = ("outside-in", "side", "tilt", "held", "clearance")
"""Names of the rules that are asked here; ``tilt`` goes with ``side``."""

_FLAT_RAD = 1e-6
_TILT_RAD = 1e-6
_STEP = re.compile(r"step (\d+): (.*)", re.DOTALL)


def rule_events(plan: FoldPlan) -> tuple[Event, ...]:
    """Every breach of a rule, in the order of the plan."""
    found = _turns(plan)
    if "held" not in plan.without:
        found += _told(plan, "held", check_held(plan))
    if "clearance" not in plan.without:
        found += _told(plan, "clearance", check_rotation_clearance(plan))
    return tuple(sorted(found, key=lambda e: (e.step, RULES.index(e.rule))))


def _turns(plan: FoldPlan) -> list[Event]:
    """Breaches of outside-in, side and tilt."""
    net, out = plan.net, []
    angle = np.zeros(len(net.edges))
    rotary = 0.0
    for number, step in enumerate(plan.steps):
        if isinstance(step, Rotate):
            rotary = step.to_rad
        elif isinstance(step, Fold):
            child = net.child_of.get(step.crease)
            if child is None:
                continue  # not a crease: whoever plays the plan refuses it
            change = step.to_rad - float(angle[step.crease])
            faces = (int(child), int(net.parent[child]))
            if abs(change) > _FLAT_RAD:
                for rule, detail in _objections(plan, int(child), step, change, rotary, angle):
                    out.append(
                        Event(
                            "rule", number, step.crease, faces, angle_rad=float(angle[step.crease]),
                            detail=detail, rule=rule,
                        )
                    )  # fmt: skip
            angle[step.crease] = step.to_rad
    return out


def _objections(
    plan: FoldPlan, child: int, fold: Fold, change: float, rotary: float, angle: np.ndarray
) -> list[tuple[str, str]]:
    net, out = plan.net, []
    if "outside-in" not in plan.without:
        inner = int(net.parent[child])
        while inner != net.base_face:
            crease = int(net.crease_of[inner])
            if abs(float(angle[crease])) > _FLAT_RAD:
                out.append((
                    "outside-in",
                    f"crease {fold.crease} turns while crease {crease}, between it and the base face, "
                    f"stands at {math.degrees(float(angle[crease])):.2f}°",
                ))  # fmt: skip
                break
            inner = int(net.parent[inner])
    if "side" not in plan.without:
        lit = math.cos(rotary)
        if change * lit <= 0.0:
            lit_side, turned = ("top", "bottom") if lit > 0.0 else ("bottom", "top")
            out.append((
                "side",
                f"crease {fold.crease} is to turn by {math.degrees(change):+.2f}°, to the {turned} side, but "
                f"the beam lights the {lit_side} side at rotary angle {math.degrees(rotary):.2f}°",
            ))  # fmt: skip
        tilt = abs(math.remainder(rotary, math.pi))
        if tilt > plan.limits.max_tilt_rad + _TILT_RAD:
            out.append((
                "tilt",
                f"crease {fold.crease} is lit at a tilt of {math.degrees(tilt):.2f}°, the machine allows "
                f"{math.degrees(plan.limits.max_tilt_rad):.2f}°",
            ))  # fmt: skip
    return out


def _told(plan: FoldPlan, rule: str, lines: list[str]) -> list[Event]:
    """Events of the lines of a planner's check: ``step N: …``, or no step for the whole plan."""
    out = []
    for line in lines:
        match = _STEP.fullmatch(line)
        number = int(match[1]) if match else max(0, len(plan.steps) - 1)
        step = plan.steps[number] if number < len(plan.steps) else None
        crease = -1
        faces: tuple[int, ...] = ()
        if isinstance(step, Fold):
            child = plan.net.child_of.get(step.crease)
            if child is not None:
                crease, faces = step.crease, (int(child), int(plan.net.parent[child]))
        out.append(Event("rule", number, crease, faces, detail=match[2] if match else line, rule=rule))
    return out
