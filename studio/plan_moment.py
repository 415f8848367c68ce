"""What part, sheet and machine look like at a moment of a plan; time is counted in steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.words import step_text

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan

__all__ = ["PlanMoment", "moment_at"]


@dataclass(frozen=True, eq=False)
class PlanMoment:
    """One moment.

    Attributes:
        time: in steps; 3.5 is half of the fourth step.
        text: the step in words.
        angles_rad: (E,) fold angle of every edge of the net.
        rotary_rad: angle of the rotary.
        gone: triangles of the sheet that are clipped.
        bent: step of a bend → its angle now, rad.
        crease: net edge that is being folded, -1 if none.
        released: the part is cut free.
    """

    time: float
    text: str
    angles_rad: NDArray[np.float64]
    rotary_rad: float
    gone: frozenset[int]
    bent: dict[int, float]
    crease: int
    released: bool


def moment_at(plan: FoldPlan, time: float) -> PlanMoment:
    """The moment ``time`` of a plan, from 0 (the flat sheet) to its number of steps; beyond is cut off."""
    from planner.fold_plan import Bend, Clip, Fold, Release, Rotate

    time = min(max(time, 0.0), float(len(plan.steps)))
    angles = np.zeros(len(plan.net.edges))
    rotary, crease, released, text = 0.0, -1, False, "flat sheet"
    gone: set[int] = set()
    bent: dict[int, float] = {}
    for index, step in enumerate(plan.steps[: math.ceil(time)]):
        share = min(1.0, time - index)
        text, crease = step_text(plan, step, _before(step, angles)), -1
        match step:
            case Fold(crease=edge, to_rad=to):
                angles[edge] += share * (to - angles[edge])
                crease = edge if share < 1.0 else -1
            case Rotate(to_rad=to):
                rotary += share * (to - rotary)
            case Clip(faces=faces) if share >= 1.0:
                gone.update(faces)
            case Bend(to_rad=to):
                bent[index] = share * to
            case Release() if share >= 1.0:
                released = True
    if time >= len(plan.steps):
        text = "finished"
    return PlanMoment(time, text, angles, rotary, frozenset(gone), bent, crease, released)


def _before(step: object, angles: NDArray[np.float64]) -> float:
    from planner.fold_plan import Fold

    return float(angles[step.crease]) if isinstance(step, Fold) else 0.0
