"""Passes by measured angles: fewer or more of the same, with a running correction of what a pass is worth."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from rigs.errors import JobError
from rigs.gcode import SYNC_S, gcode_program
from rigs.job import Block, Job
from rigs.measuring import Measure
from rigs.process import FoldProcess, Process
from rigs.replay_blocks import ReplayBlock
from rigs.resume import pass_groups
from rigs.steering_so_far import SoFar

__all__ = ["AngleSteering", "Gain", "Reading"]

_MODEL_SIGMA = 0.05
"""Scatter of a crease around the running gain."""

_GAIN_LIMITS = 0.4, 2.5
_MOST_ROUNDS = 6


@dataclass
class Gain:
    """Running estimate of true over predicted bend: a recursive least-squares filter with limits.

    Attributes:
        value: the estimate.
        variance: how uncertain it is.
    """

    value: float = 1.0
    variance: float = 0.3**2

    @property
    def at_most(self) -> float:
        """The estimate plus two standard deviations: metal that is folded too far cannot be unfolded."""
        return self.value + 2.0 * math.sqrt(self.variance)

    def learn(self, predicted_deg: float, observed_deg: float, sigma_deg: float) -> None:
        """Take in a crease that was predicted to bend by one angle and bent by another."""
        if abs(predicted_deg) < 1.0:
            return
        noise = (sigma_deg / predicted_deg) ** 2 + _MODEL_SIGMA**2
        weight = self.variance / (self.variance + noise)
        value = self.value + weight * (observed_deg / predicted_deg - self.value)
        self.value = min(max(value, _GAIN_LIMITS[0]), _GAIN_LIMITS[1])
        self.variance = (1.0 - weight) * self.variance + 1e-5


@dataclass(frozen=True)
class Reading:
    """A measurement and what followed from it.

    Attributes:
        step: plan step.
        crease: net edge.
        wanted_deg: what the plan asks for.
        measured_deg: what was measured last.
        planned: passes of the job.
        made: passes that were made.
        gain: running estimate afterwards.
    """

    step: int
    crease: int
    wanted_deg: float
    measured_deg: float
    planned: int
    made: int
    gain: float


@dataclass
class AngleSteering:
    """A ``rigs.watch.Steering`` that measures after the passes of every fold step.

    Before a step it takes off as many passes as might be too many by the running gain and its uncertainty;
    after them it measures,
    and makes
    further ones, equal to those of the step, until the crease is within half a pass of the plan. What ends
    farther
    from the plan than ``tolerance_deg`` is put before ``accept``; if that says no, the replay stops.

    Attributes:
        job: the job.
        process: its passes and what each is worth.
        measure: measures a crease.
        accept: told the plan step and the angle (rad) that the crease has; says whether the rest of the
            plan may go on.
        tolerance_deg: deviation that needs no asking.
        told: called with every crease and its measured angle (rad).
        gain: running correction.
        note: writes a record into the journal of the replay.
        readings: what was measured.
        before: what earlier replays of this sheet made and measured.
    """

    job: Job
    process: Process
    measure: Measure
    accept: Callable[[int, float], bool]
    tolerance_deg: float = 2.0
    told: Callable[[int, float], None] | None = None
    gain: Gain = field(default_factory=Gain)
    note: Callable[..., None] | None = None
    readings: list[Reading] = field(default_factory=list)
    before: SoFar = field(default_factory=SoFar)
    _groups: dict[int, list[list[int]]] = field(default_factory=dict, init=False)
    _angle: dict[int, float] = field(default_factory=dict, init=False)
    _skipped: set[int] = field(default_factory=set, init=False)
    _begun: set[int] = field(default_factory=set, init=False)
    _open: int | None = field(default=None, init=False)
    _place: tuple[float, float, float] | None = field(default=None, init=False)
    _turned: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        """Go on from what earlier replays found."""
        self._angle.update(self.before.angles_deg)
        if self.before.gain is not None:
            self.gain = Gain(*self.before.gain)
        self._open = self.before.open_step(self.job)

    def blocks_for(self, block: ReplayBlock) -> Iterator[ReplayBlock]:
        """The block, nothing in place of a pass that is not needed, or further passes after the last one."""
        number = block.index
        if not 0 <= number < len(self.job.blocks):
            yield block
            return
        made = self.job.blocks[number]
        if self._open is not None:  # it stopped between the last pass and the measurement
            step, self._open = self._open, None
            yield from self._to_the_angle(self.process.fold_at[step], self._groups_of(step))
        fold = self.process.fold_at.get(made.step) if made.kind == "pass" else None
        if fold is None:
            yield from self._from_here(block, made)
            return
        groups = self._groups_of(made.step)
        if made.step not in self._begun:
            self._begun.add(made.step)
            self._take_off(fold, groups)
        if number not in self._skipped:
            yield from self._from_here(block, made)
        if number == groups[-1][-1]:
            yield from self._to_the_angle(fold, groups)

    def _from_here(self, block: ReplayBlock, made: Block) -> Iterator[ReplayBlock]:
        """A block, after a dark move to where it begins if the head is elsewhere."""
        if self._place is not None and self._place != made.start:
            turned = made.rotary_rad if made.kind != "rotate" else self._turned
            yield from self._sent(Block("goto", made.step, self._place, (), made.start, turned, seconds=5.0))
        yield block
        self._place, self._turned = made.end, made.rotary_rad

    def _sent(self, *blocks: Block, index: int = -1) -> Iterator[ReplayBlock]:
        program = gcode_program(replace(self.job, blocks=tuple(blocks)))
        for sent in program.blocks[1:-1]:
            yield replace(sent, index=index)

    def _groups_of(self, step: int) -> list[list[int]]:
        if step not in self._groups:
            self._groups[step] = pass_groups(self.job, step)
        return self._groups[step]

    def _take_off(self, fold: FoldProcess, groups: list[list[int]]) -> None:
        """Leave out the last passes of a step that the running gain makes needless, all but one."""
        wanted = abs(math.degrees(fold.to_rad) - self._angle.get(fold.crease, math.degrees(fold.from_rad)))
        reached, needed = 0.0, 0
        for increment in fold.increments_rad:
            worth = abs(math.degrees(increment)) * self.gain.at_most
            if needed and reached + 0.5 * worth >= wanted:
                break
            reached += worth
            needed += 1
        for group in self._untouched(groups)[max(needed - self.before.passes.get(fold.step, 0), 0) :]:
            self._skipped.update(group)

    def _untouched(self, groups: list[list[int]]) -> list[list[int]]:
        """Passes of which no stroke was made by an earlier replay of the sheet."""
        return [group for group in groups if self.before.done.isdisjoint(group)]

    def _to_the_angle(self, fold: FoldProcess, groups: list[list[int]]) -> Iterator[ReplayBlock]:
        wanted = math.degrees(fold.to_rad)
        before = self._angle.get(fold.crease, math.degrees(fold.from_rad))
        made = sum(group[0] not in self._skipped for group in self._untouched(groups))
        made += self.before.passes.get(fold.step, 0)
        steps = [abs(math.degrees(x)) for x in fold.increments_rad]
        predicted = sum(steps[:made]) + steps[-1] * max(made - len(steps), 0)
        angle = before
        for _ in range(_MOST_ROUNDS):
            sign = math.copysign(1.0, wanted - before)
            angle, sigma = self.measure(fold.crease, before + sign * predicted * self.gain.value)
            self.gain.learn(predicted, sign * (angle - before), sigma)
            if self.note is not None:
                self.note(
                    "measured", step=fold.step, crease=fold.crease, deg=angle, sigma=sigma, passes=made,
                    gain=round(self.gain.value, 9), variance=round(self.gain.variance, 12),
                )  # fmt: skip
            missing = sign * (wanted - angle)
            most = made + max(3, len(groups))
            before_round = made
            while made < most:
                worth = (steps[made] if made < len(steps) else steps[-1]) * self.gain.value
                if missing < 0.5 * worth:
                    break
                yield from self._again(groups, made)
                made += 1
                predicted += worth / self.gain.value
                missing -= worth
            if made == before_round:
                break
        self._angle[fold.crease] = angle
        if self.note is not None:
            needless = sorted(k for group in groups for k in group if k in self._skipped)
            self.note("reached", sync=True, step=fold.step, crease=fold.crease, deg=angle, left_out=needless)
        if self.told is not None:
            self.told(fold.crease, math.radians(angle))
        self.readings.append(
            Reading(fold.step, fold.crease, wanted, angle, len(groups), made, round(self.gain.value, 6))
        )
        if abs(angle - wanted) > self.tolerance_deg and not self.accept(fold.step, math.radians(angle)):
            raise JobError(
                f"crease {fold.crease} stands at {angle:.1f}°, the plan wants {wanted:.1f}°, and "
                "the rest of the plan "
                "does not hold with that: stopped before light"
            )

    def _again(self, groups: list[list[int]], made: int) -> Iterator[ReplayBlock]:
        """One more pass, in the direction that begins where the head stands if there is one."""
        group = groups[made % 2] if len(groups) > 1 else groups[0]
        for number in group:
            block = self.job.blocks[number]
            if self._place != block.start:
                place = self._place or block.start
                yield from self._sent(
                    Block("goto", block.step, place, (), block.start, block.rotary_rad, seconds=5.0 + SYNC_S)
                )
            yield from self._sent(block, index=number)
            self._place = block.end
