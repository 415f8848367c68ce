"""One run of a replay over an identified controller: block after block, confirmed and journalled."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from rigs.arming import Arming
from rigs.controller import Controller
from rigs.errors import JobError, MachineError
from rigs.grbl import Status
from rigs.holding import Holder, Holding
from rigs.journal import JournalWriter, Outcome
from rigs.modes import modes_mistake
from rigs.replay_blocks import SYNC, ReplayBlock, dark_block, dark_lines, lit_block
from rigs.replay_checks import position_mistake, travel_seconds
from rigs.send_ahead import send_ahead, stretches
from rigs.stop_signals import deaf_to_signals
from rigs.watch import Steering, Watch

__all__ = ["Mode", "Progress", "Run"]

Mode = Literal["dry-run", "frame", "arm"]


@dataclass(frozen=True)
class Progress:
    """Where a replay stands.

    Attributes:
        block: blocks confirmed so far, of ``blocks``; in a dry run those that the controller has taken.
        step: plan step of the last one.
        kind: kind of the last one.
        elapsed_s: since the first block.
        left_s: estimate of what is left.
        emulated: True when no real machine is involved.
    """

    block: int
    blocks: int
    step: int
    kind: str
    elapsed_s: float
    left_s: float
    emulated: bool


class Run:
    """One replay over an identified controller."""

    def __init__(
        self,
        controller: Controller,
        journal: JournalWriter,
        mode: Mode,
        emulated: bool,
        grace_s: float,
        ask: Callable[[str], bool] | None,
        on_progress: Callable[[Progress], None] | None,
        watch: Watch | None = None,
        steering: Steering | None = None,
        holding: Holding | None = None,
    ) -> None:
        self.controller = controller
        self.journal = journal
        self.mode = mode
        self.emulated = emulated
        self.grace_s = grace_s
        self.ask = ask
        self.on_progress = on_progress
        self.watch = watch
        self.steering = steering
        self.holding = holding
        self.holder: Holder | None = None
        self.arming: Arming | None = None
        self.place: Mapping[str, float] = {}
        self.block: ReplayBlock | None = None
        self.start = time.monotonic()

    def guarded(self, work: Callable[[], None]) -> None:
        """Do the work; whatever goes wrong ends in darkness and a closed journal."""
        try:
            work()
        except BaseException as error:
            with deaf_to_signals():
                self.controller.emergency_stop()
                interrupted = isinstance(error, KeyboardInterrupt)
                reason = "interrupted" if interrupted else str(error) or type(error).__name__
                self._end("stopped" if interrupted or isinstance(error, JobError) else "fault", reason)
            if isinstance(error, MachineError) and error.block is None and self.block is not None:
                error.block, error.step = self.block.index, self.block.step
            raise
        self._end("complete", "")

    def all(
        self,
        blocks: Sequence[ReplayBlock],
        home: bool | None,
        arm: Callable[[], None],
        marks: Sequence[ReplayBlock] = (),
        arm_again: Callable[[], None] | None = None,
    ) -> None:
        """Home where needed, look at the marks, arm, then every block."""
        gate = self.controller.gate
        gate.level = "motion"
        self._home(home)
        self._look_at(marks)
        if self.mode == "frame":
            gate.level = "pilot"
        elif self.mode == "arm":
            if not self.emulated:
                arm()
            gate.level = "armed"
            self.arming = Arming()
            self.controller.on_look = self.arming.look
            self.controller.confirm_idle()
        if self.controller.status is not None:
            self.place = self.controller.work_position(self.controller.status)
        self.controller.in_job = True
        if self.holding is not None:
            self._can_be_held(self.holding, arm_again or arm)
        self.journal.write("state", state=gate.level, t=self._t())
        self.start = time.monotonic()
        if self._goes_ahead():
            self._ahead(blocks)
        else:
            self._block_by_block(blocks)
        self.block = None
        gate.level = "quiet"

    def _block_by_block(self, blocks: Sequence[ReplayBlock]) -> None:
        dark = self.mode == "dry-run"
        told = self._teller(blocks)
        for number, block in enumerate(blocks, 1):
            made = (block,) if self.steering is None or dark else self.steering.blocks_for(block)
            for sent in made:
                if self.steering is not None and self.arming is not None:
                    self.arming.renew()  # an angle was measured
                self.block = sent
                self._one(sent, dark_block(sent) if dark else lit_block(sent))
            told(number)

    def _goes_ahead(self) -> bool:
        """A dry run that nobody watches block by block is sent ahead; Marlin counts no bytes."""
        grbl = self.controller.rig.controller.dialect != "marlin"
        return self.mode == "dry-run" and self.watch is None and grbl

    def _ahead(self, blocks: Sequence[ReplayBlock]) -> None:
        told = self._teller(blocks)
        number = 0
        for stretch in stretches(blocks):
            self.controller.held(at_rest=True)
            self._stretch(stretch, number, told)
            number += len(stretch)

    def _stretch(self, blocks: Sequence[ReplayBlock], before: int, told: Callable[[int], None]) -> None:
        """Blocks without light in one go; where the last of them ends is checked."""
        lines: list[str] = []
        ends: list[int] = []  # how many lines there are up to the end of each block
        for block in blocks:
            lines += dark_lines(block)
            ends.append(len(lines))
        if not lines:
            for number, block in enumerate(blocks, before + 1):
                self.journal.write("skipped", block=block.index, step=block.step)
                told(number)
            return
        lines.append(SYNC)
        finished = 0

        def taken(count: int) -> None:
            nonlocal finished
            while finished < len(blocks) and ends[finished] <= count:
                finished += 1
                told(before + finished)
            self.block = blocks[min(finished, len(blocks) - 1)]

        taken(0)
        seconds = sum(b.seconds for b in blocks) + travel_seconds(
            self.controller.rig, self.place, blocks[0].expect
        )
        send_ahead(self.controller, lines, seconds, self.grace_s, taken)
        self.place = self.controller.work_position(self.controller.confirm_idle())
        expect = {word: wanted for block in blocks for word, wanted in block.expect}
        if mistake := position_mistake(tuple(expect.items()), self.place, self.controller.rig):
            raise MachineError(f"{mistake}: steps or bytes were lost; home it before anything else")
        for block in blocks:
            made = bool(dark_lines(block))
            self.journal.write("done" if made else "skipped", block=block.index, step=block.step, t=self._t())
        self.journal.write("at", at=[round(v, 3) for v in self.place.values()], t=self._t())

    def _teller(self, blocks: Sequence[ReplayBlock]) -> Callable[[int], None]:
        """A function that tells how many blocks are done, and estimates what is left."""
        dark = self.mode == "dry-run"
        past = [0.0]
        for block in blocks:
            past.append(past[-1] + (0.0 if dark and block.kind == "wait" else block.seconds))

        def tell(number: int) -> None:
            if self.on_progress is None:
                return
            elapsed = time.monotonic() - self.start
            rest = (past[-1] - past[number]) * (elapsed / past[number] if past[number] > 0.0 else 1.0)
            block = blocks[number - 1]
            self.on_progress(
                Progress(number, len(blocks), block.step, block.kind, elapsed, max(rest, 0.0), self.emulated)
            )

        return tell

    def _can_be_held(self, holding: Holding, arm: Callable[[], None]) -> None:
        self.holder = Holder(
            self.controller, self.journal, holding, self.arming, arm, emulated=self.emulated,
            where=lambda: (-1, -1) if self.block is None else (self.block.index, self.block.step),
            clock=self._t,
        )  # fmt: skip
        self.controller.hold = holding.request
        self.controller.on_hold = self.holder.hold

    def _one(self, block: ReplayBlock, lines: tuple[str, ...]) -> None:
        if block.kind == "ask" and self.mode == "arm" and not self.emulated:
            question = " ".join(block.comments) or "go on?"
            if self.ask is None or not self.ask(question):
                raise JobError(f"stopped at the question: {question}")
            if self.arming is not None:
                self.arming.renew()
        if not lines:
            self.journal.write("skipped", block=block.index, step=block.step)
            return
        self.controller.held(at_rest=True)
        if block.beam_s > 0.0 and self.mode == "arm":
            if self.arming is not None:
                self.arming.check()
            self.journal.write(
                "intent", sync=True, block=block.index, step=block.step, beam_s=block.beam_s, t=self._t()
            )
        if self.watch is not None:
            self.watch.begins(block, block.seconds, self._t())
        seconds = block.seconds
        if self.place and block.beam_s <= 0.0:  # the head may come from elsewhere: home, or where it stopped
            seconds = max(seconds, travel_seconds(self.controller.rig, self.place, block.expect))
        self.controller.run(lines, seconds, self.grace_s)
        status = self.controller.confirm_idle()
        place = self.controller.work_position(status)
        self.place = place
        if mistake := position_mistake(block.expect, place, self.controller.rig):
            raise MachineError(f"{mistake}: steps or bytes were lost; home it before anything else")
        if block.beam_s > 0.0 and self.mode == "arm":
            mistake = modes_mistake(lines, self.controller.modes())
            if mistake is not None:
                raise MachineError(f"{mistake}: bytes were damaged, the crease has had another dose")
        self.journal.write(
            "done", block=block.index, step=block.step, t=self._t(), at=[round(v, 3) for v in place.values()]
        )
        if self.watch is not None:
            self.watch.confirmed(block, place, self._t())

    def told_of(self, on_status: Callable[[Status], None] | None) -> Callable[[Status], None]:
        """A function for every status report."""

        def tell(status: Status) -> None:
            if on_status is not None:
                on_status(status)
            block = self.block
            if block is None or self.controller.gate.level == "held":
                return
            place = self.controller.work_position(status)
            if block.beam_s > 0.0 and self.mode == "arm":
                self.journal.write(
                    "status", block=block.index, state=status.state, f=status.speed,
                    s=status.s if status.tells_power else None,
                    at=[round(v, 3) for v in place.values()], t=self._t(),
                )  # fmt: skip
            if self.watch is not None:
                self.watch.reports(status, place, self._t())

        return tell

    def _look_at(self, marks: Sequence[ReplayBlock]) -> None:
        """Run the pilot light over the marks; a person says whether it met them."""
        for block in marks:
            self.controller.gate.level = "pilot"
            here = self.controller.work_position(self.controller.confirm_idle())
            seconds = block.seconds + travel_seconds(self.controller.rig, here, block.expect)
            self.controller.run(tuple(block.lines), seconds, self.grace_s)
            place = self.controller.work_position(self.controller.confirm_idle())
            self.controller.gate.level = "motion"
            if mistake := position_mistake(block.expect, place, self.controller.rig):
                raise MachineError(f"{mistake}: steps or bytes were lost; home it before anything else")
            question = " ".join(block.comments)
            if not self.emulated and (self.ask is None or not self.ask(question)):
                raise JobError(f"stopped: {question} no: set the zero of the sheet anew")
            self.journal.write("mark", question=question, t=self._t())

    def _home(self, allowed: bool | None) -> None:
        controller = self.controller
        status = controller.status
        if status is None or status.state != "Alarm":
            return
        if controller.rig.controller.homing != "required":
            raise MachineError(
                "the controller is locked by an alarm: find the cause, unlock it by hand, set the zero"
            )
        if allowed is None:
            question = f"REAL machine {controller.rig.name}: home it now? It moves to its switches"
            allowed = self.emulated or (self.ask is not None and self.ask(question))
        if not allowed:
            raise MachineError("the machine must be homed first: allow homing, it will move to its switches")
        controller.home()
        controller.confirm_idle()
        self.journal.write("state", state="homed", t=self._t())

    def _end(self, outcome: Outcome, reason: str) -> None:
        try:
            self.journal.write("end", sync=True, outcome=outcome, reason=reason, t=self._t())
        except MachineError:
            if outcome == "complete":
                raise

    def _t(self) -> float:
        held = 0.0 if self.holder is None else self.holder.seconds
        return round(time.monotonic() - self.start - held, 3)
