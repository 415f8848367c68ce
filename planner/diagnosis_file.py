"""The ``diagnosis`` of a blocked crease as it stands in ``plan.json``: records, angles in degrees."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import msgspec

from planner.diagnosis import Cause, Cure, CureKind, Diagnosis, Proof, View

__all__ = ["CureRecord", "DiagnosisRecord", "ProofRecord", "ViewRecord", "diagnosis_of", "diagnosis_record"]

_DECIMALS = 11
_Index = Annotated[int, msgspec.Meta(ge=0)]
_Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
_NotNegative = Annotated[float, msgspec.Meta(ge=0.0)]
_IN_DEGREES = ("tilt", "axis", "unfold")
"""Kinds of cures whose value is an angle."""


class ViewRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a crease is seen under one rotary angle."""

    rotary: float
    seen_to: float
    hidden: _Share
    by: int


class ProofRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """That a crease cannot fold fully."""

    kind: Literal["angle", "axis", "orders"]
    bound: float = 0.0
    states: _Index = 0
    beams: _Index = 0


class CureRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A change that was tried; keys that do not belong to its kind are left out."""

    kind: CureKind
    frees: bool
    reached: float
    fold_completion: _Share
    shape_rms: _NotNegative
    blocked: _Index
    tries: _Index
    value: float = 0.0
    face: int = -1
    crease: int = -1
    join: tuple[_Index, ...] = ()


class DiagnosisRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Why a crease stays short, and what would free it."""

    cause: Cause
    at: float
    loss_mm: _NotNegative
    tries: _Index
    blocker: int = -1
    toucher: int = -1
    carried: bool = False
    views: tuple[ViewRecord, ...] = ()
    path_faces: tuple[_Index, ...] = ()
    path_creases: tuple[_Index, ...] = ()
    impossible: ProofRecord | None = None
    cures: tuple[CureRecord, ...] = ()
    capped: bool = False


def diagnosis_record(found: Diagnosis) -> DiagnosisRecord:
    """The record of a diagnosis."""
    proof = found.proof
    return DiagnosisRecord(
        cause=found.cause, at=_degrees(found.at_rad), loss_mm=float(found.loss_mm), tries=found.tries,
        blocker=found.blocker, toucher=found.toucher, carried=found.carried,
        views=tuple(
            ViewRecord(_degrees(v.rotary_rad), _degrees(v.to_rad), min(1.0, float(v.hidden)), v.by)
            for v in found.views
        ),
        path_faces=found.path_faces, path_creases=found.path_creases,
        impossible=None
        if proof is None
        else ProofRecord(proof.kind, _degrees(proof.bound_rad), proof.states, proof.beams),
        cures=tuple(
            CureRecord(
                cure.kind, cure.frees, _degrees(cure.reached_rad), min(1.0, float(cure.completion)),
                float(cure.shape_rms), cure.blocked, cure.tries,
                _degrees(cure.value) if cure.kind in _IN_DEGREES else float(cure.value),
                cure.face, cure.crease, cure.join,
            )
            for cure in found.cures
        ),
        capped=found.capped,
    )  # fmt: skip


def diagnosis_of(record: DiagnosisRecord) -> Diagnosis:
    """The diagnosis of a record."""
    proof = record.impossible
    return Diagnosis(
        cause=record.cause, at_rad=math.radians(record.at), blocker=record.blocker, toucher=record.toucher,
        carried=record.carried,
        views=tuple(
            View(math.radians(v.rotary), math.radians(v.seen_to), v.hidden, v.by) for v in record.views
        ),
        path_faces=record.path_faces, path_creases=record.path_creases, loss_mm=record.loss_mm,
        proof=None
        if proof is None
        else Proof(proof.kind, math.radians(proof.bound), proof.states, proof.beams),
        cures=tuple(
            Cure(
                cure.kind, math.radians(cure.value) if cure.kind in _IN_DEGREES else cure.value, cure.face,
                cure.crease, cure.join, cure.frees, math.radians(cure.reached), cure.fold_completion,
                cure.shape_rms, cure.blocked, cure.tries,
            )
            for cure in record.cures
        ),
        tries=record.tries, capped=record.capped,
    )  # fmt: skip


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(float(angle_rad)), _DECIMALS) + 0.0
