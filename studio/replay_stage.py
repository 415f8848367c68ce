"""Replaying the job of a bundle, on a machine or on the emulated one."""

from __future__ import annotations

import contextlib
import difflib
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from studio.bundle_summary import validation_values
from studio.errors import UsageError
from studio.gauges import is_virtual
from studio.hardware_stage import hardware
from studio.live_stage import replay_view, watched
from studio.workspace import RIG_FILE, Workspace

if TYPE_CHECKING:
    from rigs.holding import Held, Holding
    from rigs.replay import Progress as Position
    from rigs.replay_checks import Certificate
    from studio.live_replay import ReplayView

__all__ = [
    "EMULATOR",
    "JOURNAL_PREFIX",
    "ask_person",
    "certificate_of",
    "check_measure",
    "holding_of",
    "machine_of",
    "next_journal",
    "replay_stage",
    "told",
    "trace_for",
]  # fmt: skip

EMULATOR = "emulator"
"""The port that starts the product's own emulated machine."""

JOURNAL_PREFIX = "journal-"
"""Journals hold wall-clock times, so they are no part of the hashed set."""

BANNER = "EMULATED machine: no laser, no metal; this process only answers as GRBL would"


def replay_stage(
    ws: Workspace,
    port: str,
    mode: Literal["dry-run", "frame", "arm"],
    *,
    confirm: Callable[[str], bool] | None = None,
    trace: Path | None = None,
    shadow: bool = False,
    measure: str | None = None,
    encoder: str | None = None,
    view_port: int | None = None,
) -> str:
    """Send the job and keep the journal in the bundle; returns the outcome in words.

    Args:
        ws: the bundle; its job must be there.
        port: ``emulator`` or the URL of a machine.
        mode: every move without light, the outline with the pilot light, or fire.
        confirm: asked before a real machine fires, and where the job needs a person.
        trace: file for what the emulated machine did.
        shadow: the twin follows and stops the machine where it differs.
        measure: how creases are measured after their passes, see ``studio.gauges``.
        encoder: port of an encoder on the rotary, or ``virtual`` for the emulated machine's.
        view_port: where the live view of machine and twin listens; None: no view.

    Raises:
        BundleError: if the bundle has no job.
        JobError: if the job may not be armed.
        MachineError: if the machine refuses, fails or vanishes.
        ViewError: if the live view cannot be shown; nothing was sent then.
    """
    from rigs.job_file import read_job
    from rigs.replay import replay

    ws.manifest.sha256_of("job.gcode")
    job = read_job(ws.path("job.json"), ws.path("job.gcode"))
    if shadow and mode == "frame":
        raise UsageError("--shadow follows a job: --frame only traces its outline")
    journal = next_journal(ws)
    with contextlib.ExitStack() as stack:
        seen = stack.enter_context(replay_view(ws, job, mode, view_port))
        trace = trace or trace_for(stack, port, measure, encoder)
        url = stack.enter_context(machine_of(ws, port, trace))
        beside = stack.enter_context(
            hardware(ws, job, shadow=shadow, measure=measure, lit=mode == "arm", trace=trace, encoder=encoder)
        )
        holding = stack.enter_context(holding_of(ws))
        stack.enter_context(ws.progress.stage("replay", f"{mode} on {port}"))
        done = replay(
            job, url, rig=ws.rig, journal_path=journal, mode=mode, certificate=certificate_of(ws),
            confirm=confirm, ask=confirm, on_progress=told(ws, seen), watch=watched(beside.watch, seen),
            steering=beside.steering, holding=holding,
        )  # fmt: skip
    what = "EMULATED" if done.emulated else "REAL machine"
    words = f"{mode} on {what}: {done.outcome}, {len(done.done)} blocks confirmed, {journal.name}"
    return "; ".join([words, *beside.words()])


def told(ws: Workspace, seen: ReplayView | None = None) -> Callable[[Position], None]:
    """A function that shows where a replay stands, in the live view, too, if there is one."""

    def tell(at: Position) -> None:
        where = "EMULATED " if at.emulated else "REAL MACHINE "
        step = f", step {at.step}" if at.step >= 0 else ""
        ws.progress.update(at.block / max(at.blocks, 1), f"{where}block {at.block} of {at.blocks}{step}")
        if seen is not None:
            seen.progress(at)

    return tell


def ask_person(*, yes: bool) -> Callable[[str], bool]:
    """A function that asks a person on the terminal; with ``yes`` the answer was given beforehand."""

    def ask(question: str) -> bool:
        sys.stderr.write(f"{question}\n")
        if yes:
            return True
        if not sys.stdin.isatty():
            raise UsageError(
                "a real laser needs a person: run this on a terminal, or add --yes if one stands by"
            )
        sys.stderr.write('Enclosure closed, eyewear on, emergency stop in reach? Type "yes" to go on: ')
        sys.stderr.flush()
        return sys.stdin.readline().strip().lower() == "yes"

    return ask


def check_measure(measure: str | None, port: str) -> None:
    """Refuse to measure a real part as if it were the twin's.

    Raises:
        UsageError: saying so.
    """
    if is_virtual(measure) and port != EMULATOR:
        raise UsageError("--measure virtual is for --port emulator: a real part has to be measured")


def trace_for(
    stack: contextlib.ExitStack, port: str, measure: str | None, encoder: str | None
) -> Path | None:
    """A passing file for what the emulated machine does, where something looks at its part; else None."""
    if port != EMULATOR or not (is_virtual(measure) or is_virtual(encoder)):
        return None
    return Path(stack.enter_context(tempfile.TemporaryDirectory())) / "trace.jsonl"


@contextlib.contextmanager
def holding_of(ws: Workspace) -> Iterator[Holding]:
    """Ctrl-Z holds the machine while the block runs; a person on the terminal lets it go on.

    What ``--yes`` said beforehand does not count here: nothing is armed again by itself.
    """
    from rigs.holding import Holding
    from rigs.stop_signals import hold_signal

    def go_on(held: Held) -> bool:
        sys.stderr.write(f"\n{held.words}\n")
        if not sys.stdin.isatty():
            sys.stderr.write("nobody can let it go on without a terminal: it is stopped\n")
            return False
        sys.stderr.write('Type "go" to go on; anything else stops the job: ')
        sys.stderr.flush()
        return sys.stdin.readline().strip().lower() == "go"

    def paused_go_on(held: Held) -> bool:
        with ws.progress.paused():
            return go_on(held)

    def arm_again(question: str) -> bool:
        with ws.progress.paused():
            return ask_person(yes=False)(question)

    holding = Holding(paused_go_on, arm_again)
    if sys.stdin.isatty():
        ws.progress.note("Ctrl-Z holds the machine, Ctrl-C stops it")
    with hold_signal(holding.request):
        yield holding


@contextlib.contextmanager
def machine_of(ws: Workspace, port: str, trace: Path | None = None) -> Iterator[str]:
    """The URL of a machine; ``emulator`` runs one while the block runs.

    Raises:
        UsageError: if the port looks like a misspelt ``emulator``.
    """
    if port != EMULATOR:
        if difflib.get_close_matches(port.lower(), [EMULATOR], cutoff=0.7):
            raise UsageError(f"unknown port '{port}': did you mean {EMULATOR}?")
        yield port
        return
    from rigs.emulator import start_emulator

    ws.progress.note(BANNER)
    with start_emulator(ws.path(RIG_FILE), trace=trace) as machine:
        yield machine.url


def next_journal(ws: Workspace) -> Path:
    """Path of the journal that is written next."""
    taken = [p.stem.removeprefix(JOURNAL_PREFIX) for p in ws.folder.glob(f"{JOURNAL_PREFIX}*.jsonl")]
    number = 1 + max((int(text) for text in taken if text.isdigit()), default=0)
    return ws.path(f"{JOURNAL_PREFIX}{number:03d}.jsonl")


def certificate_of(ws: Workspace) -> Certificate | None:
    """What the validation of the bundle says, None without one."""
    from rigs.replay_checks import Certificate

    values = validation_values(ws)
    if values is None:
        return None
    return Certificate(
        str(values.get("verdict", "")),
        *(str(values.get(f"{k}_sha256", "")) for k in ("job", "rig", "material")),
    )
