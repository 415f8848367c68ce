"""The report of the small plan, for tests."""

from __future__ import annotations

from dataclasses import replace

from studio.manifest import Manifest
from studio.report import StepSetting, report_html
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


def small_report(**changes) -> bytes:
    return report_html(
        small_plan(), small_summary(**changes), small_manifest(),
        settings={3: StepSetting(120, 12.5, 20.0, 33.0, 44.0)},
        validation={"verdict": "pass", "shape_rms": 1.2, "events": [{"kind": "sag", "step": 3}]},
    )  # fmt: skip
