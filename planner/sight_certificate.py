"""Certificates of sight: how much of its crease can be hidden at most during every fold of a finished plan.

Between two looks nothing is assumed: over an angle interval every moving corner may be anywhere within the
distance that it travels from the middle of the interval, so its shadow is widened by what that distance can
make of it. An interval whose bound is too large is halved. Nothing is shared with the planner's kernels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.beam import to_light
from planner.errors import PlanError
from planner.fold_plan import Bend, Fold, FoldPlan, Rotate
from planner.kinematics import rotation_about_line
from planner.net import Net

__all__ = ["SightCertificate", "TurnView", "certify_sight", "hidden_bound"]

ABOVE_MM = 0.01
"""What rises less than this over the sheet hides nothing."""

END_SHARE = 0.02
"""Share of a crease at each end that does not count."""

GRAZE_MM = 0.02
"""A moving face may end upright beside its crease: its shadow counts where it reaches over by more."""

OVERHANG_RAD = math.radians(0.5)
"""The turning face may lean over its crease by this much, seen along the beam."""

NARROWEST_RAD = math.radians(0.002)
"""Intervals are not halved further: what is too much there counts as hidden."""


@dataclass(frozen=True)
class TurnView:
    """What is proven of the sight of one turn.

    Attributes:
        step: index of the step in the plan.
        crease: net edge that turns.
        rotary_rad: rotary angle under which it turns.
        hidden: share of the crease that is hidden at most, as far as had to be shown.
        intervals: angle intervals that were looked at.
        proven: ``hidden`` stays within ``hidden_max`` of the plan all the time.
        from_rad: fold angle at which the first interval begins that is not proven; nan if there is none.
    """

    step: int
    crease: int
    rotary_rad: float
    hidden: float
    intervals: int
    proven: bool
    from_rad: float = math.nan


@dataclass(frozen=True)
class SightCertificate:
    """What is proven of the sight of all turns of a plan.

    Attributes:
        turns: one entry per fold step, in order.
        hidden_max: largest share that the plan allows.
    """

    turns: tuple[TurnView, ...]
    hidden_max: float

    @property
    def is_proven(self) -> bool:
        """True if every turn stays in sight."""
        return all(turn.proven for turn in self.turns)

    def words(self) -> str:
        """The result in one line."""
        proven = sum(turn.proven for turn in self.turns)
        text = f"{proven} of {len(self.turns)} turns proven to stay in sight"
        if proven < len(self.turns):
            first = next(turn for turn in self.turns if not turn.proven)
            text += (
                f"; first step {first.step} is not: up to {first.hidden:.0%} of crease {first.crease} may be "
                f"hidden from {math.degrees(first.from_rad):.2f} degrees on"
            )
        return text


def certify_sight(plan: FoldPlan, *, ends_only: bool = False) -> SightCertificate:
    """Bound, turn by turn, the share of the crease that something hides from the beam.

    What counts is what the planner's rule counts: the middle triangle of every face but those of the two
    panels at the crease; still ones as wide as the beam is where it passes them, the moving ones for a thin
    beam, where they reach over the crease by more than ``GRAZE_MM``. Metal that lies in the sheet plane, such
    as the substrate, hides nothing.

    Args:
        plan: a finished plan; only its net, limits and steps are looked at.
        ends_only: look only at the angles at which each turn begins and ends: quick, and proves nothing.

    Raises:
        PlanError: if the plan bends substrate, which this proof does not cover.
    """
    net = plan.net
    corners = np.zeros((len(net.faces), 3, 3))
    corners[:, :, :2] = net.vertices[net.faces]
    panel = _panels(net)
    angles = np.zeros(len(net.edges))
    rotary = 0.0
    views: list[TurnView] = []
    for number, step in enumerate(plan.steps):
        match step:
            case Rotate(to_rad=to_rad):
                rotary = to_rad
            case Fold(crease=crease, to_rad=to_rad):
                old = float(angles[crease])
                if to_rad != old:
                    views.append(_view(plan, corners, panel, number, crease, old, to_rad, rotary, ends_only))
                    face = net.child_of[crease]
                    members = net.subtree[face]
                    start, end = (np.append(p, 0.0) for p in net.hinge(face))
                    corners[members] = _turned(corners[members], start, end, to_rad - old)
                    angles[crease] = to_rad
            case Bend():
                raise PlanError(
                    f"step {number} bends the substrate, which no certificate covers; "
                    "plan again without bends, or leave out --certify"
                )
            case _:
                pass  # the substrate lies in the plane and hides nothing
    return SightCertificate(tuple(views), plan.hidden_max)


def hidden_bound(
    triangles: NDArray[np.float64],
    slack: NDArray[np.float64],
    thin: NDArray[np.bool_],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    light: tuple[NDArray[np.float64], bool],
    radius: float,
    spread: float,
) -> float:
    """Largest share of the segment start-end (z = 0) that ``triangles`` can hide.

    Args:
        triangles: (K, 3, 3) mm.
        slack: (K,) how far every corner may be from where it is said to be, mm.
        thin: (K,) triangles that are not widened by the beam's radius, but narrowed by ``GRAZE_MM``.
        start: (2,) and
        end: (2,) ends of the segment.
        light: direction to parallel light, False; or the point that rays come from, True.
        radius: of the beam at the crease, mm.
        spread: how much wider it is per mm above.
    """
    where, is_point = light
    near = 1.0 / where[2] if is_point else 0.0
    slope = -where[:2] / where[2]
    up = float(np.linalg.norm(where)) / where[2] if is_point else 1.0 / where[2]
    z = triangles[:, :, 2]
    depth = 1.0 - near * z
    least = (depth - abs(near) * slack[:, None]).min(axis=1)
    height = (z * up / np.maximum(depth, 1e-6)).max(axis=1) + slack * abs(up) / np.maximum(least, 1e-6)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    flat = (triangles[:, :, :2] + slope * z[:, :, None]) / np.maximum(depth, 1e-6)[:, :, None]
    # the shadow moves at most by this much when a corner moves by the slack
    reach = np.abs(slope) + abs(near) * np.abs(flat).max(axis=1)
    factor = (1.0 + np.linalg.norm(reach, axis=1)) / np.maximum(least, 1e-6)
    above = (
        np.maximum(z * up / np.maximum(depth, 1e-6), 0.0)
        + (slack * abs(up) / np.maximum(least, 1e-6))[:, None]
    )
    each = np.where(thin[:, None], -GRAZE_MM, radius + spread * above) + (slack * factor)[:, None]
    wide = each.max(axis=1)
    s = (flat - start) @ along
    w = (flat - start) @ np.array([-along[1], along[0]])
    low, high = _within(s, w, np.maximum(wide, 0.0))
    counts = (height > ABOVE_MM) & (low <= high)
    lo, hi = np.maximum(0.0, low - wide), np.minimum(length, high + wide)
    area = (s[:, 1] - s[:, 0]) * (w[:, 2] - w[:, 0]) - (s[:, 2] - s[:, 0]) * (w[:, 1] - w[:, 0])
    turn = np.sign(area)
    firm = np.abs(area) > 1e-9 + 4.0 * slack * factor * (np.ptp(s, axis=1) + np.ptp(w, axis=1))
    girth = np.hypot(s - np.roll(s, 1, axis=1), w - np.roll(w, 1, axis=1)).sum(axis=1)
    counts &= (wide >= 0.0) | (np.abs(area) > -wide * girth)  # narrowed to nothing
    for k in range(3):
        es, ew = s[:, (k + 1) % 3] - s[:, k], w[:, (k + 1) % 3] - w[:, k]
        size = np.maximum(np.hypot(es, ew), 1e-12)
        out_s, out_w = turn * ew / size, -turn * es / size
        ps, pw = s[:, k] + each[:, k] * out_s, w[:, k] + each[:, k] * out_w
        more = each[:, (k + 1) % 3] - each[:, k]
        es, ew = es + more * out_s, ew + more * out_w
        grade = -turn * ew
        rest = turn * (ew * ps - es * pw)
        usable = firm & (np.abs(grade) > 1e-12)
        bound = -rest / np.where(usable, grade, 1.0)
        lo = np.where(usable & (grade > 0.0), np.maximum(lo, bound), lo)
        hi = np.where(usable & (grade < 0.0), np.minimum(hi, bound), hi)
        counts &= ~(firm & (np.abs(grade) <= 1e-12) & (rest < 0.0))
    # a still triangle hides only where it is above the crease
    exact = firm & (slack == 0.0) & (near == 0.0)
    divisor = np.where(exact, area, 1.0)
    h = z * up
    rise = ((h[:, 1] - h[:, 0]) * (w[:, 2] - w[:, 0]) - (h[:, 2] - h[:, 0]) * (w[:, 1] - w[:, 0])) / divisor
    side = ((s[:, 1] - s[:, 0]) * (h[:, 2] - h[:, 0]) - (s[:, 2] - s[:, 0]) * (h[:, 1] - h[:, 0])) / divisor
    rest = h[:, 0] - rise * s[:, 0] - side * w[:, 0] - ABOVE_MM
    tilted = exact & (np.abs(rise) * length > 1e-12)
    bound = -rest / np.where(tilted, rise, 1.0)
    lo = np.where(tilted & (rise > 0.0), np.maximum(lo, bound), lo)
    hi = np.where(tilted & (rise < 0.0), np.minimum(hi, bound), hi)
    counts &= ~(exact & ~tilted & (rest <= 0.0))
    counts &= lo < hi
    first, last = END_SHARE * length, (1.0 - END_SHARE) * length
    covered, done = 0.0, first
    for a, b in sorted(zip(lo[counts].tolist(), hi[counts].tolist(), strict=True)):
        a, b = max(a, done), min(b, last)
        if b > a:
            covered += b - a
            done = b
    return covered / (last - first)


def _within(
    s: NDArray[np.float64], w: NDArray[np.float64], wide: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least and greatest s (K,) where triangles (K, 3) have w within ``wide``; inf, -inf: nowhere."""
    places, there = [s], [np.abs(w) <= wide[:, None]]
    step_s, step_w = np.roll(s, -1, axis=1) - s, np.roll(w, -1, axis=1) - w
    for side in (-1.0, 1.0):
        gap = side * wide[:, None] - w
        crosses = (gap * (gap - step_w) <= 0.0) & (np.abs(step_w) > 0.0)
        places.append(s + gap / np.where(crosses, step_w, 1.0) * step_s)
        there.append(crosses)
    place, valid = np.concatenate(places, axis=1), np.concatenate(there, axis=1)
    return np.where(valid, place, np.inf).min(axis=1), np.where(valid, place, -np.inf).max(axis=1)


def _view(
    plan: FoldPlan,
    corners: NDArray[np.float64],
    panel: NDArray[np.int64],
    number: int,
    crease: int,
    old: float,
    to_rad: float,
    rotary: float,
    ends_only: bool,
) -> TurnView:
    """The proof for one turn, by halving intervals; or a look at its two ends."""
    net, limits = plan.net, plan.limits
    face = net.child_of[crease]
    start, end = net.hinge(face)
    light = _light(plan, rotary)
    radius = max(limits.beam_radius, 0.5 * limits.thickness)
    own = (panel == panel[face]) | (panel == panel[int(net.parent[face])])
    moves = np.zeros(len(net.faces), dtype=np.bool_)
    moves[net.subtree[face]] = True
    standing = corners[~moves & ~own]
    standing = standing[np.abs(standing[:, :, 2]).max(axis=1) > 1e-9]
    moving = corners[moves & ~own]
    axis = np.append((end - start) / np.linalg.norm(end - start), 0.0)
    offset = moving - np.append(start, 0.0)
    lever = np.linalg.norm(offset - (offset @ axis)[:, :, None] * axis, axis=2).max(axis=1)
    lower, upper = np.append(start, 0.0), np.append(end, 0.0)

    def bound(middle: float, half: float) -> float:
        turned = _turned(moving, lower, upper, middle - old)
        both = np.concatenate([standing, turned])
        slack = np.concatenate([np.zeros(len(standing)), lever * half])
        # before the turn begins the moving part is as wide as all the rest
        thin = np.concatenate([np.zeros(len(standing), np.bool_), np.full(len(moving), middle != old)])
        return hidden_bound(both, slack, thin, start, end, light, radius, limits.beam_spread)

    hidden, looks = bound(old, 0.0), 1
    if ends_only:
        hidden = max(hidden, bound(to_rad, 0.0))
        return TurnView(number, crease, rotary, hidden, 2, proven=False)
    proven, at = hidden <= plan.hidden_max, old if hidden > plan.hidden_max else math.nan
    sign = math.copysign(1.0, to_rad - old)
    leaning = _lean(light, start, end, sign) + OVERHANG_RAD
    if proven and sign * to_rad > leaning + 1e-9:
        return TurnView(number, crease, rotary, 1.0, looks, proven=False, from_rad=sign * leaning)
    parts = max(1, math.ceil(abs(to_rad - old) / math.radians(4.0)))
    edges = np.linspace(old, to_rad, parts + 1)
    todo = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))[::-1]
    while todo:
        a, b = todo.pop()
        share = bound(0.5 * (a + b), 0.5 * abs(b - a))
        looks += 1
        if share <= plan.hidden_max:
            hidden = max(hidden, share)
        elif abs(b - a) > NARROWEST_RAD:
            todo += [(0.5 * (a + b), b), (a, 0.5 * (a + b))]
        else:
            if proven:
                proven, at = False, a
            hidden = max(hidden, share)
            break
    return TurnView(number, crease, rotary, hidden, looks, proven, at)


def _turned(
    points: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64], angle_rad: float
) -> NDArray[np.float64]:
    """Points (..., 3) turned about the line from ``start`` to ``end``."""
    motion = rotation_about_line(start, end, angle_rad)
    moved: NDArray[np.float64] = points @ motion[:3, :3].T + motion[:3, 3]
    return moved


def _lean(
    light: tuple[NDArray[np.float64], bool], start: NDArray[np.float64], end: NDArray[np.float64], sign: float
) -> float:
    """Angle to which the turning face stands along the beam, rad."""
    where, is_point = light
    ray = where - np.append(0.5 * (start + end), 0.0) if is_point else where
    along = (end - start) / np.linalg.norm(end - start)
    return math.atan2(sign * float(ray[2]), float(ray[1] * along[0] - ray[0] * along[1]))


def _light(plan: FoldPlan, rotary: float) -> tuple[NDArray[np.float64], bool]:
    """Direction to parallel light, or the point that the rays come from."""
    if plan.limits.beam_source is None:
        return to_light(rotary, np.zeros(3), plan.limits), False
    ray = to_light(rotary, np.zeros(3), plan.limits)
    return ray * float(np.linalg.norm(plan.limits.beam_source)), True


def _panels(net: Net) -> NDArray[np.int64]:
    """(F,) number of the flat panel of each face: faces on flat joints share one."""
    panel = np.arange(len(net.faces))
    for face in net.order[1:].tolist():
        if net.assignment[net.crease_of[face]] == "F":
            panel[face] = panel[net.parent[face]]
    return panel
