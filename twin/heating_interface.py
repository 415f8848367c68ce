"""What the simulation asks of a heating model: how a crease's plastic angle grows, pass by pass."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from rigs.process import Process
from twin.errors import ModelError
from twin.timeline import Turn

__all__ = ["EqualPasses", "Heating", "ProcessHeating"]


class Heating(Protocol):
    """A heating model as the dynamic run sees it."""

    @property
    def name(self) -> str:
        """Short name for the certificate."""

    def plastic_increments(self, turn: Turn) -> Sequence[float]:
        """Plastic angle in rad that each laser pass of ``turn`` adds, in order."""


@dataclass(frozen=True)
class EqualPasses:
    """Equal passes that end exactly at the plan's angle: geometry only, no physics of heating.

    Attributes:
        per_pass_rad: largest angle of a pass.
        name: short name for the certificate.
    """

    per_pass_rad: float = math.radians(1.0)
    name: str = "equal-passes"

    def plastic_increments(self, turn: Turn) -> Sequence[float]:
        """As many equal increments as ``per_pass_rad`` allows."""
        angle = turn.to_rad - turn.from_rad
        count = max(1, math.ceil(abs(angle) / self.per_pass_rad - 1e-9))
        return (angle / count,) * count


@dataclass(frozen=True, eq=False)
class ProcessHeating:
    """The passes of a process table, as its heating model predicts them.

    Attributes:
        process: the table; turns that it does not know (bent substrate) get equal passes.
    """

    process: Process

    @property
    def name(self) -> str:
        """Name of the process's heating model."""
        return self.process.model

    def plastic_increments(self, turn: Turn) -> Sequence[float]:
        """Increments of the process for the plan step of ``turn``.

        Raises:
            ModelError: if the process has another crease at that step.
        """
        fold = self.process.fold_at.get(turn.step)
        if fold is None:
            return EqualPasses().plastic_increments(turn)
        if fold.crease != turn.crease:
            raise ModelError(
                f"step {turn.step} folds crease {turn.crease}, but the process crease {fold.crease}: "
                "it was made for another plan"
            )
        return fold.increments_rad
