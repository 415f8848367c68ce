"""How a heated hinge keeps its rest angle in MuJoCo: as plastic state, or as the state of an actuator.

MuJoCo 4.0 has elasto-plastic joints (``springyield``): the rest angle of the spring is state, and it creeps
after the hinge where the load exceeds the yield torque. Older versions have an actuator with an integrator
instead: a spring towards its activation, capped at the yield torque; the creep is done here after each step.
Both sides of this module look the same to a simulation.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from twin.errors import ModelError

if TYPE_CHECKING:
    import mujoco

__all__ = ["Drive", "RestAngles", "best_drive", "hinge_actuator"]

Drive = Literal["springyield", "actuator"]


def best_drive() -> Drive:
    """``springyield`` where the installed MuJoCo has it."""
    import mujoco

    return "springyield" if hasattr(mujoco.MjModel, "jnt_plasticadr") else "actuator"


def hinge_actuator(joint: str, stiffness: float, yield_rad: float) -> ET.Element:
    """The actuator that stands for the spring of ``joint``: torque k (rest - angle), at most k yield.

    It is MuJoCo's ``intvelocity`` written out: its control is the rate of the rest angle, its activation the
    rest angle itself.
    """
    cap = stiffness * yield_rad
    return ET.Element(
        "general",
        {"name": joint, "joint": joint, "dyntype": "integrator", "gaintype": "fixed", "biastype": "affine",
         "gainprm": repr(stiffness), "biasprm": f"0 {-stiffness!r} 0",
         "forcelimited": "true", "forcerange": f"{-cap!r} {cap!r}"},
    )  # fmt: skip


class RestAngles:
    """The rest angles of all hinges of one simulation, in rad.

    Args:
        model: MuJoCo's model.
        data: its state, which is changed.
        drive: how the model was compiled.
        yield_rad: elastic angle at which a hinge yields.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, drive: Drive, yield_rad: float) -> None:
        from twin.step_kernel import hinge_extremes

        self.drive, self.yield_rad = drive, yield_rad
        self.names = tuple(model.joint(j).name for j in range(model.njnt))
        self.at = {name: n for n, name in enumerate(self.names)}
        if drive == "springyield":
            self._rest, address = data.plastic, np.array(model.jnt_plasticadr, dtype=np.int64)
        else:
            driven = np.array(model.actuator_trnid[:, 0], dtype=np.int64)
            address = np.empty(model.njnt, dtype=np.int64)
            address[driven] = model.actuator_actadr
            self._rest = data.act
        count = model.njnt
        if not np.array_equal(model.jnt_qposadr, np.arange(count)):
            raise ModelError("the model has joints that are no hinges: it was not compiled here")
        self._address, self._angle, self._rate = address, data.qpos, data.qvel
        self._extremes = hinge_extremes

    def all(self) -> NDArray[np.float64]:
        """(J,) rest angle of every joint."""
        rest: NDArray[np.float64] = self._rest[self._address]
        return rest

    def elastic(self) -> NDArray[np.float64]:
        """(J,) elastic angle of every joint: where it is less where it would rest."""
        lag: NDArray[np.float64] = self._angle - self.all()
        return lag

    def extremes(self, largest_rad_s: float) -> tuple[float, bool]:
        """Largest elastic angle of any joint without sign, and whether none turns faster than allowed.

        A rate that is no number is not allowed either.
        """
        lag, within = self._extremes(self._angle, self._rest, self._address, self._rate, largest_rad_s)
        return float(lag), bool(within)

    def of(self, joint: str) -> float:
        """Rest angle of one joint."""
        return float(self._rest[self._address[self.at[joint]]])

    def add(self, joint: str, change_rad: float) -> None:
        """Heat a hinge: its rest angle changes."""
        self._rest[self._address[self.at[joint]]] += change_rad

    def set(self, joint: str, angle_rad: float) -> None:
        """Put the rest angle of a joint."""
        self._rest[self._address[self.at[joint]]] = angle_rad

    def creep(self) -> None:
        """After a step: overloaded hinges bend for good (MuJoCo's own springs have done so already)."""
        if self.drive == "actuator":
            lag = self.elastic()
            self._rest[self._address] += lag - np.clip(lag, -self.yield_rad, self.yield_rad)
