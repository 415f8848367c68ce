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
_SHARES = np.linspace(_MARGIN, 1.0 - _MARGIN, _POINTS)
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
    model, data = loaded.model, loaded.data
    joint = loaded.joint[turn.joint]
    start = data.xanchor[joint]
    along = data.xaxis[joint] * _length(loaded, turn)
    own = loaded.geoms_at(turn.crease)
    geom = np.zeros(1, dtype=np.int32)
    faces: set[int] = set()
    pieces: set[int] = set()
    hidden = 0
    on_crease = start + _SHARES[:, None] * along
    if limits.beam_source is None:
        directions = np.tile(to_light(turn.rotary_rad, start, limits), (_POINTS, 1))
    else:
        directions = np.array([to_light(turn.rotary_rad, point, limits) for point in on_crease])
    ray = mujoco.mj_ray
    for point, direction in zip(on_crease + _START_MM * directions, directions, strict=True):
        while (distance := ray(model, data, point, direction, _GROUPS, True, -1, geom)) >= 0.0:
            met = int(geom[0])
            if met in own or not _pierces(loaded, met, point, direction):
                point = point + (distance + _START_MM) * direction
                continue
            kind, number = loaded.owner[met]
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
