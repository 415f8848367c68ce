"""How slowly, with what and within which bounds a plan is simulated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["RunSettings"]


@dataclass(frozen=True)
class RunSettings:
    """How slowly and with what the plan is run.

    Attributes:
        gravity: False for the fidelity test.
        least_turn_s: shortest time of a turn.
        fastest_rad_s: mean rate of a turn is at most this.
        settle_s: time of rest after the last turn and after a change of gravity.
        depth_tolerance_mm: a touch up to this depth is none.
        heavy_yield_share: a touch for which hinges must go further than this share of yield is sag.
        bent_rad: a hinge at rest that bends by more than this for good asks for a slower run.
        speeds: the turn's speed, and the slower ones that are tried when a touch or a bent hinge asks for it.
        past_onset_rad: how far a turn that the sweep saw blocked is driven past the first touch.
        largest_lag_rad: the turning hinge may lag by this; more is a failed run.
        largest_rate_rad_s: no hinge may turn faster; more is a failed run.
        sight_every_rad: the beam's view is tested again each time the crease has turned by this.
        black_box_states: so many states before a failure are kept.
    """

    gravity: bool = True
    least_turn_s: float = 0.2
    fastest_rad_s: float = 4.0
    settle_s: float = 0.25
    depth_tolerance_mm: float = 0.01
    heavy_yield_share: float = 0.5
    bent_rad: float = float(np.radians(0.02))
    speeds: tuple[float, ...] = (1.0, 0.5, 0.25)
    past_onset_rad: float = float(np.radians(2.0))
    largest_lag_rad: float = float(np.radians(15.0))
    largest_rate_rad_s: float = 200.0
    sight_every_rad: float = float(np.radians(10.0))
    black_box_states: int = 32
