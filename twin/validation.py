"""The verdict on a plan: sweep, dynamic run and scatter, put together to one certificate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np

from planner.fold_plan import FoldPlan
from rigs.process import Process
from twin.dynamics import DynamicResult, dynamic_run
from twin.events import Event
from twin.heating_interface import EqualPasses, Heating, ProcessHeating
from twin.hinge_law import STEEL_304, SheetMetal
from twin.mjcf_model import CompiledModel, compile_model
from twin.rule_check import rule_events
from twin.run_settings import RunSettings
from twin.sag_warnings import sag_warnings
from twin.scatter import ScatterResult, run_scatter
from twin.scatter_draws import FoldTurn, ScatterFigures
from twin.shape_error import folded_draws, shape_errors
from twin.sweep import SweepResult, kinematic_sweep
from twin.timeline import turns

__all__ = [
    "Hinge", "MaterialLike", "Validation", "Verdict", "sheet_metal", "validate",
]  # fmt: skip

Verdict = Literal["pass", "rule", "contact", "occluded", "stall", "tunnel", "sag", "numerical"]

STALL_RAD = float(np.radians(2.0))
"""A hinge that ends further than this from its plan has stalled (sag of a whole part stays below it)."""

DRAWS = 40
"""Draws of scatter of a certificate; ``blossom scatter`` makes more."""

_ORDER: tuple[Verdict, ...] = ("contact", "occluded", "rule", "numerical", "tunnel", "sag", "stall")


class MaterialLike(Protocol):
    """What of a material profile the mechanics need."""

    @property
    def young_pa(self) -> float:
        """Young's modulus at 20 °C, Pa."""

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""

    @property
    def yield_pa(self) -> float:
        """Yield stress at 20 °C, Pa."""

    @property
    def density_kg_m3(self) -> float:
        """Density, kg/m³."""


@dataclass(frozen=True)
class Hinge:
    """One crease at the end of the simulation, angles in rad.

    Attributes:
        crease: net edge.
        goal_rad: angle of the goal.
        wanted_rad: angle at the end of the plan.
        reached_rad: angle in the simulation, elastic sag included.
    """

    crease: int
    goal_rad: float
    wanted_rad: float
    reached_rad: float


@dataclass(frozen=True)
class Validation:
    """The certificate of one plan.

    Attributes:
        verdict: ``pass``, or the gravest thing that was seen.
        events: everything that was seen, in the order of the plan.
        hinges: every crease that the plan folds.
        shape_rms: RMS distance of the face corners from the goal, best rigid fit, mm.
        shape_rms_rel: the same over the diagonal of the goal's bounding box.
        max_vertex_error: largest such distance, mm.
        noted: light touches of sagging faces and creases hidden by sag alone: no reason to refuse.
        advice: where sag matters, in words; no reason to refuse either.
        missed_by_dynamics: contacts that the sweep saw and the dynamic run did not feel.
        energy_j: laser energy of the process, J.
        seconds: its time, s.
        passes: its passes.
        heating: name of the heating model.
        calibration: ``none``, or ``fitted`` if angles were fitted to a burnt table.
        grade: grade of the angles: A measured, B literature, C guess.
        flags: where the heating model says that it is not valid.
        process: ``calibrated``, or ``uncalibrated``: geometry passes, the process was never measured.
        scatter: what scatter does to the shape.
        turns: turns that were swept.
        closest_mm: smallest distance that the sweep measured between bodies that do not touch, -1 if none.
        simulated_s: simulated time of the dynamic run.
        largest_sag_rad: largest elastic angle of a hinge at the end.
        yield_share: largest elastic angle at any time as a share of the yield angle.
        base_moment_n_m: largest static moment of the part on its base panel, N m.
        warnings: messages of MuJoCo.
        mujoco: version.
        rig_sha256: the rig profile, "" if none was given.
        material_sha256: the material profile, "" if none was given.
        model_sha256: the compiled model.
        state_sha256: final state of the dynamic run (the same on one machine and version only).
    """

    verdict: Verdict
    events: tuple[Event, ...]
    hinges: tuple[Hinge, ...]
    shape_rms: float
    shape_rms_rel: float
    max_vertex_error: float
    noted: tuple[Event, ...]
    advice: tuple[str, ...]
    missed_by_dynamics: tuple[Event, ...]
    energy_j: float
    seconds: float
    passes: int
    heating: str
    calibration: str
    grade: str
    flags: tuple[str, ...]
    process: Literal["calibrated", "uncalibrated"]
    scatter: ScatterResult
    turns: int
    closest_mm: float
    simulated_s: float
    largest_sag_rad: float
    yield_share: float
    base_moment_n_m: float
    warnings: tuple[str, ...]
    mujoco: str
    rig_sha256: str
    material_sha256: str
    model_sha256: str
    state_sha256: str


def sheet_metal(material: MaterialLike | None) -> SheetMetal:
    """The mechanics of a material profile; annealed 304 if there is none.

    Raises:
        ModelError: if a value makes no sense.
    """
    if material is None:
        return STEEL_304
    return SheetMetal(material.young_pa, material.poisson, material.yield_pa, material.density_kg_m3)


def validate(
    plan: FoldPlan,
    process: Process | None = None,
    rig: object = None,
    material: MaterialLike | None = None,
    *,
    model: CompiledModel | None = None,
    heating: Heating | None = None,
    settings: RunSettings | None = None,
    draws: int = DRAWS,
    seed: int | None = None,
    on_run: Callable[[DynamicResult], None] | None = None,
) -> Validation:
    """Play ``plan`` in MuJoCo, without and with forces, and say whether it may be sent to a machine.

    Args:
        plan: the plan.
        process: passes, energy and time; figures are 0 if None.
        rig: rig profile, to which the certificate is bound by its hash.
        material: material profile; annealed 304 if None.
        model: compiled model of the plan, if it is there already.
        heating: how creases bend pass by pass; the passes of ``process`` if None, else equal passes.
        settings: of the dynamic run.
        draws: draws of scatter.
        seed: of the draws; the plan's own if None.
        on_run: given the dynamic run, with its checkpoints and, where it failed, its black box.

    Raises:
        ModelError: if no model can be made of the plan, or ``model`` is of another net.
    """
    import mujoco

    compiled = model or compile_model(plan, sheet_metal(material))
    bends = heating or (ProcessHeating(process) if process else EqualPasses())
    sweep = kinematic_sweep(compiled, plan)
    run = dynamic_run(compiled, plan, sweep, bends, settings)
    if on_run is not None:
        on_run(run)
    folds = tuple(
        FoldTurn(turn.step, turn.crease, turn.to_rad, tuple(bends.plastic_increments(turn)))
        for turn in turns(plan, compiled.side)
        if turn.crease >= 0
    )
    figures = ScatterFigures(*process.scatter) if process else ScatterFigures()
    scatter = run_scatter(plan, folds, figures, draws=draws, seed=plan.seed if seed is None else seed)
    stalled = _stalled(plan, run)
    found = (*rule_events(plan), *_felt(sweep.events, run), *run.events, *stalled)
    events = tuple(sorted(found, key=lambda e: (e.step, e.time_s, e.kind)))
    rms, worst = shape_errors(plan.net, folded_draws(plan.net, run.angles_rad[None]))
    diagonal = float(np.linalg.norm(np.ptp(plan.net.goal.vertices, axis=0)))
    calibrated = process is not None and process.calibration != "none"
    return Validation(
        verdict=_verdict(events), events=events, hinges=_hinges(plan, run, sorted({f.crease for f in folds})),
        shape_rms=float(rms[0]), shape_rms_rel=float(rms[0]) / diagonal, max_vertex_error=float(worst[0]),
        noted=run.noted, advice=sag_warnings(plan, run), missed_by_dynamics=run.missed,
        energy_j=process.energy_j if process else 0.0, seconds=process.seconds if process else 0.0,
        passes=process.passes if process else sum(len(f.increments_rad) for f in folds),
        heating=bends.name, calibration=process.calibration if process else "none",
        grade=process.grade if process else "C", flags=process.flags if process else (),
        process="calibrated" if calibrated else "uncalibrated", scatter=scatter,
        turns=sweep.turns, closest_mm=_closest(sweep), simulated_s=run.seconds,
        largest_sag_rad=run.largest_sag_rad, yield_share=run.yield_share,
        base_moment_n_m=run.tab_moment_n_m, warnings=run.warnings, mujoco=mujoco.__version__,
        rig_sha256=str(getattr(rig, "sha256", "")), material_sha256=str(getattr(material, "sha256", "")),
        model_sha256=compiled.sha256, state_sha256=run.state_sha256,
    )  # fmt: skip


def _verdict(events: Sequence[Event]) -> Verdict:
    kinds = {e.kind for e in events}
    return next((kind for kind in _ORDER if kind in kinds), "pass")


def _felt(events: Sequence[Event], run: DynamicResult) -> list[Event]:
    """Events of the sweep; the one that stopped the run with the depth and force felt a little beyond it."""
    felt = {touch.pair: touch for touch in run.felt}
    first = events[0].step if events else -1
    return [
        replace(e, depth_mm=max(e.depth_mm, felt[e.pair].depth_mm), force_n=felt[e.pair].force_n)
        if e.step == first and e.pair in felt
        else e
        for e in events
    ]


def _joined_by(plan: FoldPlan, crease: int) -> tuple[int, ...]:
    child = plan.net.child_of[crease]
    return (int(child), int(plan.net.parent[child]))


def _stalled(plan: FoldPlan, run: DynamicResult) -> list[Event]:
    """Hinges of a finished run that are not where the plan wants them."""
    if not run.finished:
        return []
    error = run.angles_rad - plan.final_angles
    return [
        Event(
            "stall", len(plan.steps) - 1, crease, _joined_by(plan, crease),
            angle_rad=float(run.angles_rad[crease]), time_s=run.seconds,
            detail=f"crease {crease} ends at {np.degrees(run.angles_rad[crease]):.2f}° "
            f"instead of {np.degrees(plan.final_angles[crease]):.2f}°",
        )
        for crease in np.flatnonzero(np.abs(error) > STALL_RAD).tolist()
    ]  # fmt: skip


def _hinges(plan: FoldPlan, run: DynamicResult, creases: list[int]) -> tuple[Hinge, ...]:
    goal, wanted = plan.net.fold_angle, plan.final_angles
    return tuple(Hinge(c, float(goal[c]), float(wanted[c]), float(run.angles_rad[c])) for c in creases)


def _closest(sweep: SweepResult) -> float:
    return float(sweep.closest_mm) if np.isfinite(sweep.closest_mm) else -1.0
