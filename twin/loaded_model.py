"""A compiled plan in MuJoCo: model, data, and the addresses of faces, sheet pieces and joints in them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.insets import inset_triangles
from planner.net import Net
from twin.errors import ModelError
from twin.hinge_drive import RestAngles
from twin.mjcf_model import FACE_GROUP, HIDDEN_GROUP, SHEET_GROUP, CompiledModel
from twin.timeline import Turn, beam_direction
from twin.units import GRAVITY_MM_S2

__all__ = ["LoadedModel", "quiet_mujoco"]

_NOTICE_ONLY_MM = 10.0
_FACE, _SHEET, _MOVING_FACE, _FACE_AT_REST, _MOVING_SHEET, _SHEET_AT_REST, _GONE = range(7)
_KINDS = np.array(
    [[1, 3, FACE_GROUP], [2, 1, SHEET_GROUP],
     [4, 8, FACE_GROUP], [8, 4, FACE_GROUP], [4, 8, SHEET_GROUP], [8, 4, SHEET_GROUP],
     [0, 0, HIDDEN_GROUP]]
)  # fmt: skip
"""Contact bits (type, affinity) and group of what a geom can be."""


@contextmanager
def quiet_mujoco() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings instead of having them printed and logged to the working directory."""
    messages: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(messages.append)
    try:
        yield messages
    finally:
        mujoco.set_mju_user_warning(before)


class LoadedModel:
    """One simulation of a compiled plan. Not shared between threads.

    Attributes:
        compiled: text and side table.
        net: the net that it was made of.
        model: MuJoCo's model; contact bits and groups are edited as the plan goes on.
        data: MuJoCo's state.
        face_geom: (F,) geom of every face.
        piece_geom: (S,) geom of every piece of the sheet.
        owner: geom → (kind, number) with kind ``"face"`` or ``"sheet"``.
        flat_position: (B, 3) where the frame of every body lies in the flat sheet.
        joint: joint name → joint number.
        rest: rest angles of the hinges.
        edge_lines: sheet piece → edges of its triangles, kept by ``touches`` for all turns.
    """

    def __init__(self, compiled: CompiledModel, net: Net) -> None:
        """Load ``compiled``.

        Raises:
            ModelError: if it was made of another net or MuJoCo refuses it.
        """
        if compiled.side.net_sha256 != net.sha256:
            raise ModelError("the model was compiled from another net: compile it again")
        self.compiled, self.net = compiled, net
        self.model = model = compiled.load()
        self.data = mujoco.MjData(model)
        self.face_geom = np.array([model.geom(f"face_{f}").id for f in range(len(net.faces))])
        pieces = len(compiled.side.pieces)
        self.piece_geom = np.array([model.geom(f"sheet_{k}").id for k in range(pieces)], dtype=np.int64)
        self.owner = {int(g): ("face", f) for f, g in enumerate(self.face_geom)}
        self.owner |= {int(g): ("sheet", k) for k, g in enumerate(self.piece_geom)}
        cores = compiled.side.has_cores
        self.face_core = (
            np.array([model.geom(f"core_{f}").id for f in range(len(net.faces))]) if cores else None
        )
        self.piece_core = (
            np.array([model.geom(f"core_sheet_{k}").id for k in range(pieces)], dtype=np.int64)
            if cores
            else None
        )
        if self.face_core is not None and self.piece_core is not None:
            self.owner |= {int(g): ("face", f) for f, g in enumerate(self.face_core)}
            self.owner |= {int(g): ("sheet", k) for k, g in enumerate(self.piece_core)}
        self.joint = {model.joint(j).name: j for j in range(model.njnt)}
        self.rest = RestAngles(model, self.data, compiled.side.drive, compiled.side.hinge.yield_rad)
        self._in_room = model.body_mocapid[[model.body(name).id for name in ("machine", "laser_head")]]
        self.edge_lines: dict[int, NDArray[np.float64]] = {}
        self._geoms = np.concatenate([self.face_geom, self.piece_geom])
        self._with_geoms = np.flatnonzero(model.body_geomnum)
        self._first_geom = model.body_geomadr[self._with_geoms]
        mujoco.mj_kinematics(model, self.data)
        self.flat_position = self.data.xpos.copy()

    def qpos_address(self, joint: str) -> int:
        """Index of a joint's angle in ``data.qpos``."""
        return int(self.model.jnt_qposadr[self.joint[joint]])

    @cached_property
    def _local_corners(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """(ngeom, K, 3) corners of the mesh geoms in their own frame, (ngeom,) how many each has."""
        model = self.model
        geoms = list(self.owner)
        count = np.zeros(model.ngeom, dtype=np.int64)
        count[geoms] = model.mesh_vertnum[model.geom_dataid[geoms]]
        out = np.zeros((model.ngeom, int(count.max(initial=1)), 3))
        for g in geoms:
            mesh = int(model.geom_dataid[g])
            first, number = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            out[g, :number] = model.mesh_vert[first : first + number]
            out[g, number:] = out[g, 0]
        return out, count

    @cached_property
    def middles(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """(ngeom, K, 3) corners of the middle surfaces of faces and sheet in the frames of their bodies.

        Counter-clockwise from outside, with (ngeom,) how many each has.
        """
        side, net = self.compiled.side, self.net
        outlines: list[NDArray[np.float64]] = list(inset_triangles(net.vertices[net.faces], side.insets))
        outlines += [piece.outline for piece in side.pieces]
        count = np.zeros(self.model.ngeom, dtype=np.int64)
        count[self._geoms] = [len(outline) for outline in outlines]
        out = np.zeros((self.model.ngeom, int(count.max(initial=1)), 3))
        for geom, outline in zip(self._geoms.tolist(), outlines, strict=True):
            out[geom, : len(outline), :2] = outline - self.flat_position[self.model.geom_bodyid[geom], :2]
        return out, count

    def corners(self, geoms: NDArray[np.int64]) -> NDArray[np.float64]:
        """(G, K, 3) corners of faces or sheet pieces in the present pose; short lists repeat the first."""
        local, count = self._local_corners
        turn = self.data.geom_xmat[geoms].reshape(-1, 3, 3)
        own = local[geoms, : int(count[geoms].max(initial=1))]
        world: NDArray[np.float64] = own @ turn.transpose(0, 2, 1) + self.data.geom_xpos[geoms][:, None]
        return world

    def other_pose(self) -> LoadedModel:
        """The same model in a pose of its own; contact bits and groups are shared."""
        other = object.__new__(LoadedModel)
        other.__dict__.update(self.__dict__)
        other.data = mujoco.MjData(self.model)
        hinge = self.compiled.side.hinge
        other.rest = RestAngles(self.model, other.data, self.compiled.side.drive, hinge.yield_rad)
        return other

    @cached_property
    def stiffness(self) -> NDArray[np.float64]:
        """(J,) torque per radian of every hinge, g mm²/s²."""
        if self.compiled.side.drive == "springyield":
            return np.array([float(self.model.jnt_stiffness[j].flat[0]) for j in range(self.model.njnt)])
        return np.array([float(self.model.actuator(name).gainprm[0]) for name in self.joint])

    @cached_property
    def _joints_to_base(self) -> NDArray[np.bool_]:
        """(P, J) True for the joints between a panel and the base panel."""
        side = self.compiled.side
        out = np.zeros((len(side.panel_root), self.model.njnt), dtype=np.bool_)
        for panel, (face, crease) in enumerate(
            zip(side.panel_root.tolist(), side.panel_crease.tolist(), strict=True)
        ):
            if crease >= 0:
                out[panel] = out[side.panel_of[self.net.parent[face]]]
                out[panel, self.joint[f"crease_{crease}"]] = True
        return out

    def joints_between(self, faces: tuple[int, ...]) -> NDArray[np.int64]:
        """Joints on the way from one of two faces to the other, or from one face to the base."""
        way = np.zeros(self.model.njnt, dtype=np.bool_)
        for face in faces:
            way ^= self._joints_to_base[self.compiled.side.panel_of[face]]
        between: NDArray[np.int64] = np.flatnonzero(way)
        return between

    def crease_angles(self) -> NDArray[np.float64]:
        """(E,) angle of every net edge in the present state; 0 where there is no joint."""
        angles = np.zeros(len(self.net.edges))
        for crease in self.compiled.side.panel_crease.tolist():
            if crease >= 0:
                angles[crease] = self.data.qpos[self.qpos_address(f"crease_{crease}")]
        return angles

    def set_angle(self, joint: str, angle_rad: float) -> None:
        """Put a joint at an angle, at rest, without force."""
        self.data.qpos[self.qpos_address(joint)] = angle_rad
        self.rest.set(joint, angle_rad)

    def set_rotary(self, rotary_rad: float, gravity: bool = True) -> None:
        """Turn gravity and what stands still in the room as seen from the sheet."""
        self.model.opt.gravity[:] = -GRAVITY_MM_S2 * beam_direction(rotary_rad) if gravity else 0.0
        half = -rotary_rad / 2.0
        self.data.mocap_quat[self._in_room] = (math.cos(half), math.sin(half), 0.0, 0.0)

    def all_contacts_on(self, gone: NDArray[np.bool_]) -> None:
        """Everything that is there can touch everything else."""
        faces = np.full(len(self.face_geom), _FACE)
        self._set_kinds(faces, np.where(gone, _GONE, _SHEET))

    def moving_contacts_on(self, turn: Turn) -> None:
        """Only what turns can touch, and only what is at rest."""
        faces = np.where(turn.moving_faces, _MOVING_FACE, _FACE_AT_REST)
        pieces = np.where(turn.moving_pieces, _MOVING_SHEET, _SHEET_AT_REST)
        pieces[turn.gone] = _GONE
        self._set_kinds(faces, pieces)

    def notice_contacts_only(self) -> None:
        """Contacts are found from ``margin + gap`` on, and would push from ``margin`` on: never."""
        self.model.geom_margin[:] = -_NOTICE_ONLY_MM
        self.model.geom_gap[:] = _NOTICE_ONLY_MM

    def _set_kinds(self, faces: NDArray[np.int64], pieces: NDArray[np.int64]) -> None:
        """Say what each face (F,) and each piece of the sheet (S,) is, as rows of ``_KINDS``.

        A body's bits are those of all its geoms, which stand in the order of their bodies.
        """
        model, kinds = self.model, np.concatenate([faces, pieces])
        model.geom_contype[self._geoms] = _KINDS[kinds, 0]
        model.geom_conaffinity[self._geoms] = _KINDS[kinds, 1]
        model.geom_group[self._geoms] = _KINDS[kinds, 2]
        model.body_contype[self._with_geoms] = np.bitwise_or.reduceat(model.geom_contype, self._first_geom)
        model.body_conaffinity[self._with_geoms] = np.bitwise_or.reduceat(
            model.geom_conaffinity, self._first_geom
        )
