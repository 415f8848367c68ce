"""Rotation clearance: the part and its sheet, turned about the rotary axis, clear the bed and the lens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Bend, Clip, Fold, FoldPlan, MachineLimits, Release, Rotate, Step
from planner.kinematics import folded_triangles, rotation_about_line

__all__ = [
    "RotationClearance", "TurningPart", "check_rotation_clearance", "height_range", "rotation_clearance",
]  # fmt: skip


@dataclass(frozen=True)
class RotationClearance:
    """What is left over the bed and under the lens during a rotation, in mm; negative means contact."""

    to_bed_mm: float
    to_lens_mm: float

    @property
    def margin_mm(self) -> float:
        """The smaller of the two."""
        return min(self.to_bed_mm, self.to_lens_mm)


def height_range(
    points: NDArray[np.float64], from_rad: float, to_rad: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest height (N,) of points (N, 3) turned about +x from ``from_rad`` to ``to_rad``.

    The height at angle a is y sin a + z cos a = r cos(a - phi) with r = hypot(y, z), phi = atan2(y, z); it is
    largest where a = phi and least where a = phi + pi, modulo a full turn, if the turn passes there.
    """
    y, z = points[:, 1], points[:, 2]
    low_angle, high_angle = min(from_rad, to_rad), max(from_rad, to_rad)
    ends = np.stack([y * np.sin(a) + z * np.cos(a) for a in (low_angle, high_angle)])
    lowest, highest = ends.min(axis=0), ends.max(axis=0)
    radius, phase = np.hypot(y, z), np.arctan2(y, z)
    turn = 2.0 * np.pi
    first_top = low_angle + (phase - low_angle) % turn
    first_bottom = low_angle + (phase + np.pi - low_angle) % turn
    return (
        np.where(first_bottom <= high_angle, -radius, lowest),
        np.where(first_top <= high_angle, radius, highest),
    )


def rotation_clearance(
    points: NDArray[np.float64],
    limits: MachineLimits,
    from_rad: float = 0.0,
    to_rad: float = 2.0 * np.pi,
) -> RotationClearance:
    """Clearance of ``points`` (N, 3), mm in the sheet frame, while the rotary turns between two angles.

    Exact for solids spanned by the points: a polyhedron is nearest to a plane at one of its corners.
    """
    if len(points) == 0:
        return RotationClearance(limits.axis_height, limits.lens_height)
    lowest, highest = height_range(points, from_rad, to_rad)
    return RotationClearance(
        to_bed_mm=limits.axis_height + float(lowest.min()),
        to_lens_mm=limits.lens_height - float(highest.max()),
    )


def check_rotation_clearance(plan: FoldPlan) -> list[str]:
    """Replay every rotation with the part as folded and the sheet as clipped by then; one line per contact.

    Raises:
        ValueError: if the rotary axis of the plan is not the line y = 0.
    """
    if np.abs(plan.sheet.rotary_axis[:, 1]).max() > 1e-6:
        raise ValueError("the rotary axis must be the line y = 0: place the net first")
    half = 0.5 * plan.limits.thickness
    part = TurningPart(plan)
    angles = np.zeros(len(plan.net.edges))
    rotary = 0.0
    problems = []
    for n, step in enumerate(plan.steps):
        part.pass_step(step)
        if isinstance(step, Fold):
            angles[step.crease] = step.to_rad
        elif isinstance(step, Rotate):
            left = rotation_clearance(part.points(angles), plan.limits, rotary, step.to_rad)
            problems += _words(n, rotary, step.to_rad, left, half)
            rotary = step.to_rad
    return problems


class TurningPart:
    """Everything that turns with the sheet, as the steps of a plan have left it.

    Args:
        plan: the plan; at first none of its steps is made.
    """

    def __init__(self, plan: FoldPlan) -> None:
        self.plan = plan
        self._present = np.ones(len(plan.sheet.faces), dtype=np.bool_)
        self._bent: list[NDArray[np.float64]] = [_bar_corners(plan)]
        self._released = False

    def pass_step(self, step: Step) -> None:
        """Take in what a step clips, bends away or releases; ``points`` is told the angles of the creases."""
        match step:
            case Clip(faces=faces):
                self._present[list(faces)] = False
            case Bend(faces=faces, hinge=hinge, to_rad=to_rad):
                self._present[list(faces)] = False
                self._bent.append(_bent_points(self.plan, faces, hinge, to_rad))
            case Release():
                self._released = True
            case _:
                pass

    def points(self, angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 3) corners of it, mm in the frame of the sheet, with the creases at ``angles_rad`` (E,)."""
        flat = self.plan.sheet.vertices[np.unique(self.plan.sheet.faces[self._present])]
        parts = [np.column_stack([flat, np.zeros(len(flat))]), *self._bent]
        if not self._released:
            parts.append(folded_triangles(self.plan.net, angles_rad).reshape(-1, 3))
        return np.concatenate(parts)


def _bar_corners(plan: FoldPlan) -> NDArray[np.float64]:
    """(K, 3) outer corners of the frame's bars, half a thickness lower, as that is added to all points."""
    rise = max(0.0, plan.sheet.clamp_height - 0.5 * plan.limits.thickness)
    outline = plan.sheet.outline
    return np.concatenate([np.column_stack([outline, np.full(len(outline), z)]) for z in (rise, -rise)])


def _bent_points(
    plan: FoldPlan, faces: tuple[int, ...], hinge: tuple[tuple[float, float], ...], to_rad: float
) -> NDArray[np.float64]:
    flat = plan.sheet.vertices[np.unique(plan.sheet.faces[list(faces)])]
    points = np.column_stack([flat, np.zeros(len(flat))])
    turn = rotation_about_line(np.array([*hinge[0], 0.0]), np.array([*hinge[1], 0.0]), to_rad)
    moved: NDArray[np.float64] = points @ turn[:3, :3].T + turn[:3, 3]
    return moved


def _words(n: int, from_rad: float, to_rad: float, left: RotationClearance, half: float) -> list[str]:
    turn = f"step {n}: turning the rotary from {np.degrees(from_rad):.4g} to {np.degrees(to_rad):.4g} degrees"
    return [
        f"{turn}, the part reaches {-gap + half:.2f} mm into {what}."
        for gap, what in ((left.to_bed_mm, "the bed"), (left.to_lens_mm, "the lens"))
        if gap - half < 0.0
    ]
