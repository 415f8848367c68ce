"""Steps and blocked creases in words and plain values, for the summary, the report and messages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner.fold_plan import Bend, Blocked, Clip, Cut, Fold, FoldPlan, Release, Rotate, Step, Wait

__all__ = ["blocked_text", "blocked_values", "degrees", "step_op", "step_text"]

_OPS: dict[type, str] = {
    Cut: "cut", Clip: "clip", Bend: "bend", Rotate: "rotate", Fold: "fold", Wait: "wait", Release: "release",
}  # fmt: skip


def degrees(angle_rad: float, digits: int = 3) -> float:
    """An angle in degrees, rounded; minus zero becomes zero."""
    return round(math.degrees(angle_rad), digits) + 0.0


def step_op(step: Step) -> str:
    """The ``op`` of a step in ``plan.json``."""
    return _OPS[type(step)]


def step_text(plan: FoldPlan, step: Step, before_rad: float = 0.0) -> str:
    """One step in words.

    Args:
        plan: the plan that the step belongs to.
        step: the step.
        before_rad: for a fold, the angle at which the crease stood before it.
    """
    match step:
        case Cut(paths=paths, why=why):
            length = sum(_length(path) for path in paths)
            return f"cut {length:.{0 if length >= 9.95 else 1}f} mm" + (f": {why}" if why else "")
        case Clip(faces=faces):
            return f"clip {_count(len(faces), 'piece')} of the sheet"
        case Bend(faces=faces, to_rad=to):
            return f"bend {_count(len(faces), 'piece')} of the sheet to {degrees(to, 1):g}°"
        case Rotate(to_rad=to):
            turn = degrees(to, 1)
            side = {0.0: " (top side up)", 180.0: " (bottom side up)"}.get(turn, " (tilted)")
            return f"rotate to {turn:g}°{side}"
        case Fold(crease=crease, to_rad=to):
            kind = "valley" if plan.net.fold_angle[crease] > 0 else "mountain"
            return f"fold crease {crease} ({kind}) from {degrees(before_rad, 1):g}° to {degrees(to, 1):g}°"
        case Wait(seconds=seconds):
            return f"wait {seconds:g} s to cool"
        case Release():
            return "cut the tabs: the part is free"


def blocked_text(blocked: Blocked) -> str:
    """Why a crease is not folded all the way, in one line."""
    reached, wanted = degrees(blocked.reached_rad, 1), degrees(blocked.wanted_rad, 1)
    who = _blockers(blocked)
    reason = {
        "collision": f"the moving part would touch {who}",
        "sight": f"{who} would hide it from the beam",
        "substrate": f"the moving part would touch the sheet ({_triangles(blocked)})",
        "order": "it could only turn after creases that stay blocked",
        "limit": "more is beyond what the machine and the material allow",
        "room": "it is left short on purpose, so that others can go further",
    }[blocked.by]
    at = f" at {degrees(blocked.at_rad, 1):g}°" if blocked.by in ("collision", "sight", "substrate") else ""
    return f"crease {blocked.crease} stops at {reached:g}° of {wanted:g}°: {reason}{at}"


def blocked_values(blocked: Blocked) -> dict[str, Any]:
    """A blocked crease as plain values, angles in degrees."""
    return {
        "crease": blocked.crease,
        "reached_deg": degrees(blocked.reached_rad),
        "wanted_deg": degrees(blocked.wanted_rad),
        "by": blocked.by,
        "with": list(blocked.blockers),
        "at_deg": degrees(blocked.at_rad),
        "text": blocked_text(blocked),
    }


def _blockers(blocked: Blocked) -> str:
    if not blocked.blockers:
        return "another face"
    shown = ", ".join(map(str, blocked.blockers[:4])) + (" …" if len(blocked.blockers) > 4 else "")
    return f"{'face' if len(blocked.blockers) == 1 else 'faces'} {shown}"


def _triangles(blocked: Blocked) -> str:
    if not blocked.blockers:
        return "a part that has to stay"
    shown = ", ".join(map(str, blocked.blockers[:4])) + (" …" if len(blocked.blockers) > 4 else "")
    return f"{'triangle' if len(blocked.blockers) == 1 else 'triangles'} {shown}"


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}" + ("" if number == 1 else "s")


def _length(path: tuple[tuple[float, float], ...]) -> float:
    if len(path) < 2:
        return 0.0
    return float(np.linalg.norm(np.diff(np.array(path), axis=0), axis=1).sum())
