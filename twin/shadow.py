"""The twin's shadow: what the machine really does, compared with the job while it runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rigs.errors import MachineError
from rigs.grbl import Status
from rigs.job import Block, Job
from rigs.replay_blocks import ReplayBlock
from rigs.rig import Rig
from twin.workpiece import Workpiece

__all__ = ["Shadow", "ShadowLimits", "VirtualPart"]


@dataclass(frozen=True)
class ShadowLimits:
    """What may differ before the shadow stops the machine.

    Attributes:
        place_mm: distance of the head from the path of the block.
        rotary_deg: distance of the rotary from where the block has it.
        power_share: of the S word, while there is light.
        late_share: of the planned time of a block, beyond ``late_s``.
        late_s: time that a block may always take longer.
    """

    place_mm: float = 0.5
    rotary_deg: float = 0.5
    power_share: float = 0.02
    late_share: float = 0.25
    late_s: float = 2.0


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

    It is a ``rigs.watch.Watch``: what it raises stops the machine.

    Attributes:
        job: what should happen.
        rig: the machine.
        part: the part; every confirmed pass folds it.
        lit: False for a replay without light.
        limits: what may differ.
        reports_seen: status reports that were compared.
        late_s: largest delay of a block over its planned time.
        off_mm: largest distance from a path.
    """

    job: Job
    rig: Rig
    part: Workpiece
    lit: bool = True
    limits: ShadowLimits = ShadowLimits()
    reports_seen: int = 0
    late_s: float = 0.0
    off_mm: float = 0.0
    _block: Block | None = field(default=None, init=False)
    _number: int = field(default=-1, init=False)
    _from_deg: float = field(default=0.0, init=False)
    _since: float = field(default=0.0, init=False)
    _seconds: float = field(default=0.0, init=False)

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """A block is about to be sent."""
        known = 0 <= block.index < len(self.job.blocks)
        self._block = self.job.blocks[block.index] if known else None
        self._number, self._since, self._seconds = block.index, t, seconds

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """Compare a status report with the block that is under way.

        Raises:
            MachineError: if it differs by more than the limits.
        """
        block = self._block
        if block is None or status.state not in ("Run", "Idle", "Jog"):
            return
        self.reports_seen += 1
        where = f"the shadow stopped the machine in block {self._number} (step {block.step})"
        off = self._off_path(block, place)
        self.off_mm = max(self.off_mm, off)
        if off > self.limits.place_mm:
            raise MachineError(f"{where}: the head is {off:.2f} mm off its path")
        turn = place.get(self.rig.rotary.word, math.nan) / (
            self.rig.rotary.units_per_deg * self.rig.rotary.sign
        )
        low, high = sorted((self._from_deg, math.degrees(block.rotary_rad)))
        if turn < low - self.limits.rotary_deg or turn > high + self.limits.rotary_deg:
            raise MachineError(
                f"{where}: the rotary is at {turn:.2f}°, not between {low:.2f}° and {high:.2f}°"
            )
        self._check_light(block, status, where)
        late = t - self._since - self._seconds
        if late > self.limits.late_s + self.limits.late_share * self._seconds:
            raise MachineError(
                f"{where}: it takes {late:.1f} s longer than the {self._seconds:.1f} s planned"
            )

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """A block was executed: fold the crease that its stroke crossed."""
        self.late_s = max(self.late_s, t - self._since - self._seconds)
        if 0 <= block.index < len(self.job.blocks):
            made = self.job.blocks[block.index]
            self._from_deg = math.degrees(made.rotary_rad)
            if made.kind == "pass" and self.lit:
                self.part.heat(made.path[0], made.path[-1], made.rotary_rad, made.power_w, made.speed_mm_s)
        else:
            words = self.rig.rotary.units_per_deg * self.rig.rotary.sign
            self._from_deg = place.get(self.rig.rotary.word, self._from_deg * words) / words
        self._block = None

    def _off_path(self, block: Block, place: Mapping[str, float]) -> float:
        """Distance of the head from the way of a block, mm; heights do not count where the focus is fixed."""
        axes = 3 if self.rig.has_focus_axis else 2
        here = np.array([place.get(w, math.nan) for w in "XYZ"[:axes]])
        if np.isnan(here).any():
            return 0.0
        way = np.array([block.start, *block.path, block.end])[:, :axes]
        if block.kind == "goto":  # rapids of the axes end one after the other: anywhere in the box
            low, high = way.min(axis=0), way.max(axis=0)
            return float(np.linalg.norm(np.maximum(np.maximum(low - here, here - high), 0.0)))
        a, d = way[:-1], np.diff(way, axis=0)
        length = (d**2).sum(axis=1)
        share = np.clip(((here - a) * d).sum(axis=1) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        return float(np.linalg.norm(a + share[:, None] * d - here, axis=1).min())

    def _check_light(self, block: Block, status: Status, where: str) -> None:
        if status.state == "Idle" or status.s <= 0.0:
            return
        if not self.lit or not block.lit:
            raise MachineError(f"{where}: it reports S{status.s:g}, where there should be no light")
        if status.s > block.s_word * (1.0 + self.limits.power_share) + 1.0:
            raise MachineError(f"{where}: it reports S{status.s:g} instead of S{block.s_word:g}")
