"""The dynamic run: heated hinges with inertia and gravity, slow enough for a verdict on sag and yield.

The rules of the run stand in ``driven_run``.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from planner.values import frozen_array
from twin.driven_run import DrivenRun, RunSettings, integration_state
from twin.events import Event
from twin.heating_interface import EqualPasses, Heating
from twin.loaded_model import LoadedModel, quiet_mujoco
from twin.mjcf_model import CompiledModel
from twin.sweep import SweepResult

__all__ = ["DynamicResult", "RunSettings", "dynamic_run"]


@dataclass(frozen=True, eq=False)
class DynamicResult:
    """What the dynamic run found.

    Attributes:
        angles_rad: (E,) angle of every net edge at the end, gravity as in the last step.
        permanent_rad: (E,) plastic angle of every net edge at the end.
        events: findings in the order of the plan.
        noted: light touches, the deepest of each pair, creases hidden by sag alone, hinges that yield.
        missed: events of the sweep that the run should have felt and did not.
        finished: False if it was stopped by a hit or a failure.
        steps: number of time steps.
        seconds: simulated time.
        largest_sag_rad: largest elastic angle of a hinge at rest at the end.
        yield_share: largest elastic angle of a hinge at any time, as a share of the yield angle.
        tab_moment_n_m: largest static moment of the part's weight on the base, N m.
        warnings: messages of MuJoCo.
        state_sha256: hash of the final state, for bit-identity on one machine and version.
    """

    angles_rad: NDArray[np.float64]
    permanent_rad: NDArray[np.float64]
    events: tuple[Event, ...]
    noted: tuple[Event, ...]
    missed: tuple[Event, ...]
    finished: bool
    steps: int
    seconds: float
    largest_sag_rad: float
    yield_share: float
    tab_moment_n_m: float
    warnings: tuple[str, ...]
    state_sha256: str


def dynamic_run(
    compiled: CompiledModel,
    plan: FoldPlan,
    sweep: SweepResult,
    heating: Heating | None = None,
    settings: RunSettings | None = None,
) -> DynamicResult:
    """Fold the plan with heated hinges under gravity.

    Args:
        compiled: model of the plan.
        plan: the plan.
        sweep: result of the kinematic sweep of the same plan.
        heating: how plastic angles grow; equal passes if None.
        settings: speeds and bounds.

    Raises:
        ModelError: if the model was compiled from another net.
    """
    loaded = LoadedModel(compiled, plan.net)
    loaded.notice_contacts_only()
    run = DrivenRun(loaded, plan, sweep, heating or EqualPasses(), settings or RunSettings())
    with quiet_mujoco() as messages:
        finished = run.play(messages)
    state = integration_state(loaded)
    permanent = np.zeros(len(plan.net.edges))
    for crease in compiled.side.panel_crease.tolist():
        if crease >= 0:
            permanent[crease] = loaded.data.plastic[loaded.plastic_address(f"crease_{crease}")]
    return DynamicResult(
        angles_rad=frozen_array(loaded.crease_angles(), np.float64, (None,)),
        permanent_rad=frozen_array(permanent, np.float64, (None,)),
        events=tuple(run.events), noted=run.noted(), missed=tuple(run.missed),
        finished=finished, steps=run.steps,
        seconds=run.steps * float(loaded.model.opt.timestep),
        largest_sag_rad=float(np.abs(run.elastic()).max(initial=0.0)),
        yield_share=run.worst_elastic / compiled.side.hinge.yield_rad,
        tab_moment_n_m=run.tab_moment, warnings=tuple(messages),
        state_sha256=hashlib.sha256(state.tobytes()).hexdigest(),
    )  # fmt: skip
