"""The twin's shadow: what the machine really does, compared with the job while it runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rigs.errors import MachineError
from rigs.gate import split_words
from rigs.grbl import Status
from rigs.job import Block, Job
from rigs.replay_blocks import ReplayBlock
from rigs.rig import Rig
from twin.stroke_samples import StrokeSamples
from twin.workpiece import Workpiece

__all__ = ["Shadow", "ShadowLimits", "VirtualPart"]

_SLOW_SHARE = 0.1


@dataclass(frozen=True)
class ShadowLimits:
    """What may differ before the shadow stops the machine.

    Attributes:
        place_mm: distance of the head from the path of the block.
        rotary_deg: distance of the rotary from where the block has it.
        power_share: of the S word, while there is light at full speed.
        speed_share: of the programmed speed, above it.
        late_share: of the planned time of a block, beyond ``late_s``.
        late_s: time that a block may always take longer.
        dose_share: of the dose of a pass.
        angle_deg: what a crease of the shadow's part may differ from that of the plan at the same block.
    """

    place_mm: float = 0.5
    rotary_deg: float = 0.5
    power_share: float = 0.03
    speed_share: float = 0.05
    late_share: float = 0.25
    late_s: float = 2.0
    dose_share: float = 0.05
    angle_deg: float = 3.0


@dataclass
class VirtualPart:
    """A ``rigs.watch.Watch`` that folds a part by the confirmed passes and looks at nothing else.

    Attributes:
        job: the job.
        part: the part.
    """

    job: Job
    part: Workpiece

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """Nothing to do."""

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """Nothing to do."""

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """Heat the crease that a pass ran along."""
        del place, t
        if 0 <= block.index < len(self.job.blocks):
            made = self.job.blocks[block.index]
            if made.kind == "pass":
                self.part.heat(made.path[0], made.path[-1], made.rotary_rad, made.power_w, made.speed_mm_s)


@dataclass
class Shadow:
    """Follows a replay block by block and heats the creases that the beam has really crossed.

    Where the beam was, how strong and with the sheet turned how far comes from the status reports of the
    machine, not from the job. It is a ``rigs.watch.Watch``: what it raises stops the machine.

    Attributes:
        job: what should happen.
        rig: the machine.
        part: the part; every confirmed pass folds it.
        lit: False for a replay without light.
        steered: passes may be left out or repeated, since creases are measured.
        limits: what may differ.
        due: blocks that are to be made; None means all of them.
        strict: False only follows, as when a journal is looked at afterwards.
        reports_seen: status reports that were compared.
        late_s: largest delay of a block over its planned time.
        off_mm: largest distance from a path.
        dose_off: largest share by which the dose of a pass differed.
        unlike: what differed, in words, where ``strict`` is False.
    """

    job: Job
    rig: Rig
    part: Workpiece
    lit: bool = True
    steered: bool = False
    limits: ShadowLimits = ShadowLimits()
    due: frozenset[int] | None = None
    strict: bool = True
    reports_seen: int = 0
    late_s: float = 0.0
    off_mm: float = 0.0
    dose_off: float = 0.0
    unlike: list[str] = field(default_factory=list)
    _block: Block | None = field(default=None, init=False)
    _number: int = field(default=-1, init=False)
    _last: int = field(default=-1, init=False)
    _placed: bool = field(default=False, init=False)
    _from_deg: float = field(default=0.0, init=False)
    _since: float = field(default=0.0, init=False)
    _seconds: float = field(default=0.0, init=False)
    _samples: StrokeSamples | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        """A second part is folded as the job says, to compare with."""
        self.wanted = replace(self.part, gain=1.0, gains={}, angles_rad={}, strokes={})

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """A block is about to be sent.

        Raises:
            MachineError: if light is left out or comes twice.
        """
        known = 0 <= block.index < len(self.job.blocks)
        self._block = self.job.blocks[block.index] if known else None
        self._number, self._since, self._seconds = block.index, t, seconds
        self._samples = None
        if self._block is None:
            return
        if self._block.lit:
            feed = max(
                (v for line in block.lines for w, v in split_words(line) or () if w == "F"), default=0.0
            )
            self._samples = StrokeSamples(self._block, feed)
        free = self.steered and self._block.kind in ("pass", "wait")
        if not free:
            if block.index <= self._last and self._block.lit:
                self._differs(
                    f"block {block.index} {self._what(self._block)} comes again: it was lit already"
                )
            for number in range(self._last + 1, block.index):
                left_out = self.job.blocks[number]
                due = self.due is None or number in self.due
                if due and left_out.lit and not (self.steered and left_out.kind == "pass"):
                    self._differs(f"block {number} {self._what(left_out)} was left out")
        self._last = max(self._last, block.index)

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """Compare a status report with the block that is under way.

        Raises:
            MachineError: if it differs by more than the limits.
        """
        block = self._block
        if block is None or status.state not in ("Run", "Idle", "Jog"):
            return
        self.reports_seen += 1
        off = self._off_path(block, place)
        self.off_mm = max(self.off_mm, off)
        if off > self.limits.place_mm:
            self._differs(f"the head is {off:.2f} mm off its path")
        turn = self._turn(place)
        low, high = sorted((self._from_deg, math.degrees(block.rotary_rad)))
        if turn < low - self.limits.rotary_deg or turn > high + self.limits.rotary_deg:
            self._differs(f"the rotary is at {turn:.2f}°, not between {low:.2f}° and {high:.2f}°")
        if self._samples is not None:
            self._samples.take(status, place, turn)
        self._check_light(block, status, place)
        late = t - self._since - self._seconds
        if self._placed and late > self.limits.late_s + self.limits.late_share * self._seconds:
            self._differs(f"it takes {late:.1f} s longer than the {self._seconds:.1f} s planned")

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """A block was executed: fold the crease that its stroke really crossed.

        Raises:
            MachineError: if it was another crease than planned, or another dose.
        """
        self.late_s = max(self.late_s, t - self._since - self._seconds)
        if 0 <= block.index < len(self.job.blocks):
            made = self.job.blocks[block.index]
            if made.kind == "pass" and self.lit:
                self._heat(made, place)
            self._placed = True
            self._from_deg = math.degrees(made.rotary_rad)
        else:
            turn = self._turn(place)
            self._from_deg = self._from_deg if math.isnan(turn) else turn
        self._block = None

    @property
    def angle_off_deg(self) -> float:
        """Largest difference between a crease of the part and of the plan at this block, degrees."""
        creases = {*self.part.angles_rad, *self.wanted.angles_rad}
        off = [abs(self.part.angles_rad.get(c, 0.0) - self.wanted.angles_rad.get(c, 0.0)) for c in creases]
        return math.degrees(max(off, default=0.0))

    def _heat(self, made: Block, place: Mapping[str, float]) -> None:
        samples = self._samples or StrokeSamples(made, 0.0)
        samples.end(place, self._turn(place))
        start, end = samples.path()
        power = self.rig.laser.power_for_s(samples.s_word())
        turned = math.radians(samples.turn_deg())
        heated = self.part.heat(start, end, turned, power, made.speed_mm_s)
        planned = self.wanted.heat(
            made.path[0], made.path[-1], made.rotary_rad, made.power_w, made.speed_mm_s
        )
        if heated.crease != planned.crease:
            what = f"along crease {heated.crease}" if heated.crease >= 0 else "along no crease"
            self._differs(f"the stroke ran {what}, not along crease {planned.crease}")
        share = abs(power / made.power_w - 1.0) if made.power_w > 0.0 else 0.0
        self.dose_off = max(self.dose_off, share)
        if share > self.limits.dose_share:
            self._differs(f"the pass had {power / made.power_w:.0%} of its dose")
        if not self.steered and self.angle_off_deg > self.limits.angle_deg:
            self._differs(f"the part is {self.angle_off_deg:.1f}° away from the plan at a crease")

    def _differs(self, what: str) -> None:
        step = self._block.step if self._block is not None else -1
        where = f"in block {self._number} (step {step})"
        if self.strict:
            raise MachineError(f"the shadow stopped the machine {where}: {what}")
        self.unlike.append(f"{where}: {what}")

    def _turn(self, place: Mapping[str, float]) -> float:
        units = self.rig.rotary.units_per_deg * self.rig.rotary.sign
        return place.get(self.rig.rotary.word, math.nan) / units

    def _off_path(self, block: Block, place: Mapping[str, float]) -> float:
        """Distance of the head from the way of a block, mm; heights do not count where the focus is fixed."""
        axes = 3 if self.rig.has_focus_axis else 2
        here = np.array([place.get(w, math.nan) for w in "XYZ"[:axes]])
        if np.isnan(here).any():
            return 0.0
        way: NDArray[np.float64] = np.array([block.start, *block.path, block.end])[:, :axes]
        if not self._placed:  # the first block may come from anywhere
            return 0.0
        if block.kind == "goto":  # rapids of the axes end one after the other: anywhere in the box
            low, high = way.min(axis=0), way.max(axis=0)
            return float(np.linalg.norm(np.maximum(np.maximum(low - here, here - high), 0.0)))
        a, d = way[:-1], np.diff(way, axis=0)
        length = (d**2).sum(axis=1)
        share = np.clip(((here - a) * d).sum(axis=1) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        return float(np.linalg.norm(a + share[:, None] * d - here, axis=1).min())

    def _check_light(self, block: Block, status: Status, place: Mapping[str, float]) -> None:
        if status.state == "Idle" or not status.tells_power:
            return
        if status.s > 0.0 and not (self.lit and block.lit):
            self._differs(f"it reports S{status.s:g}, where there should be no light")
        if not self.lit or not block.lit or self._samples is None:
            return
        most = block.s_word * (1.0 + self.limits.power_share) + 1.0
        inside, full_speed = self._samples.at(status, place)
        if status.s > most or (
            inside and full_speed and status.s < block.s_word * (1.0 - self.limits.power_share) - 1.0
        ):
            self._differs(f"it reports S{status.s:g} instead of S{block.s_word:g}")
        share = status.speed / self._samples.feed if self._samples.feed > 0.0 else 1.0
        scales = self.rig.controller.dialect != "grblhal"  # that one reports the word, not the light
        if inside and scales and status.s > (share + _SLOW_SHARE) * block.s_word + 1.0:
            self._differs(f"it burns S{status.s:g} at F{status.speed:g} instead of F{self._samples.feed:g}")
        if status.speed > self._samples.feed * (1.0 + self.limits.speed_share) + 2.0 and inside:
            self._differs(f"it moves at F{status.speed:g} instead of F{self._samples.feed:g}")

    @staticmethod
    def _what(block: Block) -> str:
        return f"(a pass over crease {block.crease})" if block.kind == "pass" else f"(a {block.kind})"
