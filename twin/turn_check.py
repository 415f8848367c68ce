"""Turns of the sheet, checked with the part as it is folded at that moment: bed and lens must stay clear."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from planner.clearance import TurningPart, rotation_clearance
from planner.fold_plan import FoldPlan
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
        part = TurningPart(self.plan)
        for done in self.plan.steps[: max(step, 0)]:
            part.pass_step(done)
        return part.points(angles)
