"""Contacts in a simulated pose, in words of the plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from twin.events import Event, EventKind
from twin.loaded_model import LoadedModel
from twin.timeline import Turn
from twin.units import force_n

__all__ = ["Touch", "TouchLog", "contact_event", "elastic_press", "named"]


@dataclass(frozen=True)
class Touch:
    """Two bodies that touch, at one time.

    Attributes:
        faces: faces of the net that take part.
        substrate: substrate triangles that take part.
        depth_mm: how deep.
        force_n: force with which the hinges between the two would press them together, N (an estimate).
        yield_share: moment of that force on the hinge that it loads most, as a share of its yield moment.
        angle_rad: angle of the turning hinge.
        time_s: simulated time.
    """

    faces: tuple[int, ...]
    substrate: tuple[int, ...]
    depth_mm: float
    force_n: float
    angle_rad: float
    time_s: float
    yield_share: float = 0.0

    @property
    def pair(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """What touches what, apart from order and depth."""
        return tuple(sorted(self.faces)), self.substrate


class TouchLog:
    """The deepest touch of every pair of geoms during one turn.

    What a touch means is worked out at the end: while time steps are made only depths are compared.

    Args:
        plan: the plan.
        loaded: the simulation.
        turn: what turns.
        tolerance_mm: depth that is no touch.
    """

    def __init__(self, plan: FoldPlan, loaded: LoadedModel, turn: Turn, tolerance_mm: float) -> None:
        self.plan, self.loaded, self.turn, self.tolerance = plan, loaded, turn, tolerance_mm
        self._angle = loaded.qpos_address(turn.joint)
        self._deepest: dict[tuple[int, int], _Sighting] = {}

    def note(self) -> None:
        """Compare the contacts that MuJoCo found last."""
        data = self.loaded.data
        if not data.ncon:
            return
        contact = data.contact
        heights = contact.dist
        if np.minimum.reduce(heights) >= -self.tolerance:
            return
        depths = -heights
        deep = np.flatnonzero(depths > self.tolerance)
        hinges: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        for n, depth, geoms in zip(
            deep.tolist(), depths[deep].tolist(), contact.geom[deep].tolist(), strict=True
        ):
            pair = (geoms[0], geoms[1])
            known = self._deepest.get(pair)
            if known is None or depth > known.depth_mm:
                hinges = hinges or (data.xanchor.copy(), data.xaxis.copy())
                self._deepest[pair] = _Sighting(
                    depth, contact.pos[n].copy(), float(data.qpos[self._angle]), float(data.time), *hinges
                )

    def touches(self) -> list[Touch]:
        """The touches of bodies that no crease joins, sorted."""
        parent, found = self.plan.net.parent, []
        for geoms, at in sorted(self._deepest.items()):
            faces, substrate = named(self.plan, self.loaded, geoms, at.where)
            if len(faces) == 2 and (int(parent[faces[0]]) == faces[1] or int(parent[faces[1]]) == faces[0]):
                continue
            force, share = elastic_press(self.loaded, faces, at.where, at.depth_mm, (at.anchor, at.axis))
            found.append(Touch(faces, substrate, at.depth_mm, force, at.angle_rad, at.time_s, share))
        deepest: dict[tuple[tuple[int, ...], tuple[int, ...]], Touch] = {}
        for touch in found:
            if touch.pair not in deepest or touch.depth_mm > deepest[touch.pair].depth_mm:
                deepest[touch.pair] = touch
        return [deepest[pair] for pair in sorted(deepest)]


class _Sighting(NamedTuple):
    """A contact as it was seen, with all hinges at that time."""

    depth_mm: float
    where: NDArray[np.float64]
    angle_rad: float
    time_s: float
    anchor: NDArray[np.float64]
    axis: NDArray[np.float64]


def elastic_press(
    loaded: LoadedModel, faces: tuple[int, ...], where: NDArray[np.float64], depth_mm: float,
    hinges: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> tuple[float, float]:  # fmt: skip
    """Force in N, and its largest moment over yield, if hinges gave way by ``depth_mm`` at ``where`` (3,).

    The hinges between the two bodies (between face and base for substrate) are springs in series, each with
    the distance of ``where`` from its axis as arm: F = depth / sum(arm^2 / k). Rigid faces, no friction.
    ``hinges`` are anchors and axes (J, 3) of all joints, those of the present pose if None.
    """
    joints = loaded.joints_between(faces)
    if not len(joints):
        return 0.0, float("inf")
    anchor, axes = hinges or (loaded.data.xanchor, loaded.data.xaxis)
    offset, axis = where - anchor[joints], axes[joints]
    along = np.einsum("ij,ij->i", offset, axis)
    square = np.maximum(np.einsum("ij,ij->i", offset, offset) - along * along, 0.0)
    stiffness = loaded.stiffness[joints]
    compliance = float((square / stiffness).sum())
    if compliance <= 0.0:
        return 0.0, float("inf")
    force = depth_mm / compliance
    share = force * float((np.sqrt(square) / stiffness).max()) / loaded.compiled.side.hinge.yield_rad
    return force_n(force), share


def named(
    plan: FoldPlan,
    loaded: LoadedModel,
    geoms: tuple[int, ...],
    where: NDArray[np.float64],
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Faces and substrate triangles behind ``geoms``; of a merged piece the triangle nearest ``where``."""
    faces: list[int] = []
    triangles: list[int] = []
    for geom in geoms:
        kind, number = loaded.owner[geom]
        if kind == "face":
            faces.append(number)
            continue
        members = loaded.compiled.side.pieces[number].triangles
        nearest = 0
        if len(members) > 1:
            if number not in loaded.edge_lines:
                loaded.edge_lines[number] = _edge_lines(plan.sheet.triangles[list(members)])
            nearest = int(_inside(loaded.edge_lines[number], where).argmax())
        triangles.append(members[nearest])
    return tuple(faces), tuple(triangles)


def _edge_lines(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, 3, 3) the edges of counter-clockwise triangles (T, 3, 2): unit normal inwards, and offset."""
    along = np.roll(triangles, -1, axis=1) - triangles
    out = np.empty((len(triangles), 3, 3))
    out[..., 0], out[..., 1] = -along[..., 1], along[..., 0]
    out[..., :2] /= np.maximum(np.linalg.norm(along, axis=2), 1e-300)[..., None]
    out[..., 2] = -(out[..., :2] * triangles).sum(axis=2)
    return out


def _inside(lines: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T,) how far ``point`` (3,) is inside each triangle, from its nearest edge; negative outside."""
    inside: NDArray[np.float64] = np.minimum.reduce(lines[..., :2] @ point[:2] + lines[..., 2], axis=1)
    return inside


def contact_event(kind: EventKind, turn: Turn, touch: Touch) -> Event:
    """The event of a touch, with a sentence."""
    parts = [f"face {f}" for f in touch.faces] + [f"substrate triangle {t}" for t in touch.substrate]
    verb = {"sag": "sag onto each other", "tunnel": "cut into each other"}.get(kind, "meet")
    return Event(
        kind, turn.step, turn.crease, touch.faces, touch.substrate, touch.depth_mm, touch.force_n,
        touch.angle_rad, touch.time_s,
        f"{' and '.join(parts)} {verb} at {np.degrees(touch.angle_rad):.2f}° of {turn.joint}, "
        f"{touch.depth_mm:.3f} mm deep",
    )  # fmt: skip
