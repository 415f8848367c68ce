"""Whole runs: everything from mesh to report in one go, or one stage on a bundle that exists."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from studio.bundle import create_bundle, edit_bundle
from studio.bundle_check import open_manifest
from studio.bundle_summary import bundle_summary
from studio.manifest import MANIFEST_NAME, Manifest
from studio.net_stage import net_stage
from studio.options import MachineOptions, MeshOptions, NetOptions, PlanOptions
from studio.progress import Progress
from studio.replay_stage import EMULATOR, JOURNAL_PREFIX, ask_person, replay_stage
from studio.stages import job_stage, plan_stage, report_stage, validate_stage
from studio.summary import Summary
from studio.workspace import Workspace

if TYPE_CHECKING:
    from studio.resume_stage import Beside, Choice

__all__ = ["PASS", "make", "make_net_bundle", "replay_bundle", "resume_bundle", "run_stage"]

PASS = "pass"  # noqa: S105  a verdict, no password


def make(
    target: Path,
    mesh: MeshOptions,
    net: NetOptions,
    plan: PlanOptions,
    machine: MachineOptions,
    *,
    force: bool = False,
    progress: Progress,
) -> Summary:
    """Run all stages one after another and write the bundle ``target``.

    The bundle appears whole at the end, or not at all. A verdict other than ``pass`` is a result: the
    bundle is written, the summary says it, and the job is not replayed.
    """
    with create_bundle(target, force=force) as folder:
        ws = Workspace(folder, Manifest(), progress)
        net_stage(ws, mesh, net, machine)
        plan_stage(ws, plan)
        verdict = validate_stage(ws)
        job_stage(ws)
        if verdict == PASS:
            replayed = replay_stage(ws, EMULATOR, "arm")
        else:
            replayed = f"not replayed, because the verdict is {verdict}"
        report_stage(ws)
        summary = bundle_summary(ws, replayed)
        _write_timing(folder, {}, progress)
        ws.finish()
    return summary.with_bundle(str(target))


def make_net_bundle(
    target: Path,
    mesh: MeshOptions,
    net: NetOptions,
    machine: MachineOptions,
    *,
    force: bool = False,
    progress: Progress,
) -> Summary:
    """Run the first stage only: a bundle with goal and net."""
    with create_bundle(target, force=force) as folder:
        ws = Workspace(folder, Manifest(), progress)
        net_stage(ws, mesh, net, machine)
        summary = bundle_summary(ws)
        _write_timing(folder, {}, progress)
        ws.finish()
    return summary.with_bundle(str(target))


def run_stage(target: Path, stage: str, work: Callable[[Workspace], Any], progress: Progress) -> Summary:
    """Run one stage on an existing bundle; files of later stages are removed, because they are stale.

    Args:
        target: the bundle.
        stage: name of the stage, one of ``studio.bundle.STAGES``.
        work: what to do.
        progress: where to tell how far it is.
    """
    before = _read_timing(target)
    with edit_bundle(target, stage) as (folder, manifest):
        ws = Workspace(folder, manifest, progress)
        work(ws)
        summary = bundle_summary(ws)
        _write_timing(folder, before, progress)
    return summary.with_bundle(str(target))


def replay_bundle(
    target: Path,
    port: str,
    mode: Literal["dry-run", "frame", "arm"],
    *,
    yes: bool,
    trace: Path | None = None,
    shadow: bool = False,
    measure: str | None = None,
    encoder: str | None = None,
    view_port: int | None = None,
    progress: Progress,
) -> Summary:
    """Replay the job of a bundle; the journal stays in it whatever happens, other files are left alone."""
    return _on_the_machine(
        target,
        progress,
        lambda ws: replay_stage(
            ws,
            port,
            mode,
            confirm=ask_person(yes=yes),
            trace=trace,
            shadow=shadow,
            measure=measure,
            encoder=encoder,
            view_port=view_port,
        ),
    )


def resume_bundle(
    target: Path,
    port: str,
    choice: Choice,
    *,
    yes: bool,
    look_only: bool,
    beside: Beside | None = None,
    progress: Progress,
) -> Summary:
    """Go on with the job of a bundle where its last armed replay stopped."""
    from studio.resume_stage import resume_stage

    return _on_the_machine(
        target,
        progress,
        lambda ws: resume_stage(
            ws, port, choice, confirm=ask_person(yes=yes), look_only=look_only, beside=beside
        ),
    )


def _on_the_machine(target: Path, progress: Progress, work: Callable[[Workspace], str]) -> Summary:
    """Do work that writes a journal; only one process at a time does so for a bundle."""
    from rigs.one_process import one_at_a_time

    ws = Workspace(target, open_manifest(target), progress)
    before = _journals(target)
    with one_at_a_time(target / MANIFEST_NAME):
        try:
            words = work(ws)
        except BaseException:
            for name in sorted(_journals(target) - before):
                progress.note(f"the journal tells how far it came: {target / name}")
            raise
    return bundle_summary(ws, words).with_bundle(str(target))


def _journals(target: Path) -> set[str]:
    return {path.name for path in target.glob(f"{JOURNAL_PREFIX}*")}


def _read_timing(target: Path) -> dict[str, float]:
    try:
        values = json.loads((target / "timing.json").read_bytes())
        return {str(name): float(seconds) for name, seconds in values["seconds"].items()}
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        return {}


def _write_timing(folder: Path, before: dict[str, float], progress: Progress) -> None:
    seconds = {name: round(took, 3) for name, took in (before | progress.seconds).items()}
    document = {"format": "metal-blossom/timing", "version": 1, "seconds": seconds}
    (folder / "timing.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
