"""The kinematic sweep: does anything touch while the plan is played without forces?

MuJoCo measures the distance of every pair of a moving and a resting body. Between two poses a pair is
skipped only if a plane proves that it stays apart: the plane between the nearest points stands still, and the
first angle at which a corner of the moving body reaches it has a closed form. Where no plane helps, the pair
is measured again before any of its corners has moved by more than half a thickness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from twin.events import Event
from twin.loaded_model import LoadedModel, quiet_mujoco
from twin.mjcf_model import CompiledModel
from twin.sweep_bounds import first_reach, may_meet
from twin.timeline import Turn, turns
from twin.touches import named

__all__ = ["DEPTH_TOLERANCE_MM", "SweepResult", "kinematic_sweep"]

DEPTH_TOLERANCE_MM = 5e-4
"""Penetration that is not yet a hit: MuJoCo keeps corners as 32-bit floats and measures to about 1e-5 mm."""

_FAR_MM = 1e4
_REACH_SLACK_MM = 1e-3
_BISECTIONS = 24

_NUDGES_RAD = (0.0, 1e-9, 1e-7, -1e-7, 1e-6, -1e-6)
"""MuJoCo 4.0.1 gives up on some poses of two thin prisms that overlap: it finds no contact, and a distance of
exactly 0. Then a pose beside it is measured; these turn a tip at 100 mm by no more than 0.1 µm."""


@dataclass(frozen=True)
class SweepResult:
    """What the sweep found.

    Attributes:
        events: contacts, in the order of the plan, the first of each pair and step.
        turns: how many turns were played.
        measured: how many distances MuJoCo measured.
        closest_mm: smallest distance of a pair that is not a hit, over all poses that were measured.
    """

    events: tuple[Event, ...]
    turns: int
    measured: int
    closest_mm: float


def kinematic_sweep(
    compiled: CompiledModel, plan: FoldPlan, *, tolerance_mm: float = DEPTH_TOLERANCE_MM
) -> SweepResult:
    """Play every turn of ``plan`` and report each pair that meets, with the angle at which it does.

    All pairs of a moving body with a resting one count but the two faces of the turning crease; after each
    turn MuJoCo's own collision detection looks at everything once more.

    Raises:
        ModelError: if the model was compiled from another net.
    """
    loaded = LoadedModel(compiled, plan.net)
    sweeper = _Sweeper(loaded, plan, tolerance_mm)
    events: list[Event] = []
    played = turns(plan, compiled.side)
    with quiet_mujoco():
        for turn in played:
            events += sweeper.play(turn)
            loaded.set_angle(turn.joint, turn.to_rad)
            mujoco.mj_kinematics(loaded.model, loaded.data)
            known = {e.pair for e in events}
            events += [e for e in sweeper.full_check(turn) if e.pair not in known]
    return SweepResult(tuple(events), len(played), sweeper.measured, sweeper.closest)


class _Sweeper:
    def __init__(self, loaded: LoadedModel, plan: FoldPlan, tolerance_mm: float) -> None:
        self.loaded, self.plan, self.tolerance = loaded, plan, tolerance_mm
        self.net = plan.net
        self.half_thickness = plan.limits.thickness / 2.0
        self.bound = np.array(loaded.model.geom_rbound)
        self.face_of = np.full(loaded.model.ngeom, -1, dtype=np.int64)
        for geom, (kind, number) in loaded.owner.items():
            if kind == "face":
                self.face_of[geom] = number
        self.neighbour_of = {int(e): (f, int(self.net.parent[f])) for e, f in self.net.child_of.items()}
        self.measured = 0
        self.closest = np.inf

    def within_reach(
        self, moving: NDArray[np.int64], rest: NDArray[np.int64],
        anchor: NDArray[np.float64], axis: NDArray[np.float64],
    ) -> NDArray[np.int64]:  # fmt: skip
        """Those of ``rest`` with bounding spheres in the ring that ``moving`` sweeps about the axis."""
        heights, radii = [], []
        for geoms in (moving, rest):
            centre = self.loaded.data.geom_xpos[geoms] - anchor
            height = centre @ axis
            heights.append(height)
            radii.append(np.sqrt(np.maximum((centre * centre).sum(axis=1) - height * height, 0.0)))
        (h, height), (r, radius) = heights, radii
        own, bound = self.bound[moving], self.bound[rest] + _REACH_SLACK_MM
        near = (height + bound >= (h - own).min()) & (height - bound <= (h + own).max())
        near &= (radius - bound <= (r + own).max()) & (radius + bound >= (r - own).min())
        kept: NDArray[np.int64] = rest[near]
        return kept

    def play(self, turn: Turn) -> list[Event]:
        """Events of one turn, from the pose before it; leaves the data in an undefined pose."""
        loaded = self.loaded
        faces, pieces = turn.moving_faces, turn.moving_pieces
        sharp = loaded.compiled.side.sharp
        hits: dict[tuple[int, int], _Hit] = {}
        layers = [(loaded.face_geom, loaded.piece_geom, np.ones_like(faces), np.ones_like(faces))]
        if (
            loaded.face_core is not None and loaded.piece_core is not None
        ):  # a core meets cores, one of them sharp
            layers.append((loaded.face_core, loaded.piece_core, sharp, np.ones_like(faces)))
            layers.append((loaded.face_core, loaded.piece_core, ~sharp, sharp))
        for face_geom, piece_geom, moves, rests in layers:
            moving, rest = [face_geom[faces & moves]], [face_geom[~faces & rests]]
            if rests.all():
                rest.append(piece_geom[~pieces & ~turn.gone])
            if moves.all():
                moving.append(piece_geom[pieces & ~turn.gone])
            found = self._meet(turn, np.concatenate(moving), np.concatenate(rest))
            for hit in found:
                pair = (hit.moving, hit.rest)
                if pair not in hits or hit.angle_rad < hits[pair].angle_rad:
                    hits[pair] = hit
        return self._as_events(turn, list(hits.values()))

    def _meet(self, turn: Turn, moving: NDArray[np.int64], rest: NDArray[np.int64]) -> list[_Hit]:
        """Pairs of geoms of ``moving`` and ``rest`` that meet during a turn."""
        loaded, data = self.loaded, self.loaded.data
        sweep = turn.to_rad - turn.from_rad
        if sweep == 0.0 or not len(moving) or not len(rest):
            return []
        joint = loaded.joint[turn.joint]
        anchor, axis = data.xanchor[joint].copy(), data.xaxis[joint] * np.sign(sweep)
        rest = self.within_reach(moving, rest, anchor, axis)
        if not len(rest):
            return []
        moving = self.within_reach(rest, moving, anchor, axis)
        if not len(moving):
            return []
        moving_corners, rest_corners = loaded.corners(moving) - anchor, loaded.corners(rest) - anchor
        i, j = may_meet(moving_corners, rest_corners, axis, abs(sweep))
        keep = ~self._exempt(turn, moving[i], rest[j])
        i, j = i[keep], j[keep]
        radius = np.linalg.norm(np.cross(moving_corners, axis), axis=2).max(axis=1)
        least_step = self.half_thickness / np.maximum(radius, 1e-9)
        pose = _Pose(loaded, moving, anchor, axis)
        at, clear = np.zeros(len(i)), np.zeros(len(i))
        hits: list[_Hit] = []
        while len(i):
            distance, normal, witness = self._measure(pose, moving[i], rest[j], i, at)
            clear = np.where(distance >= 0.0, at, clear)
            hit = distance < -self.tolerance
            for n in np.flatnonzero(hit).tolist():
                a, b = int(i[n]), int(j[n])
                angle = self._onset(pose, moving[a], rest[b], a, clear[n], at[n]) if at[n] > 0.0 else 0.0
                hits.append(_Hit(int(moving[a]), int(rest[b]), angle, -float(distance[n]), witness[n]))
            go = ~hit
            i, j, at, clear = i[go], j[go], at[go], clear[go]
            if not len(i):
                break
            step = first_reach(moving_corners[i], rest_corners[j], axis, at, normal[go], abs(sweep))
            # A pair whose plane holds to the end needs no further look; all others are measured there too.
            done = (at >= abs(sweep)) | (step >= abs(sweep) - at)
            at = np.minimum(at + np.maximum(step, least_step[i]), abs(sweep))
            i, j, at, clear = i[~done], j[~done], at[~done], clear[~done]
        return hits

    def _measure(
        self, pose: _Pose, moving: NDArray[np.int64], rest: NDArray[np.int64],
        body: NDArray[np.int64], at: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
        """Signed distance (N,), direction from moving to rest (N, 3), point between (N, 3) of each pair."""
        count = len(moving)
        distance, fromto = np.empty(count), np.empty((count, 6))
        segment = np.zeros(6)
        for n, (a, b, k, angle) in enumerate(
            zip(moving.tolist(), rest.tolist(), body.tolist(), at.tolist(), strict=True)
        ):
            distance[n] = pose.distance(a, b, k, angle, segment)
            fromto[n] = segment
        self.measured += count
        apart = distance > -self.tolerance
        if apart.any():
            self.closest = min(self.closest, float(distance[apart].min()))
        normal = fromto[:, 3:] - fromto[:, :3]
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        usable = (length > 1e-9) & (distance[:, None] > 0.0)
        return (
            distance,
            np.where(usable, normal / np.maximum(length, 1e-12), 0.0),
            (fromto[:, :3] + fromto[:, 3:]) / 2.0,
        )

    def _onset(self, pose: _Pose, a: int, b: int, body: int, low: float, high: float) -> float:
        """Angle between ``low`` (apart) and ``high`` (a hit) at which the pair begins to touch."""
        segment = np.zeros(6)
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            if pose.distance(a, b, body, middle, segment) < 0.0:
                high = middle
            else:
                low = middle
        return high

    def _exempt(self, turn: Turn, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Pairs that the turning joint itself joins."""
        if turn.crease < 0:
            return np.zeros(len(a), dtype=np.bool_)
        child, parent = self.neighbour_of[turn.crease]
        mates: NDArray[np.bool_] = (self.face_of[a] == child) & (self.face_of[b] == parent)
        return mates

    def _as_events(self, turn: Turn, hits: list[_Hit]) -> list[Event]:
        """One event for each pair of bodies, the first to meet first."""
        sign = float(np.sign(turn.to_rad - turn.from_rad))
        events: dict[tuple[tuple[int, ...], tuple[int, ...]], Event] = {}
        for hit in sorted(hits, key=lambda h: (h.angle_rad, h.moving, h.rest)):
            at = turn.from_rad + sign * hit.angle_rad
            event = self.event(turn, hit.moving, hit.rest, hit.depth_mm, at, hit.where)
            events.setdefault(event.pair, event)
        return list(events.values())

    def event(
        self, turn: Turn, a: int, b: int, depth: float, angle: float, where: NDArray[np.float64]
    ) -> Event:
        """The contact of geoms ``a`` and ``b`` near ``where`` (3,) in words of the plan."""
        faces, triangles = named(self.plan, self.loaded, (a, b), where)
        joint = turn.joint.replace("_", " ")
        parts = [f"face {f}" for f in faces] + [f"substrate triangle {t}" for t in triangles]
        return Event(
            "contact", turn.step, turn.crease, faces, triangles, depth, 0.0, angle, -1.0,
            f"{' and '.join(parts)} meet at {np.degrees(angle):.2f}° of {joint}",
        )  # fmt: skip

    def full_check(self, turn: Turn) -> list[Event]:
        """Contacts of everything with everything in the present pose, by MuJoCo's collision detection."""
        loaded = self.loaded
        loaded.all_contacts_on(turn.gone)
        mujoco.mj_collision(loaded.model, loaded.data)
        contact = loaded.data.contact
        events: dict[tuple[int, int], Event] = {}
        for n in np.flatnonzero(contact.dist < -self.tolerance).tolist():
            a, b = sorted(int(g) for g in contact.geom[n])
            joined = self._joined(a, b)
            if (a, b) not in events and not joined:
                depth = -float(contact.dist[n])
                events[a, b] = self.event(turn, a, b, depth, turn.to_rad, contact.pos[n])
        return list(events.values())

    def _joined(self, a: int, b: int) -> bool:
        (kind_a, first), (kind_b, second) = self.loaded.owner[a], self.loaded.owner[b]
        if kind_a != "face" or kind_b != "face":
            return False
        return int(self.net.parent[first]) == second or int(self.net.parent[second]) == first


class _Hit(NamedTuple):
    """A pair of geoms that meets: angle of the turn at first touch, depth and place where it was noticed."""

    moving: int
    rest: int
    angle_rad: float
    depth_mm: float
    where: NDArray[np.float64]


class _Pose:
    """Puts single moving geoms at an angle of the turn, from the pose before it."""

    def __init__(
        self, loaded: LoadedModel, moving: NDArray[np.int64],
        anchor: NDArray[np.float64], axis: NDArray[np.float64],
    ) -> None:  # fmt: skip
        self.model, self.data = loaded.model, loaded.data
        x, y, z = axis
        self.cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        self.square = self.cross @ self.cross
        self.anchor = anchor
        self.position = loaded.data.geom_xpos[moving] - anchor
        self.frame = loaded.data.geom_xmat[moving].reshape(-1, 3, 3).copy()
        self.eye = np.eye(3)

    def put(self, geom: int, body: int, angle_rad: float) -> None:
        turn = self.eye + np.sin(angle_rad) * self.cross + (1.0 - np.cos(angle_rad)) * self.square
        self.data.geom_xpos[geom] = turn @ self.position[body] + self.anchor
        self.data.geom_xmat[geom] = (turn @ self.frame[body]).ravel()

    def distance(
        self, geom: int, other: int, body: int, angle_rad: float, segment: NDArray[np.float64]
    ) -> float:
        """Signed distance of ``geom`` at an angle to ``other``; ``segment`` (6,) gets the nearest points."""
        found = 0.0
        for nudge in _NUDGES_RAD:
            self.put(geom, body, angle_rad + nudge)
            found = float(mujoco.mj_geomDistance(self.model, self.data, geom, other, _FAR_MM, segment))
            if found != 0.0:
                break
        return found
