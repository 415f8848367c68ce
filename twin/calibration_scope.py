"""Whether a calibration holds for a sheet, a laser and a heating model."""

from __future__ import annotations

from typing import Literal

from rigs.material import Material
from twin.pass_law import HeatingModel

__all__ = ["calibration_holds"]

_SAME_THICKNESS, _SAME_WAVELENGTH = 0.05, 0.05
"""A calibration holds for thicknesses and wavelengths within this share of what was burnt."""


def calibration_holds(
    material: Material,
    *,
    thickness_mm: float,
    wavelength_nm: float,
    absorptivity: float,
    heating: HeatingModel,
) -> tuple[Literal["none", "fitted"], str]:
    """Whether angles on a sheet are those that were calibrated, and if not why, in words.

    Args:
        material: what the sheet is made of.
        thickness_mm: of the sheet.
        wavelength_nm: of the laser.
        absorptivity: absorbed share of the light that is used.
        heating: where angles of passes come from.
    """
    calibration = material.calibration
    if calibration.status == "none":
        return "none", (
            f"material {material.name} is not calibrated: angles may be 30 % off, burn a test strip"
        )
    lead = f"the calibration of material {material.name} does not hold here: "
    burnt = calibration.thickness_mm
    if burnt and not any(abs(thickness_mm / h - 1.0) <= _SAME_THICKNESS for h in burnt):
        sheets = ", ".join(f"{h:g}" for h in burnt)
        return "none", f"{lead}the sheet is {thickness_mm:g} mm, {sheets} mm were burnt"
    light = calibration.wavelength_nm
    if light > 0.0 and abs(wavelength_nm / light - 1.0) > _SAME_WAVELENGTH:
        return "none", f"{lead}the laser has {wavelength_nm:g} nm, the table was burnt with {light:g} nm"
    if abs(absorptivity / material.absorptivity_at(wavelength_nm) - 1.0) > 1e-6:
        return "none", f"{lead}another absorptivity was given"
    if heating != "fast":
        return "none", f"{lead}it was fitted to the fast heating model, not to the section model"
    return "fitted", ""
