"""Sag where it matters: what gravity does to a part, as warnings for the plan."""

from __future__ import annotations

import numpy as np

from planner.fold_plan import FoldPlan
from twin.dynamics import DynamicResult
from twin.shape_error import folded_draws, shape_errors

__all__ = ["SHAPE_SHARE", "TIGHT_YIELD_SHARE", "sag_warnings"]

TIGHT_YIELD_SHARE = 0.5
"""Elastic angle over yield angle from which a hinge is called nearly yielding."""

SAG_RAD = float(np.radians(0.5))
"""Elastic angle at the end from which a crease is named."""

SHAPE_SHARE = 0.005
"""Growth of the shape error by sag, over the goal's diagonal, that is worth a word."""

_MOST = 3


def sag_warnings(plan: FoldPlan, run: DynamicResult) -> tuple[str, ...]:
    """What a person who looks at the plan should know about its weight; empty if gravity does not matter.

    Args:
        plan: the plan.
        run: its dynamic run; nothing is said of one that did not finish.
    """
    if not run.finished:
        return ()
    out = []
    elastic = run.angles_rad - run.permanent_rad
    order = np.argsort(-np.abs(elastic), kind="stable")
    sagging = [int(c) for c in order if abs(elastic[c]) > SAG_RAD]
    if sagging:
        named = ", ".join(f"{c} by {np.degrees(elastic[c]):+.2f}°" for c in sagging[:_MOST])
        more = f" and {len(sagging) - _MOST} more" if len(sagging) > _MOST else ""
        out.append(
            f"sag: creases give under the weight at the end: {named}{more}; "
            "a thicker sheet or a smaller part sags less"
        )
    if run.yield_share > TIGHT_YIELD_SHARE:
        out.append(
            f"sag: a crease carries {100.0 * run.yield_share:.0f} % of the load at which it yields "
            "while the part is folded or turned; above 100 % it bends by itself"
        )
    corners = folded_draws(plan.net, np.stack([run.angles_rad, run.permanent_rad]))
    with_sag, without = shape_errors(plan.net, corners)[0].tolist()
    diagonal = float(np.linalg.norm(np.ptp(plan.net.goal.vertices, axis=0)))
    if with_sag - without > SHAPE_SHARE * diagonal:
        out.append(
            f"sag: hanging in its frame the part is {with_sag:.2f} mm rms off its goal, without weight "
            f"{without:.2f} mm"
        )
    touching = [e for e in run.noted if e.depth_mm > plan.limits.thickness]
    if touching:
        worst = max(touching, key=lambda e: e.depth_mm)
        number = "once" if len(touching) == 1 else f"{len(touching)} times"
        out.append(
            f"sag: faces lean on others by more than a thickness {number}, most of all {worst.detail}; "
            "the creases between give way by less than half of what they bear"
        )
    hidden = sum(e.kind == "occluded" for e in run.noted)
    if hidden:
        number = "1 crease is" if hidden == 1 else f"{hidden} creases are"
        out.append(
            f"sag: {number} hidden from the beam by more than planned while the part sags; a tilt to the "
            "other side may cure it"
        )
    return tuple(out)
