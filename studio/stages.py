"""The stages of a run. Each reads what it needs from the bundle and writes its own files into it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from studio.contact_stage import record_contact
from studio.errors import UsageError
from studio.heat_stage import choose_heat, made_process, taking_turns
from studio.net_stage import compile_kernels, known
from studio.options import PlanOptions, parameters
from studio.workspace import Workspace

if TYPE_CHECKING:
    from planner.fold_plan import MachineLimits
    from twin.dynamics import DynamicResult

__all__ = ["job_stage", "plan_stage", "report_stage", "validate_stage"]

_LARGEST_RELIEF_MM = 5.0

PLANNERS = ("fp", "mp", "first-block")
"""Planners that ``--planner`` may name: those of ``planner.FOLD_METHODS`` that make a plan for a laser."""


def plan_stage(ws: Workspace, options: PlanOptions) -> None:
    """Plan folds, sheet and cuts: ``plan.json``, ``sheet.svg``, ``sheet.dxf`` and the net as it is folded.

    Raises:
        PlanError: if there is no plan.
        UsageError: if an option asks for what the rig cannot do.
    """
    from planner.diagnose import diagnose
    from planner.fold_file import write_fold
    from planner.motion_baselines import FOLD_METHODS, fold_method
    from planner.pattern_check import pattern_figures
    from planner.plan_file import read_plan, write_plan
    from planner.plan_folds import plan_folds
    from planner.sheet_dxf import write_sheet_dxf
    from planner.sheet_svg import write_sheet_svg

    if options.planner in FOLD_METHODS and options.planner not in (*PLANNERS, "fp-search"):
        raise UsageError(
            f"--planner {options.planner} turns all creases at once, which no laser can do, so it makes no "
            f"plan; choose one of {', '.join(PLANNERS)}. blossom bench paper --planners {options.planner} "
            "says how far it folds"
        )
    known("planner", options.planner, PLANNERS)
    limits = ws.limits
    if options.tilt_deg is not None:
        most = math.degrees(limits.max_tilt_rad)
        if not 0.0 <= options.tilt_deg <= most + 1e-9:
            raise UsageError(f"--tilt {options.tilt_deg:g}: rig {ws.rig.name} tilts by 0 to {most:g} degrees")
        limits = replace(limits, max_tilt_rad=math.radians(options.tilt_deg))
    limits = bend_limits(limits, options)
    choose_heat(ws, options)
    compile_kernels(ws)
    with ws.progress.stage("plan", "planning the folds"):
        if options.planner == "fp":
            plan = plan_folds(
                ws.net, limits, seed=options.seed, budget_s=options.budget_s, fixed_base=options.fixed_base,
                keep_net=options.keep_net, without=options.without, on_progress=ws.progress.update,
            )  # fmt: skip
        else:
            result = fold_method(options.planner)(
                ws.net, limits, seed=options.seed, budget_s=options.budget_s, without=options.without
            )
            assert result.plan is not None  # noqa: S101  PLANNERS are those that make plans
            plan = result.plan
        if options.diagnosis and options.planner == "fp" and plan.blocked:
            ws.progress.update(0.99, f"looking into why {len(plan.blocked)} creases stay short")
            plan = diagnose(plan)
        write_fold(plan.net, ws.path("net.fold"))
        ws.record("net", "net.fold")
        # The process follows from the plan as it is read back, so that a later run of a stage cannot differ.
        write_plan(plan, ws.path("plan.json"), ws.hashes("goal", "net"))
        plan = taking_turns(ws, plan, options)
        write_plan(plan, ws.path("plan.json"), ws.hashes("goal", "net"))
        process = made_process(ws, read_plan(ws.path("plan.json"), ws.net))
        plan = plan.with_metrics(energy_j=process.energy_j, seconds=process.seconds)
        write_plan(plan, ws.path("plan.json"), ws.hashes("goal", "net"))
        write_sheet_svg(plan, ws.path("sheet.svg"))
        write_sheet_dxf(plan, ws.path("sheet.dxf"))
    ws.manifest.seed = options.seed
    ws.manifest.parameters["plan"] = parameters(options)
    ws.manifest.process |= {"sha256": process.sha256, "pattern": pattern_figures(plan).to_values()}
    ws.record("plan", "plan.json", "sheet.svg", "sheet.dxf")
    record_contact(ws, wanted=options.certify)
    ws.process = process


def bend_limits(limits: MachineLimits, options: PlanOptions) -> MachineLimits:
    """``limits`` with the bend allowance and the relief holes that the user wants.

    Raises:
        UsageError: if ``--relief`` is neither ``auto``, ``off`` nor a radius.
    """
    if not options.bend_allowance:
        limits = replace(limits, bend_width=0.0, neutral_shift=0.0)
    if options.relief == "auto":
        return limits
    try:
        radius = 0.0 if options.relief == "off" else float(options.relief)
    except ValueError:
        radius = math.nan
    if not 0.0 <= radius <= _LARGEST_RELIEF_MM:
        raise UsageError(
            f"--relief {options.relief}: expected auto, off, or a radius from 0 to {_LARGEST_RELIEF_MM:g} mm"
        )
    return replace(limits, relief_mm=radius)


def validate_stage(ws: Workspace) -> str:
    """Play the plan in MuJoCo: model, certificate and checkpoints; returns the verdict.

    Writes ``model.xml`` with its side table ``model.json``, ``validation.json``, ``checkpoints.npz`` and,
    where the simulation failed, ``black-box.npz``.

    The certificate names the hash of the job that follows from the plan, so that the machine gets what was
    validated and nothing else.
    """
    from twin.black_box import BLACK_BOX_FILE, write_black_box
    from twin.checkpoint_file import CHECKPOINT_FILE, write_checkpoints
    from twin.mjcf_model import compile_model
    from twin.validation import sheet_metal, validate
    from twin.validation_file import write_validation

    for name in (CHECKPOINT_FILE, BLACK_BOX_FILE):
        ws.manifest.files.pop(name, None)
    with ws.progress.stage("validate", "playing the plan in MuJoCo"):
        model = compile_model(ws.plan, sheet_metal(ws.material))
        ws.path("model.xml").write_text(model.xml, encoding="utf-8")
        ws.path("model.json").write_text(model.side.to_json() + "\n", encoding="utf-8")
        ws.record("validate", "model.xml", "model.json")
        runs: list[DynamicResult] = []
        validation = validate(ws.plan, ws.process, ws.rig, ws.material, model=model, on_run=runs.append)
        hashes = ws.hashes("goal", "net", "plan", "model") | {"job": ws.job.sha256}
        write_validation(validation, ws.path("validation.json"), hashes, ws.manifest.versions)
        run = runs[0]
        write_checkpoints(ws.path(CHECKPOINT_FILE), run.checkpoints, run.state_sha256, hashes)
        ws.record("validate", CHECKPOINT_FILE)
        if run.black_box is not None:
            write_black_box(run.black_box, ws.path(BLACK_BOX_FILE), hashes)
            ws.record("validate", BLACK_BOX_FILE)
    ws.manifest.parameters["validate"] = {}
    ws.record("validate", "validation.json")
    return str(validation.verdict)


def job_stage(ws: Workspace) -> None:
    """Write the instructions of the rig: ``job.gcode`` and ``job.json``.

    Raises:
        JobError: if the rig cannot run the job.
    """
    from rigs.job_file import write_job

    with ws.progress.stage("job", f"writing the instructions of {ws.rig.name}"):
        ws.path("job.gcode").write_bytes(ws.gcode)
        write_job(ws.job, ws.path("job.json"))
    ws.manifest.parameters["job"] = {}
    ws.record("job", "job.gcode", "job.json")


def report_stage(ws: Workspace) -> None:
    """Write what people look at: ``report.html`` and ``motion.glb``."""
    from studio.bundle_summary import bundle_summary, step_settings, validation_values
    from studio.motion_glb import motion_glb
    from studio.report import report_html
    from studio.report_rooms import step_rooms

    with ws.progress.stage("report", "writing the page and the animation"):
        ws.path("motion.glb").write_bytes(motion_glb(ws.plan))
        page = report_html(
            ws.plan, bundle_summary(ws), ws.manifest,
            settings=step_settings(ws), rooms=step_rooms(ws), validation=validation_values(ws),
        )  # fmt: skip
        ws.path("report.html").write_bytes(page)
    ws.manifest.parameters["report"] = {}
    ws.record("report", "motion.glb", "report.html")
