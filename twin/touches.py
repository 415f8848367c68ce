"""Contacts in a simulated pose, in words of the plan."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
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
        force_n: normal force, N.
        angle_rad: angle of the turning hinge.
        time_s: simulated time.
    """

    faces: tuple[int, ...]
    substrate: tuple[int, ...]
    depth_mm: float
    force_n: float
    angle_rad: float
    time_s: float

    @property
    def pair(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """What touches what, apart from order and depth."""
        return tuple(sorted(self.faces)), self.substrate


def touches(plan: FoldPlan, loaded: LoadedModel, turn: Turn, tolerance_mm: float) -> list[Touch]:
    """Present contacts deeper than ``tolerance_mm`` between bodies that no crease joins."""
    data = loaded.data
    found = []
    force = np.zeros(6)
    for n in np.flatnonzero(data.contact.dist < -tolerance_mm).tolist():
        faces, substrate = named(
            plan, loaded, tuple(int(g) for g in data.contact.geom[n]), data.contact.pos[n]
        )
        if len(faces) == 2 and (
            int(plan.net.parent[faces[0]]) == faces[1] or int(plan.net.parent[faces[1]]) == faces[0]
        ):
            continue
        mujoco.mj_contactForce(loaded.model, data, n, force)
        found.append(
            Touch(
                faces, substrate, -float(data.contact.dist[n]), force_n(float(force[0])),
                float(data.qpos[loaded.qpos_address(turn.joint)]), float(data.time),
            )
        )  # fmt: skip
    return found


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
