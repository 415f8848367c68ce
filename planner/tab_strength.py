"""How much of what the tabs can carry the part's weight takes, over all poses and rotary angles of a plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Fold, FoldPlan, MachineLimits, Release, Rotate, Tab
from planner.kinematics import rotation_about_line

__all__ = ["TabResistance", "TabStrength", "mass_centres", "tab_notice", "tab_strength"]

_SHEAR_SHARE = 1.0 / math.sqrt(3.0)  # yield in shear over yield in tension (von Mises)


@dataclass(frozen=True)
class TabStrength:
    """How the tabs stand up to the weight of the part.

    Attributes:
        share: load over the load at which the tabs yield, never too small; from 1 on they may bend.
        weight_n: weight of the part.
        arm_mm: largest distance in the sheet plane from the middle of the tabs to the centre of mass.
    """

    share: float
    weight_n: float
    arm_mm: float

    @property
    def margin(self) -> float:
        """How many times the weight the tabs are sure to carry."""
        return math.inf if self.share <= 0.0 else 1.0 / self.share


def tab_strength(plan: FoldPlan) -> TabStrength:
    """The largest share of the tabs' strength that the part's weight takes until the release.

    A tab is a beam as wide as its stretch and as thick as the sheet, rigid and perfectly plastic. By the
    lower bound theorem of limit analysis the tabs carry a load if some equilibrium keeps all within yield;
    here each tab's six section forces, as shares of what it carries of each alone, may add up to 1, which
    lies inside of any convex yield surface. A linear program finds the least such sum over all equilibria. It
    is a convex function of the load, and the load is linear in the centre of mass and in the direction of
    gravity, so the corners of the box around all centres of mass, under gravity across and along the sheet,
    bound every pose and, by the triangle inequality, every rotary angle. Weight at rest: no acceleration.

    Raises:
        ValueError: if the plan has no tabs.
    """
    if not plan.sheet.tabs:
        raise ValueError("the plan has no tabs, so nothing holds the part: make it with plan_folds")
    centres = mass_centres(plan)
    low, high = centres.min(axis=0), centres.max(axis=0)
    corners = np.array([np.where([k & 1, k & 2, k & 4], high, low) for k in range(8)])
    weight = plan.limits.weight_n_mm2 * float(_areas(plan).sum())
    resistance = TabResistance(plan.sheet.tabs, plan.limits)
    across = weight * max(resistance.share(corner, np.array([0.0, 0.0, 1.0])) for corner in corners)
    along = 0.0
    if any(isinstance(step, Rotate) for step in plan.steps):
        along = weight * max(resistance.share(corner, np.array([0.0, 1.0, 0.0])) for corner in corners)
    arm = float(np.linalg.norm((centres - resistance.places.mean(axis=0))[:, :2], axis=1).max())
    return TabStrength(math.hypot(across, along), weight, arm)


def tab_notice(plan: FoldPlan) -> tuple[str, ...]:
    """What the user should know about the tabs of ``plan``; nothing where they are sure to hold."""
    strength = tab_strength(plan)
    if strength.share < 1.0:
        return ()
    return (
        f"the tabs may sag: they are sure to carry {strength.margin:.2g} times the weight of the part "
        f"({1e3 * strength.weight_n:.3g} mN, up to {strength.arm_mm:.3g} mm off); a smaller part, a thicker "
        "sheet or a base with longer free edges helps",
    )


def mass_centres(plan: FoldPlan) -> NDArray[np.float64]:
    """(K, 3) centre of mass of the part in mm, flat and after each fold up to the release."""
    net = plan.net
    areas = _areas(plan)
    spots = np.zeros((len(net.faces), 3))
    spots[:, :2] = net.vertices[net.faces].mean(axis=1)
    angle = dict.fromkeys(net.child_of, 0.0)
    out = [areas @ spots / areas.sum()]
    for step in plan.steps:
        if isinstance(step, Release):
            break
        if isinstance(step, Fold):
            face = net.child_of[step.crease]
            moving = net.subtree[face]
            start, end = (np.append(point, 0.0) for point in net.hinge(face))
            pose = rotation_about_line(start, end, step.to_rad - angle[step.crease])
            spots[moving] = spots[moving] @ pose[:3, :3].T + pose[:3, 3]
            angle[step.crease] = step.to_rad
            out.append(areas @ spots / areas.sum())
    return np.array(out)


def _areas(plan: FoldPlan) -> NDArray[np.float64]:
    """(F,) areas of the faces, mm²."""
    corners = plan.net.vertices[plan.net.faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas: NDArray[np.float64] = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return areas


class TabResistance:
    """The tabs as a linear program: the six section forces of each, balanced against one weight."""

    def __init__(self, tabs: Sequence[Tab], limits: MachineLimits) -> None:
        starts, ends = (np.array([getattr(tab, end) for tab in tabs]) for end in ("start", "end"))
        self.places = np.column_stack([0.5 * (starts + ends), np.zeros(len(tabs))])
        widths = np.linalg.norm(ends - starts, axis=1)
        columns, strengths = [], []
        for place, along, width in zip(self.places, (ends - starts) / widths[:, None], widths, strict=True):
            u, v, w = np.append(along, 0.0), np.array([along[1], -along[0], 0.0]), np.array([0.0, 0.0, 1.0])
            thick, moment = limits.thickness, limits.plastic_moment_n
            tension = 4.0 * moment / thick  # N per mm of width: yield stress times thickness
            broad, thin = max(width, thick), min(width, thick)
            stress = 4.0 * moment / thick**2  # at yield, N/mm²
            torque = 0.5 * _SHEAR_SHARE * stress * thin**2 * (broad - thin / 3.0)  # sand heap analogy
            shear = _SHEAR_SHARE * tension * width
            for direction, strength in ((u, shear), (v, tension * width), (w, shear)):
                columns.append(np.concatenate([direction, np.cross(place, direction)]))
                strengths.append(strength)
            for direction, strength in (
                (u, moment * width), (v, torque), (w, moment * width**2 / thick),
            ):  # fmt: skip
                columns.append(np.concatenate([np.zeros(3), direction]))
                strengths.append(strength)
        self.balance = np.array(columns).T * np.array(strengths)
        self.count = len(tabs)

    def share(self, centre: NDArray[np.float64], down: NDArray[np.float64]) -> float:
        """Least share of their strength that the tabs need for a weight of 1 N at ``centre``."""
        from scipy.optimize import linprog

        forces = 6 * self.count
        load = np.concatenate([down, np.cross(centre, down)])
        equal = np.hstack([self.balance, -self.balance, np.zeros((6, 1))])
        limit = np.zeros((self.count, 2 * forces + 1))
        for tab in range(self.count):
            limit[tab, 6 * tab : 6 * tab + 6] = 1.0
            limit[tab, forces + 6 * tab : forces + 6 * tab + 6] = 1.0
        limit[:, -1] = -1.0
        cost = np.append(np.zeros(2 * forces), 1.0)
        found = linprog(cost, A_ub=limit, b_ub=np.zeros(self.count), A_eq=equal, b_eq=load, method="highs")
        if not found.success or found.fun is None:
            raise ValueError(f"the balance of the tabs could not be found: {found.message}")
        return float(found.fun)
