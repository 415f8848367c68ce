"""The pass law of one setting by the section model: what a chain of passes asks, answered from its table."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twin.errors import HeatingError
from twin.process_table import Conditions
from twin.section_model import SectionCase
from twin.section_table import TABLE_PASSES, section_table

__all__ = ["MODEL_NAME", "SectionLaw", "section_case"]

MODEL_NAME = "section-table/1"


def section_case(conditions: Conditions, power_w: float, speed_mm_s: float) -> SectionCase:
    """The setting as the section model wants it.

    A footprint that is longer across the crease is a round beam that leans across it. One that is longer
    along the crease has no such picture: a round spot of the same area stands for it.
    """
    across, along = conditions.across_mm, conditions.along_mm
    leans = across >= along
    return SectionCase(
        conditions.material,
        conditions.thickness_mm,
        power_w,
        speed_mm_s,
        spot_mm=2.0 * (along if leans else math.sqrt(across * along)),
        absorptivity=conditions.absorptivity,
        tilt_rad=math.acos(along / across) if leans else 0.0,
    )


class SectionLaw:
    """Angles of the passes of one setting by the section model; satisfies ``PassLaw``.

    Args:
        conditions: what the setting is used under.
        power_w: laser power.
        speed_mm_s: along the crease.
        folder: where tables are kept; the user's folder for caches if None.

    Raises:
        HeatingError: if the section model does not fold at this setting.
    """

    def __init__(
        self, conditions: Conditions, power_w: float, speed_mm_s: float, *, folder: Path | None = None
    ) -> None:
        self.power_w = power_w
        case = section_case(conditions, power_w, speed_mm_s)
        self.table = section_table(case, max(conditions.allowed_c, 100.0), folder=folder)
        if float(self.table.angle_rad.min()) <= 0.0:
            raise HeatingError(
                f"the section model folds away from the beam, or not at all, at {power_w:.3g} W and "
                f"{speed_mm_s:.3g} mm/s on {conditions.thickness_mm:g} mm of {conditions.material.name}: "
                "take --heating fast and burn a test strip, or another thickness or rig"
            )
        self.first_rad = self.table.first_rad
        flags = []
        if self.table.failures:
            flags.append("the section model did not find its balance everywhere: angles may be off")
        if conditions.across_mm < conditions.along_mm * (1.0 - 1e-9):
            flags.append("for beams that lean along a crease the section model takes a round spot")
        if conditions.material.calibration.status != "none":
            flags.append("the material's fitted pass law is for the fast model; the section does not use it")
        self._flags = tuple(flags)

    def factors(self, start_c: NDArray[np.float64], done: int = 0) -> NDArray[np.float64]:
        """(N,) angles of passes over that of the first one on cold metal, after ``done`` passes."""
        return self.table.angles(np.asarray(start_c, dtype=np.float64), done) / self.first_rad

    def first_rad_at(self, power_w: float) -> float:
        """Angle of a first pass on cold metal at another power, rad."""
        return self.table.angle_at_share(power_w / self.power_w)

    def flags_after(self, passes: int) -> tuple[str, ...]:
        """What is doubtful when a crease gets so many passes, in words."""
        if passes <= TABLE_PASSES:
            return self._flags
        beyond = f"creases get more than {TABLE_PASSES} passes: later ones go on along a power law"
        return (*self._flags, beyond)
