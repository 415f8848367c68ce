"""Checks of a rig profile that need more than one value."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigs.rig import Rig

__all__ = ["TALLEST_CLAMP_MM", "mistakes"]

TALLEST_CLAMP_MM = 50.0
"""Bars of a frame that stand out farther than this are taken for a slip of the pen."""


def mistakes(rig: Rig) -> Iterator[str]:
    """Every mistake of a profile as ``$.place: what, and what to do``."""
    yield from _positive(rig)
    yield from _ranges(rig)
    yield from _controller(rig)
    yield from _laser(rig)
    yield from _rotary(rig)
    yield from _sheet(rig)


def _positive(rig: Rig) -> Iterator[str]:
    positive = {
        "controller.baud": rig.controller.baud,
        "axes.max_step_hz": rig.axes.max_step_hz,
        "head.focal_mm": rig.head.focal_mm,
        "head.working_distance_mm": rig.head.working_distance_mm,
        "head.depth_of_focus_mm": rig.head.depth_of_focus_mm,
        "head.spot_mm": rig.head.spot_mm,
        "laser.wavelength_nm": rig.laser.wavelength_nm,
        "laser.max_w": rig.laser.max_w,
        "rotary.units_per_deg": rig.rotary.units_per_deg,
        "rotary.steps_per_deg": rig.rotary.steps_per_deg,
        "rotary.max_deg_s": rig.rotary.max_deg_s,
        "rotary.accel_deg_s2": rig.rotary.accel_deg_s2,
        "safety.arm_timeout_s": rig.safety.arm_timeout_s,
        "safety.status_hz": rig.safety.status_hz,
        "safety.status_lost_s": rig.safety.status_lost_s,
        "sheet.thickness_mm": rig.sheet.thickness_mm,
    }
    for name in ("max_mm_s", "accel_mm_s2", "steps_per_mm"):
        for i, value in enumerate(getattr(rig.axes, name)):
            positive[f"axes.{name}[{i}]"] = value
    for name, value in positive.items():
        if value <= 0:
            yield f"$.{name}: must be more than 0, got {value}"
    for name, value in {
        "rotary.settle_s": rig.rotary.settle_s,
        "rotary.backlash_deg": rig.rotary.backlash_deg,
        "sheet.frame_margin_mm": rig.sheet.frame_margin_mm,
        "sheet.clearance_mm": rig.sheet.clearance_mm,
        "head.kerf_mm": rig.head.kerf_mm,
        "laser.min_on_ms": rig.laser.min_on_ms,
        "laser.pilot.s": rig.laser.pilot.s,
        "laser.pilot.max_w": rig.laser.pilot.max_w,
    }.items():
        if value < 0:
            yield f"$.{name}: must not be negative, got {value}"


def _ranges(rig: Rig) -> Iterator[str]:
    axes = rig.axes
    for name in ("x_mm", "y_mm", "z_mm"):
        low, high = getattr(axes, name)
        if low > high or (low == high and name != "z_mm"):
            yield f"$.axes.{name}: expected [low, high] with low < high, got [{low}, {high}]"
    for i, (steps, speed) in enumerate(zip(axes.steps_per_mm, axes.max_mm_s, strict=True)):
        if rig.rotary.word == "Z" and i == 2:
            continue  # that motor turns the rotary: checked there
        if steps * speed > axes.max_step_hz:
            yield (
                f"$.axes.max_mm_s[{i}]: {steps:g} steps/mm at {speed:g} mm/s need {steps * speed:g} steps/s, "
                f"the controller makes {axes.max_step_hz:g}: lower the speed"
            )
    if not 0.0 <= rig.head.max_incidence_deg < 90.0:
        yield f"$.head.max_incidence_deg: expected 0 to below 90, got {rig.head.max_incidence_deg}"
    if rig.head.m2 < 1.0:
        yield f"$.head.m2: a beam is never better than M2 = 1, got {rig.head.m2}"
    if rig.head.beam_dir != (0.0, 0.0, -1.0):
        yield f"$.head.beam_dir: the beam shines along [0, 0, -1], got {list(rig.head.beam_dir)}"
    low, high = rig.sheet.thickness_range_mm
    if not 0.0 < low <= rig.sheet.thickness_mm <= high:
        yield f"$.sheet.thickness_mm: {rig.sheet.thickness_mm} is outside thickness_range_mm [{low}, {high}]"


def _controller(rig: Rig) -> Iterator[str]:
    controller = rig.controller
    for key in controller.expect:
        if not (key.startswith("$") and key[1:].isdigit()):
            yield f"$.controller.expect.{key}: expected a setting such as $32"
    if controller.dialect == "marlin":
        if rig.safety.status_lost_s < 3.0:
            yield "$.safety.status_lost_s: Marlin says that it is busy every 2 s: expected 3 or more"
        if rig.laser.pilot.kind == "low-power":
            yield "$.laser.pilot.kind: M3 of Marlin stays on at standstill: expected aux-output or none"
    else:
        if controller.expect.get("$32") != 1.0:
            yield '$.controller.expect: needs "$32" = 1 (laser mode): else M4 burns in travel and at rest'
        if rig.laser.power_curve and controller.expect.get("$30") != rig.laser.power_curve[-1][0]:
            yield (
                f'$.controller.expect: "$30" (full scale of S) must be {rig.laser.power_curve[-1][0]:g}, '
                f"the end of laser.power_curve, got {controller.expect.get('$30', 'nothing')}"
            )
    for name in ("baud", "rx_bytes", "line_chars"):
        if getattr(controller, name) > 10_000_000:
            yield f"$.controller.{name}: no controller has {getattr(controller, name):.3g}"
    if controller.rx_bytes < 64:
        yield f"$.controller.rx_bytes: a beam block needs at least 64 bytes, got {controller.rx_bytes}"
    if controller.line_chars < 40:
        yield f"$.controller.line_chars: a move needs at least 40 characters, got {controller.line_chars}"
    if controller.g54_mm and len(controller.g54_mm) != len(rig.axis_words):
        yield f"$.controller.g54_mm: expected {len(rig.axis_words)} values ({' '.join(rig.axis_words)})"


def _laser(rig: Rig) -> Iterator[str]:
    laser = rig.laser
    curve = laser.power_curve
    if len(curve) < 2 or curve[0] != (0.0, 0.0):
        yield "$.laser.power_curve: expected at least two [S, W] pairs, the first [0, 0]"
    elif any(b[0] <= a[0] or b[1] < a[1] for a, b in itertools.pairwise(curve)):
        yield "$.laser.power_curve: S must rise and W must not fall from pair to pair"
    elif curve[-1][1] != laser.max_w:
        yield f"$.laser.power_curve: must end at max_w = {laser.max_w:g} W, ends at {curve[-1][1]:g} W"
    if not 0.0 < laser.cap_fraction <= 1.0:
        yield f"$.laser.cap_fraction: expected above 0 up to 1, got {laser.cap_fraction}"
    if not laser.min_on_ms / 1000.0 < laser.max_beam_s <= 30.0:
        yield f"$.laser.max_beam_s: expected more than min_on_ms and at most 30 s, got {laser.max_beam_s}"
    if (
        laser.pilot.kind == "low-power"
        and len(curve) > 1
        and laser.power_for_s(laser.pilot.s) > laser.pilot.max_w
    ):
        yield (
            f"$.laser.pilot.s: S{laser.pilot.s:g} gives {laser.power_for_s(laser.pilot.s):g} W, "
            f"more than pilot.max_w = {laser.pilot.max_w:g} W"
        )


def _rotary(rig: Rig) -> Iterator[str]:
    rotary = rig.rotary
    if abs(math.hypot(*rotary.axis_dir) - 1.0) > 1e-9 or abs(abs(rotary.axis_dir[0]) - 1.0) > 1e-9:
        yield f"$.rotary.axis_dir: expected the unit vector along x, [1, 0, 0], got {list(rotary.axis_dir)}"
    elif rotary.axis_dir[0] < 0:
        yield "$.rotary.axis_dir: write [1, 0, 0] and turn rotary.sign instead"
    if (rotary.kind == "swap") != (rotary.word == "Z"):
        yield (
            f"$.rotary.word: kind {rotary.kind} does not go with word {rotary.word}: "
            "Z is a swapped plug (swap), A B C are axes of their own (true-deg)"
        )
    if rotary.word == "Z" and rig.axes.z_mm[0] != rig.axes.z_mm[1]:
        yield "$.axes.z_mm: the z plug drives the rotary, so the focus is fixed: give the same height twice"
    if rotary.word == "Z" and rig.axes.z_mm[0] != rotary.axis_point_mm[2]:
        yield "$.axes.z_mm: a fixed focus must lie at the height of the rotary axis"
    if rotary.kind == "true-deg" and rotary.units_per_deg != 1.0:
        yield f"$.rotary.units_per_deg: true degrees have 1 unit a degree, got {rotary.units_per_deg}"
    rate = rotary.steps_per_deg * rotary.max_deg_s
    if rate > rig.axes.max_step_hz:
        yield f"$.rotary.max_deg_s: needs {rate:g} steps/s, the controller makes {rig.axes.max_step_hz:g}"
    low, high = rotary.range_deg
    if low >= high or not (rotary.endless or (low <= 0.0 and high >= 180.0)):
        yield f"$.rotary.range_deg: must hold 0 and 180 to light both sides, got [{low:g}, {high:g}]"
    for i, name in enumerate("xyz"):
        a, b = getattr(rig.axes, f"{name}_mm")
        if not a <= rotary.axis_point_mm[i] <= b:
            point = rotary.axis_point_mm[i]
            yield f"$.rotary.axis_point_mm[{i}]: {point:g} is outside axes.{name}_mm [{a:g}, {b:g}]"


def _sheet(rig: Rig) -> Iterator[str]:
    width, depth = rig.sheet.max_mm
    if width <= 2 * rig.sheet.frame_margin_mm or depth <= 2 * rig.sheet.frame_margin_mm:
        yield "$.sheet.max_mm: nothing is left between the clamped strips"
    for i, (name, size) in enumerate((("x", width), ("y", depth))):
        low, high = getattr(rig.axes, f"{name}_mm")
        point = rig.rotary.axis_point_mm[i]
        room = 2.0 * min(point - low, high - point)
        if size > room + 1e-9:
            yield (
                f"$.sheet.max_mm[{i}]: a sheet of {size:g} mm leaves the work area at one of its "
                f"sides; around rotary.axis_point_mm there are {room:g} mm in {name}"
            )
    if not 0.0 <= rig.sheet.clamp_height_mm <= TALLEST_CLAMP_MM:
        yield (
            f"$.sheet.clamp_height_mm: the bars of the frame stand 0 to {TALLEST_CLAMP_MM:g} mm out of the "
            f"sheet plane on either side, got {rig.sheet.clamp_height_mm:g}"
        )
    for number, clamp in enumerate(rig.sheet.clamp_polygons_mm):
        if len(clamp) < 3:
            yield f"$.sheet.clamp_polygons_mm[{number}]: a polygon has 3 corners or more, got {len(clamp)}"
    swing = math.hypot(depth / 2.0, max(rig.sheet.thickness_mm, rig.sheet.clamp_height_mm))
    under = rig.rotary.axis_point_mm[2] - rig.clear.bed_z_mm
    if under <= swing:
        yield (
            f"$.clear.bed_z_mm: the turning sheet swings {swing:.4g} mm down, "
            f"the bed is {under:g} mm under the axis"
        )
    if rig.head.working_distance_mm <= swing:
        yield (
            f"$.head.working_distance_mm: the turning sheet swings {swing:.4g} mm up to the head, which is "
            f"{rig.head.working_distance_mm:g} mm over the axis"
        )
    if rig.has_focus_axis:
        low, high = rig.axes.z_mm
        reach = min(rig.rotary.axis_point_mm[2] - low, high - rig.rotary.axis_point_mm[2])
        need = (
            depth / 2.0 * math.sin(math.radians(rig.head.max_incidence_deg))
            - rig.head.depth_of_focus_mm / 2.0
        )
        if reach < need:
            yield (
                f"$.axes.z_mm: at {rig.head.max_incidence_deg:g} degrees of tilt the focus must move "
                f"{need:.4g} mm, it moves {reach:g} mm: lower head.max_incidence_deg"
            )
