"""A material with the values of a calibration."""

from __future__ import annotations

import math

import msgspec

from rigs.material import Calibration, Material
from rigs.rig import Grade
from twin.calibration import Fit

__all__ = ["calibrated_material"]


def calibrated_material(fit: Fit, material: Material) -> Material:
    """The material with the fitted values, graded, its calibration marked.

    Args:
        fit: the calibration.
        material: what was fitted.
    """
    absorptivity = round(fit.value("absorptivity"), 6)
    name = "at_10600nm" if fit.wavelength_nm > 5000.0 else "at_1064nm"
    light = msgspec.structs.replace(material.absorptivity, **{name: absorptivity})
    more = {} if fit.scatter_crease is None else {"scatter_crease": round(max(fit.scatter_crease, 0.005), 4)}
    forming = msgspec.structs.replace(
        material.forming, gain=1.0, threshold=round(fit.value("threshold"), 6),
        half_passes=round(fit.value("half_passes"), 4), **more,
    )  # fmt: skip
    error = f"{100.0 * fit.left_out.rms:.0f} %" if math.isfinite(fit.left_out.rms) else "not known"
    sheets = ", ".join(f"{h:g}" for h in fit.thicknesses_mm)
    source = (
        f"{len(fit.table.rows)} creases of {fit.table.name}, {sheets} mm; error of a left-out "
        f"{fit.left_out.by}: {error}"
    )
    grade = Grade(grade=fit.grade, source=f"fitted to {source}")
    return msgspec.structs.replace(
        material,
        absorptivity=light,
        forming=forming,
        calibration=Calibration(
            status="fitted", source=source, thickness_mm=fit.thicknesses_mm, wavelength_nm=fit.wavelength_nm
        ),
        grades={**material.grades, "absorptivity": grade, "forming": grade},
    )
