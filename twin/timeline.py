"""A plan as the turns of single joints, each with what is there and which way is up while it happens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Bend, Fold, FoldPlan, Rotate
from planner.values import frozen_array
from twin.errors import ModelError
from twin.sheet_pieces import KEPT
from twin.side_table import SideTable

__all__ = ["Turn", "beam_direction", "turns"]


@dataclass(frozen=True, eq=False)
class Turn:
    """One joint turns from one angle to another; all else is at rest.

    Attributes:
        step: index of the plan step.
        joint: name of the joint in the model.
        crease: net edge, -1 if substrate is bent.
        from_rad: angle before.
        to_rad: angle after.
        rotary_rad: absolute angle of the rotary.
        gone: (S,) True for the pieces of the sheet that were clipped before.
        moving_faces: (F,) True for the faces that turn.
        moving_pieces: (S,) True for the pieces of the sheet that turn.
    """

    step: int
    joint: str
    crease: int
    from_rad: float
    to_rad: float
    rotary_rad: float
    gone: NDArray[np.bool_]
    moving_faces: NDArray[np.bool_]
    moving_pieces: NDArray[np.bool_]


def beam_direction(rotary_rad: float) -> NDArray[np.float64]:
    """(3,) unit vector from the sheet to the laser, in the frame of the sheet.

    The part is turned about +x by the rotary angle and the beam comes from +z of the machine, so the
    direction is that of +z turned back: (0, sin a, cos a).
    """
    return np.array([0.0, np.sin(rotary_rad), np.cos(rotary_rad)])


def turns(plan: FoldPlan, side: SideTable) -> tuple[Turn, ...]:
    """The folds and bends of ``plan`` in order.

    Raises:
        ModelError: if a step folds an edge that is not a crease with a joint.
    """
    net = plan.net
    count, pieces = len(net.faces), len(side.pieces)
    gone_at = np.array([p.gone_at for p in side.pieces], dtype=np.int64).reshape(pieces)
    bent_at = np.array([p.bent_at for p in side.pieces], dtype=np.int64).reshape(pieces)
    jointed = set(side.panel_crease.tolist()) - {-1}
    angle = np.zeros(len(net.edges))
    rotary = 0.0
    out: list[Turn] = []
    for number, step in enumerate(plan.steps):
        gone = frozen_array((gone_at != KEPT) & (gone_at < number), np.bool_, (pieces,))
        if isinstance(step, Rotate):
            rotary = step.to_rad
        elif isinstance(step, Fold):
            if step.crease not in jointed:
                raise ModelError(
                    f"step {number} folds net edge {step.crease}, which is not a crease with a joint: "
                    "the plan does not belong to this net"
                )
            moving = np.zeros(count, dtype=np.bool_)
            moving[net.subtree[net.child_of[step.crease]]] = True
            out.append(
                Turn(
                    number, f"crease_{step.crease}", step.crease, float(angle[step.crease]), step.to_rad,
                    rotary, gone, frozen_array(moving, np.bool_, (count,)),
                    frozen_array(np.zeros(pieces), np.bool_, (pieces,)),
                )
            )  # fmt: skip
            angle[step.crease] = step.to_rad
        elif isinstance(step, Bend):
            out.append(
                Turn(
                    number, f"bend_{number}", -1, 0.0, step.to_rad, rotary, gone,
                    frozen_array(np.zeros(count), np.bool_, (count,)),
                    frozen_array(bent_at == number, np.bool_, (pieces,)),
                )
            )  # fmt: skip
    return tuple(out)
