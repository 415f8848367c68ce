"""Writing the bundle of a test strip: job, picture, check, and the table to fill in."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from planner.atomic_file import write_atomic
from studio.errors import OutputError
from studio.options import MachineOptions
from studio.strip_summary import STRIP_STAGE
from studio.workspace import Workspace

if TYPE_CHECKING:
    from rigs.job import Job
    from rigs.strip import Cutting, Strip
    from twin.strip_design import Expected

__all__ = ["TABLE", "StripOptions", "keep_filled_table", "strip_stage"]

TABLE = "strip.csv"


@dataclass(frozen=True)
class StripOptions:
    """What a test strip tries.

    Attributes:
        kind: ``fold`` or ``kerf``.
        powers: W; chosen by the model if empty.
        speeds: mm/s; chosen by the model if empty.
        passes: how often; usual numbers if empty.
        repeats: how often the whole set.
        width_mm: of a piece, which is the length of a crease.
        length_mm: of a piece.
    """

    kind: Literal["fold", "kerf"]
    powers: tuple[float, ...]
    speeds: tuple[float, ...]
    passes: tuple[int, ...]
    repeats: int
    width_mm: float
    length_mm: float


def strip_stage(ws: Workspace, machine: MachineOptions, options: StripOptions) -> None:
    """Write everything of a test strip into an empty bundle.

    Raises:
        HeatingError: if no setting is safe, or one would cut or fold too far.
        JobError: if the pieces do not fit, or the rig cannot burn them.
        ProfileError: if a profile is wrong.
    """
    from rigs.gcode import write_gcode
    from rigs.job_file import write_job
    from rigs.strip import Cutting, lay_out
    from rigs.strip_job import strip_job
    from studio.strip_svg import strip_svg
    from twin.cut_setting import cut_setting
    from twin.strip_design import expected_folds, fold_settings, kerf_settings, rest_between_s

    ws.choose_machine(machine, STRIP_STAGE)
    rig, material, limits = ws.rig, ws.material, ws.limits
    thickness = limits.thickness
    share = material.absorptivity_at(rig.laser.wavelength_nm)
    cutting = Cutting(*cut_setting(rig, material, thickness, limits.kerf, share, "the strip"))
    if options.kind == "fold":
        settings = fold_settings(
            rig, material, thickness, powers=options.powers, speeds=options.speeds, passes=options.passes,
            repeats=options.repeats,
        )  # fmt: skip
    else:
        settings = kerf_settings(
            cutting.speed_mm_s, cutting.power_w, fastest_mm_s=min(rig.axes.max_mm_s[:2]),
            powers=options.powers, speeds=options.speeds, passes=options.passes, repeats=options.repeats,
        )  # fmt: skip
    strip = lay_out(options.kind, settings, rig, width_mm=options.width_mm, length_mm=options.length_mm)
    expected = expected_folds(strip, rig, material, thickness) if options.kind == "fold" else None
    rest = rest_between_s(strip, rig, material, thickness) if expected else 0.0
    job = strip_job(strip, rig, material, cutting, rest, ws.hashes())
    write_job(job, ws.path("job.json"))
    ws.path("job.gcode").write_bytes(write_gcode(job).encode("ascii"))
    title = f"{thickness:g} mm {material.name} {material.temper_name} on {rig.name}"
    ws.path("strip.svg").write_text(strip_svg(strip, title, _how_to(strip)), encoding="utf-8")
    ws.path(TABLE).write_text(_table(strip, expected, thickness, rig.head.spot_mm), encoding="utf-8")
    write_atomic(ws.path("validation.json"), _check(ws, job, expected, rest, cutting))
    ws.manifest.parameters[STRIP_STAGE] = {
        "kind": options.kind, "pieces": len(strip.pieces), "strip_mm": list(strip.size_mm), "rest_s": rest,
    }  # fmt: skip
    ws.record(STRIP_STAGE, "job.json", "job.gcode", "strip.svg", "validation.json")


def keep_filled_table(target: Path) -> None:
    """Refuse to replace a strip whose table a person has begun to fill in.

    Raises:
        OutputError: if so.
    """
    path = target / TABLE
    try:
        rows = list(csv.DictReader(io.StringIO(path.read_text("utf-8-sig"))))
    except (OSError, UnicodeDecodeError, csv.Error):
        return
    if any((row.get(name) or "").strip() for row in rows for name in ("angle_deg", "piece_mm", "hole_mm")):
        raise OutputError(f"{path}: holds measured figures: move it away, or name another folder with -o DIR")


def _how_to(strip: Strip) -> list[str]:
    size = f"{strip.size_mm[0]:.0f} x {strip.size_mm[1]:.0f} mm of metal and the clamped strip"
    if strip.kind == "fold":
        return [
            size,
            "numbers as in strip.csv",
            "dashed: creases, full: slits",
            "measure the fold of each finger",
        ]
    return [size, "numbers as in strip.csv", "tape below", "measure pieces and holes along x"]


def _table(strip: Strip, expected: Expected | None, thickness_mm: float, spot_mm: float) -> str:
    """The CSV to fill in."""
    from twin.calibration_table import table_text
    from twin.kerf_table import KERF_COLUMNS

    if expected is None:
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(KERF_COLUMNS)
        for p in strip.pieces:
            writer.writerow(
                (p.number, f"{p.power_w:g}", f"{p.speed_mm_s:g}", p.passes, f"{strip.width_mm:g}", "", "", "")
            )
        return out.getvalue()
    return table_text(
        (
            p.number, f"{p.power_w:g}", f"{p.speed_mm_s:g}", f"{spot_mm:g}", f"{thickness_mm:g}", p.passes,
            20, "", f"expected {angle:.1f}" + ("" if regime in ("tgm", "mixed") else f", {regime}"),
        )
        for p, angle, regime in zip(strip.pieces, expected.angle_deg, expected.regime, strict=True)
    )  # fmt: skip


def _check(ws: Workspace, job: Job, expected: Expected | None, rest_s: float, cutting: Cutting) -> bytes:
    """The certificate of a strip: what was looked at before it may be armed."""
    checks = ["every block lies within travel, speed, step rate and power cap of the rig"]
    if expected is not None:
        checks += [
            "no setting cuts by the model",
            f"no finger folds beyond {max(expected.angle_deg):.1f} degrees by the model",
            f"every finger rests {rest_s:g} s between passes",
        ]
    else:
        checks.append("windows are cut free: tape must hold the pieces")
    document = {
        "format": "metal-blossom/strip-check",
        "version": 1,
        **{f"{name}_sha256": value for name, value in ws.hashes().items()},
        "job_sha256": job.sha256,
        "verdict": "pass",
        "process": "uncalibrated",
        "checks": checks,
        "notes": list(expected.notes) if expected else [],
        "slits": {
            "power_w": cutting.power_w, "speed_mm_s": cutting.speed_mm_s, "passes": cutting.passes
        },
        "versions": dict(sorted(ws.manifest.versions.items())),
    }  # fmt: skip
    return (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
