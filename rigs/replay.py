"""The replay: a job sent block by block, each confirmed before the next, and journalled."""

from __future__ import annotations

import contextlib
import datetime
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from urllib.parse import urlsplit

from rigs.arming import Arming
from rigs.controller import Controller
from rigs.errors import JobError, MachineError
from rigs.grbl import Status
from rigs.identity import Identity
from rigs.job import Job
from rigs.journal import Journal, JournalWriter, Outcome, read_journal
from rigs.link import open_link
from rigs.marlin import spoken
from rigs.modes import modes_mistake
from rigs.replay_blocks import ReplayBlock, ReplayJob, dark_block, frame_blocks, lit_block, replay_job
from rigs.replay_checks import (
    Certificate,
    check_certificate,
    check_dry_run,
    check_identity,
    check_job,
    position_mistake,
    travel_seconds,
)
from rigs.rig import Rig
from rigs.stop_signals import deaf_to_signals, stop_signals
from rigs.watch import Steering, Watch

__all__ = ["Mode", "Progress", "replay"]

Mode = Literal["dry-run", "frame", "arm"]
_GRACE_S = 1.5


@dataclass(frozen=True)
class Progress:
    """Where a replay stands.

    Attributes:
        block: blocks confirmed so far, of ``blocks``.
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


def replay(
    job: Job | ReplayJob,
    url: str,
    *,
    rig: Rig,
    journal_path: Path,
    mode: Mode = "dry-run",
    certificate: Certificate | None = None,
    dry_run_journal: Path | None = None,
    confirm: Callable[[str], bool] | None = None,
    ask: Callable[[str], bool] | None = None,
    home: bool | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    on_status: Callable[[Status], None] | None = None,
    marks: Sequence[ReplayBlock] = (),
    resumes: Mapping[str, Any] | None = None,
    watch: Watch | None = None,
    steering: Steering | None = None,
    stop: threading.Event | None = None,
    grace_s: float = _GRACE_S,
) -> Journal:
    """Send a job to a machine.

    Every line is checked before the port is opened. ``dry-run`` makes every move without light and without
    waits, ``frame`` traces the rectangle around the job with the pilot light, ``arm`` fires. A controller on
    this computer whose ``$I`` carries the emulator's mark counts as emulated; every other one is real, and
    arming it needs a passing certificate of this very job, rig and material and a person who confirms.

    Args:
        job: what to send.
        url: port, such as ``/dev/ttyUSB0`` or ``socket://127.0.0.1:4000``.
        rig: the profile of the machine.
        journal_path: a new file for the journal.
        mode: what to do.
        certificate: hashes and verdict of the validation; needed to arm a real machine.
        dry_run_journal: journal of a complete dry run of this job, where the rig demands one before arming.
        confirm: called before a real machine is armed, with a text that names job, rig and power cap.
        ask: called for blocks that need a person; False stops. An emulated machine needs no person.
        home: True allows the homing cycle, which moves the machine, False does not; None asks ``ask`` unless
            the machine is emulated.
        on_progress: called after every block.
        on_status: called with every status report.
        marks: pilot strokes over the marks of the sheet (``mark_blocks``), made before arming; each asks.
        resumes: what this replay goes on from, kept in the header of the journal (``rigs.resume``).
        watch: sees every block and status; what it raises stops the machine.
        steering: may leave passes out or repeat them, since angles are measured.
        stop: when it is set, from any thread, the machine is stopped.
        grace_s: time beyond the planned one after which a missing answer is a fault.

    Returns:
        the journal, read back from its file.

    Raises:
        JobError: the job does not fit the rig or may not be armed; nothing was lit.
        MachineError: the machine refused, failed or vanished; the beam was switched off, the journal says
            how far it came.
        KeyboardInterrupt: after Ctrl-C or SIGTERM; the machine was stopped and the journal closed.
    """
    plan = replay_job(job) if isinstance(job, Job) else job
    check_job(plan, rig)
    blocks = frame_blocks(plan, rig) if mode == "frame" else plan.blocks
    link = open_link(url, rig)
    controller = Controller(spoken(link, rig), rig)
    controller.stop = stop
    try:
        identity = _identify(controller)
        emulated = is_emulated(identity, url)
        check_identity(identity, rig, armed=mode == "arm")
        if resumes is not None and bool(resumes.get("emulated")) != emulated:
            raise JobError(
                f"the sheet is in {'the emulated' if resumes.get('emulated') else 'a real'} machine, this is "
                f"{'an emulated' if emulated else 'a real'} one: it cannot go on here"
            )
        if mode == "arm" and not emulated:
            check_certificate(certificate, plan, rig)
            check_dry_run(dry_run_journal, plan, rig)
        with contextlib.closing(
            JournalWriter(journal_path, durable=mode == "arm" and not emulated)
        ) as journal:
            journal.write(
                "header", format="metal-blossom/journal", version=1, mode=mode,
                machine="EMULATED" if emulated else "REAL", emulated=emulated, url=url, rig=rig.name,
                rig_sha256=rig.sha256, job_sha256=plan.sha256, material_sha256=plan.material_sha256,
                blocks=len(blocks), info=list(identity.info), settings=identity.settings,
                offsets=list(identity.offsets), modes=list(identity.modes),
                at=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
                resumes=dict(resumes or {}),
            )  # fmt: skip
            run = _Run(controller, journal, mode, emulated, grace_s, ask, on_progress, watch, steering)
            controller.on_status = run.told_of(on_status)
            if steering is not None:
                steering.note = journal.write
            with stop_signals():
                run.guarded(lambda: run.all(blocks, home, lambda: _arm(confirm, plan, rig), marks))
    finally:
        link.close()
    return read_journal(journal_path)


def is_emulated(identity: Identity, url: str) -> bool:
    """True for the emulator on this computer; a mark that comes over a network or a cable does not count."""
    return identity.emulated and urlsplit(url).hostname in ("127.0.0.1", "localhost")


def _identify(controller: Controller) -> Identity:
    status = controller.hello()
    if status.state in ("Run", "Home", "Jog"):
        raise MachineError(
            f"{controller.link.url}: the machine is busy ({status.state}): wait until it is idle"
        )
    if status.state in ("Hold", "Door", "Check", "Sleep"):
        raise MachineError(
            f"{controller.link.url}: the machine is in state {status.state}: reset it by hand, then home it"
        )
    controller.darken()
    return controller.identify()


def _arm(confirm: Callable[[str], bool] | None, job: ReplayJob, rig: Rig) -> None:
    cap = rig.laser.cap_fraction * rig.laser.max_w
    text = f"arm REAL laser {rig.name}, job {job.sha256[:12]}, up to {cap:g} W"
    start = time.monotonic()
    if confirm is None or not confirm(text):
        raise JobError("not armed: a person has to confirm before a real laser fires")
    if time.monotonic() - start > rig.safety.arm_timeout_s:
        raise JobError(f"not armed: the answer came later than {rig.safety.arm_timeout_s:g} s: start again")


class _Run:
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
        self.journal.write("state", state=gate.level, t=self._t())
        dark = self.mode == "dry-run"
        planned = [0.0 if dark and b.kind == "wait" else b.seconds for b in blocks]
        left, past = sum(planned), 0.0
        self.start = time.monotonic()
        for number, (block, seconds) in enumerate(zip(blocks, planned, strict=True), 1):
            made = (block,) if self.steering is None or dark else self.steering.blocks_for(block)
            for sent in made:
                if self.steering is not None and self.arming is not None:
                    self.arming.renew()  # an angle was measured
                self.block = sent
                self._one(sent, dark_block(sent) if dark else lit_block(sent))
            left -= seconds
            past += seconds
            if self.on_progress is not None:
                elapsed = time.monotonic() - self.start
                rest = left * (elapsed / past if past > 0.0 else 1.0)
                self.on_progress(
                    Progress(
                        number, len(blocks), block.step, block.kind, elapsed, max(rest, 0.0), self.emulated
                    )
                )
        self.block = None
        gate.level = "quiet"

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
            if block is None:
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
        return round(time.monotonic() - self.start, 3)
