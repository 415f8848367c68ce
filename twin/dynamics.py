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
from twin.black_box import BlackBox
from twin.driven_run import DrivenRun
from twin.events import Event
from twin.heating_interface import EqualPasses, Heating
from twin.loaded_model import LoadedModel, quiet_mujoco
from twin.mjcf_model import CompiledModel
from twin.run_settings import RunSettings
from twin.stepper import Checkpoint, integration_state
from twin.sweep import SweepResult
from twin.touches import Touch

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
        felt: touches felt up to a little beyond the hit that stopped the run.
        checkpoints: the simulation before the first turn and after each.
        black_box: the last states before a failure, None if it did not fail.
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
    felt: tuple[Touch, ...]
    checkpoints: tuple[Checkpoint, ...]
    black_box: BlackBox | None


def dynamic_run(
    compiled: CompiledModel,
    plan: FoldPlan,
    sweep: SweepResult,
    heating: Heating | None = None,
    settings: RunSettings | None = None,
    start: Checkpoint | None = None,
) -> DynamicResult:
    """Fold the plan with heated hinges under gravity.

    Args:
        compiled: model of the plan.
        plan: the plan.
        sweep: result of the kinematic sweep of the same plan.
        heating: how plastic angles grow; equal passes if None.
        settings: speeds and bounds.
        start: checkpoint of an earlier run of the same model, plan, heating and settings; only what follows
            is run then, and told.

    Raises:
        ModelError: if the model was compiled from another net.
        RecordFileError: if the checkpoint is of another model.
    """
    loaded = LoadedModel(compiled, plan.net)
    loaded.notice_contacts_only()
    with quiet_mujoco() as messages:
        run = DrivenRun(
            loaded, plan, sweep, heating or EqualPasses(), settings or RunSettings(), messages, start
        )
        finished = run.play()
    state = integration_state(loaded)
    permanent = np.zeros(len(plan.net.edges))
    for crease in compiled.side.panel_crease.tolist():
        if crease >= 0:
            permanent[crease] = loaded.rest.of(f"crease_{crease}")
    return DynamicResult(
        angles_rad=frozen_array(loaded.crease_angles(), np.float64, (None,)),
        permanent_rad=frozen_array(permanent, np.float64, (None,)),
        events=tuple(sorted((*run.events, *run.sight.events), key=lambda e: e.step)),
        noted=run.noted(), missed=tuple(run.missed),
        finished=finished, steps=run.stepper.steps, seconds=run.stepper.time_s,
        largest_sag_rad=float(np.abs(loaded.rest.elastic()).max(initial=0.0)),
        yield_share=run.stepper.worst_elastic_rad / compiled.side.hinge.yield_rad,
        tab_moment_n_m=run.tab_moment, warnings=tuple(messages),
        state_sha256=hashlib.sha256(state.tobytes()).hexdigest(),
        felt=run.felt, checkpoints=tuple(run.checkpoints), black_box=run.black_box,
    )  # fmt: skip
