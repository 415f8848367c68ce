"""Tables as a strip of known parameters would give them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rigs.material import Material, load_material
from twin.calibration_table import BurntCrease, CalibrationTable
from twin.pass_fit import predict

STEEL: Material = load_material("304")
THICKNESS = 0.1
TRUE = {"absorptivity": 0.38, "threshold": 7.0, "half_passes": 60.0}
"""The threshold puts the first fold near 4 W, so that it matters at the powers of the table."""


def burnt(
    powers: Sequence[float] = (5.0, 7.0, 9.0, 11.0),
    speeds: Sequence[float] = (100.0, 200.0),
    passes: Sequence[int] = (1, 5, 10, 20),
    thicknesses: Sequence[float | None] = (None,),
    repeats: int = 1,
    *,
    noise: float = 0.0,
    seed: int = 0,
    material: Material = STEEL,
    truth: dict[str, float] = TRUE,
) -> CalibrationTable:
    """Every combination, ``repeats`` times, with relative scatter ``noise``."""
    settings = [(p, v, n, h) for h in thicknesses for v in speeds for p in powers for n in passes]
    rows = [
        BurntCrease(k + 2, p, v, 0.1, h, n, 20.0, 0.0) for k, (p, v, n, h) in enumerate(settings * repeats)
    ]
    angles = predict(material, rows, THICKNESS, **truth)
    angles *= np.exp(noise * np.random.default_rng(seed).standard_normal(len(rows)))
    measured = tuple(replace(row, angle_deg=float(a)) for row, a in zip(rows, angles, strict=True))
    return CalibrationTable("strip.csv", measured, ())
