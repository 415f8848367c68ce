"""``checkpoints.npz``: the simulation of a plan after every turn, to go on from any of them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from twin.errors import RecordFileError
from twin.record_file import read_record, write_record
from twin.stepper import Checkpoint

__all__ = ["CHECKPOINT_FILE", "Checkpoints", "read_checkpoints", "write_checkpoints"]

CHECKPOINT_FILE = "checkpoints.npz"
FORMAT, VERSION = "metal-blossom/checkpoints", 1
_CURE = "validate again to make another"


@dataclass(frozen=True, eq=False)
class Checkpoints:
    """The checkpoints of one run.

    Attributes:
        at: the checkpoints, in the order of the plan.
        mujoco: version that the run was made with.
        hashes: what it belonged to, such as ``{"plan": "…", "model": "…"}``.
        state_sha256: hash of the final state of the run.
    """

    at: tuple[Checkpoint, ...]
    mujoco: str
    hashes: Mapping[str, str]
    state_sha256: str

    def before(self, step: int) -> Checkpoint:
        """The last checkpoint before plan step ``step`` is made.

        Raises:
            RecordFileError: if there is none.
        """
        fit = [c for c in self.at if c.step < step]
        if not fit:
            raise RecordFileError(f"no checkpoint lies before step {step}: {_CURE}")
        return fit[-1]


def write_checkpoints(
    path: str | os.PathLike[str],
    checkpoints: Sequence[Checkpoint],
    state_sha256: str,
    hashes: Mapping[str, str],
) -> None:
    """Write checkpoints, whole or not at all.

    Raises:
        OSError: if the file cannot be written.
    """
    head = {
        "format": FORMAT, "version": VERSION, "mujoco": mujoco.__version__, "state_sha256": state_sha256,
        "hashes": dict(sorted(hashes.items())),
    }  # fmt: skip
    figures = [
        (c.step, c.steps, c.rotary_rad, c.worst_elastic_rad, c.tab_moment_n_m, *c.gravity)
        for c in checkpoints
    ]
    width = len(checkpoints[0].state) if checkpoints else 0
    arrays = {
        "figures": np.array(figures, dtype=np.float64).reshape(-1, 8),
        "states": np.array([c.state for c in checkpoints], dtype=np.float64).reshape(len(checkpoints), width),
    }
    write_record(path, head, arrays)


def read_checkpoints(path: str | os.PathLike[str]) -> Checkpoints:
    """Read checkpoints back.

    Raises:
        RecordFileError: if the file is damaged or is something else.
        OSError: if it cannot be read.
    """
    head, arrays = read_record(path, FORMAT, VERSION, {"figures": 2, "states": 2}, _CURE)
    figures, states = arrays["figures"], arrays["states"]
    if figures.shape != (len(states), 8) or not np.isfinite(figures).all():
        raise RecordFileError(f"{path}: its arrays do not belong together: {_CURE}")
    at = tuple(
        Checkpoint(int(row[0]), state, row[5:8], float(row[2]), int(row[1]), float(row[3]), float(row[4]))
        for row, state in zip(figures, states, strict=True)
    )
    try:
        hashes = {str(k): str(v) for k, v in head["hashes"].items()}
        return Checkpoints(at, str(head["mujoco"]), hashes, str(head["state_sha256"]))
    except (KeyError, AttributeError) as error:
        raise RecordFileError(f"{path}: not complete ({error!r}): {_CURE}") from error
