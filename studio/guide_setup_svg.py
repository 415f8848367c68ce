"""The set-up as a drawing with dimensions: sheet, clamps and rotary from above and along the rotary axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.fold_plan import Release

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan
    from rigs.rig import Rig

__all__ = ["end_svg", "top_svg"]

_ROOM_MM = 22.0
"""Room around a drawing for its dimensions."""


def top_svg(plan: FoldPlan, rig: Rig) -> str:
    """The sheet in the work area seen from the head: an ``<svg>`` element, 1 unit = 1 mm."""
    origin = np.array(rig.rotary.axis_point_mm[:2])
    area = np.array([[rig.axes.x_mm[0], rig.axes.y_mm[0]], [rig.axes.x_mm[1], rig.axes.y_mm[1]]])
    corners = plan.sheet.outline + origin
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = np.array([low - 2.5 * _ROOM_MM, high + 2.5 * _ROOM_MM])  # the machine is shown near the sheet
    room = np.clip(room, area[0] - _ROOM_MM, area[1] + _ROOM_MM)
    draw = _Drawing(room[0], room[1])
    draw.rectangle(area[0], area[1], "area")
    draw.text(np.maximum(area[0], room[0]) + np.array([3.0, 4.0]), "reach of the beam", "soft")
    draw.polygon(corners, "sheet")
    for face in np.flatnonzero(plan.sheet.frame_faces).tolist():
        draw.polygon(plan.sheet.triangles[face] + origin, "frame")
    for clamp in rig.sheet.clamp_polygons_mm:
        draw.polygon(np.array(clamp), "clamp")
    for face in range(len(plan.net.faces)):
        draw.polygon(plan.net.vertices[plan.net.faces[face]] + origin, "net")
    for face in plan.net.base_panel.tolist():
        draw.polygon(plan.net.vertices[plan.net.faces[face]] + origin, "base")
    for step in plan.steps:
        if isinstance(step, Release):
            for path in step.paths:
                draw.line(np.array(path) + origin, "tab")
    for mark in rig.sheet.fiducials_mm:
        draw.cross(np.array(mark), "mark")
    axis = np.array([[room[0][0], origin[1]], [room[1][0], origin[1]]])
    draw.line(axis, "axis")
    draw.text(axis[0] + np.array([3.0, 2.5]), f"rotary axis {rig.rotary.word}, y = {origin[1]:g}", "soft")
    draw.across((low[0], high[0]), float(high[1]) + 9.0, f"{high[0] - low[0]:.1f}")
    draw.upright((low[1], high[1]), float(high[0]) + 9.0, f"{high[1] - low[1]:.1f}")
    draw.text(low + np.array([0.0, -6.0]), f"corner at x {low[0]:.1f}, y {low[1]:.1f}", "")
    return draw.svg("The sheet in the machine, seen from the laser head")


def end_svg(plan: FoldPlan, rig: Rig) -> str:
    """Bed, rotary axis and lens seen along the rotary axis: an ``<svg>`` element, 1 unit = 1 mm."""
    radius = float(np.abs(plan.sheet.outline[:, 1]).max())
    axis_z, bed = rig.rotary.axis_point_mm[2], rig.clear.bed_z_mm
    lens = axis_z + rig.head.working_distance_mm
    half = max(radius, 40.0)
    draw = _Drawing(np.array([-half - 3 * _ROOM_MM, bed - 8.0]), np.array([half + 3 * _ROOM_MM, lens + 30.0]))
    draw.line(np.array([[-half - 2 * _ROOM_MM, bed], [half + 2 * _ROOM_MM, bed]]), "bed")
    draw.text(np.array([-half - 2 * _ROOM_MM, bed + 3.0]), "bed", "soft")
    draw.circle(np.array([0.0, axis_z]), radius, "swing")
    draw.line(np.array([[-radius, axis_z], [radius, axis_z]]), "sheetline")
    draw.rectangle(np.array([-14.0, lens]), np.array([14.0, lens + 24.0]), "clamp")
    draw.line(np.array([[0.0, axis_z], [0.0, lens]]), "beam")
    draw.text(np.array([17.0, lens + 9.0]), "head", "soft")
    draw.text(np.array([radius + 4.0, axis_z - 2.0]), "rotary axis", "soft")
    draw.upright((bed, axis_z), half + _ROOM_MM, f"{axis_z - bed:g}")
    draw.upright((axis_z, lens), half + _ROOM_MM, f"{lens - axis_z:g}")
    draw.across((-radius, radius), axis_z - radius - 7.0, f"swing {2 * radius:.1f}")
    return draw.svg("The machine seen along the rotary axis")


class _Drawing:
    """Collects shapes in mm, y up; written with y down as SVG has it."""

    def __init__(self, low: np.ndarray, high: np.ndarray) -> None:
        self.low, self.high = low, high
        self.parts: list[str] = []

    def polygon(self, points: np.ndarray, kind: str) -> None:
        listed = " ".join(f"{x:.2f},{-y:.2f}" for x, y in points.tolist())
        self.parts.append(f'<polygon class="{kind}" points="{listed}"/>')

    def rectangle(self, low: np.ndarray, high: np.ndarray, kind: str) -> None:
        (a, b), (c, d) = low.tolist(), high.tolist()
        self.polygon(np.array([[a, b], [c, b], [c, d], [a, d]]), kind)

    def line(self, points: np.ndarray, kind: str) -> None:
        listed = " ".join(f"{x:.2f},{-y:.2f}" for x, y in points.tolist())
        self.parts.append(f'<polyline class="{kind}" points="{listed}"/>')

    def circle(self, middle: np.ndarray, radius: float, kind: str) -> None:
        x, y = middle.tolist()
        self.parts.append(f'<circle class="{kind}" cx="{x:.2f}" cy="{-y:.2f}" r="{radius:.2f}"/>')

    def cross(self, middle: np.ndarray, kind: str, arm: float = 2.5) -> None:
        for step in np.diag([arm, arm]):
            self.line(np.array([middle - step, middle + step]), kind)

    def text(self, place: np.ndarray, words: str, kind: str, anchor: str = "start") -> None:
        x, y = np.asarray(place).tolist()
        self.parts.append(
            f'<text class="{kind}" x="{x:.2f}" y="{-y:.2f}" text-anchor="{anchor}">{words}</text>'
        )

    def across(self, span: tuple[float, float], y: float, words: str) -> None:
        """A dimension from left to right."""
        a, b = map(float, span)
        self.line(np.array([[a, y], [b, y]]), "dimension")
        for x in (a, b):
            self.line(np.array([[x, y - 2.0], [x, y + 2.0]]), "dimension")
        self.text(np.array([0.5 * (a + b), y + 1.5]), words, "", "middle")

    def upright(self, span: tuple[float, float], x: float, words: str) -> None:
        """A dimension upwards."""
        a, b = map(float, span)
        self.line(np.array([[x, a], [x, b]]), "dimension")
        for y in (a, b):
            self.line(np.array([[x - 2.0, y], [x + 2.0, y]]), "dimension")
        self.text(np.array([x + 2.0, 0.5 * (a + b) + 3.0]), words, "")

    def svg(self, title: str) -> str:
        (a, b), (c, d) = self.low.tolist(), self.high.tolist()
        letters = 0.026 * max(c - a, d - b)
        return (
            f'<svg class="setup" style="--letters: {letters:.2f}px" role="img" aria-label="{title}" '
            f'viewBox="{a:.2f} {-d:.2f} {c - a:.2f} {d - b:.2f}">{"".join(self.parts)}</svg>'
        )
