"""Turns of the sheet, checked with the part as it is folded at that moment: bed and lens must stay clear."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from planner.clearance import bar_corners, bent_points, rotation_clearance
from planner.fold_plan import Bend, Clip, FoldPlan, Release
from planner.kinematics import folded_triangles
from rigs.errors import JobError
from rigs.grbl import Status
from rigs.job import Job
from rigs.replay_blocks import ReplayBlock

__all__ = ["TurnCheck"]


class TurnCheck:
    """A ``rigs.watch.Watch`` that refuses a turn before it is sent, where the part would touch something.

    The plan was checked with its own angles; a part that bent more or less than planned sweeps another space.

    Args:
        plan: the plan, with the sheet and what is clipped, bent and released when.
        job: its job.
        angles_rad: crease → angle of the part in the machine, asked before every turn.
    """

    def __init__(self, plan: FoldPlan, job: Job, angles_rad: Callable[[], Mapping[int, float]]) -> None:
        self.plan, self.job, self.angles_rad = plan, job, angles_rad
        self.turns = 0
        self.least_mm = np.inf
        self._bars = bar_corners(plan)

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """A block is about to be sent.

        Raises:
            JobError: if it turns the sheet and the part would touch bed or lens.
        """
        del seconds, t
        if block.kind != "rotate" or not 0 <= block.index < len(self.job.blocks):
            return
        made = self.job.blocks[block.index]
        before = self.job.blocks[block.index - 1].rotary_rad if block.index else made.rotary_rad
        left = rotation_clearance(
            self._points(made.step), self.plan.limits, *sorted((before, made.rotary_rad))
        )
        margin = left.margin_mm - 0.5 * self.plan.limits.thickness
        self.turns += 1
        self.least_mm = min(self.least_mm, margin)
        if margin < 0.0:
            what = "the bed" if left.to_bed_mm < left.to_lens_mm else "the lens"
            raise JobError(
                f"turn refused in block {block.index} (step {made.step}): the part as it is folded now would "
                f"reach {-margin:.2f} mm into {what} from {np.degrees(before):.4g}° to "
                f"{np.degrees(made.rotary_rad):.4g}°; measure the creases, or take the part out"
            )

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """Nothing to do."""

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """Nothing to do."""

    def _points(self, step: int) -> NDArray[np.float64]:
        """(N, 3) corners of everything that turns at a plan step, mm in the frame of the sheet."""
        angles = np.zeros(len(self.plan.net.edges))
        for crease, angle in self.angles_rad().items():
            angles[crease] = angle
        present = np.ones(len(self.plan.sheet.faces), dtype=np.bool_)
        parts = [self._bars]
        released = False
        for done in self.plan.steps[: max(step, 0)]:
            match done:
                case Clip(faces=faces):
                    present[list(faces)] = False
                case Bend(faces=faces, hinge=hinge, to_rad=to_rad):
                    present[list(faces)] = False
                    parts.append(bent_points(self.plan, faces, hinge, to_rad))
                case Release():
                    released = True
                case _:
                    pass
        flat = self.plan.sheet.vertices[np.unique(self.plan.sheet.faces[present])]
        parts.append(np.column_stack([flat, np.zeros(len(flat))]))
        if not released:
            parts.append(folded_triangles(self.plan.net, angles).reshape(-1, 3))
        return np.concatenate(parts)
