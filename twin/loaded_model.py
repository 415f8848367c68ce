"""A compiled plan in MuJoCo: model, data, and the addresses of faces, sheet pieces and joints in them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.net import Net
from twin.errors import ModelError
from twin.hinge_drive import RestAngles
from twin.mjcf_model import FACE_GROUP, HIDDEN_GROUP, SHEET_GROUP, CompiledModel
from twin.timeline import Turn, beam_direction
from twin.units import GRAVITY_MM_S2

__all__ = ["LoadedModel", "quiet_mujoco"]

_FACE_BITS, _SHEET_BITS, _NO_BITS = (1, 3), (2, 1), (0, 0)
_NOTICE_ONLY_MM = 10.0
_MOVING_BITS, _REST_BITS = (4, 8), (8, 4)


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
        self.joint = {model.joint(j).name: j for j in range(model.njnt)}
        self.rest = RestAngles(model, self.data, compiled.side.drive, compiled.side.hinge.yield_rad)
        mujoco.mj_kinematics(model, self.data)
        self.flat_position = self.data.xpos.copy()

    def qpos_address(self, joint: str) -> int:
        """Index of a joint's angle in ``data.qpos``."""
        return int(self.model.jnt_qposadr[self.joint[joint]])

    def stiffness(self, joint: str) -> float:
        """Torque per radian of a hinge, g mm²/s²."""
        if self.compiled.side.drive == "springyield":
            return float(self.model.jnt_stiffness[self.joint[joint]].flat[0])
        return float(self.model.actuator(joint).gainprm[0])

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
        up = beam_direction(rotary_rad)
        self.model.opt.gravity[:] = -GRAVITY_MM_S2 * up if gravity else 0.0
        half = -rotary_rad / 2.0
        for name in ("machine", "laser_head"):
            body = int(self.model.body_mocapid[self.model.body(name).id])
            self.data.mocap_quat[body] = (np.cos(half), np.sin(half), 0.0, 0.0)

    def all_contacts_on(self, gone: NDArray[np.bool_]) -> None:
        """Everything that is there can touch everything else."""
        self._set_bits(self.face_geom, _FACE_BITS, FACE_GROUP)
        self._set_bits(self.piece_geom[~gone], _SHEET_BITS, SHEET_GROUP)
        self._set_bits(self.piece_geom[gone], _NO_BITS, HIDDEN_GROUP)
        self._sum_up_bits()

    def moving_contacts_on(self, turn: Turn) -> None:
        """Only what turns can touch, and only what is at rest."""
        self._set_bits(self.face_geom[turn.moving_faces], _MOVING_BITS, FACE_GROUP)
        self._set_bits(self.face_geom[~turn.moving_faces], _REST_BITS, FACE_GROUP)
        self._set_bits(self.piece_geom[turn.moving_pieces], _MOVING_BITS, SHEET_GROUP)
        self._set_bits(self.piece_geom[~turn.moving_pieces], _REST_BITS, SHEET_GROUP)
        self._set_bits(self.piece_geom[turn.gone], _NO_BITS, HIDDEN_GROUP)
        self._sum_up_bits()

    def notice_contacts_only(self) -> None:
        """Contacts are found from ``margin + gap`` on, and would push from ``margin`` on: never."""
        self.model.geom_margin[:] = -_NOTICE_ONLY_MM
        self.model.geom_gap[:] = _NOTICE_ONLY_MM

    def _set_bits(self, geoms: NDArray[np.int64], bits: tuple[int, int], group: int) -> None:
        self.model.geom_contype[geoms], self.model.geom_conaffinity[geoms] = bits
        self.model.geom_group[geoms] = group

    def _sum_up_bits(self) -> None:
        """A body's bits are those of all its geoms."""
        for body_bits, geom_bits in (
            (self.model.body_contype, self.model.geom_contype),
            (self.model.body_conaffinity, self.model.geom_conaffinity),
        ):
            body_bits[:] = 0
            np.bitwise_or.at(body_bits, self.model.geom_bodyid, geom_bits)
