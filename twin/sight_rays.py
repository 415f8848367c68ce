"""Does the beam reach the crease? Rays through MuJoCo's model in the pose that was simulated."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.beam import to_light
from planner.fold_plan import MachineLimits
from twin.loaded_model import LoadedModel
from twin.sight_kernel import pierced
from twin.timeline import Turn

__all__ = ["BeamView", "Hidden"]

_POINTS = 21
_MARGIN = 0.02
_START_MM = 0.02
_SHARES = np.linspace(_MARGIN, 1.0 - _MARGIN, _POINTS)[:, None]


@dataclass(frozen=True)
class Hidden:
    """How much of a crease the beam does not reach.

    Attributes:
        share: hidden share of the sampled points.
        faces: faces of the net in the way, sorted.
        pieces: pieces of the sheet in the way, sorted.
    """

    share: float
    faces: tuple[int, ...] = ()
    pieces: tuple[int, ...] = ()


class BeamView:
    """The beam's view of one turning crease past all faces and the sheet that is there during the turn.

    The crease's own two panels do not count. A body hides a point if the ray goes through its middle surface;
    to graze its thickness is not enough (the planes of both panels hold the crease, and faces may stand along
    the beam). The points lie in the middle 96 % of the crease.

    Args:
        loaded: the simulation.
        turn: what turns; it turns a crease.
        limits: of the machine; they say where the light comes from.
    """

    def __init__(self, loaded: LoadedModel, turn: Turn, limits: MachineLimits) -> None:
        self.loaded, self.turn, self.limits = loaded, turn, limits
        panel_of, child = loaded.compiled.side.panel_of, loaded.net.child_of[turn.crease]
        own = (panel_of == panel_of[child]) | (panel_of == panel_of[loaded.net.parent[child]])
        self._geoms = np.concatenate([loaded.face_geom[~own], loaded.piece_geom[~turn.gone]])
        self._reach = loaded.model.geom_rbound[self._geoms]
        self._joint = loaded.joint[turn.joint]
        start, end = loaded.net.hinge(child)
        self._length = float(np.linalg.norm(end - start))
        self._parallel: NDArray[np.float64] | None = None
        if limits.beam_source is None:
            self._parallel = np.repeat(to_light(turn.rotary_rad, start, limits)[None], _POINTS, axis=0)

    def hidden(self) -> Hidden:
        """Cast rays from points of the crease towards the laser, in the present pose.

        Of several bodies in the way of one ray the nearest is named.
        """
        points, lights = self._rays()
        model, data = self.loaded.model, self.loaded.data
        nearest: dict[int, tuple[float, int]] = {}
        for point, geom in pierced(
            points, lights, _START_MM, self._geoms, self._reach, data.geom_xpos, model.geom_bodyid,
            data.xmat, data.xpos, *self.loaded.middles,
        ).tolist():  # fmt: skip
            start = points[point] + _START_MM * lights[point]
            distance = mujoco.mj_rayMesh(model, data, geom, start, lights[point])
            if distance >= 0.0:
                nearest[point] = min(nearest.get(point, (np.inf, -1)), (distance, geom))
        names = {self.loaded.owner[geom] for _, geom in nearest.values()}
        faces, pieces = (
            tuple(sorted(n for kind, n in names if kind == wanted)) for wanted in ("face", "sheet")
        )
        return Hidden(len(nearest) / _POINTS, faces, pieces)

    def _rays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(P, 3) points of the crease and unit vectors from them towards the light."""
        start, along = self.loaded.data.xanchor[self._joint], self.loaded.data.xaxis[self._joint]
        points = start + _SHARES * (along * self._length)
        if self._parallel is not None:
            return points, self._parallel
        return points, np.array([to_light(self.turn.rotary_rad, point, self.limits) for point in points])
