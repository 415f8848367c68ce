"""Figures of a bundle, read from its files."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from studio.contact_stage import contact_words
from studio.diagnosis_words import blocked_summary
from studio.heat_stage import heat_values
from studio.report_validation import event_text
from studio.strip_summary import is_strip, strip_summary
from studio.summary import Summary

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan
    from studio.report_steps import StepSetting
    from studio.workspace import Workspace

__all__ = ["bundle_summary", "step_settings", "validation_values"]


def validation_values(ws: Workspace) -> dict[str, Any] | None:
    """The certificate as plain values, None if the bundle has none."""
    if "validation.json" not in ws.manifest.files:
        return None
    values: dict[str, Any] = json.loads(ws.path("validation.json").read_bytes())
    return values


def bundle_summary(ws: Workspace, replay: str = "") -> Summary:
    """The figures of whatever stages have run."""
    from planner.lost_folds import left_out_words

    if is_strip(ws):
        return strip_summary(ws, replay)
    manifest = ws.manifest
    planned = "plan.json" in manifest.files
    net = ws.plan.net if planned else ws.net
    certificate = net.certificate
    missing = left_out_words(net.goal)
    goal_notices = (*ws.goal.notices, missing) if missing else ws.goal.notices
    known: dict[str, Any] = {
        "mesh": ws.goal.name,
        "faces": len(net.faces),
        "creases": int(np.isin(net.assignment, ("V", "M")).sum()),
        "edits": certificate.edits,
        "lower_bound": certificate.lower_bound,
        "optimal": certificate.optimal,
        "base_face": net.base_face,
        "tree": certificate.tree,
        "bases": tuple(trial.to_json() for trial in certificate.bases),
        "proof_s": ws.progress.seconds.get("prove"),
        "faces_left_out": certificate.faces_left_out,
        "planned": planned,
        "rig": str(manifest.rig.get("name", "")),
        "material": str(manifest.material.get("name", "")),
        "thickness_mm": float(manifest.material.get("thickness_mm", 0.0)),
        "notices": goal_notices,
        "replay": replay,
    }
    if planned:
        plan, metrics = ws.plan, ws.plan.metrics
        known |= {
            "completion": metrics.fold_completion,
            "shape_rms_mm": metrics.shape_rms,
            "shape_rms_rel": metrics.shape_rms_rel,
            "blocked": tuple(blocked_summary(plan, b) for b in plan.blocked),
            "rotations": metrics.rotations,
            "clipped_faces": metrics.clipped_faces,
            "clipped_pieces": _clipped_pieces(plan),
            "clipped_area_mm2": metrics.clipped_area,
            "without": plan.without,
            "contact": contact_words(ws),
            "notices": (*goal_notices, *plan.notices, *ws.process.flags),
            "passes": ws.process.passes,
            "seconds": ws.job.seconds if "job.json" in manifest.files else ws.process.seconds,
            "energy_j": ws.process.energy_j,
            "heat": heat_values(ws.process),
            "pattern": dict(manifest.process.get("pattern", {})),
        }
    validation = validation_values(ws)
    if validation is not None:
        known["verdict"] = str(validation["verdict"])
        known["process"] = str(validation.get("process", ""))
        known["notices"] = (*known["notices"], *map(str, validation.get("advice", ())))
        if known["verdict"] != "pass":
            known["reason"] = _reason(validation)
    return Summary(**known)


def _clipped_pieces(plan: FoldPlan) -> int:
    """How many connected pieces of the sheet are cut away."""
    from planner.fold_plan import Clip
    from planner.metal_pieces import clipped_pieces

    clipped = {face for step in plan.steps if isinstance(step, Clip) for face in step.faces}
    return len(clipped_pieces(plan.sheet, clipped)) if clipped else 0


def _reason(validation: dict[str, Any]) -> str:
    """The first event of the kind that decided the verdict, and how many there are."""
    events = [e for e in validation.get("events", ()) if e.get("kind") == validation["verdict"]]
    if not events:
        return "; ".join(map(str, validation.get("warnings", ())))
    more = f" (and {len(events) - 1} more, see report.html)" if len(events) > 1 else ""
    if validation["verdict"] == "numerical":
        more += "; blossom replay-dump opens the black box"
    return event_text(events[0]) + more


def step_settings(ws: Workspace) -> dict[int, StepSetting]:
    """Step index → how it is burnt, for the report; times are those of the job where there is one."""
    from studio.report_heat import cooling_c
    from studio.report_steps import StepSetting

    seconds: dict[int, float] = {}
    if "job.json" in ws.manifest.files:
        for block in ws.job.blocks:
            seconds[block.step] = seconds.get(block.step, 0.0) + block.seconds
    settings = {
        step: StepSetting(seconds=took) for step, took in seconds.items() if 0 <= step < len(ws.plan.steps)
    }
    for cut in ws.process.cuts:
        took = seconds.get(cut.step, cut.beam_s)
        settings[cut.step] = StepSetting(cut.passes, cut.power_w, cut.speed_mm_s, took, cut.energy_j)
    for fold in ws.process.folds:
        settings[fold.step] = StepSetting(
            fold.passes, fold.power_w, fold.speed_mm_s, seconds.get(fold.step, fold.seconds), fold.energy_j,
            (fold.start_c[0], fold.start_c[-1]) if fold.start_c else None,
            cooling_c(fold, ws.process, ws.material),
        )  # fmt: skip
    return settings
