"""Temperatures of creases for the report: when passes begin, and how a crease cools after its last one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rigs.material import Material
    from rigs.process import FoldProcess, Process

__all__ = ["AGES_S", "cooling_c"]

AGES_S = (1.0, 5.0, 20.0, 60.0, 300.0, 1200.0)
"""Seconds after a fold at which its temperature is told."""


def cooling_c(fold: FoldProcess, process: Process, material: Material) -> tuple[float, ...]:
    """Mean temperature in °C of a crease at ``AGES_S`` after its fold, the heat of its own passes added up.

    Heat of other creases is left out. Never above the hottest temperature of the lit side.
    """
    from twin.cooling import AMBIENT_C, crease_rise

    if not fold.passes:
        return tuple(AMBIENT_C for _ in AGES_S)
    beam_s = fold.beam_s / fold.passes
    begins = np.concatenate([[0.0], np.cumsum(beam_s + np.array(fold.waits_s))[:-1]])
    ages = np.array(AGES_S)[:, None] + (fold.seconds - begins)[None]
    line_j_m = 1e3 * process.absorptivity * fold.power_w / fold.speed_mm_s
    rise = crease_rise(np.maximum(ages, 1e-3), line_j_m, process.thickness_mm, material).sum(axis=1)
    return tuple(float(v) for v in np.minimum(AMBIENT_C + rise, max(fold.peak_top_c, AMBIENT_C)))
