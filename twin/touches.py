"""Contacts in a simulated pose, in words of the plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from twin.events import Event, EventKind
from twin.loaded_model import LoadedModel
from twin.timeline import Turn
from twin.units import force_n

__all__ = ["Touch", "contact_event", "touches"]


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


def touches(plan: FoldPlan, loaded: LoadedModel, turn: Turn, tolerance_mm: float) -> list[Touch]:
    """Present contacts deeper than ``tolerance_mm`` between bodies that no crease joins."""
    data = loaded.data
    found = []
    for n in np.flatnonzero(data.contact.dist < -tolerance_mm).tolist():
        where, depth = data.contact.pos[n], -float(data.contact.dist[n])
        faces, substrate = named(plan, loaded, tuple(int(g) for g in data.contact.geom[n]), where)
        if len(faces) == 2 and (
            int(plan.net.parent[faces[0]]) == faces[1] or int(plan.net.parent[faces[1]]) == faces[0]
        ):
            continue
        force, share = elastic_press(loaded, faces, where, depth)
        angle = float(data.qpos[loaded.qpos_address(turn.joint)])
        found.append(Touch(faces, substrate, depth, force, angle, float(data.time), share))
    return found


def elastic_press(
    loaded: LoadedModel, faces: tuple[int, ...], where: NDArray[np.float64], depth_mm: float
) -> tuple[float, float]:
    """Force in N, and its largest moment over yield, if hinges gave way by ``depth_mm`` at ``where`` (3,).

    The hinges between the two bodies (between face and base for substrate) are springs in series, each with
    the distance of ``where`` from its axis as arm: F = depth / sum(arm^2 / k). Rigid faces, no friction.
    """
    side, data = loaded.compiled.side, loaded.data
    paths = [_creases_to_base(loaded, face) for face in faces]
    between = paths[0] ^ paths[1] if len(paths) == 2 else paths[0] if paths else set()
    compliance, loads = 0.0, []
    for crease in sorted(between):
        joint = loaded.joint[f"crease_{crease}"]
        arm = float(np.linalg.norm(np.cross(where - data.xanchor[joint], data.xaxis[joint])))
        stiffness = loaded.stiffness(f"crease_{crease}")
        compliance += arm**2 / stiffness
        loads.append(arm / (stiffness * side.hinge.yield_rad))
    if compliance <= 0.0:
        return 0.0, float("inf")
    force = depth_mm / compliance
    return force_n(force), force * max(loads)


def _creases_to_base(loaded: LoadedModel, face: int) -> set[int]:
    side, parent = loaded.compiled.side, loaded.net.parent
    out = set()
    while side.panel_of[face] != 0:
        panel = side.panel_of[face]
        out.add(int(side.panel_crease[panel]))
        face = int(parent[side.panel_root[panel]])
    return out


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
        members = list(loaded.compiled.side.pieces[number].triangles)
        middle = plan.sheet.triangles[members].mean(axis=1)
        triangles.append(members[int(np.argmin(np.linalg.norm(middle - where[:2], axis=1)))])
    return tuple(faces), tuple(triangles)


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
