"""The records of ``plan.json``: names, types and ranges of everything in the file, in degrees and mm."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from planner.diagnosis_file import DiagnosisRecord
from planner.fold_plan import MachineLimits

__all__ = [
    "BendRecord", "BlockedRecord", "ClipRecord", "CutRecord", "FoldRecord", "LimitsRecord", "MetricsRecord",
    "PlanRecord", "ReleaseRecord", "RotaryRecord", "RotateRecord", "SheetRecord", "SightRecord", "StepRecord",
    "SubstrateRecord", "TabRecord", "WaitRecord",
]  # fmt: skip

_Point = tuple[float, float]
_Path = Annotated[tuple[_Point, ...], msgspec.Meta(min_length=2)]
_Index = Annotated[int, msgspec.Meta(ge=0)]
_Positive = Annotated[float, msgspec.Meta(gt=0.0)]
_NotNegative = Annotated[float, msgspec.Meta(ge=0.0)]
_Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
_Degrees = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]


class CutRecord(msgspec.Struct, frozen=True, tag="cut", tag_field="op", forbid_unknown_fields=True):
    """A ``cut`` step."""

    paths: tuple[_Path, ...]
    why: str = ""


class ClipRecord(msgspec.Struct, frozen=True, tag="clip", tag_field="op", forbid_unknown_fields=True):
    """A ``clip`` step."""

    faces: tuple[_Index, ...]


class BendRecord(msgspec.Struct, frozen=True, tag="bend", tag_field="op", forbid_unknown_fields=True):
    """A ``bend`` step."""

    faces: tuple[_Index, ...]
    hinge: tuple[_Point, _Point]
    to: _Degrees


class RotateRecord(msgspec.Struct, frozen=True, tag="rotate", tag_field="op", forbid_unknown_fields=True):
    """A ``rotate`` step."""

    to: _Degrees


class FoldRecord(msgspec.Struct, frozen=True, tag="fold", tag_field="op", forbid_unknown_fields=True):
    """A ``fold`` step."""

    crease: _Index
    to: _Degrees


class WaitRecord(msgspec.Struct, frozen=True, tag="wait", tag_field="op", forbid_unknown_fields=True):
    """A ``wait`` step."""

    seconds: _NotNegative


class ReleaseRecord(msgspec.Struct, frozen=True, tag="release", tag_field="op", forbid_unknown_fields=True):
    """The ``release`` step."""

    paths: tuple[_Path, ...]


StepRecord = CutRecord | ClipRecord | BendRecord | RotateRecord | FoldRecord | WaitRecord | ReleaseRecord


class SheetRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The outline of the sheet."""

    outline: Annotated[tuple[_Point, ...], msgspec.Meta(min_length=3)]


class RotaryRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rotary axis."""

    axis: tuple[_Point, _Point]


class SightRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What may be hidden of a crease."""

    hidden_max: _Share


class SubstrateRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The triangulated substrate."""

    vertices: tuple[_Point, ...]
    faces: tuple[tuple[_Index, _Index, _Index], ...]


class TabRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One tab."""

    edge: _Index
    start: _Point = msgspec.field(name="from")
    end: _Point = msgspec.field(name="to")


class MetricsRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Figures of the plan."""

    fold_completion: _Share
    clipped_faces: _Index
    clipped_area: _NotNegative
    rotations: _Index
    energy_j: _NotNegative
    seconds: _NotNegative
    shape_rms: _NotNegative
    shape_rms_rel: _NotNegative
    swept_area: _NotNegative = 0.0


class BlockedRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A crease that stays short of the goal."""

    crease: _Index
    reached: _Degrees
    wanted: _Degrees
    by: Literal["collision", "sight", "substrate", "order", "limit", "room"]
    blockers: tuple[_Index, ...] = msgspec.field(name="with")
    at: _Degrees
    diagnosis: DiagnosisRecord | None = None


class LimitsRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the plan was made for, beside thickness and clearance."""

    kerf: _NotNegative
    work_area: tuple[_Positive, _Positive]
    axis_height: _Positive
    lens_height: _Positive
    max_tilt: _Degrees
    beam_radius: _NotNegative
    frame_margin: _NotNegative
    depth_of_focus: _NotNegative
    focus_travel: _NotNegative
    bend_width: _NotNegative = 0.0
    neutral_shift: _NotNegative = 0.0
    relief_mm: _NotNegative = 0.0
    clamp_height: _NotNegative = 0.0
    clamps: tuple[tuple[_Point, ...], ...] = ()
    beam_spread: _NotNegative = 0.0
    beam_source: tuple[float, float, float] | None = None
    weight_n_mm2: _NotNegative = MachineLimits.weight_n_mm2
    plastic_moment_n: _Positive = MachineLimits.plastic_moment_n


class PlanRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The whole file. The keys of the project's own start with ``blossom:``."""

    format: Literal["metal-blossom/plan"]
    version: Literal[1]
    goal_sha256: str
    net_sha256: str
    rig_sha256: str
    material_sha256: str
    thickness: _Positive
    clearance: _NotNegative
    base_face: _Index
    sheet: SheetRecord
    rotary: RotaryRecord
    sight: SightRecord
    substrate: SubstrateRecord
    tabs: tuple[TabRecord, ...]
    steps: tuple[StepRecord, ...]
    metrics: MetricsRecord
    blocked: tuple[BlockedRecord, ...]
    limits: LimitsRecord | None = msgspec.field(name="blossom:limits", default=None)
    frame_faces: tuple[_Index, ...] = msgspec.field(name="blossom:frame_faces", default=())
    seed: int = msgspec.field(name="blossom:seed", default=0)
    without: tuple[str, ...] = msgspec.field(name="blossom:without", default=())
    notices: tuple[str, ...] = msgspec.field(name="blossom:notices", default=())
