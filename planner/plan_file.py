"""``plan.json``: a fold plan written whole, and read back with every reference checked."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.atomic_file import write_atomic
from planner.corner_tabs import is_corner_tab, neck_of
from planner.errors import FormatError
from planner.fold_plan import (
    Bend,
    Blocked,
    Clip,
    Cut,
    Fold,
    FoldPlan,
    MachineLimits,
    PlanMetrics,
    Point,
    Release,
    Rotate,
    Sheet,
    Step,
    Tab,
    Wait,
)
from planner.net import Net

if TYPE_CHECKING:
    from planner.plan_records import PlanRecord, StepRecord

__all__ = ["plan_bytes", "read_plan", "write_plan"]

_BOUND = ("goal", "net", "rig", "material")
_ANGLE_DECIMALS = 11  # degrees
_SHARED_LIMITS = (
    "kerf", "axis_height", "lens_height", "beam_radius", "frame_margin", "depth_of_focus",
    "focus_travel", "bend_width", "neutral_shift", "relief_mm",
    "clamp_height", "beam_spread", "weight_n_mm2", "plastic_moment_n",
)  # fmt: skip


def write_plan(plan: FoldPlan, path: str | os.PathLike[str], hashes: Mapping[str, str]) -> None:
    """Write ``plan`` to ``path``, whole or not at all.

    Args:
        plan: the plan.
        path: usually ``plan.json`` in a bundle.
        hashes: sha256 of what the plan was made from, under ``goal``, ``net``, ``rig`` and ``material``
            (with or without ``_sha256``); one that is missing is written as an empty text.

    Raises:
        ValueError: if a number of the plan is not finite.
        OSError: if the file cannot be written.
    """
    write_atomic(path, plan_bytes(plan, hashes))


def plan_bytes(plan: FoldPlan, hashes: Mapping[str, str]) -> bytes:
    """The content of ``plan.json``: the same bytes for the same plan and hashes."""
    import msgspec

    packed = msgspec.json.encode(_record(plan, hashes))
    data = msgspec.json.format(packed, indent=1)
    # msgspec writes numbers that are not finite as null, which no field of the format allows.
    try:
        msgspec.json.decode(packed, type=_record_type())
    except msgspec.ValidationError as error:
        raise ValueError(f"the plan holds a value that plan.json cannot hold: {error}") from error
    return _one_line_rows(data) + b"\n"


def read_plan(path: str | os.PathLike[str], net: Net) -> FoldPlan:
    """Read a plan for ``net``.

    Args:
        path: the file.
        net: the net that the plan folds, in the frame of the sheet.

    Raises:
        FormatError: if the file does not follow the format or does not belong to ``net``; names the place.
        OSError: if the file cannot be read.
    """
    import msgspec

    name = Path(path).name
    try:
        record = msgspec.json.decode(Path(path).read_bytes(), type=_record_type())
    except msgspec.ValidationError as error:
        raise FormatError(f"{name}: {error}. Make the plan again with `blossom plan`.") from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise FormatError(
            f"{name} is not JSON: {error}. The file may be half written; make the plan again."
        ) from error
    _check_references(record, net, name)
    return _plan(record, net)


def _record_type() -> type[PlanRecord]:
    from planner.plan_records import PlanRecord

    return PlanRecord


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(float(angle_rad)), _ANGLE_DECIMALS) + 0.0


def _rows(points: NDArray[np.float64]) -> tuple[Point, ...]:
    return tuple((x + 0.0, y + 0.0) for x, y in points.tolist())


def _record(plan: FoldPlan, hashes: Mapping[str, str]) -> PlanRecord:
    from planner import plan_records as r
    from planner.diagnosis_file import diagnosis_record

    sheet, limits, metrics = plan.sheet, plan.limits, plan.metrics
    return r.PlanRecord(
        format="metal-blossom/plan",
        version=1,
        **{f"{key}_sha256": hashes.get(f"{key}_sha256", hashes.get(key, "")) for key in _BOUND},
        thickness=float(limits.thickness),
        clearance=float(limits.clearance),
        base_face=int(plan.net.base_face),
        sheet=r.SheetRecord(_rows(sheet.outline)),
        rotary=r.RotaryRecord(_pair(_rows(sheet.rotary_axis))),
        sight=r.SightRecord(float(plan.hidden_max)),
        substrate=r.SubstrateRecord(_rows(sheet.vertices), tuple(map(_triple, sheet.faces.tolist()))),
        tabs=tuple(r.TabRecord(tab.edge, tab.start, tab.end) for tab in sheet.tabs),
        steps=tuple(map(_step_record, plan.steps)),
        metrics=r.MetricsRecord(
            fold_completion=float(metrics.fold_completion),
            clipped_faces=int(metrics.clipped_faces),
            clipped_area=float(metrics.clipped_area),
            rotations=int(metrics.rotations),
            energy_j=float(metrics.energy_j),
            seconds=float(metrics.seconds),
            shape_rms=float(metrics.shape_rms),
            shape_rms_rel=float(metrics.shape_rms_rel),
            swept_area=float(metrics.swept_area),
        ),
        blocked=tuple(
            r.BlockedRecord(
                crease=b.crease,
                reached=_degrees(b.reached_rad),
                wanted=_degrees(b.wanted_rad),
                by=b.by,
                blockers=b.blockers,
                at=_degrees(b.at_rad),
                diagnosis=None if b.diagnosis is None else diagnosis_record(b.diagnosis),
            )
            for b in plan.blocked
        ),
        limits=r.LimitsRecord(
            work_area=(float(limits.work_area[0]), float(limits.work_area[1])),
            max_tilt=_degrees(limits.max_tilt_rad),
            clamps=limits.clamps,
            beam_source=limits.beam_source,
            **{key: float(getattr(limits, key)) for key in _SHARED_LIMITS},
        ),
        frame_faces=tuple(np.flatnonzero(sheet.frame_faces).tolist()),
        seed=plan.seed,
        without=plan.without,
        notices=plan.notices,
    )


def _step_record(step: Step) -> StepRecord:
    from planner import plan_records as r

    match step:
        case Cut(paths=paths, why=why):
            return r.CutRecord(paths, why)
        case Clip(faces=faces):
            return r.ClipRecord(tuple(map(int, faces)))
        case Bend(faces=faces, hinge=hinge, to_rad=to_rad):
            return r.BendRecord(faces, hinge, _degrees(to_rad))
        case Rotate(to_rad=to_rad):
            return r.RotateRecord(_degrees(to_rad))
        case Fold(crease=crease, to_rad=to_rad):
            return r.FoldRecord(int(crease), _degrees(to_rad))
        case Wait(seconds=seconds):
            return r.WaitRecord(float(seconds))
        case Release(paths=paths):
            return r.ReleaseRecord(paths)


def _pair(rows: tuple[Point, ...]) -> tuple[Point, Point]:
    return rows[0], rows[1]


def _triple(row: list[int]) -> tuple[int, int, int]:
    return row[0], row[1], row[2]


def _plan(record: PlanRecord, net: Net) -> FoldPlan:
    """The plan of a checked record."""
    from planner.diagnosis_file import diagnosis_of

    frame = np.zeros(len(record.substrate.faces), dtype=np.bool_)
    frame[list(record.frame_faces)] = True
    limits = MachineLimits(thickness=record.thickness, clearance=record.clearance)
    if record.limits is not None:
        limits = MachineLimits(
            thickness=record.thickness,
            clearance=record.clearance,
            max_tilt_rad=math.radians(record.limits.max_tilt),
            work_area=record.limits.work_area,
            clamps=record.limits.clamps,
            beam_source=record.limits.beam_source,
            **{key: getattr(record.limits, key) for key in _SHARED_LIMITS},
        )
    m = record.metrics
    return FoldPlan(
        net=net,
        sheet=Sheet(
            outline=np.array(record.sheet.outline),
            vertices=np.array(record.substrate.vertices).reshape(-1, 2),
            faces=np.array(record.substrate.faces, dtype=np.int64).reshape(-1, 3),
            frame_faces=frame,
            tabs=tuple(Tab(t.edge, t.start, t.end) for t in record.tabs),
            rotary_axis=np.array(record.rotary.axis),
            clamp_height=limits.clamp_height,
        ),
        limits=limits,
        steps=tuple(map(_step, record.steps)),
        metrics=PlanMetrics(
            fold_completion=m.fold_completion, shape_rms=m.shape_rms, shape_rms_rel=m.shape_rms_rel,
            rotations=m.rotations, clipped_faces=m.clipped_faces, clipped_area=m.clipped_area,
            energy_j=m.energy_j, seconds=m.seconds, swept_area=m.swept_area,
        ),
        blocked=tuple(
            Blocked(
                crease=b.crease, reached_rad=math.radians(b.reached), wanted_rad=math.radians(b.wanted),
                by=b.by, blockers=b.blockers, at_rad=math.radians(b.at),
                diagnosis=None if b.diagnosis is None else diagnosis_of(b.diagnosis),
            )
            for b in record.blocked
        ),
        hidden_max=record.sight.hidden_max,
        without=record.without,
        seed=record.seed,
        notices=record.notices,
    )  # fmt: skip


def _step(record: StepRecord) -> Step:
    from planner import plan_records as r

    match record:
        case r.CutRecord(paths=paths, why=why):
            return Cut(paths, why)
        case r.ClipRecord(faces=faces):
            return Clip(faces)
        case r.BendRecord(faces=faces, hinge=hinge, to=to):
            return Bend(faces, hinge, math.radians(to))
        case r.RotateRecord(to=to):
            return Rotate(math.radians(to))
        case r.FoldRecord(crease=crease, to=to):
            return Fold(crease, math.radians(to))
        case r.WaitRecord(seconds=seconds):
            return Wait(seconds)
        case r.ReleaseRecord(paths=paths):
            return Release(paths)


def _check_references(record: PlanRecord, net: Net, name: str) -> None:
    """Every number that points at something must point at something that is there.

    Raises:
        FormatError: naming file and place.
    """
    from planner import plan_records as r

    def wrong(place: str, found: object, expected: str) -> FormatError:
        return FormatError(
            f"{name}: {place} is {found}, expected {expected}. Does the plan belong to this net?"
        )

    if record.base_face != net.base_face:
        raise wrong("$.base_face", record.base_face, f"{net.base_face}, the base face of the net")
    corners, triangles = len(record.substrate.vertices), len(record.substrate.faces)
    for number, row in enumerate(record.substrate.faces):
        if max(row) >= corners or len(set(row)) < 3:
            raise wrong(f"$.substrate.faces[{number}]", list(row), f"three vertices below {corners}")
    for number, triangle in enumerate(record.frame_faces):
        if triangle >= triangles:
            raise wrong(f"$['blossom:frame_faces'][{number}]", triangle, f"a triangle below {triangles}")
    kerf = MachineLimits().kerf if record.limits is None else record.limits.kerf
    for number, tab in enumerate(record.tabs):
        if tab.edge >= len(net.edges):
            raise wrong(f"$.tabs[{number}].edge", tab.edge, "a cut edge of the net")
        corner = Tab(tab.edge, tab.start, tab.end)
        if is_corner_tab(net, corner) and neck_of(net, corner, kerf) is None:
            raise wrong(
                f"$.tabs[{number}].edge", tab.edge, "a cut edge of the net, or a crease at whose end on the "
                "base panel a neck lies free between petals",
            )  # fmt: skip
    for number, step in enumerate(record.steps):
        if isinstance(step, r.FoldRecord) and step.crease not in net.child_of:
            raise wrong(f"$.steps[{number}].crease", step.crease, "a crease of the net")
        if isinstance(step, r.ClipRecord | r.BendRecord) and any(t >= triangles for t in step.faces):
            raise wrong(f"$.steps[{number}].faces", max(step.faces), f"triangles below {triangles}")
    for number, blocked in enumerate(record.blocked):
        if blocked.crease not in net.child_of:
            raise wrong(f"$.blocked[{number}].crease", blocked.crease, "a crease of the net")
        why = blocked.diagnosis
        if why is not None and not (
            set(why.path_creases) <= set(net.child_of)
            and all(f < len(net.faces) for f in (*why.path_faces, why.toucher))
        ):
            raise wrong(f"$.blocked[{number}].diagnosis", "a path beyond the net", "faces and creases of it")


def _one_line_rows(data: bytes) -> bytes:
    """Put every list of plain numbers on one line: a point or a triangle is easier to read that way."""
    return re.sub(rb"\[\s+([-+0-9.eE,\s]+?)\s+\]", lambda m: b"[" + b" ".join(m[1].split()) + b"]", data)
