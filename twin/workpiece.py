"""The part in the machine as the twin sees it: which crease each lit stroke crosses, and how far it folds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from planner.kinematics import folded_triangles
from planner.pattern import pattern_of
from rigs.material import Material
from rigs.process import FoldProcess, Process
from rigs.rig import Rig
from twin.shape_error import shape_errors

__all__ = ["Heated", "Workpiece"]

_OFF_MM = 0.3
"""A stroke belongs to a crease if it runs along it no farther away than this."""


@dataclass(frozen=True)
class Heated:
    """What a stroke did.

    Attributes:
        crease: net edge, -1 if it ran along no crease (a cut).
        change_rad: change of its fold angle.
    """

    crease: int
    change_rad: float


@dataclass
class Workpiece:
    """Fold angles of a part, from the strokes that the beam made.

    The change by a pass is that of the process where the setting is the planned one, scaled by the dose
    where it is
    not, by the share of the crease that was lit, and by ``gain``.

    Attributes:
        plan: the plan.
        process: its passes.
        rig: the machine, for coordinates.
        material: the sheet.
        gain: true bend over predicted bend; crease → gain overrides it.
        angles_rad: crease → fold angle.
        strokes: crease → lit share so far in units of a whole crease.
    """

    plan: FoldPlan
    process: Process
    rig: Rig
    material: Material
    gain: float = 1.0
    gains: Mapping[int, float] = field(default_factory=dict)
    angles_rad: dict[int, float] = field(default_factory=dict)
    strokes: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Note where the creases lie in the sheet."""
        lines = pattern_of(self.plan).creases
        self._creases = np.array(sorted(lines), dtype=np.int64)
        self._ends: NDArray[np.float64] = np.array(
            [lines[c] for c in self._creases.tolist()], dtype=np.float64
        ).reshape(-1, 2, 2)
        self._folds: dict[int, list[FoldProcess]] = {}
        for fold in self.process.folds:
            self._folds.setdefault(fold.crease, []).append(fold)

    def heat(
        self,
        start: tuple[float, float, float],
        end: tuple[float, float, float],
        rotary_rad: float,
        power_w: float,
        speed_mm_s: float,
    ) -> Heated:
        """A lit stroke in work coordinates of the rig; returns what it folded."""
        x0, y0, _ = self.rig.rotary.axis_point_mm
        cos = math.cos(rotary_rad)
        if abs(cos) < 1e-6 or power_w <= 0.0 or speed_mm_s <= 0.0:
            return Heated(-1, 0.0)
        a = np.array([start[0] - x0, (start[1] - y0) / cos])
        b = np.array([end[0] - x0, (end[1] - y0) / cos])
        crease, share = self._crease_along(a, b)
        if crease < 0:
            return Heated(-1, 0.0)
        moved, length = math.dist(start[:2], end[:2]), float(np.linalg.norm(b - a))
        if moved <= 0.0:
            return Heated(-1, 0.0)
        change = (
            self._change(crease, power_w, speed_mm_s * length / moved)
            * share
            * self.gains.get(crease, self.gain)
        )
        side = 1.0 if cos > 0.0 else -1.0  # the lit side is where the sheet folds to
        change = side * abs(change)
        self.angles_rad[crease] = self.angles_rad.get(crease, 0.0) + change
        self.strokes[crease] = self.strokes.get(crease, 0.0) + share
        return Heated(crease, change)

    def _crease_along(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> tuple[int, float]:
        """Crease that the stroke runs along, and the share of it that is lit; (-1, 0) if there is none."""
        start, end = self._ends[:, 0], self._ends[:, 1]
        along = end - start
        length = np.linalg.norm(along, axis=1)
        unit = along / length[:, None]
        off = [np.abs(unit[:, 0] * (p - start)[:, 1] - unit[:, 1] * (p - start)[:, 0]) for p in (a, b)]
        at = np.sort([((p - start) * unit).sum(axis=1) for p in (a, b)], axis=0)
        lit = np.minimum(at[1], length) - np.maximum(at[0], 0.0)
        score = np.where((np.maximum(off[0], off[1]) < _OFF_MM) & (lit > 0.0), lit / length, 0.0)
        best = int(np.argmax(score)) if len(score) else -1
        if best < 0 or score[best] <= 0.0:
            return -1, 0.0
        whole = float(np.linalg.norm(b - a))
        if float(lit[best]) < 0.5 * whole and score[best] < 0.5:
            return -1, 0.0  # it only crosses the crease
        return int(self._creases[best]), min(float(score[best]), 1.0)

    def _change(self, crease: int, power_w: float, speed_mm_s: float) -> float:
        """Change by the next whole pass over a crease, rad, without sign."""
        folds = self._folds.get(crease)
        if not folds:
            return 0.0
        done = self.strokes.get(crease, 0.0)
        for fold in folds:
            if done < fold.passes - 0.5:
                increment = abs(fold.increments_rad[int(done + 0.5)])
                break
            done -= fold.passes
        else:
            fold, increment = folds[-1], abs(folds[-1].increments_rad[-1]) if folds[-1].passes else 0.0
        dose, planned = power_w / speed_mm_s, fold.power_w / fold.speed_mm_s
        return increment * dose / planned

    def angles_of_net(self) -> NDArray[np.float64]:
        """(E,) fold angle of every edge of the net, rad."""
        angles = np.zeros(len(self.plan.net.edges))
        for crease, angle in self.angles_rad.items():
            angles[crease] = angle
        return angles

    def shape_rms_mm(self) -> float:
        """Root mean square distance of the corners to the goal."""
        corners = folded_triangles(self.plan.net, self.angles_of_net())
        return float(shape_errors(self.plan.net, corners[None])[0][0])

    def completion(self) -> float:
        """Folded share of all angles of the goal, 0 to 1."""
        net = self.plan.net
        wanted = np.where(np.isin(net.assignment, ("V", "M")), net.fold_angle, 0.0)
        have = self.angles_of_net()
        total = float(np.abs(wanted).sum())
        same = np.where(have * wanted > 0.0, np.minimum(np.abs(have), np.abs(wanted)), 0.0)
        return float(same.sum() / total) if total else 1.0
