"""Cures that change the net or how it lies: another axis, another base face, one crease joined elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner.diagnosis import Cure, CureKind, Diagnosis
from planner.flat_layout import FlatLayout
from planner.fold_trials import Trial, Workbench

__all__ = ["NetAttempt", "axis_attempts", "base_attempts", "cut_cure", "make_cure", "settle"]


@dataclass(frozen=True, eq=False)
class NetAttempt:
    """A net that might free creases, folded without a sheet.

    Attributes:
        layout: the net.
        axis_rad: direction of the rotary axis in it, as ``flat_tree`` takes it.
        trial: how it folds.
        value: of the cure.
        face: new base face, -1 if it is the old one.
        cut: interior edge of the goal that is cut, -1 if none.
        join: interior edge that is joined instead, -1 if none.
    """

    layout: FlatLayout
    axis_rad: float
    trial: Trial
    value: float = 0.0
    face: int = -1
    cut: int = -1
    join: int = -1


def make_cure(
    kind: CureKind,
    trial: Trial,
    edge: int,
    tries: int,
    *,
    value: float = 0.0,
    face: int = -1,
    crease: int = -1,
    join: tuple[int, ...] = (),
) -> Cure:
    """The cure that a trial amounts to for the crease at the interior edge ``edge`` of the goal."""
    reached, frees = trial.angle_at(edge)
    return Cure(
        kind, value, face, crease, join, frees, reached, trial.completion, trial.shape_rms,
        int(trial.short.sum()), tries,
    )  # fmt: skip


def axis_attempts(bench: Workbench, count: int) -> list[NetAttempt]:
    """The same net with the rotary axis in ``count`` other directions, evenly over half a turn."""
    found = []
    for k in range(1, count + 1):
        turn = math.pi * k / (count + 1)
        layout = bench.layout
        axis = bench.axis_of(layout, turn)
        trial = bench.fold_net(layout, axis)
        if trial is not None:
            found.append(NetAttempt(layout, axis, trial, value=turn))
    return found


def base_attempts(bench: Workbench, count: int) -> list[NetAttempt]:
    """The same net held at other faces, at most ``count`` of them, evenly spread over the net."""
    net = bench.plan.net
    panel = set(net.base_panel.tolist())
    others = [face for face in net.order.tolist() if face not in panel]
    picked = sorted({round(k) for k in np.linspace(0, len(others) - 1, min(count, len(others)))})
    found = []
    for face in (others[k] for k in picked):
        layout = bench.layout.copy()
        layout.set_base(face)
        if layout.free_edges() == 0:
            continue
        axis = bench.axis_of(layout)
        trial = bench.fold_net(layout, axis)
        if trial is not None:
            found.append(NetAttempt(layout, axis, trial, face=face))
    return found


def settle(
    bench: Workbench, kind: CureKind, attempts: list[NetAttempt], edge: int, sheets: int, failures: bool
) -> Cure | None:
    """The best attempt that keeps on a sheet of its own what it promises; else the best there is.

    Args:
        bench: the plan.
        kind: of the cure.
        attempts: what was folded without a sheet.
        edge: interior edge of the goal whose crease is to be freed; if it was cut, the joint in its place.
        sheets: attempts that are placed in a sheet, at most.
        failures: tell the best attempt even if it does not free the crease.
    """

    def look(attempt: NetAttempt) -> int:
        return attempt.join if attempt.cut == edge else edge

    def promise(number: int) -> tuple[bool, float, int]:
        trial = attempts[number].trial
        return not trial.angle_at(look(attempts[number]))[1], round(trial.shape_rms, 6), number

    best: Cure | None = None
    child = bench.plan.net.child_of
    creases = {int(bench.layout.crease[face]): crease for crease, face in child.items()}
    for number in sorted(range(len(attempts)), key=promise)[:sheets]:
        tried = attempts[number]
        if not failures and not tried.trial.angle_at(look(tried))[1]:
            break
        sure = bench.fold_net_on_sheet(tried.layout, tried.axis_rad)
        if sure is None:
            continue
        joined = bench.layout.graph.faces[tried.join].tolist() if tried.join >= 0 else []
        cure = make_cure(
            kind, sure, look(tried), len(attempts), value=tried.value, face=tried.face,
            crease=creases.get(tried.cut, -1), join=tuple(sorted(joined)),
        )  # fmt: skip
        if cure.frees:
            return cure
        if best is None or abs(cure.reached_rad) > abs(best.reached_rad):
            best = cure
    return best if failures else None


def cut_cure(
    bench: Workbench, crease: int, found: Diagnosis, tries: int, sheets: int, failures: bool
) -> tuple[Cure | None, bool]:
    """One crease on the witness path cut, and the parts joined along another edge so that nothing overlaps.

    Returns:
        The cure, and whether some exchanges were left untried. Which are tried follows from the plan's seed.
    """
    layout, net = bench.layout, bench.plan.net
    edge = int(layout.crease[net.child_of[crease]])
    cuts = sorted({edge, *(int(layout.crease[net.child_of[c]]) for c in found.path_creases)})
    pairs = [
        (cut, join)
        for cut in cuts
        if not layout.graph.flat[cut]
        for join in layout.joinable(cut).tolist()
        if join != cut
    ]
    order = np.random.default_rng([bench.plan.seed, crease]).permutation(len(pairs)).tolist()
    attempts: list[NetAttempt] = []
    looked = 0
    for number in order:
        if len(attempts) >= tries:
            break
        looked += 1
        changed = layout.copy()
        if not changed.exchange(*pairs[number]):
            continue
        axis = bench.axis_of(layout)
        trial = bench.fold_net(changed, axis)
        if trial is not None:
            cut, join = pairs[number]
            attempts.append(NetAttempt(changed, axis, trial, cut=cut, join=join))
    return settle(bench, "cut", attempts, edge, sheets, failures), looked < len(pairs)
