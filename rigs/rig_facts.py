"""What follows from a rig profile: figures that an owner can compare with the machine."""

from __future__ import annotations

import math

from rigs.rig import Rig

__all__ = ["rig_facts"]


def rig_facts(rig: Rig) -> dict[str, float]:
    """Derived figures, mm, W, s and degrees in the names.

    ``swing_mm`` is how far the edge of the largest sheet swings up and down when it turns;
    ``room_under_mm`` and
    ``room_over_mm`` are what it has to the bed and to the head. ``off_focus_spot_mm`` is the spot at the
    end of
    the depth of focus. ``largest_s`` is the largest S word that ever passes the gate.
    """
    depth = rig.sheet.max_mm[1]
    axis_z = rig.rotary.axis_point_mm[2]
    tilt = math.radians(rig.head.max_incidence_deg)
    travel = min(axis_z - rig.axes.z_mm[0], rig.axes.z_mm[1] - axis_z) if rig.has_focus_axis else 0.0
    cap = rig.laser.cap_fraction * rig.laser.max_w
    return {
        "sheet_x_mm": rig.sheet.max_mm[0],
        "sheet_y_mm": depth,
        "swing_mm": math.hypot(depth / 2.0, rig.sheet.thickness_mm),
        "room_under_mm": axis_z - rig.clear.bed_z_mm,
        "room_over_mm": rig.head.working_distance_mm,
        "focus_travel_mm": travel,
        "focus_needed_mm": max(depth / 2.0 * math.sin(tilt) - rig.head.depth_of_focus_mm / 2.0, 0.0),
        "spot_mm": rig.head.spot_mm,
        "off_focus_spot_mm": 2.0 * rig.beam_radius_mm(rig.head.depth_of_focus_mm / 2.0),
        "largest_w": cap,
        "largest_s": rig.laser.s_for_power(cap),
        "longest_beam_s": rig.laser.max_beam_s,
        "largest_tilt_deg": rig.head.max_incidence_deg,
        "half_turn_s": 180.0 / rig.rotary.max_deg_s
        + rig.rotary.max_deg_s / rig.rotary.accel_deg_s2
        + rig.rotary.settle_s,
    }
