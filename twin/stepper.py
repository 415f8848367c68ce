"""Time steps of one simulation: counted, bounded, and the last of them kept for a black box."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.values import frozen_array
from twin.errors import RecordFileError
from twin.loaded_model import LoadedModel
from twin.run_settings import RunSettings

__all__ = [
    "RING_SIGNATURE", "Checkpoint", "DivergedError", "Stepper", "integration_state", "restore_state",
]  # fmt: skip

_SIGNATURE = mujoco.mjtState.mjSTATE_INTEGRATION

RING_SIGNATURE = mujoco.mjtState.mjSTATE_FULLPHYSICS | mujoco.mjtState.mjSTATE_WARMSTART
"""What is kept of each of the last steps: all that a step starts from, as nothing is applied from outside."""


class DivergedError(Exception):
    """The simulation has left the bounds within which it means anything."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """The simulation between two turns; from it the run goes on as if it had never stopped.

    Attributes:
        step: plan step of the turn that was just made, -1 before the first one.
        state: (N,) MuJoCo's ``mjSTATE_INTEGRATION``.
        gravity: (3,) gravity in the frame of the sheet, mm/s².
        rotary_rad: rotary angle that gravity was last turned to.
        steps: time steps made so far.
        worst_elastic_rad: largest elastic angle so far.
        tab_moment_n_m: largest static moment on the base so far.
    """

    step: int
    state: NDArray[np.float64]
    gravity: NDArray[np.float64]
    rotary_rad: float
    steps: int
    worst_elastic_rad: float
    tab_moment_n_m: float

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "state", frozen_array(self.state, np.float64, (None,)))
        object.__setattr__(self, "gravity", frozen_array(self.gravity, np.float64, (3,)))


def integration_state(loaded: LoadedModel) -> NDArray[np.float64]:
    """Everything that the next step depends on."""
    state = np.empty(mujoco.mj_stateSize(loaded.model, _SIGNATURE))
    mujoco.mj_getState(loaded.model, loaded.data, state, _SIGNATURE)
    return state


def restore_state(loaded: LoadedModel, state: NDArray[np.float64]) -> None:
    """Put a state that ``integration_state`` gave.

    Raises:
        RecordFileError: if it is of another model or version of MuJoCo.
    """
    size = mujoco.mj_stateSize(loaded.model, _SIGNATURE)
    if len(state) != size:
        raise RecordFileError(
            f"the checkpoint holds {len(state)} numbers, the model has {size}: it is of another model or "
            "version of MuJoCo; validate again"
        )
    mujoco.mj_setState(loaded.model, loaded.data, np.array(state), _SIGNATURE)


class Stepper:
    """Makes time steps and keeps the last states.

    Args:
        loaded: the simulation.
        settings: bounds, and how many states to keep.
        messages: where MuJoCo's warnings appear; any is a failure.

    Attributes:
        steps: time steps so far.
        worst_elastic_rad: largest elastic angle of a hinge so far.
    """

    def __init__(self, loaded: LoadedModel, settings: RunSettings, messages: list[str]) -> None:
        self.loaded, self.messages = loaded, messages
        self.largest_rate = settings.largest_rate_rad_s
        self.steps = 0
        self.worst_elastic_rad = 0.0
        size = mujoco.mj_stateSize(loaded.model, RING_SIGNATURE)
        self._ring = np.zeros((settings.black_box_states, size))
        self._gravity = np.zeros((settings.black_box_states, 3))
        self._kept = 0
        self._pull, self._rest = loaded.model.opt.gravity, loaded.rest
        self._model, self._data = loaded.model, loaded.data

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.steps * float(self.loaded.model.opt.timestep)

    def count(self, seconds: float) -> int:
        """Steps that make up at least ``seconds``, at least one."""
        return max(1, int(np.ceil(seconds / float(self.loaded.model.opt.timestep) - 1e-9)))

    def step(self) -> None:
        """One step.

        Raises:
            DivergedError: if MuJoCo warned or a hinge turns too fast.
        """
        model, data = self._model, self._data
        slot = self._kept % len(self._ring)
        mujoco.mj_getState(model, data, self._ring[slot], RING_SIGNATURE)
        self._gravity[slot] = self._pull
        self._kept += 1
        mujoco.mj_step(model, data)
        self.steps += 1
        if self.messages:
            raise DivergedError(f"MuJoCo warned: {self.messages[0]}")
        rest = self._rest
        lag, within = rest.extremes(self.largest_rate)
        if not within:
            self._too_fast()
        if lag > rest.yield_rad:
            rest.creep()
            lag, _ = rest.extremes(self.largest_rate)
        if lag > self.worst_elastic_rad:
            self.worst_elastic_rad = lag

    def _too_fast(self) -> None:
        speeds = np.abs(self.loaded.data.qvel)
        worst = int(np.argmax(np.where(np.isnan(speeds), np.inf, speeds)))
        raise DivergedError(
            f"{self.loaded.rest.names[worst]} turns at {speeds[worst]:.3g} rad/s, more than "
            f"{self.largest_rate:g}"
        )

    def rest(self, seconds: float) -> None:
        """Let time pass; nobody looks at contacts meanwhile.

        Raises:
            DivergedError: as ``step``.
        """
        with_contacts = self.contacts(on=False)
        for _ in range(self.count(seconds)):
            self.step()
        self.loaded.model.opt.disableflags = with_contacts

    def contacts(self, *, on: bool) -> int:
        """Switch the search for contacts on or off; returns the flags as they were."""
        option = self.loaded.model.opt
        before = int(option.disableflags)
        flag = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        option.disableflags = before & ~flag if on else before | flag
        return before

    def go_back(self, state: NDArray[np.float64], steps: int) -> None:
        """Put an earlier state; what was kept since is forgotten."""
        restore_state(self.loaded, state)
        self.steps = steps
        self._kept = 0

    def present_state(self) -> NDArray[np.float64]:
        """(N,) the state now, as ``last_states`` has them."""
        state = np.empty(self._ring.shape[1])
        mujoco.mj_getState(self.loaded.model, self.loaded.data, state, RING_SIGNATURE)
        return state

    def last_states(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(K, N) the states before the last steps, oldest first, and (K, 3) their gravity."""
        size = len(self._ring)
        first = max(0, self._kept - size)
        rows = np.arange(first, self._kept) % size
        return self._ring[rows], self._gravity[rows]
