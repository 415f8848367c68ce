"""A black box opened: what every hinge did before the failure, and whether the failure happens again."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.black_box import BlackBox
from twin.errors import RecordFileError
from twin.hinge_drive import RestAngles
from twin.loaded_model import quiet_mujoco
from twin.stepper import RING_SIGNATURE

__all__ = ["Retrace", "load_box", "put_state", "retrace"]


@dataclass(frozen=True, eq=False)
class Retrace:
    """What the states of a black box say.

    Attributes:
        joints: names of the hinges.
        time_s: (K,) simulated time of each state.
        angle_rad: (K, J) angle of every hinge.
        rest_rad: (K, J) its rest angle.
        rate_rad_s: (K, J) its rate.
        same_bits: True if every step, made again, gives the next state bit for bit; None if the installed
            MuJoCo is another version, with which that cannot be expected.
        warnings: what MuJoCo says when the steps are made again.
    """

    joints: tuple[str, ...]
    time_s: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    rest_rad: NDArray[np.float64]
    rate_rad_s: NDArray[np.float64]
    same_bits: bool | None
    warnings: tuple[str, ...]

    def fastest(self) -> tuple[str, float]:
        """The hinge with the highest rate in the last state, and that rate in rad/s."""
        return self._worst(self.rate_rad_s)

    def farthest(self) -> tuple[str, float]:
        """The hinge farthest from its rest angle in the last state, and how far in rad."""
        return self._worst(self.angle_rad - self.rest_rad)

    def _worst(self, values: NDArray[np.float64]) -> tuple[str, float]:
        last = np.where(np.isfinite(values[-1]), np.abs(values[-1]), np.inf)
        worst = int(np.argmax(last))
        return self.joints[worst], float(values[-1, worst])


def load_box(box: BlackBox) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The model of a black box, as it was simulated.

    Raises:
        RecordFileError: if MuJoCo refuses the model, or it has other states than those of the box.
    """
    try:
        model = mujoco.MjModel.from_xml_string(box.xml)
    except ValueError as error:
        raise RecordFileError(f"the black box holds a model that MuJoCo refuses: {error}") from error
    size = mujoco.mj_stateSize(model, RING_SIGNATURE)
    if size != box.states.shape[1]:
        raise RecordFileError(
            f"the black box was written with MuJoCo {box.mujoco}: its states have {box.states.shape[1]} "
            f"numbers, those of the installed {mujoco.__version__} have {size}; open it with that version"
        )
    if not len(box.states) or not model.njnt:
        raise RecordFileError("the black box holds no state, or a model without hinges: validate again")
    model.geom_margin[:] = -1e4  # contacts are looked at, they never push
    return model, mujoco.MjData(model)


def put_state(box: BlackBox, model: mujoco.MjModel, data: mujoco.MjData, number: int) -> None:
    """Put state ``number`` of the box, gravity included."""
    model.opt.gravity[:] = box.gravity[number]
    mujoco.mj_setState(model, data, np.array(box.states[number]), RING_SIGNATURE)


def retrace(box: BlackBox) -> Retrace:
    """Open a black box: read every state, and make every step once more.

    Raises:
        RecordFileError: if the model of the box cannot be loaded or does not fit its states.
    """
    model, data = load_box(box)
    rest = RestAngles(model, data, box.drive, box.yield_rad)
    count = len(box.states)
    time, rows = np.empty(count), np.empty((3, count, model.njnt))
    same = True
    with quiet_mujoco() as messages:
        for k in range(count):
            put_state(box, model, data, k)
            time[k] = data.time
            rows[0, k], rows[1, k], rows[2, k] = data.qpos, rest.all(), data.qvel
            mujoco.mj_step(model, data)
            made = _moving_part(data)
            following = box.states[k + 1] if k + 1 < count else box.after
            mujoco.mj_setState(model, data, np.array(following), RING_SIGNATURE)
            same = same and made == _moving_part(data)
        warnings = tuple(messages)
    known = box.mujoco == mujoco.__version__
    return Retrace(rest.names, time, rows[0], rows[1], rows[2], same if known else None, warnings)


def _moving_part(data: mujoco.MjData) -> bytes:
    """What a step changes by itself, as bytes: rest angles are also changed from outside."""
    parts = (np.array([data.time]), data.qpos, data.qvel, data.qacc_warmstart)
    return b"".join(np.ascontiguousarray(p).tobytes() for p in parts)
