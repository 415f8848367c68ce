"""One stand of the live view: part, sheet, rotary and beam as nodes of a viser scene."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from planner.kinematics import folded_triangles, rotation_about_line

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan
    from studio.plan_moment import PlanMoment

__all__ = ["Stand"]

COLOURS = {
    "part": (112, 130, 150), "base": (52, 140, 112), "sheet": (150, 156, 164), "edges": (38, 50, 63),
    "burning": (255, 170, 30), "beam": (224, 59, 18), "short": (179, 0, 94),
}  # fmt: skip


class Stand:
    """A part in its sheet, in the rotary, under the beam.

    Nodes lie under ``/name``: ``turned`` holds what the rotary turns, ``beam`` does not turn.

    Attributes:
        name: of the stand.
        radius_mm: half the diagonal of the sheet.
    """

    def __init__(self, scene: Any, name: str, plan: FoldPlan, shift_mm: float = 0.0) -> None:  # noqa: ANN401  viser
        self.name, self.plan = name, plan
        outline = plan.sheet.outline
        self.radius_mm = 0.5 * float(np.linalg.norm(np.ptp(outline, axis=0)))
        self._panel = np.isin(np.arange(len(plan.net.faces)), plan.net.base_panel)
        self._hinges = {crease: plan.net.hinge(face) for crease, face in plan.net.child_of.items()}
        self._gone: frozenset[int] | None = None
        self._bent: dict[int, float] = {}
        at = (shift_mm, 0.0, 0.0)
        scene.add_frame(f"/{name}", show_axes=False, position=at)
        self.turned = scene.add_frame(f"/{name}/turned", show_axes=False)
        flat = folded_triangles(plan.net, np.zeros(len(plan.net.edges)))
        self.part = self._mesh(scene, "part", flat[~self._panel])
        self._mesh(scene, "base", flat[self._panel])
        self.sheet = self._mesh(scene, "sheet", self._sheet_corners(frozenset(), {}))
        self.edges = scene.add_line_segments(
            f"/{name}/turned/edges", _outlines(flat), COLOURS["edges"], thickness=0.002 * self.radius_mm
        )
        nothing = np.zeros((1, 2, 3))
        self.burning = scene.add_line_segments(
            f"/{name}/turned/burning", nothing, COLOURS["burning"], thickness=0.012 * self.radius_mm
        )
        self.beam = scene.add_line_segments(
            f"/{name}/beam", nothing, COLOURS["beam"], thickness=0.012 * self.radius_mm
        )
        self.label = scene.add_label(f"/{name}/label", name, position=(0.0, -1.15 * self.radius_mm, 0.0))
        self.burning.visible = self.beam.visible = False

    def _mesh(self, scene: Any, what: str, corners: NDArray[np.float64]) -> Any:  # noqa: ANN401  viser
        return scene.add_mesh_simple(
            f"/{self.name}/turned/{what}", corners.reshape(-1, 3).astype(np.float32), _faces(len(corners)),
            color=COLOURS[what], flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip

    def show(self, moment: PlanMoment) -> None:
        """Show a moment of the plan, the beam on the crease that is folded."""
        self.fold(moment.angles_rad)
        self.turn(moment.rotary_rad)
        self.lay(moment.gone, moment.bent, released=moment.released)
        self.burn(moment.crease, moment.angles_rad)

    def fold(self, angles_rad: NDArray[np.float64]) -> None:
        """Fold every edge of the net to its angle (E,)."""
        corners = folded_triangles(self.plan.net, angles_rad)
        self.part.vertices = corners[~self._panel].reshape(-1, 3).astype(np.float32)
        self.edges.points = _outlines(corners)

    def turn(self, rotary_rad: float) -> None:
        """Turn the rotary."""
        self.turned.wxyz = (math.cos(rotary_rad / 2.0), math.sin(rotary_rad / 2.0), 0.0, 0.0)

    def lay(self, gone: frozenset[int], bent: dict[int, float], *, released: bool) -> None:
        """Show the sheet without the triangles that are gone, and with those that are bent."""
        self.sheet.visible = not released
        if gone != self._gone or bent != self._bent:
            self._gone, self._bent = gone, dict(bent)
            corners = self._sheet_corners(gone, bent)
            self.sheet.faces = _faces(len(corners))
            self.sheet.vertices = corners.reshape(-1, 3).astype(np.float32)

    def burn(self, crease: int, angles_rad: NDArray[np.float64]) -> None:
        """Put the beam on a crease; -1: no beam."""
        self.burning.visible = self.beam.visible = crease >= 0
        if crease < 0:
            return
        net, face = self.plan.net, self.plan.net.child_of[crease]
        start, end = self._hinges[crease]
        corners = folded_triangles(net, angles_rad)[face]
        flat = net.vertices[net.faces[face]]
        ends = np.array([corners[int(np.argmin(np.linalg.norm(flat - p, axis=1)))] for p in (start, end)])
        self.burning.points = ends[None]
        w, x = float(self.turned.wxyz[0]), float(self.turned.wxyz[1])
        turn = rotation_about_line(np.zeros(3), np.array([1.0, 0.0, 0.0]), 2.0 * math.atan2(x, w))
        self.light(turn[:3, :3] @ ends.mean(axis=0))

    def light(self, place: NDArray[np.float64] | None) -> None:
        """Put the beam on a place (3,) of the machine, mm from the middle of the rotary; None: dark."""
        self.beam.visible = place is not None
        if place is not None:
            self.beam.points = np.stack([place, place + np.array([0.0, 0.0, 0.8 * self.radius_mm])])[None]

    def _sheet_corners(self, gone: frozenset[int], bent: dict[int, float]) -> NDArray[np.float64]:
        """(T, 3, 3) corners of the triangles that are left."""
        from planner.fold_plan import Bend

        flat = self.plan.sheet.triangles
        corners = np.zeros((len(flat), 3, 3))
        corners[:, :, :2] = flat
        for index, angle in bent.items():
            step = self.plan.steps[index]
            if isinstance(step, Bend):
                start, end = (np.append(p, 0.0) for p in step.hinge)
                turn = rotation_about_line(start, end, angle)
                members = list(step.faces)
                corners[members] = corners[members] @ turn[:3, :3].T + turn[:3, 3]
        left = np.array([t for t in range(len(flat)) if t not in gone], dtype=np.int64)
        return corners[left]


def _faces(count: int) -> NDArray[np.uint32]:
    return np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


def _outlines(corners: NDArray[np.float64]) -> NDArray[np.float32]:
    """(3F, 2, 3) sides of triangles (F, 3, 3)."""
    ends = np.roll(corners, -1, axis=1)
    return np.stack([corners, ends], axis=2).reshape(-1, 2, 3).astype(np.float32)
