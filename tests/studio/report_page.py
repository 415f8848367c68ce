"""The report of the small plan, for tests."""

from __future__ import annotations

from dataclasses import replace

from studio.manifest import Manifest
from studio.report import report_html
from studio.report_steps import StepRoom, StepSetting
from studio.summary import Summary
from studio.words import blocked_values
from tests.studio.small_plan import small_plan


def small_summary(**changes) -> Summary:
    plan = small_plan()
    summary = Summary(
        mesh="pyramid", faces=6, creases=4, edits=0, optimal=True, completion=0.9, shape_rms_mm=1.25,
        shape_rms_rel=0.0625, blocked=tuple(blocked_values(b) for b in plan.blocked), rotations=2,
        clipped_faces=1, clipped_pieces=1, clipped_area_mm2=175.0, passes=400,
        seconds=1234.0, energy_j=512.0, verdict="pass",
        rig="grbl-4axis", material="304", thickness_mm=0.1, notices=("scaled from 1 to 60 mm",),
    )  # fmt: skip
    return replace(summary, **changes)


def small_manifest() -> Manifest:
    return Manifest(
        input={"name": "pyramid.obj", "sha256": "ab" * 32},
        rig={"name": "grbl-4axis", "sha256": "12" * 32}, material={"name": "304", "sha256": "34" * 32},
        parameters={"net": {"method": "nb", "base": None}}, versions={"metal-blossom": "0.1.0"},
        files={"goal.ply": {"sha256": "cd" * 32, "bytes": 1, "stage": "net"}},
    )  # fmt: skip


def small_settings():
    return {
        3: StepSetting(120, 12.5, 20.0, 33.0, 44.0, (21.0, 190.0), (400.0, 300.0, 120.0, 60.0, 25.0, 20.0)),
        0: StepSetting(2, 15.0, 5.0, 4.0, 60.0), 2: StepSetting(seconds=3.0),
    }  # fmt: skip


def small_report(**changes) -> bytes:
    return report_html(
        small_plan(), small_summary(**changes), small_manifest(),
        settings=small_settings(), rooms={3: StepRoom(0.0123, 1.0, 0.97, True)},
        validation={
            "verdict": "pass", "shape_rms": 1.2, "events": [{"kind": "sag", "step": 3}],
            "heating": {"model": "fast/1", "calibration": "none", "grade": "C"},
            "scatter": {"draws": 40, "open_loop": {"probability": 0.75, "interval": [0.6, 0.86]}},
        },
    )  # fmt: skip
