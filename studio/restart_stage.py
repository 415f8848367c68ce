"""Going on with a simulation from one of its checkpoints."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.bundle_check import open_manifest
from studio.commands_lists import say
from studio.errors import BundleError, UsageError
from studio.report_validation import event_text
from studio.workspace import Workspace

if TYPE_CHECKING:
    from studio.progress import Progress

__all__ = ["print_restart", "restart"]


def restart(bundle: Path, step: int, progress: Progress) -> dict[str, Any]:
    """Run the simulation of a bundle again from the checkpoint before plan step ``step``; changes nothing.

    Returns:
        Plain values: where it began, what was seen from there on, and whether it ended in the same state.

    Raises:
        UsageError: if the plan has no such step.
        BundleError: if the bundle was not validated, or its checkpoints are of something else.
        RecordFileError: if the file of checkpoints is damaged.
    """
    import mujoco

    from twin.checkpoint_file import CHECKPOINT_FILE, read_checkpoints
    from twin.dynamics import dynamic_run
    from twin.event_values import event_values
    from twin.heating_interface import ProcessHeating
    from twin.mjcf_model import compile_model
    from twin.sweep import kinematic_sweep
    from twin.validation import sheet_metal

    ws = Workspace(bundle, open_manifest(bundle), progress)
    ws.manifest.sha256_of(CHECKPOINT_FILE)
    plan = ws.plan
    if step >= len(plan.steps):
        raise UsageError(f"--from-step {step}: the plan has steps 0 to {len(plan.steps) - 1}")
    kept = read_checkpoints(ws.path(CHECKPOINT_FILE))
    for name, digest in ws.hashes("net", "plan", "model").items():
        if kept.hashes.get(name) != digest:
            raise BundleError(f"{CHECKPOINT_FILE} was made with another {name}: validate the bundle again")
    start = kept.before(step)
    with progress.stage("validate", f"going on after step {start.step}"):
        compiled = compile_model(plan, sheet_metal(ws.material))
        run = dynamic_run(
            compiled, plan, kinematic_sweep(compiled, plan), ProcessHeating(ws.process), start=start
        )
    return {
        "format": "metal-blossom/restart", "version": 1, "after_step": start.step,
        "from_s": start.steps * float(compiled.load().opt.timestep), "to_s": run.seconds,
        "finished": run.finished, "events": [event_values(e) for e in run.events],
        "noted": len(run.noted), "state_sha256": run.state_sha256,
        "same_state": run.state_sha256 == kept.state_sha256,
        "mujoco": mujoco.__version__, "mujoco_then": kept.mujoco,
    }  # fmt: skip


def print_restart(values: dict[str, Any], *, as_json: bool) -> None:
    """Print what ``restart`` returned, in words or as JSON."""
    if as_json:
        say(json.dumps(values, ensure_ascii=False, allow_nan=False))
        return
    place = f"step {values['after_step']}" if values["after_step"] >= 0 else "nothing was folded yet"
    say(f"went on after {place}: {values['from_s']:.2f} s to {values['to_s']:.2f} s")
    for event in values["events"]:
        say(event_text(event))
    if values["same_state"]:
        say("ended in the same state as the run of the certificate, bit for bit")
        return
    say("ended in another state than the run of the certificate")
    if values["mujoco"] != values["mujoco_then"]:
        say(f"that run was made with MuJoCo {values['mujoco_then']}, this one with {values['mujoco']}: ")
        say("the same bits can be expected of one version on one machine only")
