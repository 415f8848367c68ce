"""The black box of a failed run: the last states before the failure, and what is needed to look at them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.values import frozen_array
from twin.errors import RecordFileError
from twin.event_values import event_values, read_event
from twin.events import Event
from twin.hinge_drive import Drive
from twin.mjcf_model import CompiledModel
from twin.record_file import read_record, write_record

__all__ = ["BLACK_BOX_FILE", "BlackBox", "black_box_of", "read_black_box", "write_black_box"]

BLACK_BOX_FILE = "black-box.npz"
FORMAT, VERSION = "metal-blossom/black-box", 1
_CURE = "validate again to make another"


@dataclass(frozen=True, eq=False)
class BlackBox:
    """What a failed run leaves behind.

    Attributes:
        xml: the model.
        drive: how its hinges keep their rest angle.
        yield_rad: elastic angle at which they yield.
        model_sha256: hash of ``xml``.
        mujoco: version that the run was made with.
        event: the failure.
        states: (K, N) states (``mjSTATE_FULLPHYSICS`` and warm start) before each of the last steps, oldest
            first; the last one is the state before the step that failed.
        gravity: (K, 3) gravity during each of them, mm/s².
        after: (N,) the state after the step that failed, as MuJoCo left it.
        hashes: what the run belonged to, such as ``{"plan": "…"}``.
    """

    xml: str
    drive: Drive
    yield_rad: float
    model_sha256: str
    mujoco: str
    event: Event
    states: NDArray[np.float64]
    gravity: NDArray[np.float64]
    after: NDArray[np.float64]
    hashes: Mapping[str, str]

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they belong together."""
        object.__setattr__(self, "states", frozen_array(self.states, np.float64, (None, None)))
        object.__setattr__(self, "gravity", frozen_array(self.gravity, np.float64, (len(self.states), 3)))
        size = self.states.shape[1]
        object.__setattr__(self, "after", frozen_array(self.after, np.float64, (size,)))


def black_box_of(
    compiled: CompiledModel,
    event: Event,
    states: NDArray[np.float64],
    gravity: NDArray[np.float64],
    after: NDArray[np.float64],
) -> BlackBox:
    """The black box of a run of ``compiled`` that just failed."""
    side = compiled.side
    return BlackBox(
        compiled.xml, side.drive, side.hinge.yield_rad, compiled.sha256, mujoco.__version__, event, states,
        gravity, after, {"net": side.net_sha256},
    )  # fmt: skip


def write_black_box(
    box: BlackBox, path: str | os.PathLike[str], hashes: Mapping[str, str] | None = None
) -> None:
    """Write a black box, whole or not at all.

    Args:
        box: the black box.
        path: the file.
        hashes: further hashes of what the run was made from.

    Raises:
        OSError: if the file cannot be written.
    """
    head: dict[str, Any] = {
        "format": FORMAT, "version": VERSION, "mujoco": box.mujoco, "model_sha256": box.model_sha256,
        "drive": box.drive, "yield_rad": box.yield_rad, "event": event_values(box.event),
        "hashes": dict(sorted({**box.hashes, **(hashes or {})}.items())), "xml": box.xml,
    }  # fmt: skip
    write_record(path, head, {"states": box.states, "gravity": box.gravity, "after": box.after})


def read_black_box(path: str | os.PathLike[str]) -> BlackBox:
    """Read a black box back.

    Raises:
        RecordFileError: if the file is damaged or is something else.
        OSError: if it cannot be read.
    """
    head, arrays = read_record(path, FORMAT, VERSION, {"states": 2, "gravity": 2, "after": 1}, _CURE)
    try:
        drive = head["drive"]
        if drive not in ("springyield", "actuator"):
            raise ValueError(f"drive {drive!r} is unknown")
        return BlackBox(
            str(head["xml"]), drive, float(head["yield_rad"]), str(head["model_sha256"]),
            str(head["mujoco"]), read_event(head["event"]), arrays["states"], arrays["gravity"],
            arrays["after"], {str(k): str(v) for k, v in head["hashes"].items()},
        )  # fmt: skip
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise RecordFileError(f"{path}: not a complete black box ({error!r}): {_CURE}") from error
