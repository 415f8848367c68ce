"""What a rig and a material allow, in the terms of the planner."""

from __future__ import annotations

import math
from typing import Protocol

from planner.fold_plan import MachineLimits
from planner.relief import relief_mm_for
from rigs.errors import ProfileError
from rigs.rig import Rig

__all__ = ["machine_limits"]


class SheetMaterial(Protocol):
    """The part of a material that the limits need."""

    @property
    def name(self) -> str:
        """Name of the material, for messages."""

    @property
    def density_kg_m3(self) -> float:
        """Density, kg/m³."""

    @property
    def yield_pa(self) -> float:
        """Yield stress at room temperature, Pa."""

    @property
    def neutral_share(self) -> float:
        """Neutral fibre beyond the middle of the sheet, away from the beam, as a share of the thickness."""


def machine_limits(rig: Rig, material: SheetMaterial, thickness_mm: float | None = None) -> MachineLimits:
    """Limits of ``rig`` for a sheet of ``material``.

    The lens height is the one with the focus on the rotary axis, so a rotation needs no raised head. A rig
    that cannot move its focus gets no focus travel; the planner then keeps tilted creases within the depth
    of focus. Where the rays come from one point, the tilt is limited so that the incidence at the corners of
    the work area is still allowed. The strip that bends is as wide as the spot: the heating model gives a
    crease the stiffness of such a strip (grade C, measure it on a bent section). Both it and the relief holes
    are on.

    Args:
        rig: the machine.
        material: what the sheet is made of.
        thickness_mm: of the sheet; the rig's usual thickness when None.

    Raises:
        ProfileError: if the clamps do not hold that thickness.
    """
    thickness = rig.sheet.thickness_mm if thickness_mm is None else thickness_mm
    low, high = rig.sheet.thickness_range_mm
    if not low <= thickness <= high:
        raise ProfileError(
            f"rig {rig.name}: a {thickness:g} mm sheet of {material.name} does not fit its clamps, "
            f"which hold {low:g} to {high:g} mm: choose a thickness in that range"
        )
    axis_z = rig.rotary.axis_point_mm[2]
    travel = min(axis_z - rig.axes.z_mm[0], rig.axes.z_mm[1] - axis_z) if rig.has_focus_axis else 0.0
    source = _beam_source(rig)
    return MachineLimits(
        thickness=thickness,
        kerf=rig.head.kerf_mm or rig.head.spot_mm,
        work_area=rig.sheet.max_mm,
        axis_height=axis_z - rig.clear.bed_z_mm,
        lens_height=rig.head.working_distance_mm,
        max_tilt_rad=_most_tilt(rig, source),
        beam_radius=rig.beam_radius_mm(rig.head.depth_of_focus_mm / 2.0),
        beam_spread=rig.beam_spread,
        beam_source=source,
        frame_margin=rig.sheet.frame_margin_mm,
        clearance=rig.sheet.clearance_mm,
        depth_of_focus=rig.head.depth_of_focus_mm,
        focus_travel=travel,
        weight_n_mm2=material.density_kg_m3 * 9.81 * thickness * 1e-9,
        plastic_moment_n=material.yield_pa * 1e-6 * thickness**2 / 4.0,
        bend_width=rig.head.spot_mm,
        neutral_shift=material.neutral_share * thickness,
        relief_mm=relief_mm_for(rig.head.spot_mm, thickness),
        clamp_height=rig.sheet.clamp_height_mm,
        clamps=rig.sheet.clamp_polygons_mm,
    )


def _beam_source(rig: Rig) -> tuple[float, float, float] | None:
    """Where the rays come from, seen from the origin of the sheet; None where they are parallel."""
    if rig.head.telecentric:
        return None
    (x, y, z), origin = rig.head.scan_centre_mm, rig.rotary.axis_point_mm
    return x - origin[0], y - origin[1], z - origin[2]


def _most_tilt(rig: Rig, source: tuple[float, float, float] | None) -> float:
    """Largest tilt at which the incidence stays within the limit of the head, rad."""
    allowed = math.radians(rig.head.max_incidence_deg)
    if source is None:
        return allowed
    half = 0.5 * math.hypot(*rig.sheet.max_mm) + math.hypot(*source[:2])
    return max(0.0, allowed - math.atan2(half, source[2]))
