"""Folding another, cold crease while one cools: a plan whose folds are made in stages that take turns.

Folds that follow one another in a plan, under one rotary angle, are made in bursts of passes: when a crease
has to rest, the coldest of the others goes on. Every stage is a ``fold`` step of its own to a part of the
angle. The order is kept only if the rules of the planner allow every stage where it stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from planner.fold_plan import Cut, Fold, FoldPlan, Release, Rotate, Step, Wait
from planner.fold_replay import FoldReplay
from rigs.job_build import make_job
from rigs.material import Material
from rigs.rig import Rig
from twin.cooling import AMBIENT_C
from twin.pass_law import HeatingModel
from twin.plan_process import ALLOWED_START_C, ProcessMaker, plan_process, rotation_s
from twin.process_table import Chain, Objective
from twin.thermal_schedule import PassClock

__all__ = ["Interleaving", "interleave"]

LARGEST_GROUP = 48
"""Folds that may take turns with one another."""

SHORTEST_BURST = 8
"""A crease that is begun gets at least so many passes before another goes on."""

MOST_STAGES = 8
"""Stages that a fold is made in at most."""

PATIENCE_S = 0.05
"""A rest that is not longer than this beyond the least one is waited for."""

COLD_SHARE = 0.6
"""Another crease goes on if its rise is below this share of the allowed one."""


@dataclass(frozen=True, eq=False)
class Interleaving:
    """A plan whose folds take turns, and what was changed.

    Attributes:
        plan: the plan; the given one if nothing helps.
        seconds: duration of its job, with all dark ways.
        seconds_in_order: the same for the given plan.
        groups: how many groups of folds take turns.
        staged: folds that are made in more than one stage.
        refused: groups that a rule did not allow to take turns, and were made smaller for it.
    """

    plan: FoldPlan
    seconds: float
    seconds_in_order: float
    groups: int
    staged: int
    refused: int


@dataclass
class _Turn:
    """One fold of a group while its passes are shared out."""

    step: Fold
    begin_rad: float
    chain: Chain
    stroke_s: float
    power_w: float
    count: int
    seen: int
    done: int = 0
    reached: float = 0.0
    after: tuple[_Turn, ...] = ()

    @property
    def is_free(self) -> bool:
        """All that hangs on the crease and is folded in this group has been folded."""
        return all(turn.done == turn.count for turn in self.after)

    def angle_after(self, share: float) -> float:
        return self.begin_rad + share * (self.step.to_rad - self.begin_rad)


def interleave(
    plan: FoldPlan,
    rig: Rig,
    material: Material,
    *,
    objective: Objective = "joules",
    allowed_start_c: float = ALLOWED_START_C,
    absorptivity: float | None = None,
    heating: HeatingModel = "fast",
) -> Interleaving:
    """Let folds take turns where that saves waiting.

    Every fold ends at the angle that it had, and where the group of folds ends the part is as it was in
    ``plan``; only on the way do several creases stand partly folded. Contact, sight, side and outside-in are
    asked of the planner's kernels for every stage. The plan is changed only if its job becomes shorter.

    Args:
        plan: the plan.
        rig: the machine.
        material: what the sheet is made of.
        objective: what the search for a setting minimises.
        allowed_start_c: highest mean temperature of a crease when a pass begins.
        absorptivity: absorbed share of the light; the material's value when None.
        heating: where angles of passes come from.

    Raises:
        HeatingError: if a crease cannot be folded with any setting of the rig.
        PlanError: if the plan bends substrate.
    """
    share = material.absorptivity_at(rig.laser.wavelength_nm) if absorptivity is None else absorptivity
    weaver = _Weaver(plan, ProcessMaker(plan, rig, material, objective, allowed_start_c, share, heating))
    steps = weaver.woven()

    def seconds(made: FoldPlan) -> float:
        process = plan_process(
            made, rig, material, objective=objective, allowed_start_c=allowed_start_c, absorptivity=share,
            heating=heating,
        )  # fmt: skip
        return make_job(made, process, rig, material).seconds

    in_order = seconds(plan)
    if weaver.staged == 0:
        return Interleaving(plan, in_order, in_order, 0, 0, weaver.refused)
    woven = replace(plan, steps=steps)
    taken = seconds(woven)
    if taken >= in_order:  # ways between creases may eat what the waits save
        return Interleaving(plan, in_order, in_order, 0, 0, weaver.refused)
    return Interleaving(woven, taken, in_order, weaver.groups, weaver.staged, weaver.refused)


class _Weaver:
    def __init__(self, plan: FoldPlan, maker: ProcessMaker) -> None:
        self.plan, self.maker = plan, maker
        self.clock: PassClock = maker.clock()
        self.replay = FoldReplay(plan)
        self.angle: dict[int, float] = {}
        self.seen: dict[int, int] = {}
        self.groups = self.staged = self.refused = 0

    def woven(self) -> tuple[Step, ...]:
        """The steps of the plan, folds in stages where that saves time."""
        out: list[Step] = []
        steps = self.plan.steps
        number = 0
        while number < len(steps):
            step = steps[number]
            if isinstance(step, Fold):
                group = self._group(number)
                out += self._made(number, group)
                number += len(group)
                continue
            if isinstance(step, Rotate):
                self.clock.idle(rotation_s(self.maker.rig, self.replay.rotary_rad, step.to_rad))
            elif isinstance(step, Wait):
                self.clock.idle(step.seconds)
            elif isinstance(step, (Cut, Release)):
                self.clock.idle(self.maker.cut(number, step.paths).beam_s)
            self.replay.make(step)
            out.append(step)
            number += 1
        return tuple(out)

    def _group(self, number: int) -> list[Fold]:
        """Folds from ``number`` on that may take turns: one after another, outside-in, within the rules."""
        net, replay = self.plan.net, self.replay.copy()
        group: list[Fold] = []
        for step in self.plan.steps[number:]:
            if not isinstance(step, Fold) or len(group) == LARGEST_GROUP or replay.objection(step):
                break
            face = net.child_of[step.crease]
            if any(face in net.subtree[net.child_of[other.crease]] for other in group):
                break  # the same crease again, or one that others hang on
            replay.make(step)
            group.append(step)
        first = self.plan.steps[number]
        assert isinstance(first, Fold)  # noqa: S101  the caller looked
        return group or [first]

    def _made(self, number: int, group: list[Fold]) -> list[Fold]:
        """Make a group, taking turns if the rules allow it, else in two halves."""
        if len(group) == 1:
            self._alone(number, group[0])
            return group
        clock = PassClock(self.clock.heat.copy(), self.maker.absorptivity)
        turns = [self._turn(number + k, step) for k, step in enumerate(group)]
        for turn in turns:
            members = self.plan.net.subtree[self.plan.net.child_of[turn.step.crease]]
            turn.after = tuple(
                other
                for other in turns
                if other is not turn and self.plan.net.child_of[other.step.crease] in members
            )
        stages = _shared_out(turns, clock)
        replay = self.replay.copy()
        for stage in stages:
            if replay.objection(stage):
                self.refused += 1
                half = (len(group) + 1) // 2
                return self._made(number, group[:half]) + self._made(number + half, group[half:])
            replay.make(stage)
        self.replay, self.clock = replay, clock
        for turn in turns:
            self.angle[turn.step.crease] = turn.step.to_rad
            self.seen[turn.step.crease] = turn.seen + turn.count
        stages_of: dict[int, int] = {}
        for stage in stages:
            stages_of[stage.crease] = stages_of.get(stage.crease, 0) + 1
        split = sum(many > 1 for many in stages_of.values())
        self.staged += split
        self.groups += split > 0
        return stages

    def _turn(self, number: int, step: Fold) -> _Turn:
        begin = self.angle.get(step.crease, 0.0)
        seen = self.seen.get(step.crease, 0)
        change = step.to_rad - begin
        chain, stroke_s, _ = self.maker.setting(
            number, step, change, self.replay.rotary_rad, self.maker.whole[step.crease]
        )
        guess = chain.schedule(abs(change), stroke_s, seen)
        return _Turn(step, begin, chain, stroke_s, guess.power_w, len(guess.increments_rad), seen)

    def _alone(self, number: int, step: Fold) -> None:
        turn = self._turn(number, step)
        made = self.clock.fold(
            turn.chain, step.crease, abs(step.to_rad - turn.begin_rad), turn.stroke_s, turn.seen
        )
        self.angle[step.crease] = step.to_rad
        self.seen[step.crease] = turn.seen + len(made.increments_rad)
        self.replay.make(step)


def _shared_out(turns: list[_Turn], clock: PassClock) -> list[Fold]:
    """Stages of folds that take turns: who rests too long lets the coldest of the others go on."""
    heat = clock.heat
    stages: list[Fold] = []
    current = turns[0]
    burst = 0
    while True:
        allowed = current.chain.conditions.allowed_c
        heat.wait_until_cold(current.step.crease, allowed)
        start = heat.start_c(current.step.crease)
        current.reached += float(current.chain.factors(np.array([start]), current.seen + current.done)[0])
        heat.burn(current.step.crease, clock.line_j_m(current.chain, current.power_w))
        clock.idle(current.stroke_s)
        current.done += 1
        burst += 1
        left = [turn for turn in turns if turn.done < turn.count]
        if not left:
            break
        if current.done < current.count:
            clock.idle(current.chain.conditions.shortest_wait_s)
            least = max(SHORTEST_BURST, math.ceil(current.count / MOST_STAGES))
            ends_soon = current.count - current.done < least
            if burst < least or ends_soon or not _rests(current, clock):
                continue
        following = _coldest(left, current, clock)
        if following is current:
            continue
        stages.append(_stage(current))
        current, burst = following, 0
    stages.append(_stage(current))
    return stages


def _stage(turn: _Turn) -> Fold:
    """The fold so far; its angle is that of the passes burnt, by the law of the setting."""
    if turn.done == turn.count:
        return turn.step
    later = turn.chain.factors(
        np.full(turn.count - turn.done, turn.chain.conditions.allowed_c), turn.seen + turn.done
    )
    return Fold(turn.step.crease, turn.angle_after(turn.reached / (turn.reached + float(later.sum()))))


def _rests(turn: _Turn, clock: PassClock) -> bool:
    """Whether the crease is still too warm after a short rest."""
    heat = clock.heat.copy()
    rise = heat.rise(turn.step.crease, heat.now_s + PATIENCE_S)
    return rise > turn.chain.conditions.allowed_c - AMBIENT_C


def _coldest(left: list[_Turn], current: _Turn, clock: PassClock) -> _Turn:
    """The coldest of the creases that are left; ``current`` goes on where no other is cold enough."""
    rises = [
        (clock.heat.rise(turn.step.crease), order)
        for order, turn in enumerate(left)
        if turn is not current and turn.is_free
    ]
    if not rises:
        return current
    rise, order = min(rises)
    enough = COLD_SHARE * (left[order].chain.conditions.allowed_c - AMBIENT_C)
    return left[order] if rise <= enough or current.done == current.count else current
