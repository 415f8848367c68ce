"""Power, speed and passes of a cut: as fast as the power cap of a rig melts the kerf."""

from __future__ import annotations

import math

from rigs.material import Material
from rigs.rig import Rig
from twin.errors import HeatingError
from twin.hot_metal import melting_heat

__all__ = ["CUT_RESERVE", "MELTING_SHARE", "SLOWEST_CUT_MM_S", "cut_setting"]

MELTING_SHARE = 0.483
"""Largest share of the absorbed power that melts a kerf. Swift-Hook and Gick, Welding J. 52 (1973)."""

CUT_RESERVE = 1.25
"""Cuts get this much more than melting needs. Grade C."""

SLOWEST_CUT_MM_S = 2.0

MOST_PASSES = 20


def cut_setting(
    rig: Rig, material: Material, thickness_mm: float, kerf_mm: float, absorptivity: float, where: str
) -> tuple[float, float, int]:
    """Power in W, speed in mm/s and number of passes that cut a sheet.

    Args:
        rig: the machine.
        material: of the sheet.
        thickness_mm: of the sheet.
        kerf_mm: width of the cut.
        absorptivity: absorbed share of the light.
        where: for messages, such as ``step 3``.

    Raises:
        HeatingError: if the rig cannot cut it.
    """
    power = rig.laser.cap_fraction * rig.laser.max_w
    needed = melting_heat(material) * 1e-6 * thickness_mm * kerf_mm  # J/m
    speed = 1e3 * MELTING_SHARE * absorptivity * power / (CUT_RESERVE * needed)
    passes = max(1, math.ceil(SLOWEST_CUT_MM_S / speed))
    if passes > MOST_PASSES:
        raise HeatingError(
            f"{where} cuts {thickness_mm:g} mm of {material.name}: {power:.3g} W would "
            f"need {passes} passes at {SLOWEST_CUT_MM_S:g} mm/s: choose thinner metal or a stronger laser"
        )
    return power, min(speed * passes, 0.5 * min(rig.axes.max_mm_s[:2])), passes
