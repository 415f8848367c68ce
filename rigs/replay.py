"""The replay: a job sent block by block, each confirmed before the next, and journalled."""

from __future__ import annotations

import contextlib
import datetime
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from rigs.controller import Controller
from rigs.errors import JobError, MachineError
from rigs.grbl import Status
from rigs.holding import Holding
from rigs.identity import Identity
from rigs.job import Job
from rigs.journal import Journal, JournalWriter, read_journal
from rigs.link import open_link
from rigs.marlin import spoken
from rigs.replay_blocks import ReplayBlock, ReplayJob, frame_blocks, replay_job
from rigs.replay_checks import (
    Certificate,
    check_certificate,
    check_dry_run,
    check_identity,
    check_job,
)
from rigs.replay_run import Mode, Progress, Run
from rigs.rig import Rig
from rigs.stop_signals import stop_signals
from rigs.watch import Steering, Watch

__all__ = ["Mode", "Progress", "replay"]

_GRACE_S = 1.5


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
    holding: Holding | None = None,
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
        holding: lets the machine be held and go on again; without it every hold ends the replay.
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
    link.interrupted = None if stop is None else stop.is_set
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
            run = Run(
                controller, journal, mode, emulated, grace_s, ask, on_progress, watch, steering, holding
            )
            controller.on_status = run.told_of(on_status)
            if steering is not None:
                steering.note = journal.write
            again = confirm if holding is None else holding.arm_again
            with stop_signals():
                run.guarded(
                    lambda: run.all(
                        blocks, home, lambda: _arm(confirm, plan, rig), marks, lambda: _arm(again, plan, rig)
                    )
                )
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
