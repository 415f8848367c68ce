"""Where the head of a rig must go so that the beam runs along a line of the sheet, and how fast it may."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from planner.fold_plan import Point
from rigs.errors import JobError
from rigs.job import MachinePoint
from rigs.motion_time import line_seconds, line_time_at
from rigs.rig import Rig

__all__ = ["Stroke", "between_strokes_s", "largest_speed", "machine_path", "plan_strokes"]

RUN_IN_RESERVE = 1.05
"""Run-in and run-out are this much longer than acceleration needs."""

_TINY = 1e-9


@dataclass(frozen=True, slots=True)
class Stroke:
    """A straight laser stroke in machine coordinates.

    Attributes:
        run_in: where the dark run-in begins.
        start: where the beam goes on.
        end: where it goes off.
        run_out: where the dark run-out ends.
        head_mm_s: speed of the head that gives the wanted speed along the crease.
        accel_mm_s2: acceleration along the stroke.
    """

    run_in: MachinePoint
    start: MachinePoint
    end: MachinePoint
    run_out: MachinePoint
    head_mm_s: float
    accel_mm_s2: float

    @property
    def seconds(self) -> float:
        """Duration from rest to rest."""
        return line_seconds(math.dist(self.run_in, self.run_out), self.head_mm_s, self.accel_mm_s2)

    @property
    def beam_s(self) -> float:
        """Seconds with the beam on."""
        total = math.dist(self.run_in, self.run_out)
        first = math.dist(self.run_in, self.start)
        last = total - math.dist(self.end, self.run_out)
        args = (total, self.head_mm_s, self.accel_mm_s2)
        return line_time_at(last, *args) - line_time_at(first, *args)


def machine_path(rig: Rig, points: tuple[Point, ...], rotary_rad: float) -> tuple[MachinePoint, ...]:
    """Head positions over points of the sheet plane, focus on the metal; raw, neither rounded nor checked.

    The sheet is turned about +x by ``rotary_rad``. The focus is held at the mean height where the path stays
    within the depth of focus, and follows the metal otherwise.

    Args:
        rig: the machine.
        points: in the frame of the sheet, mm.
        rotary_rad: absolute angle of the rotary.

    Raises:
        JobError: if the rig cannot move its focus and the path leaves the depth of focus.
    """
    x0, y0, z0 = rig.rotary.axis_point_mm
    cos, sin = math.cos(rotary_rad), math.sin(rotary_rad)
    heights = [y * sin for _, y in points]
    low, high = min(heights), max(heights)
    reach = rig.head.depth_of_focus_mm / 2.0
    if not rig.has_focus_axis:
        if max(high, -low) > reach + 1e-6:
            raise JobError(
                f"rig {rig.name} cannot move its focus: at {math.degrees(rotary_rad):.4g} degrees a line of "
                f"the sheet lies {max(high, -low):.3g} mm off it, {reach:g} mm are allowed: plan with a "
                "smaller tilt"
            )
        heights = [0.0] * len(points)
    elif high - low <= 2.0 * reach + 1e-6:
        heights = [0.5 * (low + high)] * len(points)
    return tuple((x0 + x, y0 + y * cos, z0 + h) for (x, y), h in zip(points, heights, strict=True))


def largest_speed(rig: Rig, start: Point, end: Point, rotary_rad: float) -> float:
    """Fastest speed along a line of the sheet, mm/s, with the focus held while the beam is on."""
    (ax, ay), (bx, by) = start, end
    a, b = (ax, ay * math.cos(rotary_rad), 0.0), (bx, by * math.cos(rotary_rad), 0.0)
    head, along = math.dist(a, b), math.dist(start, end)
    return _within(rig.axes.max_mm_s, a, b) * (along / head if head > _TINY else 1.0)


def plan_strokes(
    rig: Rig, start: Point, end: Point, rotary_rad: float, speed_mm_s: float, *, digits: int = 3
) -> tuple[Stroke, ...]:
    """The strokes of one pass along a crease, each with a run-in and run-out for acceleration.

    One stroke does where the crease stays within the depth of focus, or the focus axis keeps up with the
    metal. Else the crease is lit in parts, each with the focus held at its mean height. The run-in is as long
    as the acceleration needs, less where the axes end.

    Args:
        rig: the machine.
        start: where the beam goes on, sheet coordinates, mm.
        end: where it goes off.
        rotary_rad: absolute angle of the rotary.
        speed_mm_s: wanted speed along the crease.
        digits: decimals of the coordinates.

    Raises:
        JobError: if the line is out of focus or has no length.
    """
    a, b = machine_path(rig, (start, end), rotary_rad)
    followed = _stroke(rig, a, b, math.dist(start, end), speed_mm_s, digits)
    if a[2] == b[2] or followed.head_mm_s <= _within(rig.axes.max_mm_s, a, b):
        return (followed,)
    count = math.ceil(abs(b[2] - a[2]) / rig.head.depth_of_focus_mm)
    marks = [
        (start[0] + (end[0] - start[0]) * k / count, start[1] + (end[1] - start[1]) * k / count)
        for k in range(count + 1)
    ]
    strokes = []
    for p, q in itertools.pairwise(marks):
        a, b = machine_path(rig, (p, q), rotary_rad)
        strokes.append(_stroke(rig, a, b, math.dist(p, q), speed_mm_s, digits))
    return tuple(strokes)


def between_strokes_s(rig: Rig, strokes: tuple[Stroke, ...]) -> float:
    """Dark time that the head needs between the strokes of one pass, s."""
    return sum(
        line_seconds(
            math.dist(p.run_out, q.run_in),
            _within(rig.axes.max_mm_s, p.run_out, q.run_in),
            _within(rig.axes.accel_mm_s2, p.run_out, q.run_in),
        )
        for p, q in itertools.pairwise(strokes)
    )


def _stroke(
    rig: Rig, a: MachinePoint, b: MachinePoint, along: float, speed_mm_s: float, digits: int
) -> Stroke:
    head = math.dist(a, b)
    if head < 1e-3:
        raise JobError(
            f"a crease of {along:.3g} mm has no length for the head of rig {rig.name}: coarsen the goal"
        )
    head_speed = speed_mm_s * head / along
    accel = _within(rig.axes.accel_mm_s2, a, b)
    wanted = RUN_IN_RESERVE * head_speed**2 / (2.0 * accel)
    unit = tuple((q - p) / head for p, q in zip(a, b, strict=True))
    before = _beyond(rig, a, tuple(-u for u in unit), wanted, digits)
    after = _beyond(rig, b, unit, wanted, digits)
    return Stroke(before, _rounded(a, digits), _rounded(b, digits), after, head_speed, accel)


def _beyond(
    rig: Rig, point: MachinePoint, unit: tuple[float, ...], wanted: float, digits: int
) -> MachinePoint:
    """``point`` moved on by ``wanted`` mm along ``unit``, or as far as the axes go."""
    room = wanted
    spans = (rig.axes.x_mm, rig.axes.y_mm, rig.axes.z_mm)
    for place, step, (low, high) in zip(point, unit, spans, strict=True):
        if step > _TINY:
            room = min(room, (high - place) / step)
        elif step < -_TINY:
            room = min(room, (low - place) / step)
    room = max(room - 10.0**-digits, 0.0) if room < wanted else wanted
    x, y, z = (p + room * u for p, u in zip(point, unit, strict=True))
    return _rounded((x, y, z), digits)


def _within(limits: tuple[float, float, float], a: MachinePoint, b: MachinePoint) -> float:
    length = math.dist(a, b)
    if length < _TINY:
        return min(limits[:2])
    return min(m * length / d for m, p, q in zip(limits, a, b, strict=True) if (d := abs(q - p)) > _TINY)


def _rounded(point: tuple[float, ...], digits: int) -> MachinePoint:
    x, y, z = (round(c, digits) + 0.0 for c in point)
    return x, y, z
