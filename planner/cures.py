"""What would free a crease: changes that are tried by folding again, and told only as measured."""

from __future__ import annotations

import math
from dataclasses import dataclass

from planner.diagnosis import Cure, CureKind, Diagnosis
from planner.fold_trials import Change, Trial, Workbench
from planner.net_cures import NetAttempt, axis_attempts, base_attempts, cut_cure, make_cure, settle

__all__ = ["TILTS_DEG", "CureFinder", "Effort"]

TILTS_DEG = (10, 20, 30, 40, 45, 50, 55, 60, 65, 70, 75, 80)
"""Tilt limits that are tried beyond the plan's, degrees; the smallest that helps is found to a degree."""

CLEARANCE_FACTORS = (2.0, 4.0, 8.0)
HIDDEN_SHARES = (0.1, 0.15, 0.25, 0.4, 0.6, 0.8)
REMAINS_RAD = math.radians(1.0)
"""A crease that is folded less keeps this angle, and how much less is found as exactly."""


@dataclass(frozen=True)
class Effort:
    """How much is tried. Work is counted in faces folded: a net of F faces that is folded once is F.

    Attributes:
        creases: blocked creases for which cures are looked for, those with the largest shape loss first.
        shared: work on changes that concern all creases: other axes and bases, half of it each.
        each: work on cuts and on folding less, for each crease.
        axes: other directions of the rotary axis, at most.
        sheets: promising nets of each kind that are placed in a sheet of their own, for each crease.
        states: states of a small net that are looked at when all its orders are tried.
        failures: tell the best change of a kind even if it does not free the crease.
    """

    creases: int = 16
    shared: int = 16_000
    each: int = 6000
    axes: int = 17
    sheets: int = 3
    states: int = 3000
    failures: bool = True

    @classmethod
    def small(cls) -> Effort:
        """For every plan: about three seconds on 128 faces."""
        return cls(creases=4, shared=1500, each=900, axes=5, sheets=1, states=100, failures=False)


class CureFinder:
    """Tries changes to one plan; what concerns all its creases is folded once.

    Args:
        bench: the plan.
        effort: how much is tried.
    """

    def __init__(self, bench: Workbench, effort: Effort) -> None:
        self.bench, self.effort = bench, effort
        half = max(2, effort.shared // (2 * len(bench.tree.parent)))
        self._tries = max(3, effort.each // len(bench.tree.parent))
        self._axes: list[NetAttempt] | None = None
        self._bases: list[NetAttempt] | None = None
        self._tilts = bench.problem.use_sight and bench.plan.limits.max_tilt_rad > math.radians(1.0)
        self._most_axes, self._most_bases = min(effort.axes, half), half

    def find(self, crease: int, found: Diagnosis) -> tuple[tuple[Cure, ...], bool]:
        """Cures for one blocked crease, and whether some of what could be tried was left out.

        Of each kind the best change is told. The most useful come first: those that free the crease, among
        these those that do not spoil the shape, then by its error.
        """
        bench = self.bench
        if found.cause == "room":
            face = bench.plan.net.child_of[crease]
            whole = bench.fold_on_sheet(Change(restore=face))
            edge = int(bench.layout.crease[face])
            return (() if whole is None else (make_cure("restore", whole, edge, 1),)), False
        if self._axes is None or self._bases is None:
            self._axes = axis_attempts(bench, self._most_axes if self._tilts else 0)
            self._bases = base_attempts(bench, self._most_bases)
        face = bench.plan.net.child_of[crease]
        edge = int(bench.layout.crease[face])
        sheets, failures = self.effort.sheets, self.effort.failures
        cut, cut_short = cut_cure(bench, crease, found, max(2, self._tries * 2 // 3), sheets, failures)
        less, less_short = self._unfold(edge, face, found, max(1, self._tries // 3))
        clearance = max(bench.plan.limits.clearance, 0.5 * bench.plan.limits.kerf, 0.01)
        cures = (
            self._tilt(edge),
            self._ladder(edge, "clearance", [f * clearance for f in CLEARANCE_FACTORS]),
            self._ladder(edge, "hidden", [z for z in HIDDEN_SHARES if z > bench.plan.hidden_max + 1e-9]),
            settle(bench, "axis", self._axes, edge, sheets, failures),
            settle(bench, "base", self._bases, edge, sheets, failures),
            cut,
            less,
        )
        before = bench.plan.metrics.shape_rms
        kept = [cure for cure in cures if cure is not None]
        kept.sort(
            key=lambda c: (not c.frees, c.shape_rms > before + 1e-9, round(c.shape_rms, 6), -c.completion)
        )
        few = self._most_bases < len(bench.tree.parent) - len(bench.plan.net.base_panel)
        return tuple(kept), cut_short or less_short or few

    def _frees(self, trial: Trial | None, edge: int) -> bool:
        return trial is not None and trial.angle_at(edge)[1]

    def _tilt(self, edge: int) -> Cure | None:
        """The smallest tilt limit on the ladder that frees the crease, bisected to a degree."""
        bench = self.bench
        if not bench.problem.use_sight:
            return None
        below = math.degrees(bench.plan.limits.max_tilt_rad)
        ladder = [t for t in TILTS_DEG if t > below + 0.5]
        for tries, tilt in enumerate(ladder, 1):
            if self._frees(bench.fold(_changed("tilt", tilt)), edge):
                low, high = below, tilt
                while high - low > 1.5:
                    middle = math.floor(0.5 * (low + high))
                    tries += 1
                    if self._frees(bench.fold(_changed("tilt", middle)), edge):
                        high = middle
                    else:
                        low = middle
                sure = bench.fold_on_sheet(_changed("tilt", high))
                if sure is not None and self._frees(sure, edge):
                    return make_cure("tilt", sure, edge, tries, value=math.radians(high))
            below = tilt
        return self._farthest(edge, "tilt", [float(t) for t in ladder])

    def _ladder(self, edge: int, kind: CureKind, values: list[float]) -> Cure | None:
        """The first value that frees the crease; else the one with which it comes farthest."""
        bench = self.bench
        if kind == "hidden" and not bench.problem.use_sight:
            return None
        for number, value in enumerate(values):
            if self._frees(bench.fold(_changed(kind, value)), edge):
                sure = bench.fold_on_sheet(_changed(kind, value))
                if sure is not None and self._frees(sure, edge):
                    return make_cure(kind, sure, edge, number + 1, value=value)
        return self._farthest(edge, kind, values)

    def _farthest(self, edge: int, kind: CureKind, values: list[float]) -> Cure | None:
        """The value with which the crease comes farthest, where none frees it."""
        if not (values and self.effort.failures):
            return None
        comes = [round(abs(self.bench.fold(_changed(kind, v)).angle_at(edge)[0]), 6) for v in values]
        value = values[comes.index(max(comes))]
        sure = self.bench.fold_on_sheet(_changed(kind, value))
        if sure is None:
            return None
        told = math.radians(value) if kind == "tilt" else value
        return make_cure(kind, sure, edge, len(values), value=told)

    def _unfold(self, edge: int, face: int, found: Diagnosis, tries: int) -> tuple[Cure | None, bool]:
        """One other crease on the witness path folded as little less as frees this one."""
        bench, net = self.bench, self.bench.plan.net
        final = bench.plan.final_angles
        others = [
            other
            for other in (net.child_of[c] for c in found.path_creases)
            if other != face and abs(final[net.crease_of[other]]) > REMAINS_RAD
        ]
        folded = 0
        best: tuple[float, int, float] | None = None
        for other in others[:tries]:
            held = float(bench.back[bench.layout.crease[other]])
            most = abs(float(bench.tree.target[other])) - held - REMAINS_RAD
            folded += 1
            if not self._frees(bench.fold(Change(unfold=(other, most))), edge):
                continue
            low, high = 0.0, most
            while high - low > REMAINS_RAD:
                middle = 0.5 * (low + high)
                folded += 1
                if self._frees(bench.fold(Change(unfold=(other, middle))), edge):
                    high = middle
                else:
                    low = middle
            shape = round(bench.fold(Change(unfold=(other, high))).shape_rms, 6)
            if best is None or (shape, other) < best[:2]:
                best = (shape, other, high)
        short = len(others) > tries
        if best is None:
            return None, short
        sure = bench.fold_on_sheet(Change(unfold=(best[1], best[2])))
        if sure is None:
            return None, short
        crease = int(net.crease_of[best[1]])
        return make_cure("unfold", sure, edge, folded, value=best[2], crease=crease), short


def _changed(kind: CureKind, value: float) -> Change:
    if kind == "tilt":
        return Change(tilt_rad=math.radians(value))
    return Change(clearance=value) if kind == "clearance" else Change(hidden_max=value)
