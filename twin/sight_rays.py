"""Does the beam reach the crease? Rays through MuJoCo's model in the pose that was simulated."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.beam import to_light
from planner.fold_plan import MachineLimits
from planner.insets import inset_triangles
from twin.loaded_model import LoadedModel
from twin.timeline import Turn

__all__ = ["Hidden", "hidden_by"]

_POINTS = 21
_MARGIN = 0.02
_START_MM = 0.02
_MOST_LAYERS = 40
_GROUPS = np.array([0, 1, 1, 0, 0, 0], dtype=np.uint8)  # faces and the sheet that is there


@dataclass(frozen=True)
class Hidden:
    """How much of a crease the beam does not reach.

    Attributes:
        share: hidden share of the sampled points.
        faces: faces of the net in the way, sorted.
        pieces: pieces of the sheet in the way, sorted.
    """

    share: float
    faces: tuple[int, ...]
    pieces: tuple[int, ...]


def hidden_by(loaded: LoadedModel, turn: Turn, limits: MachineLimits) -> Hidden:
    """Cast rays from points of the turning crease towards the laser; its own two panels do not count.

    A body hides a point if the ray goes through its middle surface; to graze its thickness is not enough (the
    planes of both panels hold the crease, and faces may stand along the beam). The points lie in the middle
    96 % of the crease; the pose is the present one of ``loaded``. ``limits`` say where the light comes from.
    """
    data = loaded.data
    joint = loaded.joint[turn.joint]
    start = data.xanchor[joint]
    along = data.xaxis[joint] * _length(loaded, turn)
    own = _own_geoms(loaded, turn)
    geom = np.zeros(1, dtype=np.int32)
    faces: set[int] = set()
    pieces: set[int] = set()
    hidden = 0
    for share in np.linspace(_MARGIN, 1.0 - _MARGIN, _POINTS).tolist():
        direction = to_light(turn.rotary_rad, start + share * along, limits)
        point = start + share * along + _START_MM * direction
        for _ in range(_MOST_LAYERS):
            distance = mujoco.mj_ray(loaded.model, data, point, direction, _GROUPS, True, -1, geom)
            if distance < 0.0:
                break
            reached = point + (distance + _START_MM) * direction
            if int(geom[0]) in own or not _pierces(loaded, int(geom[0]), point, direction):
                point = reached
                continue
            kind, number = loaded.owner[int(geom[0])]
            (faces if kind == "face" else pieces).add(number)
            hidden += 1
            break
    return Hidden(hidden / _POINTS, tuple(sorted(faces)), tuple(sorted(pieces)))


def _length(loaded: LoadedModel, turn: Turn) -> float:
    start, end = loaded.net.hinge(loaded.net.child_of[turn.crease])
    return float(np.linalg.norm(end - start))


def _pierces(
    loaded: LoadedModel, geom: int, point: NDArray[np.float64], direction: NDArray[np.float64]
) -> bool:
    """Does the ray go through the middle surface of the geom's prism?"""
    outline = _middle_outline(loaded, geom)
    first, second = outline[1] - outline[0], outline[-1] - outline[0]
    normal = np.cross(first, second)
    towards = float(normal @ direction)
    if abs(towards) < 1e-12 * float(normal @ normal) ** 0.5:
        return False
    along = float(normal @ (outline[0] - point)) / towards
    if along < -_START_MM:
        return False
    offset = point + along * direction - outline
    inside = np.cross(np.roll(outline, -1, axis=0) - outline, offset) @ normal
    return bool(np.all(inside >= 0.0))


def _middle_outline(loaded: LoadedModel, geom: int) -> NDArray[np.float64]:
    """(K, 3) corners of the middle surface of a prism, counter-clockwise from outside."""
    side = loaded.compiled.side
    kind, number = loaded.owner[geom]
    if kind == "face":
        flat = loaded.net.vertices[loaded.net.faces[number]]
        outline = inset_triangles(flat, side.insets[number])
    else:
        outline = side.pieces[number].outline
    body = int(loaded.model.geom_bodyid[geom])
    corners = np.zeros((len(outline), 3))
    corners[:, :2] = outline - loaded.flat_position[body, :2]
    world: NDArray[np.float64] = corners @ loaded.data.xmat[body].reshape(3, 3).T + loaded.data.xpos[body]
    return world


def _own_geoms(loaded: LoadedModel, turn: Turn) -> set[int]:
    panel_of = loaded.compiled.side.panel_of
    child = loaded.net.child_of[turn.crease]
    own = (panel_of == panel_of[child]) | (panel_of == panel_of[loaded.net.parent[child]])
    return {int(geom) for geom in loaded.face_geom[own]}
